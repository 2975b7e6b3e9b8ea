# SPDX-License-Identifier: Apache-2.0
"""What `waymark hil` judges by: faults against what was received, JUnit XML, limits, samples, derived configurations, comparisons.

    test_judging.py TYPES      the folder with LCM's types for Python"""
import json
import lzma
import math
import os
import pathlib
import re
import sys
import tempfile
import types
import unittest
from unittest import mock

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools/hil"), str(ROOT / "tools/fleet")]
from waymark_hil import HilError, compare, fault_judge, guest, hil, judge, lcm_log, limits, poses, recording, samples, scenario, stamps, targets, verdict  # noqa: E402

TYPES = lcm_log.types(sys.argv.pop(1))
END_S, RATE_HZ = 30.0, 50
ABSENT, WORKS, FROZEN = 2, 1, 7


def pose(t_s, x_m, sigma_m=0.02, flags=0, state=1):
    out = TYPES.pose_t()
    out.t_ns, out.state, out.status_flags = round(t_s * 1e9), state, flags
    out.position_m, out.orientation_xyzw = [x_m, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]
    out.covariance = [[0.0] * 6 for _ in range(6)]
    out.covariance[0][0] = sigma_m ** 2
    return out


def health(t_s, device, lost=0, cause=0):
    out, source = TYPES.health_t(), TYPES.source_health_t()
    name = b"edges:front"
    source.name, source.device, source.lost = list(name.ljust(48, b"\0")), device, lost
    out.t_ns, out.source_count, out.sources, out.cause = round(t_s * 1e9), 1, [source], cause
    return out


class Drive:
    """30 s at 1 m/s; a camera is unplugged from 10 to 15 s, and all is as it should be. Each test makes one thing wrong."""

    def __init__(self):
        self.poses = []
        for k in range(int(END_S * RATE_HZ)):
            t = k / RATE_HZ
            without_s = t - 10 if 10 <= t < 15 else 0.0
            self.poses.append((t, pose(t, t + 0.01 * without_s, 0.02 + 0.02 * without_s)))
        self.healths = [(t + 0.4, health(t + 0.4, ABSENT if 10 <= t < 15 else WORKS, lost=3 if t >= 15 else 0)) for t in range(int(END_S))]
        self.fault = {"name": "unplugged", "fault": "camera_unplugged", "from_s": 10.0, "until_s": 15.0, "by": "player", "health": [
            {"what": "device", "source": "edges:front", "value": "absent", "within_s": 1.0, "cleared_within_s": 2.0}], "pose": None}
        self.said, self.done = "", {"done": True}

    def failures(self, others=()):
        checks = verdict.Checks()
        reference = [(k * 0.1, k * 0.1, 0.0, 0.0, 0.0) for k in range(int(10 * END_S))]
        heard = fault_judge.Heard(self.poses, self.healths, reference, self.said, END_S)
        fault_judge.judge(checks, self.fault, heard, self.done, "by the truth", others)
        self.checks = checks
        return [check.name for check in checks.failed()]

    def status(self, name):
        """Of a check of the last judgement."""
        return next(check.status for check in self.checks if check.name == name)


class InFolder(unittest.TestCase):
    """With a folder of its own."""

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)

    def write(self, name, text):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path


