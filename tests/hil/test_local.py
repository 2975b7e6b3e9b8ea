# SPDX-License-Identifier: Apache-2.0
"""`waymark hil --local`, whole, with a recording in the place of the kernel's drivers: verdict, page, result.json, JUnit XML; faults that
are stated wrongly are found; an interrupted test leaves nothing behind.

    test_local.py BUILD      needs root and the right to namespaces; skipped (77) without"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv.pop(1)).resolve()
SECONDS = 9
# A busy desk gives data late, by more than a robot's own bound: here all of them are fused.
CONFIG = "merge: {horizon_ms: 2500, lateness_max_ms: 2000, queue_events: 16384}\n"
LIMITS = "format: waymark-hil-limits/1\nrun: {play_late_ms: 1000, deadlines_missed_share: off, wake_over_cyclictest: off}\n"
FAULTS = """format: waymark-faults/1
faults:
  - {name: bus silent, fault: bus_silent, bus: can0, from_s: 3, until_s: 5, health: [{flag: motion_stale, within_s: 1.2}], pose: {gap_max_s: BOUND}}
  - {name: camera-like state, fault: bus_down, bus: can0, from_s: 6.5, until_s: 8, health: [{source: can, device: STATE, within_s: 1.2}]}
"""


def processes_in(folder):
    """Processes that work in a folder or below it."""
    found = []
    for link in pathlib.Path("/proc").glob("[0-9]*/cwd"):
        try:
            if str(folder) in os.readlink(link):
                found.append(link.parent.name)
        except OSError:
            continue
    return found


class Local(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="waymark-hil-")
        cls.folder = pathlib.Path(cls.temporary.name)
        subprocess.run([BUILD / "bin/waymark-simulate", ROOT / "config/worlds/crossing.yaml", "--no-video", "--duration", str(SECONDS), "--out", cls.folder / "drive"],
                       check=True, stdout=subprocess.DEVNULL)
        config = (ROOT / "config/datasets/crossing-points.yaml").read_text()
        (cls.folder / "robot.yaml").write_text(config.replace(", lateness_max_ms: 300", "") + CONFIG)
        (cls.folder / "limits.yaml").write_text(LIMITS)
        for name, state, bound in (("right", "down", "4"), ("wrong", "bus-off", "0.0001")):
            (cls.folder / f"{name}.yaml").write_text(FAULTS.replace("STATE", state).replace("BOUND", bound))

        (cls.folder / "full.yaml").write_text("format: waymark-faults/1\nfaults:\n  - {name: full, fault: disk_full, from_s: 7, until_s: 8}\n")

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def command(self, out, *words):
        return [sys.executable, BUILD / "bin/waymark-hil", self.folder / "drive", "--config", self.folder / "robot.yaml", "--local", "--played",
                BUILD / "tests/waymark-played", "--limits", self.folder / "limits.yaml", "--out", self.folder / out, *words]

    def run_it(self, out, *words):
        done = subprocess.run(self.command(out, *words), capture_output=True, text=True, check=False, cwd=self.folder, timeout=240)
        self.assertIn(done.returncode, (0, 1), done.stdout + done.stderr)
        return done, json.loads((self.folder / out / "result.json").read_text())

    def test_a_drive(self):
        import junitparser
        done, result = self.run_it("plain")
        failed = [row for row in result["checks"] if row["status"] == "failed"]
        self.assertEqual((done.returncode, failed, result["verdict"]), (0, [], "passed"))
        self.assertTrue(result["figures"]["same_bits"])
        self.assertLess(result["figures"]["position_max_m"], 0.02)
        read = junitparser.JUnitXml.fromfile(str(self.folder / "plain/junit.xml"))
        self.assertEqual((read.failures, read.tests), (0, len(result["checks"])))
        page = (self.folder / "plain/report.html").read_text()
        for text in ("passed", "Distance from the replay", "Threads"):
            self.assertIn(text, page)
        self.assertNotRegex(re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL), r"\bnan\b|None|Traceback")
        self.assertIn("0 failed", done.stdout)
        self.compare(result)

    def compare(self, result):
        """The same test against itself, and against one that became slower."""
        for name, factor, code in (("same", 1.0, 0), ("slower", 3.0, 1)):
            (self.folder / name).mkdir()
            changed = {**result, "figures": {**result["figures"], "correct_p99_us": factor * 1000.0}}
            (self.folder / name / "result.json").write_text(json.dumps(changed))
            done = subprocess.run([sys.executable, BUILD / "bin/waymark-hil", "--compare", self.folder / "same", self.folder / name, "--out", self.folder / f"compared-{name}"],
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertIn("worse", (self.folder / "compared-slower/comparison.html").read_text())

    def test_a_part_in_motion(self):
        """With --from the run begins where the robot is then, and nothing of before or after the part comes."""
        _, result = self.run_it("part", "--from", "4", "--until", "7")
        failed = [row for row in result["checks"] if row["status"] == "failed"]
        self.assertEqual(failed, [])
        self.assertLess(result["figures"]["position_max_m"], 0.02)
        received = json.loads((self.folder / "part/out/drive/health.json").read_text())["sources"]["can"]["received"]
        whole = len((self.folder / "drive/can.log").read_text().splitlines())
        self.assertLess(received, 1.05 * whole * 3 / SECONDS)

    def test_faults(self):
        _, result = self.run_it("right", "--faults", self.folder / "right.yaml")
        rows = [row for row in result["checks"] if row["group"].startswith("fault: ")]
        self.assertEqual([row["text"] for row in rows if row["status"] != "passed"], [])
        self.assertGreaterEqual(len(rows), 5)

    def test_faults_that_are_stated_wrongly(self):
        done, result = self.run_it("wrong", "--faults", self.folder / "wrong.yaml")
        failed = [f"{row['group']}: {row['name']}" for row in result["checks"] if row["status"] == "failed"]
        self.assertEqual(done.returncode, 1)
        self.assertIn("fault: bus silent: pose gap_max_s", failed)
        self.assertIn("fault: camera-like state: health 1: can bus-off, in time", failed)

    def test_a_disk_that_is_soon_full(self):
        """What the log has is judged, and where it ends is stated (data are fused 2 s later); with nothing in it, the faults are judged all the same."""
        for begin_s, least_s in (("4", 0.5), ("6.7", 0.0)):
            _, result = self.run_it("full", "--faults", self.folder / "full.yaml", "--from", begin_s)
            self.assertEqual([row for row in result["checks"] if row["status"] == "failed"], [])
            log = next(row for row in result["checks"] if row["group"] == "log")
            ends = re.search(r"the log (ends (\d+\.\d) s after the part's begin|has none)", log["text"])
            self.assertGreaterEqual(float(ends[2] or 0), least_s)
            self.assertEqual(log["status"], "passed" if least_s else log["status"])
            self.assertIn("passed", [row["status"] for row in result["checks"] if row["group"] == "fault: full"])

    def test_interrupted(self):
        process = subprocess.Popen(self.command("interrupted"), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=self.folder)
        end_s = time.monotonic() + 60
        while time.monotonic() < end_s and not (self.folder / "interrupted/out/start_ns").exists():
            time.sleep(0.1)
        self.assertNotEqual(processes_in(self.folder / "interrupted"), [])
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)
        self.assertNotEqual(process.returncode, 0)
        end_s = time.monotonic() + 20  # on a busy machine a daemon writes its last files for seconds
        while time.monotonic() < end_s and processes_in(self.folder / "interrupted"):
            time.sleep(0.1)
        self.assertEqual(processes_in(self.folder / "interrupted"), [])

    def test_errors(self):
        for words, code, text in ((["--from", "50"], 2, "has 9"), (["--can", "x"], 2, "RUN=PLAYER"), (["--faults", "none.yaml"], 2, "none.yaml"),
                                  (["--limits", str(self.folder / "robot.yaml")], 2, "waymark-hil-limits/1"),
                                  (["--faults", str(self.folder / "full.yaml"), "--from", "7.5"], 2, "the disk is full then (fault 'full', from 7 s to 8 s)")):
            done = subprocess.run(self.command("errors", *words), capture_output=True, text=True, check=False, cwd=self.folder)
            self.assertEqual((done.returncode, "Traceback" in done.stderr), (code, False), done.stderr)
            self.assertIn(text, done.stderr)


if __name__ == "__main__":
    if os.geteuid() != 0 or subprocess.run(["unshare", "-n", "-m", "-p", "--fork", "true"], capture_output=True, check=False).returncode:
        print("skipped: no root, or no right to namespaces")
        sys.exit(77)
    unittest.main()
