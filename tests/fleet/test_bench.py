# SPDX-License-Identifier: Apache-2.0
"""waymark bench: its drives are localized and are the same bytes each time, its file and its table have what was measured, and a file that
is none is refused. test_bench.py BIN    in a network of its own (else 77)"""
import contextlib
import io
import json
import pathlib
import sys
import tempfile
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "common"))
import in_a_network  # noqa: E402

in_a_network.begin(programs=())
from common import BIN  # noqa: E402
from waymark_fleet import bench, bench_drives  # noqa: E402


def said(*words):
    """Exit code and outputs of the program."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = bench.main([str(word) for word in words], beside=BIN)
    return code, out.getvalue(), err.getvalue()


class Bench(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="waymark-bench-")
        cls.folder = pathlib.Path(cls.temporary.name)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_a_board(self):
        file = self.folder / "a.json"
        code, out, err = said("--board", "--minutes", "0.01", "--name", "a desk", "--out", file)
        self.assertEqual(code, 0, err)
        result = json.loads(file.read_text())
        self.assertEqual(set(result["drives"]), set(bench_drives.DRIVES))
        for name, drive in result["drives"].items():
            self.assertLess(drive["end_off_m"], bench.LAST_M, name)
            self.assertTrue(all(stage["count"] > 0 and 0 < stage["p50_us"] <= stage["p99_us"] for stage in drive["stages"].values()), drive)
        for size in ("tags-vga", "tags-720p"):  # twelve tags in each of thirty pictures
            self.assertEqual((result["drives"][size]["stages"]["detect"]["count"], result["drives"][size]["stages"]["correct"]["count"]), (30, 360))
        self.assertGreater(result["live"]["deadlines_total"], 1000)
        self.assertGreater(result["live"]["first_pose_ms"], 0)
        self.assertGreater(result["live"]["resident_kb"], 5000)
        self.assertGreater(result["heat"]["first_hz"], 1)
        self.assertTrue(any(f["id"] == "computer-clock" for f in result["doctor"]["findings"]))
        self.assertIn("| a desk |", out)
        code, both, err = said("--table", file, file)
        self.assertEqual((code, len(both.splitlines())), (0, 4), err)
        self.assertEqual(len({line.count("|") for line in both.splitlines()}), 1)

    def test_a_drive_that_is_not_localized(self):
        _, make, stages = bench_drives.DRIVES["landmarks"]
        drive = self.folder / "moved"
        drive.mkdir()
        x_m, y_m = make(drive)
        measured = bench.measure_drive([BIN / "waymark"], drive, (x_m + 1, y_m), stages, self.folder / "run")
        self.assertAlmostEqual(measured["end_off_m"], 1, delta=bench.LAST_M)
        self.assertEqual(bench.astray({"drives": {"landmarks": measured, "slam": {"end_off_m": 0.01}}}), ["landmarks"])

    def test_the_same_bytes(self):
        for name, (_, make, _) in bench_drives.DRIVES.items():
            if name == "tags-720p":
                continue
            one, two = self.folder / "one" / name, self.folder / "two" / name
            for place in (one, two):
                place.mkdir(parents=True)
                make(place)
            for path in one.rglob("*"):
                self.assertTrue(path.is_dir() or path.read_bytes() == (two / path.relative_to(one)).read_bytes(), path)

    def test_warmth(self):
        zones, clocks = self.folder / "sys/class/thermal", self.folder / "sys/devices/system/cpu"
        for path, text in ((zones / "thermal_zone0/temp", "41500"), (zones / "thermal_zone1/temp", "256000"), (clocks / "cpu0/cpufreq/scaling_cur_freq", "1500000"),
                           (clocks / "cpu1/cpufreq/scaling_cur_freq", "600000")):
            path.parent.mkdir(parents=True)
            path.write_text(text + "\n")
        self.assertEqual(bench.warmth(self.folder), (41.5, 600.0))
        self.assertEqual(bench.warmth(self.folder / "nothing"), (None, None))

    def test_what_is_no_such_file(self):
        for text in ("{}", "[", "[1]"):
            (self.folder / "bad.json").write_text(text)
            code, _, err = said("--table", self.folder / "bad.json")
            self.assertEqual(code, 2)
            self.assertIn("bad.json: ", err)
            self.assertIn("waymark bench --board writes such a file", err)


if __name__ == "__main__":
    unittest.main()