class Faults(unittest.TestCase):
    def setUp(self):
        self.drive = Drive()

    def test_all_as_it_should_be(self):
        self.drive.fault["pose"] = {"position_m": 0.1, "error_sigmas": 3, "sigma_m": 0.2, "sigma_grows": 2, "rate_hz": 45, "gap_max_s": 0.1, "within_s": 1.0}
        self.assertEqual(self.drive.failures(), [])

    def test_a_bound_that_is_too_tight(self):
        for name, value in (("position_m", 0.04), ("error_sigmas", 0.3), ("sigma_m", 0.1), ("sigma_grows", 20), ("rate_hz", 60), ("gap_max_s", 0.01)):
            self.drive.fault["pose"] = {name: value}
            self.assertEqual(self.drive.failures(), [f"pose {name}"], name)

    def test_health_that_is_wrong(self):
        """In some seconds of the drive another state of the device."""
        for name, seconds, state, failed, is_all in (("another", (12, 13), FROZEN, "as long as it lasts", True),
                                                     ("never stated", range(30), WORKS, "in time", False),
                                                     ("too late", (10, 11, 12), WORKS, "in time", False),
                                                     ("not taken back", range(15, 29), ABSENT, "taken back", True)):
            with self.subTest(name):
                self.drive = Drive()
                for i in seconds:
                    self.drive.healths[i] = (i + 0.4, health(i + 0.4, state))
                failures = self.drive.failures()
                self.assertIn(f"health 1: edges:front absent, {failed}", failures)
                self.assertTrue(not is_all or len(failures) == 1, failures)

    def test_a_pose_that_does_not_recover(self):
        self.drive.fault["pose"] = {"within_s": 2.0}
        self.drive.poses = [(t, p if t < 15 else pose(t, t, 0.4)) for t, p in self.drive.poses]
        self.assertEqual(self.drive.failures(), ["pose within_s"])

    def test_a_pose_whose_time_is_not_over(self):
        """Nothing is known of a recovery that may come after the drive's end; one that came is good."""
        self.drive.fault["pose"] = {"within_s": 20.0}
        usual = list(self.drive.poses)
        self.drive.poses = [(t, p if t < 15 else pose(t, t, 0.4)) for t, p in usual]
        self.assertEqual([self.drive.failures(), self.drive.status("pose within_s")], [[], "skipped"])
        self.drive.poses = [(t, pose(t, t, 0.4) if 15 < t < 28 else p) for t, p in usual]
        self.assertEqual([self.drive.failures(), self.drive.status("pose within_s")], [[], "passed"])

    def test_a_pose_that_is_good_for_a_moment(self):
        """A search finds the place, the next picture doubts it: the pose is well when it stays so."""
        self.drive.fault["pose"] = {"within_s": 3.0}
        usual = list(self.drive.poses)
        for doubted_s, failures in ((17.5, []), (19.5, ["pose within_s"])):
            self.drive.poses = [(t, pose(t, t, 0.02 if 16 <= t < 16.2 else 0.4) if 15 <= t < doubted_s else p) for t, p in usual]
            self.assertEqual(self.drive.failures(), failures)

    def test_recoveries_that_overlap(self):
        """Faults that begin before the pose had to be well after another: it is as before the first of them, by the latest of their times."""
        first = {"fault": "bus_down", "from_s": 2.0, "until_s": 3.0, "pose": {"within_s": 14.0}}
        between = {"fault": "bus_silent", "from_s": 8.0, "until_s": 9.0, "pose": {"within_s": 2.0}}
        after = {"fault": "bus_off", "from_s": 15.5, "until_s": 17.0, "pose": {"within_s": 3.0}}
        self.drive.fault["pose"] = {"within_s": 1.0}
        alone = (10.0, 16.0)
        for others, found in (((), alone), ((between,), (8.0, 16.0)), ((first, between), (2.0, 17.0)), ((between, first), (2.0, 17.0)), ((after,), (10.0, 20.0)),
                              ((between, after, first), (2.0, 20.0)), (({**first, "until_s": None},), alone), (({**first, "pose": None},), alone),
                              (({**after, "from_s": 16.5},), alone), (({**first, "pose": {"within_s": 7.0}},), alone)):
            self.assertEqual(fault_judge.recovery(self.drive.fault, others), found, others)
        usual = list(self.drive.poses)
        for well_s, failures in ((16.5, []), (17.5, ["pose within_s"])):  # 1 s is not enough, 2 s are; its sigma just before is no measure
            self.drive.poses = [(t, pose(t, t, 0.2) if 2 <= t < well_s else p) for t, p in usual]
            self.assertEqual(self.drive.failures((first,)), failures)

    def test_the_file_leaves_each_its_time(self):
        """config/faults/indoor.yaml: the next fault begins a second or more after the pose has to be well again."""
        faults = yaml.safe_load((ROOT / "config/faults/indoor.yaml").read_text())["faults"]
        spans = [(one["name"], one["from_s"], one["from_s"] + one.get("for_s", 0) + one.get("pose", {}).get("within_s", 0)) for one in faults]
        self.assertEqual(len(faults), 24)
        for (_, _, due_s), (name, from_s, _) in zip(spans, spans[1:]):
            self.assertGreaterEqual(from_s, due_s + 1, name)

    def test_a_process_that_is_killed_a_little_later(self):
        """Poses between the fault's time and the kill are no recovery."""
        self.drive.fault |= {"fault": "process_killed", "until_s": 10.0, "health": [], "pose": {"within_s": 2.0}}
        self.drive.poses = [(t, p if t < 11.04 else pose(t, t, 0.4)) for t, p in self.drive.poses if not 11.04 < t < 12]
        self.assertEqual(self.drive.failures(), [])
        self.drive.done = {"done": True, "ended_s": 11.06}
        self.assertEqual(self.drive.failures(), ["pose within_s"])

    def test_poses_that_stop(self):
        self.drive.fault["pose"] = {"gap_max_s": 0.5, "rate_hz": 40}
        self.drive.poses = [(t, p) for t, p in self.drive.poses if not 11 < t < 13]
        self.assertEqual(self.drive.failures(), ["pose gap_max_s", "pose rate_hz"])

    def test_counters(self):
        for least, most, failed in ((1, 5, 0), (4, None, 1), (None, 2, 1)):
            self.drive.fault["health"] = [{"what": "counter", "source": "edges:front", "value": "lost", "at_least": least, "at_most": most}]
            self.assertEqual(len(self.drive.failures()), failed, (least, most))

    def test_flags_causes_and_texts(self):
        self.drive.fault["health"] = [{"what": "flag", "value": "motion_stale", "within_s": 0.5}]
        self.assertEqual(len(self.drive.failures()), 2)
        self.drive.poses = [(t, pose(t, t, flags=1) if 10.2 < t < 15.1 else p) for t, p in self.drive.poses]
        self.assertEqual(self.drive.failures(), [])
        self.drive.fault["health"] = [{"what": "cause", "value": "refused", "within_s": 2}]
        self.assertEqual(len(self.drive.failures()), 2)
        self.drive.fault["health"] = [{"what": "text", "value": "front is gone", "at_most": 1}]
        self.assertEqual(len(self.drive.failures()), 1)
        self.drive.said = "front is gone\n"
        self.assertEqual(self.drive.failures(), [])
        self.drive.said *= 2
        self.assertEqual(len(self.drive.failures()), 1)

    def test_names_are_those_of_the_run(self):
        text = (ROOT / "msgs/src/names.c").read_text()
        for table, names in (("kCauses", ["", *fault_judge.CAUSES[1:]]), ("kStates", lcm_log.STATES), ("kDeviceStates", ["", *lcm_log.DEVICES[1:]])):
            self.assertEqual(re.findall(r'"([^"]*)"', re.search(rf"{table}\[\] = {{(.*?)}};", text, re.DOTALL)[1]), list(names), table)

    def test_faults_in_a_part(self):
        for fault, part, is_in in (((10, 15), (0, 30), True), ((10, 15), (15, 30), False), ((10, 15), (14, 30), True), ((10, 15), (0, 10), False),
                                   ((10, None), (20, 30), True), ((10, 10), (10, 30), True), ((10, 10), (11, 30), False)):
            self.assertEqual(fault_judge.is_in({"from_s": fault[0], "until_s": fault[1]}, *part), is_in, (fault, part))

    def test_what_a_player_cannot_do_to_a_device(self):
        """Pictures that a player leaves out have no number on the target; a played driver leaves out the number, too."""
        self.drive.fault |= {"fault": "camera_dropped", "health": [{"what": "counter", "source": "edges:front", "value": "lost", "at_least": 9}]}
        self.assertEqual(len(self.drive.failures()), 1)
        played, on_target = (hil._as_the_target_has_them([self.drive.fault], is_played)[0] for is_played in (True, False))
        self.assertEqual(played, self.drive.fault)
        self.drive.fault = on_target
        self.assertEqual((self.drive.failures(), self.drive.status("health 1: edges:front lost")), ([], "skipped"))

    def test_a_fault_that_did_not_happen(self):
        self.drive.done = {"done": False, "why": "EPERM"}
        self.assertEqual(self.drive.failures(), ["it happened"])


class Written(InFolder):
    def checks(self):
        out = verdict.Checks()
        out.add("log", "bits", True, "the same")
        out.at_most("poses", "distance <m> & \"turn\"", 0.03, 0.02, "too far\x00\x1b[0m")
        out.add("computer", "temperature", None, "no thermometer")
        return out

    def test_junit_is_read_by_a_parser(self):
        import junitparser
        text = verdict.junit(self.checks(), "waymark hil drive", 12.5, "said\x01")
        (self.folder / "junit.xml").write_bytes(text)
        read = junitparser.JUnitXml.fromfile(str(self.folder / "junit.xml"))
        cases = [case for suite in read for case in suite]
        self.assertEqual((read.tests, read.failures, [suite.name for suite in read]), (3, 1, ["log", "poses", "computer"]))
        self.assertEqual([type(case.result[0]).__name__ if case.result else "passed" for case in cases], ["passed", "Failure", "Skipped"])
        self.assertEqual(cases[1].name, 'distance <m> & "turn"')
        self.assertIn("too far", cases[1].result[0].message)

    def test_json_has_no_nan(self):
        checks = verdict.Checks()
        checks.at_most("poses", "never", math.inf, 1.0, "never")
        result = verdict.write(self.folder, {"name": "x"}, checks)
        self.assertEqual(json.loads((self.folder / "result.json").read_text())["verdict"], "failed")
        self.assertEqual(result["checks"][0]["value"], None)


class Files(InFolder):
    def robot(self):
        self.write("rec/recording.yaml", "format: waymark-recording/1\nname: r\nvehicle: {initial_pose: {t_ns: 5, x_m: 1, y_m: 2, heading_rad: 1e-3}}\n")
        self.write("rec/can.log", "(10.000000) can0 101#00\n(10.500000) can1 102##100112233445566778899\n(11.000000) can0 101#01\n")
        self.write("rec/vehicle.dbc", "")
        self.write("rec/calibration.yaml", "")
        self.write("rec/video/front.csv", "frame,t_ns\n0,10000000000\n1,10100000000\n2,10200000000\n")
        self.write("rec/video/front.avi", "RIFF....AVI MJPG")
        self.write("rec/imu.csv", "t_ns,wx\n12000000000,1\n")
        return recording.read(self.folder / "rec")

    def test_a_recording(self):
        found = self.robot()
        self.assertEqual([(bus.name, bus.frames, bus.has_fd) for bus in found.buses], [("can0", 2, False), ("can1", 1, True)])
        self.assertEqual((found.first_ns, found.last_ns, found.streams), (10 * 10**9, 12 * 10**9, ["imu"]))
        self.assertAlmostEqual(found.cameras[0].rate_hz, 10)

    def test_bad_recordings(self):
        for text in ("", "rubbish\n", "(1.0) can0\n"):
            self.write("bad/can.log", text)
            with self.assertRaises(HilError):
                recording.read(self.folder / "bad")
        with self.assertRaises(HilError):
            recording.read(self.folder / "none")

    def test_a_derived_configuration(self):
        rec, out = self.robot(), self.folder / "test"
        out.mkdir()
        config = self.write("robot/robot.yaml", "format: waymark-config/1\nestimator: slam\ndbc: own.dbc\nvision: {apriltag: {}}\nmotion: {noise: {speed_mps: 1e-3}}\n"
                            "devices: {can: [{interface: can1, dbc: own.dbc}], cameras: [{name: front, device: /dev/video0, format: YUYV}], iio: {device: bmi160}}\n"
                            "start: {saved_pose: /var/lib/waymark/pose.yaml}\ncommands: {socket: /run/x}\n")
        self.write("robot/own.dbc", "mine")
        _, buses, cameras = scenario.derive(config, rec, out, True, False)
        derived = yaml.safe_load((out / "robot.yaml").read_text())
        self.assertEqual(buses, [("can1", "can1")])
        self.assertEqual((cameras[0]["format"], cameras[0]["device"]), ("YUYV", "/dev/video40"))
        self.assertEqual((out / derived["dbc"]).read_text(), "mine")
        self.assertEqual(derived["calibration"], "recording/calibration.yaml")
        self.assertEqual(derived["devices"]["lcm"], [{"stream": "imu"}])
        self.assertNotIn("iio", derived["devices"])
        self.assertNotIn("commands", derived)
        self.assertFalse(derived["start"]["saved_pose"].startswith("/"))
        self.assertEqual(derived["initial_pose"].keys(), {"x_m", "y_m", "heading_rad"})
        self.assertIn("speed_mps: 1e-3", (out / "robot.yaml").read_text())

    def test_a_later_start(self):
        table = self.write("before/published.csv", "t_ns,x_m,y_m,z_m,qx,qy,qz,qw\n100,1,2,0.5,0,0,0,1\n200,3,4,0.6,0,0,1,0\n300,5,6,0.7,0,0,0,1\n")
        for start, keys in (({"x_m": "9", "y_m": "9", "heading_rad": "1", "sigma_xy_m": "0.5"}, {"x_m", "y_m", "qx", "qy", "qz", "qw", "sigma_xy_m"}),
                            ({"x_m": "9", "y_m": "9", "z_m": "9"}, {"x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"})):
            self.assertTrue(scenario.begin_at({"initial_pose": start}, self.folder, table, 299))
            derived = yaml.safe_load((self.folder / "robot.yaml").read_text())["initial_pose"]
            self.assertEqual((derived.keys(), derived["x_m"], derived["qz"]), (keys, 3, 1))
        self.assertFalse(scenario.begin_at({"initial_pose": {}}, self.folder, table, 99))

    def test_bad_configurations(self):
        rec = self.robot()
        for text in ("a: [", "just text", "dbc: missing.dbc\n", "devices: 5\n"):
            with self.assertRaises(HilError):
                scenario.derive(self.write("bad.yaml", text), rec, self.folder, False, False)

    def test_limits(self):
        run, figures = limits.read(self.write("l.yaml", "format: waymark-hil-limits/1\nrun: {position_m: 0.5, memory_mb: off}\ncompare: {memory_mb: {share: 0.2}, cpu_share: 0.5}\n"), False)
        self.assertEqual((run["position_m"], run["memory_mb"], figures["memory_mb"], figures["cpu_share"]), (0.5, None, (0.2, 1.0), (0.5, 0.01)))
        for text in ("run: {}\n", "format: waymark-hil-limits/1\nrun: {positon_m: 1}\n", "format: waymark-hil-limits/1\nrun: {position_m: -1}\n",
                     "format: waymark-hil-limits/1\nrun: {position_m: wide}\n", "format: waymark-hil-limits/1\nother: 1\n"):
            with self.assertRaises(HilError):
                limits.read(self.write("l.yaml", text), False)

    def test_samples(self):
        self.write("out/samples.txt", "# ...; ticks a second: 100\n0.5 cpu wm-source-0:7 10\n0.5 cpu wm-source-0:8 0\n10.5 cpu wm-source-0:7 210\n10.5 cpu wm-source-0:8 100\n"
                   "1.0 temperature 0 41000\n1.0 temperature 1 52500\n1.0 clock 0 1200000\n1.0 clock 1 900000\n1.0 memory VmRSS 20480\n1.0 memory VmHWM 30720\nrubbish\n2.0 cpu\n")
        found = samples.read(self.folder / "out")
        self.assertEqual([(name, round(share, 9)) for name, share in found.threads], [("wm-source-0", 0.3)])
        self.assertEqual((found.temperature, found.clock, found.memory_peak_mb), ([(1.0, 52.5)], [(1.0, 900.0)], 30.0))

    def test_wake_ups(self):
        self.assertIsNone(samples.wake_us(self.folder))
        self.write("cyclictest.json", json.dumps({"thread": {"0": {"histogram": {"10": 990, "40": 9, "900": 1}}}}))
        self.assertEqual(samples.wake_us(self.folder), {"what": "cyclictest", "p99_us": 10.0, "max_us": 900.0})


class Stamps(InFolder):
    """10 s of a bus at 100 Hz and a camera at 10 Hz, and what the target recorded of it on its own clock."""

    OFFSET_NS, SETTLE_S = 5_000_000_000_123, 1.0

    def judged(self, lost_frame=(), lost_picture=(), frame_late_ms=0.2, picture_late_ms=0.4, faults=(), recorded=True):
        """{name: status} and the figures; the bus has another name on the target."""
        def table(name, shift_ns, leave_out):
            self.write(name, "frame,t_ns\n" + "".join(f"{k},{k * 10**8 + shift_ns}\n" for k in range(100) if k not in leave_out))

        def log(name, bus, shift_ns, leave_out):
            self.write(name, "".join(f"({t // 10**9}.{t % 10**9:09d}) {bus} 101#{k % 256:02X}\n" for k in range(1000) if k not in leave_out for t in (k * 10**7 + shift_ns,)))
        log("rec/can.log", "can0", 0, ())
        table("rec/video/front.csv", 0, ())
        if recorded:
            log("out/recorded/can.log", "can7", self.OFFSET_NS + int(frame_late_ms * 1e6), lost_frame)
            table("out/recorded/video/front.csv", self.OFFSET_NS + int(picture_late_ms * 1e6), lost_picture)
        facts = {"recording": self.folder / "rec", "from_s": 0.0, "until_s": 9.9, "faults": list(faults)}
        one = types.SimpleNamespace(checks=verdict.Checks(), out=self.folder / "out", facts=facts, played={"offset_ns": self.OFFSET_NS}, figures={}, is_broken=bool(faults),
                                    start_ns=self.OFFSET_NS, limits=limits.read(None, False)[0])
        stamps.judge(one, [("can0", "can7")], ["front"], self.SETTLE_S)
        return {check.name: check.status for check in one.checks}, one

    def test_all_is_there(self):
        found, one = self.judged()
        self.assertEqual(set(found.values()), {"passed"})
        self.assertAlmostEqual(one.figures["skew_front_p99_ms"], 0.2, places=3)
        self.assertIn("870 of 870", one.checks[0].text)  # from the second second on, and what is on its way at the end is left out

    def test_a_skew(self):
        for late_ms, status in ((1.1, "passed"), (1.3, "failed"), (-1.0, "failed")):
            self.assertEqual(self.judged(picture_late_ms=late_ms)[0]["skew of front and CAN"], status, late_ms)

    def test_what_is_lost(self):
        self.assertEqual(self.judged(lost_frame=(500,))[0], {"can:can0": "failed", "camera:front": "passed", "skew of front and CAN": "passed"})
        self.assertEqual(self.judged(lost_picture=(50,))[0]["camera:front"], "failed")
        self.assertEqual(self.judged(lost_frame=(10,), lost_picture=(3,))[0]["camera:front"], "passed")  # before it had settled

    def test_nothing_was_recorded(self):
        self.assertEqual(self.judged(recorded=False)[0], {"recorded": "failed"})

    def test_with_faults(self):
        self.assertEqual(set(self.judged(lost_frame=(500,), picture_late_ms=30, faults=("one",))[0].values()), {"skipped"})


class Timing(InFolder):
    """10 of 1000 deadlines were missed, ten times what is allowed."""

    def judged(self, faults=(), deadlines=None):
        """Status of the check of deadlines, by a whole judge of a folder."""
        self.write("out/drive/timing.json", json.dumps({"deadlines_missed": 10, "deadlines_total": 1000}))
        run = limits.read(None, False)[0] | ({} if deadlines is None else {"deadlines_missed_share": deadlines})
        one = judge.Judge(verdict.Checks(), self.folder, {"from_s": 0.0, "until_s": 9.0, "faults": list(faults)}, run, None, None)
        one.timing()
        found = next(check for check in one.checks if check.name == "deadlines")
        return found.status, found.text, one.figures["deadlines_missed_share"]

    def test_deadlines(self):
        self.assertEqual(self.judged(), ("failed", "10 of 1000 missed", 0.01))
        self.assertEqual(self.judged(deadlines=0.02)[0], "passed")

    def test_with_faults_they_are_reported_alone(self):
        fault = {"name": "hog", "fault": "cpu_hogged", "from_s": 2.0, "until_s": 3.0}
        self.assertEqual(self.judged(faults=(fault,)), ("skipped", "10 of 1000 missed", 0.01))
        self.assertEqual(self.judged(faults=({**fault, "from_s": 20.0, "until_s": 21.0},))[0], "failed")  # none in the part that was played


class Players(InFolder):
    def judged(self, sent, faults=()):
        """Status of a camera of which one picture was 8 ms late, and of a bus."""
        stream = {"sent": sent, "p50_us": 10, "max_us": 8035}
        streams = [{**stream, "name": "camera:front", "p99_us": 8035}, {**stream, "name": "can:can0", "p99_us": 8035}]
        self.write("out/played.json", json.dumps({"streams": streams}))
        facts = {"from_s": 0.0, "until_s": 9.0, "faults": list(faults), "plays": True, "played": False, "unused": []}
        one = judge.Judge(verdict.Checks(), self.folder, facts, limits.read(None, False)[0], None, None)
        one.player()
        return [check.status for check in one.checks[:2]]

    def test_a_device_that_is_opened_again(self):
        """A camera that comes back has one late picture, of few."""
        fault = {"name": "unplugged", "fault": "camera_unplugged", "camera": "front", "from_s": 2.0, "until_s": 3.0}
        self.assertEqual(self.judged(60), ["failed", "failed"])
        self.assertEqual(self.judged(60, [fault]), ["skipped", "failed"])
        self.assertEqual(self.judged(600, [fault]), ["failed", "failed"])  # 99 of 100 have one to spare
        for other in ({"camera": "rear"}, {"from_s": 20.0, "until_s": 21.0}, {"fault": "camera_frozen"}):
            self.assertEqual(self.judged(60, [{**fault, **other}]), ["failed", "failed"])


class Guests(InFolder):
    def test_rate_of_instructions(self):
        machine, words = guest.at_rate("amd64", 2000)
        self.assertEqual((machine, words), (guest.MACHINES["amd64"], "tsc_early_khz=2000000 tsc=reliable"))
        machine, words = guest.at_rate("arm64", 3000)
        self.assertEqual((machine["qemu"][-1], words), ("cortex-a57,cntfrq=3000000000", ""))
        for arch in guest.MACHINES:
            self.assertEqual(guest.at_rate(arch, 1000), (guest.MACHINES[arch], ""))

    def test_an_unpacked_kernel(self):
        """Of x86-64, once for each kernel; another architecture's is booted as it is."""
        image = self.folder
        for number, content in enumerate((b"\x7fELF kernel", b"\x7fELF of an update")):
            payload = lzma.compress(content)
            packed = bytearray(1024 + 0x300 + len(payload))
            packed[0x1F1], packed[0x202:0x206] = 1, b"HdrS"
            packed[0x248:0x250] = (0x300).to_bytes(4, "little") + len(payload).to_bytes(4, "little")
            packed[1024 + 0x300:] = payload
            (image / "vmlinuz").write_bytes(packed)
            os.utime(image / "vmlinuz", ns=((2 + number) * 10**18,) * 2)
            self.assertEqual(guest.kernel_of(image).read_bytes(), content)
            os.utime(image / "vmlinux", ns=((2 + number) * 10**18,) * 2)
        self.assertEqual(guest.kernel_of(image), image / "vmlinux")
        (image / "vmlinuz").write_bytes(b"MZ" + bytes(0x300))
        os.utime(image / "vmlinuz", ns=(4 * 10**18,) * 2)
        self.assertEqual(guest.kernel_of(image), image / "vmlinuz")

    def test_an_end(self):
        """A guest that is done, one that works without an end, one that waits on a busy desk."""
        log = self.folder / "log"
        self.assertTrue(guest.boot(["sh", "-c", "echo GUEST-RC 0"], log))
        self.assertFalse(guest.boot(["sh", "-c", "while :; do :; done"], log, 0.3))
        self.assertIn("was ended by the desk", log.read_text())
        self.assertTrue(guest.boot(["sh", "-c", "sleep 1.5; echo GUEST-RC 0"], log, 1))
        self.assertNotIn("was ended", log.read_text())

    def test_what_is_missing(self):
        """An image of an older kernel is there, and a newer one cannot be made."""
        self.write("image/made_of", "6.1.0-1 0")
        with mock.patch.object(guest, "missing", lambda arch, has_image=False: [] if has_image else ["mmdebstrap"]), \
                mock.patch.object(guest.subprocess, "run", lambda *_, **__: types.SimpleNamespace(returncode=1)), \
                self.assertRaisesRegex(HilError, "apt-get install mmdebstrap"):
            guest.prepare("amd64", self.folder)

    def test_programs_that_are_missing(self):
        with mock.patch.object(targets.shutil, "which", lambda *_, **__: None), self.assertRaisesRegex(HilError, "openssh-client"):
            targets.Host("pi@board", [], {}).prepare(None)

    def test_the_rate_is_stated(self):
        self.assertEqual(targets.Guest("amd64", None, None).name, "guest amd64")
        other = targets.Guest("amd64", None, None, 3000)  # so that the two are not compared
        self.assertEqual((other.name, other.computer), ("guest amd64, 3000 MIPS", ["one processor that does 3000 million instructions a second"]))


class Boards(InFolder):
    """Who may do what root does."""

    def prepared(self, *lines):
        board, quiet = targets.Host("pi@board", [], {}), types.SimpleNamespace(say=lambda text: None)
        board._ask = lambda command: "\n".join(("waymark 0.1.0", *lines))
        board.prepare(quiet)
        return board

    def test_users(self):
        self.assertEqual(self.prepared("4", "0", "alone").as_root, "")
        self.assertEqual((self.prepared("1", "1000", "sudo").as_root, self.prepared("1", "1000", "sudo").single_core), ("sudo -n ", True))
        with self.assertRaisesRegex(HilError, "NOPASSWD"):
            self.prepared("4", "1000", "alone")

    def test_no_connection(self):
        """ssh's own failure is stated without the command that was to run there."""
        self.write("ssh", "#!/bin/sh\necho 'ssh: Could not resolve hostname robot' >&2\nexit 255\n").chmod(0o755)
        with mock.patch.dict(os.environ, {"PATH": f"{self.folder}:{os.environ['PATH']}"}):
            with self.assertRaisesRegex(HilError, "^pi@robot: no connection: ssh: Could not resolve hostname robot; try `ssh pi@robot true`$"):
                targets.Host("pi@robot", [], {}).prepare(None)


class Compared(unittest.TestCase):
    def side(self, **figures):
        seconds = [[i, figures.get("truth_rmse_m", 0.02) + 0.001 * (i % 3)] for i in range(40)]
        return {"recording": "r", "target": "t", "figures": figures, "per_second": {"truth_m": seconds}, "checks": []}

    def verdicts(self, before, after):
        result, _ = compare.compare(before, after, limits.COMPARE)
        return {row["figure"]: row["verdict"] for row in result["figures"]}, result["is_worse"]

    def test_the_same(self):
        one = self.side(truth_rmse_m=0.02, cpu_share=0.2)
        self.assertEqual(self.verdicts(one, one), ({"truth_rmse_m": "no difference found", "cpu_share": "no difference found"}, False))

    def test_worse_and_better(self):
        self.assertEqual(self.verdicts(self.side(truth_rmse_m=0.02, cpu_share=0.2), self.side(truth_rmse_m=0.03, cpu_share=0.1)),
                         ({"truth_rmse_m": "worse", "cpu_share": "better"}, True))

    def test_within_its_limit(self):
        self.assertEqual(self.verdicts(self.side(correct_p99_us=100.0), self.side(correct_p99_us=114.0)), ({"correct_p99_us": "no difference found"}, False))

    def test_a_check_that_fails_now(self):
        one, two = self.side(memory_mb=20.0), self.side(memory_mb=20.0)
        one["checks"], two["checks"] = [[{"group": "log", "name": "bits", "status": status, "text": "x"}] for status in ("passed", "failed")]
        self.assertTrue(self.verdicts(one, two)[1])
        self.assertFalse(self.verdicts(two, two)[1])

    def test_different_targets(self):
        with self.assertRaises(HilError):
            compare.compare(self.side(memory_mb=1.0), self.side(memory_mb=1.0) | {"target": "other"}, limits.COMPARE)


class Poses(InFolder):
    def test_a_run_in_the_plane_has_no_height(self):
        """A road that climbs is no error of a planar estimator; in space the height counts."""
        truth = self.write("truth.csv", "t_ns,x_m,y_m,z_m\n0,3,0,4\n20,3,0,4\n")
        for name, columns in (("plane", "cov_xx,cov_xy,cov_yy"), ("space", "cov_xx,cov_zz")):
            run = self.write(f"{name}.csv", f"t_ns,x_m,y_m,z_m,qx,qy,qz,qw,{columns}\n" + "".join(
                f"{t},0,0,0,0,0,0,1{',1' * columns.count('cov')}\n" for t in (0, 10)))
            rows = poses.table(truth, not poses.is_planar(run))
            self.assertEqual(poses.rms(m for _, m, _ in poses.differences(poses.table(run), rows, 0)), 3.0 if name == "plane" else 5.0)

    def test_between_and_around(self):
        rows = [(k * 10**9, float(k), 0.0, 3.1 if k % 2 else -3.1, 0.0) for k in range(8)]
        times = [row[0] for row in rows]
        x, _, heading, _ = poses.at(rows, times, 2_500_000_000)
        self.assertAlmostEqual(x, 2.5)
        self.assertAlmostEqual(abs(math.remainder(heading, 2 * math.pi)), math.pi, places=6)
        self.assertIsNone(poses.at(rows, times, -1))
        live = [(3_500_000_000, 3.5, 0.3, math.pi, 0.0)]
        (_, metres, degrees), = poses.apart_of(live, rows, 0)
        self.assertAlmostEqual(metres, 0.3)
        self.assertLess(degrees, 3)

    def test_a_correction_of_one_message_is_no_distance(self):
        """A correction falls within one message: what is carried on across it has the noise of the motion. Two messages count."""
        rows = [(k * 10**9, float(k), 0.0, 0.0, 0.0) for k in range(12)]
        live = lambda *late: [(k * 10**9, float(k), 0.5 if k in late else 0.0, 0.0, 0.0) for k in range(12)]
        worst = lambda *late: max(m for _, m, _ in poses.apart_of(live(*late), rows, 0))
        self.assertAlmostEqual(worst(5), 0.0)
        self.assertAlmostEqual(worst(5, 6), 0.5)


if __name__ == "__main__":
    unittest.main()
