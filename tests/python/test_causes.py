#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The engine for causes without a drive: changes of files, the judgement between drives, sizes.

    test_causes.py BIN_DIR       Skipped (77) where the build has no libwaymark.so (sanitizers)."""

import dataclasses
import io
import math
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from common import BIN, Folder, use_library
from PIL import Image

use_library()

import plan_robots  # noqa: E402
from waymark.causes import changes, plan, search, trial  # noqa: E402
from waymark.causes.faults import all_faults  # noqa: E402
from waymark.causes.features import with_features  # noqa: E402
from waymark.causes.fault import Clock, Fault, discrete, factor_words  # noqa: E402
from waymark.causes.robot import Robot  # noqa: E402
from waymark.causes.trial import Blocks, Drive, Undo, likelihoods  # noqa: E402
from waymark.maps import FloorPlan, write_floor_plan  # noqa: E402
from waymark.replaying import EventLog, replay  # noqa: E402

SCENARIO = plan_robots.HEAD + plan_robots.CORRIDOR + "cameras: [{name: front, size: [320, 180], xyz_m: [0.33, 0, 0.5], rpy_deg: [0, 20, 0], rate_hz: 5}]\n"
YAML = b"# a robot\nsensors:\n  front:   # screwed on by eye\n    mounting: {xyz_m: [0.1, 0, 0.2]}\nwheels: {radius_m: 0.05}\n"
DBC = b"BO_ 256 ODOMETRY: 8 R\n SG_ TICKS : 0|32@1- (1,0) [0|1] \"\" W\n\nBO_ 257 OTHER: 8 R\n SG_ TICKS : 8|16@1+ (2,0) [0|1] \"\" W\n"


class Changes(unittest.TestCase):
    def value(self, path, text):
        return changes.Value("f", path, text).apply(YAML).decode()

    def test_a_value_is_replaced_and_all_else_stays(self):
        self.assertEqual(self.value(("wheels", "radius_m"), "0.06"), YAML.decode().replace("0.05", "0.06"))
        self.assertEqual(self.value(("sensors", "front", "mounting", "xyz_m"), "[0, 0, 1]"), YAML.decode().replace("[0.1, 0, 0.2]", "[0, 0, 1]"))

    def test_a_missing_value_is_added_to_what_is_there(self):
        self.assertIn("mounting: {rpy_deg: [0, 0, 90], xyz_m:", self.value(("sensors", "front", "mounting", "rpy_deg"), "[0, 0, 90]"))
        self.assertIn("gnss: {mounting: {xyz_m: [1, 0, 0]}}\nsensors:", self.value(("gnss", "mounting", "xyz_m"), "[1, 0, 0]"))

    def test_a_dotted_key_is_the_same_value(self):
        dotted = changes.Value("f", ("motion", "noise", "speed_mps"), "0.1")
        self.assertEqual(dotted.apply(b"motion:\n  noise.speed_mps: 0.02  # by eye\n"), b"motion:\n  noise.speed_mps: 0.1  # by eye\n")
        self.assertEqual(dotted.apply(b"motion.noise:\n  speed_mps: 0.02\n"), b"motion.noise:\n  speed_mps: 0.1\n")

    def test_stamps_stay_whole_and_other_sensors_stay(self):
        table = b"t_ns,sensor,range_m\n1700000000000000001,a,2.5\n1700000000000000002,b,\n"
        self.assertEqual(changes.column("f", "t_ns", 1, -10**9).apply(table).splitlines()[1], b"1699999999000000001,a,2.5")
        self.assertEqual(changes.column("f", "range_m", 2, only="b").apply(table), table)
        self.assertEqual(changes.column("f", "range_m", 2, only="a").apply(table).splitlines()[1:], [b"1700000000000000001,a,5", b"1700000000000000002,b,"])

    def test_counters_go_on_at_the_end_of_their_bits(self):
        table = b"t_ns,left,right\n1,250,3\n2,4,1\n3,14,254\n4,251,250\n"
        self.assertEqual(changes.Counted("f", 8).apply(table), b"t_ns,left,right\n1,250,3\n2,260,1\n3,270,-2\n4,251,-6\n")

    def test_a_signal_is_that_of_its_message(self):
        self.assertIn(b"TICKS : 7|32@0- (1,0)", changes.Signal("f", "ODOMETRY", "TICKS", "order").apply(DBC))
        self.assertIn(b"TICKS : 8|16@1- (2,0)", changes.Signal("f", "OTHER", "TICKS", "sign").apply(DBC))
        self.assertIn(b"TICKS : 8|12@1+ (2,0)", changes.Signal("f", "OTHER", "TICKS", "bits", 12).apply(DBC))
        motorola = DBC.replace(b"8|16@1+", b"15|16@0+")
        self.assertIn(b"TICKS : 11|12@0+ (2,0)", changes.Signal("f", "OTHER", "TICKS", "bits", 12).apply(motorola))
        self.assertIn(b"TICKS : 23|8@0+ (2,0)", changes.Signal("f", "OTHER", "TICKS", "bits", 8).apply(motorola))
        for signal, layout, bits in (("NONE", "sign", 0), ("TICKS", "bits", 16)):
            with self.assertRaises(changes.Impossible):
                changes.Signal("f", "OTHER", signal, layout, bits).apply(DBC)


def drive(gain, unusual=0.0, lost=0.0):
    """A drive of 40 blocks with 20 updates each, of `gain` nats an update."""
    rng = np.random.default_rng(1)
    nats = 20 * gain + rng.normal(0, 0.5, 40)
    return Drive(nats, nats, np.full(40, 20), 1.0, 0.9, lost, 0.0, 0.1, unusual=unusual)


def row(name, group=""):
    return discrete(name, lambda _: [], lambda _: name, group=group)


class Rows(unittest.TestCase):
    """Rows of motion in tables."""

    def rows_of(self, **tables):
        folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        (folder / "robot.yaml").write_text("format: waymark-config/1\n")
        for name, lines in tables.items():
            (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
        return {row.name: row for row in all_faults(Robot.read(folder, folder / "robot.yaml", {}))}

    def ticks(self, counts):
        return ["t_ns,left,right", *(f"{10**9 + k * 10**7},{c},{c}" for k, c in enumerate(counts))]

    def test_clocks_of_motion_are_of_several_streams(self):
        turns = ["t_ns,wx_radps,wy_radps,wz_radps", "1000000000,0,0,0.1", "1010000000,0,0,0.2"]
        alone, both = self.rows_of(imu=turns), self.rows_of(imu=turns, ticks=self.ticks(range(9)))
        self.assertFalse([name for name in alone if name.startswith(("clock of", "drift of"))])
        self.assertTrue({"drift of imu", "clock of imu", "drift of ticks", "clock of ticks"} <= set(both))

    def test_a_speed_s_unit_is_what_the_filter_s_own_scale_took(self):
        speed = self.rows_of(motion=["t_ns,v_mps,w_radps", "1000000000,0.5,0.1"])["scale of the speed"]
        self.assertEqual(speed.unit(speed.by_states({"motion.speed_scale": 0.3})), (1 / 3.6,))
        self.assertIn("km/h", speed.say((1 / 3.6,)))

    def test_rows_in_disorder_are_a_fact_and_a_late_one_is_none(self):
        def stamped(order):
            turns = ["t_ns,wx_radps,wy_radps,wz_radps", *(f"{10**9 + k * 10**8},0,0,0.1" for k in order)]
            return [row.is_fact for name, row in self.rows_of(imu=turns, ticks=self.ticks(range(9))).items() if name == "order of imu"]
        self.assertEqual((stamped([*range(20, 40), *range(20)]), stamped([0, 2, 1, 3, 4])), ([True], []))

    def test_a_source_that_begins_and_ends_later_by_as_much_is_a_fact(self):
        def late(begin_s, end_s):
            rows = self.rows_of(ticks=self.ticks(range(1000)), gnss=["t_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m", *(f"{round((1 + s) * 1e9)},0,0,0,1,1" for s in np.arange(begin_s, 10 + end_s, 0.1))])
            return [round(row.start[0][0], 1) for name, row in rows.items() if name == "clock of gnss" and row.is_fact]
        self.assertEqual((late(2, 2), late(-3, -3), late(2, 0), late(2, 3), late(0.5, 0.5)), ([-2.0], [3.0], [], [], []))

    def test_numbers_in_reverse_are_a_row(self):
        seen = ["t_ns,sensor,id,bearing_rad,range_m", *(f"{10**9 + k},s,{26 - k},0.1,2" for k in range(6, 18))]
        rows = self.rows_of(sightings=seen, landmarks=["id,x_m,y_m,z_m,sigma_m", *(f"{k},{k},0,0,0.1" for k in range(6, 21))])
        edit, = rows["identities of sightings:s from 26"].edits((1.0,))
        self.assertEqual(edit.apply("\n".join(seen).encode()).splitlines()[1], b"1000000006,s,6,0.1,2")

    def test_counters_of_fewer_bits_are_a_fact_and_a_restart_is_none(self):
        counters = [name for name in self.rows_of(ticks=self.ticks(20 * k % 256 for k in range(60))) if name.startswith("counters")]
        self.assertEqual(counters, ["counters of 8 bits"])
        restart = self.rows_of(ticks=self.ticks([*range(0, 50000, 20), *range(0, 2000, 20)]))
        self.assertFalse([name for name in restart if name.startswith("counters")])


MARKERS = """format: waymark-config/1
estimator: slam
motion: {noise: {ticks_per_sqrt_m: 0.001}}
vision: {apriltag: {}}
sources:
  - {name: "apriltag:ceiling", lateness_max_ms: 250}
"""
CAMERA = """cameras:
  up:
    model: pinhole-radtan
    size: [640, 480]
    intrinsics: [450, 452, 322, 237]
    distortion: [0, 0, 0, 0]
    mounting: {xyz_m: [0.1, 0, 0.3], rpy_deg: [0, -90, 0]}
markers: {family: tag36h11, size_m: 0.2}
"""


class Pictures(Folder):
    """What a detector finds in pictures is found once."""

    def drive(self, family="tag36h11"):
        """A robot under markers on a ceiling, for some seconds."""
        drive, config = self.folder / "drive", self.folder / "robot.yaml"
        subprocess.run([BIN / "waymark-simulate", BIN.parent.parent / "config/worlds/office-easy.yaml", "--duration", "5", "--out", drive], check=True, capture_output=True)
        calibration = drive / "calibration.yaml"
        calibration.write_text(calibration.read_text().replace("tag36h11", family))
        config.write_text(MARKERS)
        return Robot.read(drive, config, {})

    @unittest.skipUnless((BIN / "waymark-simulate").exists(), "no simulator here")
    def test_markers_give_the_same_drive_as_their_pictures(self):
        robot = self.drive()
        seen = with_features(robot, self.folder)
        ends = [replay(r.files.recording, r.files.config) for r in (robot, seen)]
        self.assertGreater(len(ends[0].innovations["t_ns"]), 100)
        for name in ("observed", "variance"):
            self.assertLess(np.abs(ends[0].innovations[name] - ends[1].innovations[name]).max(), 1e-6)
        rows = {row.name: row for row in all_faults(seen)}
        clock = rows["clock of apriltag:ceiling"]
        self.assertTrue(clock.clock.is_of("markers:ceiling"))
        self.assertEqual({place.file for place in robot.files.places(clock.edits((0.4,)))}, {"video/ceiling.csv"})
        size = rows["size of the markers"].edits((0.5,))
        self.assertEqual([{edit.file for edit in way(size)} for way in (changes.for_robot, changes.for_trial)], [{"calibration.yaml"}, {"calibration.yaml", "markers.csv"}])
        self.assertFalse([name for name in rows if name.startswith(("identities", "family"))])  # a detector's own are right

    @unittest.skipUnless((BIN / "waymark-simulate").exists(), "no simulator here")
    def test_another_family_is_tried_where_no_marker_is_found(self):
        seen = with_features(self.drive("tag25h9"), self.folder)
        self.assertEqual([list(seen.families), seen.sources], [["tag36h11"], []])
        edits = {row.name: row for row in all_faults(seen)}["family tag36h11"].edits((1.0,))
        self.assertEqual([place.text for place in seen.original.files.places(edits)], ["family: tag36h11"])
        self.assertGreater(len(changes.for_trial(edits)[1].apply(b"").splitlines()), 20)

    def test_markers_are_measured_anew_as_their_corners_would_be(self):
        # A print on a ceiling, seen by a camera that looks up: the reader of corners makes the pose by each calibration.
        corners = "t_ns,sensor,id,u0_px,v0_px,u1_px,v1_px,u2_px,v2_px,u3_px,v3_px\n" + "".join(
            f"{10**9 + k * 10**8},up,7,{400 + k},200,{442 + k},210,{432 + k},252,{390 + k},242\n" for k in range(3))

        def read(name, *edits):
            folder = self.folder / name
            folder.mkdir()
            files = {"calibration.yaml": CAMERA, "marker-corners.csv": corners, "motion.csv": "t_ns,v_mps,w_radps\n" + "".join(f"{10**9 + k * 10**7},0.1,0\n" for k in range(60)),
                     "recording.yaml": "format: waymark-recording/1\nname: n\nstreams: [motion.csv, marker-corners.csv, calibration.yaml]\n"}
            for edit in edits:
                files[edit.file] = edit.apply(files[edit.file].encode()).decode()
            for file, text in files.items():
                (folder / file).write_text(text)
            (self.folder / "slam.yaml").write_text("format: waymark-config/1\nestimator: slam\n")
            replay(folder, self.folder / "slam.yaml", out=folder / "run")
            event = EventLog(folder / "run/events.wmlog").events("marker")[0]
            return [*event["p_m"], event["yaw_rad"]]

        table = "t_ns,sensor,id,x_m,y_m,z_m,yaw_rad\n1,up,7,{},{},{},{}\n".format(*read("stated")).encode()
        angles = (0.0, -math.pi / 2, 0.0)
        focal = ((2.0, 0, 0), (322 / 450, 1, 0), (237 / 452, 0, 1))
        for name, path, text, again in (("size", ("markers", "size_m"), "0.5", changes.Measured("f", "up", ((2.5, 0, 0), (0, 2.5, 0), (0, 0, 2.5)))),
                                        ("down", ("cameras", "up", "mounting", "rpy_deg"), "[0, 90, 0]", changes.Measured("f", "up", before=angles, after=(0.0, math.pi / 2, 0.0))),
                                        ("roll", ("cameras", "up", "mounting", "rpy_deg"), "[180, -90, 0]", changes.Measured("f", "up", before=angles, after=(math.pi, -math.pi / 2, 0.0))),
                                        ("yaw", ("cameras", "up", "mounting", "rpy_deg"), "[0, -90, 40]", changes.Measured("f", "up", before=angles, after=(0.0, -math.pi / 2, 0.7))),
                                        ("lens", ("cameras", "up", "intrinsics"), "[900, 904, 644, 474]", changes.Measured("f", "up", focal))):
            right = read(name, changes.Value("calibration.yaml", path, text))
            anew = [float(number) for number in again.apply(table).decode().splitlines()[1].split(",")[3:]]
            for a, b in zip(anew[:3], right[:3]):
                self.assertAlmostEqual(a, b, delta=0.02 * right[0], msg=name)
            self.assertLess(abs(math.remainder(anew[3] - right[3], 2 * math.pi)), 0.02, name)
        other = table.replace(b"up", b"down")
        self.assertEqual(changes.Measured("f", "up", focal).apply(other), other)


class Judgement(unittest.TestCase):
    def setUp(self):
        self.search = search.Search(None, None)

    def judged(self, *drives, groups=("", "", "")):
        found = self.search._ordered([search.Candidate(row(f"row {i}", groups[i]), (1.0,), d) for i, d in enumerate(drives)])
        best, tied, probability = self.search._judge(found, drive(1.0, unusual=20.0))
        return best.fault.name, [c.fault.name for c in tied], probability

    def test_the_better_one_is_named_with_its_probability(self):
        name, tied, probability = self.judged(drive(1.5), drive(2.0), drive(1.1))
        self.assertEqual((name, tied), ("row 1", []))
        self.assertGreater(probability, 0.99)

    def test_two_that_predict_alike_are_not_told_apart(self):
        self.assertEqual(self.judged(drive(2.0), drive(2.001))[1], ["row 0"])
        self.assertEqual(self.judged(drive(2.0), drive(2.001), groups=("same", "same"))[1], [])
        self.assertEqual(self.judged(drive(2.0), drive(2.001, lost=0.5))[1], [])  # one that is no right drive is none to choose

    def test_states_that_need_not_move_decide_between_two_that_predict_alike(self):
        self.assertEqual(self.judged(drive(2.0, unusual=1.0), drive(2.001, unusual=15.0))[:2], ("row 0", []))

    def test_a_small_gain_names_nothing(self):
        found = [search.Candidate(dataclasses.replace(row("row"), is_shown=is_shown), (1.0,), drive(gain)) for gain, is_shown in ((1.05, False), (1.2, False), (1.05, True))]
        self.assertEqual([self.search._helps(one, drive(1.0)) for one in found], [False, True, True])

    def test_a_size_is_the_top_of_the_parabola(self):
        fault = Fault("f", ((0.0,),), lambda _: [], lambda _: "", step=(1.0,))
        size, step = search._parabola(fault, (3.0,), 0, 1.0, [-(2.0 - 3.4) ** 2, -(3.0 - 3.4) ** 2, -(4.0 - 3.4) ** 2])
        self.assertAlmostEqual(size[0], 3.4)
        self.assertLess(step, 1.0)

    def scaled_ranges(self):
        """Ranges in mm whose stated sigma is too large: a larger factor predicts better, and the filter's own scale of ranges takes it up."""
        ranges = Fault("ranges", ((0.001,),), lambda _: [], lambda _: "", step=(0.03,), smallest=(0.003,), is_log=True, named=(0.001, 0.01),
                       settled=lambda size, states: (size[0] / states["range_scale"],))

        def driven(jobs, *_, **__):
            far = [math.log(jobs[k][-1][1][0] / 0.001) for k in range(len(jobs))]
            return [dataclasses.replace(drive(2.0 + 0.4 * x), states={"range_scale": math.exp(x)}, unusual=min(12.0, 0.5 * (x / 0.02)**2), far_states=0.5 * (x / 0.02)**2) for x in far]
        self.search.trials = SimpleNamespace(run=driven, blocks=Blocks(0, 1.0, 40))
        self.search._drives = lambda jobs, *_, **__: driven([[job] for job in jobs])
        return ranges, driven

    def test_a_longer_part_is_screened_where_time_is_left_for_one_that_is_twice_as_long(self):
        for left_s, is_longer in ((28.0, True), (8.0, False)):  # of 100 trials at 1 ms a second of the drive: 84 s and 24 s of it
            self.search.left_s = lambda left_s=left_s: left_s
            self.search.trial_cost, self.search.duration_s, self.search.starts, self.search.screened_s = 1e-3, 1000.0, 100, 20.0
            self.search.moved_at_s = self.search.moved_s = np.arange(1000.0)
            self.assertEqual(self.search._may_screen_more(), is_longer)
            self.assertAlmostEqual(self.search.part_s(100, search.SCREEN_SHARE, self.search.screen_most_s), 84.0 if is_longer else 20.0)

    def test_a_part_has_movement_where_the_robot_stands_at_first(self):
        t_s = np.arange(0, 200, 0.1)
        published = {"t_ns": (1e9 * t_s).astype(np.int64), "odom_x_m": 0.02 * t_s + 0.5 * np.maximum(0, t_s - 50), "odom_y_m": 0 * t_s, "odom_heading_rad": 0 * t_s}
        self.search.trial_cost, self.search.duration_s, self.search.left_s = 1e-3, 200.0, lambda: 5.0
        self.search.moved_at_s, self.search.moved_s = search._moving(published)
        self.assertAlmostEqual(self.search.part_s(100, search.SCREEN_SHARE, 20.0), 60.0, delta=1.0)
        self.search.moved_at_s, self.search.moved_s = search._moving(published | {"odom_x_m": 0.02 * t_s})  # no witness of what stands
        self.assertAlmostEqual(self.search.part_s(100, search.SCREEN_SHARE, 20.0), 15.0, delta=1.0)

    def test_a_drive_whose_states_are_far_from_their_priors_is_no_right_one(self):
        self.assertEqual([self.search._is_right(drive(2.0, unusual=nats)) for nats in (1.0, 12.5)], [True, False])

    def test_what_is_found_is_judged_though_the_budget_is_spent(self):
        self.search.left_s, self.search.trials = (lambda: -1.0), SimpleNamespace(run=lambda jobs, *_, **__: [drive(2.0)] * len(jobs))
        self.assertEqual([one is None for last in (False, True) for one in self.search._drives([(row("row"), (1.0,))], [], 0.0, is_last=last)], [True, False])

    def test_the_prior_of_a_state_is_that_before_any_observation(self):
        folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        (folder / "made").mkdir()
        (folder / "made/motion.csv").write_text("t_ns,v_mps\n0,1\n")
        (folder / "made/sightings.csv").write_text("t_ns,id\n0,1\n1000000000,2\n1500000000,3\n")
        trial._blinded(folder / "made", folder / "blind")
        self.assertEqual((folder / "blind/sightings.csv").read_text(), "t_ns,id\n1500000000,3\n")
        self.assertEqual((folder / "blind/motion.csv").read_text(), "t_ns,v_mps\n0,1\n")

    def test_states_of_a_drive_that_is_lost_tell_no_size(self):
        clock = Fault("clock", ((0.0,),), lambda _: [], lambda _: "", step=(0.25,), smallest=(0.01,), settled=lambda size, states: (size[0] - states.get("offset", 0.0),))
        told = [self.search._by_states([clock], dataclasses.replace(drive(1.0, unusual=9.0, lost=lost), states={"offset": 0.4})) for lost in (0.1, 0.95)]
        self.assertEqual([[size for _, size in one] for one in told], [[(-0.4,)], []])

    def test_a_size_that_a_state_takes_up_is_near_the_state_s_start(self):
        ranges, driven = self.scaled_ranges()
        (_, (size,)), = self.search._fitted([search.Candidate(ranges, (0.001,), driven([[(ranges, (0.001,))]])[0])], [], 0.0)
        self.assertLess(abs(math.log(size / 0.001)), 0.1)

    def test_a_unit_is_named_in_place_of_a_factor_near_it(self):
        ranges, driven = self.scaled_ranges()
        near, far = (search.Candidate(ranges, (f,), driven([[(ranges, (f,))]])[0]) for f in (0.00106, 0.0016))
        self.assertEqual(self.search._settled(near, []).size, (0.001,))
        self.assertNotEqual(self.search._as_unit(far, []).size, (0.001,))  # that is no unit's
        worse = dataclasses.replace(near.drive, unusual=0.0)  # the states say that it is no mm
        self.search.trials.run = lambda jobs, **_: [dataclasses.replace(drive(2.0), unusual=9.0)]
        self.assertEqual(self.search._as_unit(search.Candidate(ranges, (0.00106,), worse), []).size, (0.00106,))

    def test_whole_seconds_are_named_in_place_of_a_clock_s_size_near_them(self):
        clock = Fault("clock", ((0.0,),), lambda _: [], lambda _: "", step=(0.25,), smallest=(0.01,), clock=Clock("s", 0))
        self.assertEqual([clock.unit((size,)) for size in (-2.27, -2.4, 0.3, 18.4, 3.0)], [(-2.0,), None, None, (18.0,), None])
        worse = [dataclasses.replace(drive(2.0), unusual=nats) for nats in (6.0, 9.0)]
        for again, size in zip(worse, (-2.0, -2.27)):
            self.search.trials = SimpleNamespace(run=lambda jobs, has_states, again=again: [again] * len(jobs))
            self.assertEqual(self.search._as_unit(search.Candidate(clock, (-2.27,), drive(2.0)), []).size, (size,))

    def test_a_size_that_is_far_off_on_a_part_is_judged_beside_what_the_states_tell_and_beside_a_unit(self):
        speed = Fault("speed", ((0.001,),), lambda _: [], lambda _: "", step=(0.04,), smallest=(0.004,), is_log=True, named=(0.001,),
                      settled=lambda size, states: (size[0] * states["scale"],))
        found = search.Candidate(speed, (0.00088,), dataclasses.replace(drive(2.0), states={"scale": 1.25}))
        self.assertEqual([size for _, size in search._near(found)], [(0.0011,), (0.001,)])
        self.assertEqual(search._near(search.Candidate(row("no size"), (1.0,), drive(2.0))), [])

    def test_two_mistakes_are_found_by_the_part_that_both_explain(self):
        first, second, other = (search.Candidate(row(name), (1.0,), drive(0.5)) for name in ("first", "second", "other"))
        mended = search.Candidate(second.fault, (1.0,), drive(2.0))
        self.search.trials = SimpleNamespace(settings={}, run=lambda jobs, *_, **__: [
            drive(2.0) if {fault.name for fault, _ in job} == {"first", "second"} else dataclasses.replace(drive(0.5), explained=0.3) for job in jobs])
        self.search.trials.blocks = Blocks(0, 1.0, 40)
        self.search.robot = SimpleNamespace(config={}, vehicle={})
        self.search.firsts, self.search.screened_s, self.search.duration_s = [other, first, second], 40.0, 40.0
        self.search._round = lambda fixed, now: [mended] if [fault.name for fault, _ in fixed] == ["first"] else []
        fixed, _ = self.search._pairs(drive(0.2), search.Verdict(None))
        self.assertEqual([fault.name for fault, _ in fixed], ["first", "second"])
        self.search.firsts = [other, first]
        self.assertIsNone(self.search._pairs(drive(0.2), search.Verdict(None)))

    def test_a_lag_is_not_fitted_where_a_row_of_another_family_leaves_nothing(self):
        lag = Fault("drift", ((0.0,),), lambda _: [], lambda _: "", step=(0.01,), smallest=(1e-4,), group="along the way of s")
        clock = Fault("clock", ((0.0,),), lambda _: [], lambda _: "", step=(0.25,), smallest=(0.01,), group="along the way of s")
        best = [search.Candidate(fault, (1.0,), found) for fault, found in ((row("bearings"), drive(2.0)), (clock, drive(2.0)), (row("bearings"), drive(2.0, unusual=6.0)))]
        self.assertEqual([self.search._is_explained([one], lag) for one in best], [True, False, False])

    def test_a_row_without_a_size_among_the_best_is_kept_though_a_size_gains_more(self):
        self.search.trials = SimpleNamespace(blocks=Blocks(0, 1.0, 40))
        sized = Fault("ranges", ((1.0,),), lambda _: [], lambda _: "", step=(0.1,), smallest=(0.01,))
        weak = Fault("speed", ((1.0,),), lambda _: [], lambda _: "", step=(0.1,), smallest=(0.01,))
        ordered = [search.Candidate(fault, (1.0,), drive(gain)) for fault, gain in ((sized, 2.0), (weak, 0.3), (row("turn"), 0.2), (row("worse"), -0.2))]
        self.assertEqual([c.fault.name for c in self.search._within_reach(ordered, drive(0.0), 0.0)], ["ranges", "turn"])

    def test_a_size_takes_what_a_state_took_of_it_where_the_drive_is_as_good(self):
        clock = Fault("clock", ((0.0,),), lambda _: [], lambda _: "", step=(0.25,), smallest=(0.01,), settled=lambda size, states: (size[0] - states["offset"],))
        first = search.Candidate(clock, (-2.3,), dataclasses.replace(drive(2.0), states={"offset": 0.36}))
        for loss, size in ((2.0, -2.66), (10.0, -2.3)):  # nats of the whole drive
            again = dataclasses.replace(drive(2.0 - loss / 800), states={"offset": 0.0})
            self.search.trials = SimpleNamespace(run=lambda jobs, has_states, again=again: [again] * len(jobs))
            self.assertAlmostEqual(self.search._settled(first, []).size[0], size)

    def test_ranges_that_are_scaled_down_gain_nothing_by_it(self):
        def rows(scale):
            return {"residual": np.array(["range"] * 3), "observed": scale * np.array([2.0, 3.0, 4.0]), "expected": scale * np.array([2.02, 3.01, 3.97]),
                    "variance": scale**2 * np.array([0.01] * 3)}
        np.testing.assert_allclose(likelihoods(rows(0.5), {"range": -3.91}, {"range": math.log(0.5)}), likelihoods(rows(1.0), {"range": -3.91}, {}))

    def test_a_far_size_is_told_from_one_that_is_further(self):
        rows = {"residual": np.array(["x", "x"]), "observed": np.array([2.0, 4.0]), "expected": np.zeros(2), "variance": np.full(2, 0.0009)}
        near, far = (likelihoods(rows, {"x": -3.91}, {}, is_far) for is_far in (False, True))
        self.assertAlmostEqual(near[0], near[1])
        self.assertAlmostEqual(far[0] - far[1], math.log(4), places=2)

    def test_observations_whose_stamps_a_trial_moves_stay_in_their_blocks(self):
        begin = 1_700_000_000_000_000_000
        stamps = begin + np.arange(0, 100, 10, np.int64) * 10**9
        for clock, size, moved in ((Clock("sightings", begin), (-2.0,), stamps - 2 * 10**9), (Clock("sightings:front", begin, True), (0.02,), stamps - (stamps - begin) // 50)):
            change = Fault("f", (size,), lambda _: [], lambda _: "", clock=clock), size
            rows = {"t_ns": np.concatenate([moved, stamps]), "source": np.repeat([1, 2], 10)}
            original = Undo.of([change], ("can", "sightings:front", "gnss")).original(rows)
            np.testing.assert_allclose((original - begin) * 1e-9, np.tile(stamps - begin, 2) * 1e-9, atol=1e-6)

    def test_stamps_that_two_mistakes_move_are_moved_back_in_turn(self):
        begin = 1_700_000_000_000_000_000
        stamps = begin + np.arange(0, 100, 10, np.int64) * 10**9
        shift, drift = (Fault("f", ((0.0,),), lambda _: [], lambda _: "", clock=Clock("gnss", begin, is_rate)) for is_rate in (False, True))
        moved = stamps + 3 * 10**9
        moved = moved - (moved - begin) // 50
        rows = {"t_ns": moved, "source": np.repeat(0, 10)}
        original = Undo.of([(shift, (3.0,)), (drift, (0.02,))], ("gnss",)).original(rows)
        np.testing.assert_allclose((original - begin) * 1e-9, (stamps - begin) * 1e-9, atol=1e-6)

    def test_two_landmarks_that_few_observations_see_are_named_by_these(self):
        few = np.where(np.arange(40) % 20 == 5, 30.0, 0.0)
        better = dataclasses.replace(drive(1.0), gain=drive(1.0).gain + few)
        self.assertFalse(self.search._helps(search.Candidate(row("row"), (1.0,), better), drive(1.0)))
        self.assertTrue(self.search._helps(search.Candidate(row("row"), (1.0,), dataclasses.replace(better, is_local=True)), drive(1.0)))
        self.assertFalse(self.search._helps(search.Candidate(row("row"), (1.0,), dataclasses.replace(drive(1.0), is_local=True)), drive(1.0)))

    def test_student_s_distribution(self):
        self.assertAlmostEqual(search._student(2.086, 20), 0.975, places=3)
        self.assertAlmostEqual(search._student(-2.086, 20), 0.025, places=3)

    def test_words_of_a_factor(self):
        self.assertEqual([factor_words(f) for f in (0.001, 1 / 1.05, 2.0)], ["in mm", "5 % too large", "0.5 times the true one"])


class FloorPlans(Folder):
    """A room of 4 x 3 m, a robot that drives along it, and points of its walls."""

    def setUp(self):
        super().setUp()
        edges = np.zeros((360, 460), bool)
        edges[30:330, [30, 429]] = edges[[30, 329], 30:430] = edges[80, 30:430] = True
        write_floor_plan(self.folder, FloorPlan(0.01, (-0.3, -0.3, 0.0), edges=edges))
        t_ns = 10**9 + np.arange(20) * 10**8
        self.trajectory = {"t_ns": t_ns, "x_m": np.linspace(1, 2, 20), "y_m": np.full(20, 1.5), "qz": np.zeros(20), "qw": np.ones(20)}
        walls = [(x, y) for x in np.arange(0.05, 4, 0.2) for y in (0.505, 0.505, 2.995)] + [(x, y) for x in (0.005, 3.995) for y in np.arange(0.05, 3, 0.2)]
        self.walls = np.array(walls)

    def judged(self, scale=1.0, turned=False, at=0.0):
        lines = ["t_ns,x_m,y_m"]
        for t, x, y in zip(self.trajectory["t_ns"], self.trajectory["x_m"], self.trajectory["y_m"]):
            lines += [f"{t},{scale * (px - x):.4f},{scale * (py - y) * (-1 if turned else 1) + at:.4f}" for px, py in self.walls]
        (self.folder / "points.csv").write_text("\n".join(lines) + "\n")
        return plan.judged(self.trajectory, self.folder / "points.csv", self.folder / "map/map.yaml", None)

    def test_points_on_the_walls_fit_and_others_do_not(self):
        right, off = self.judged(), self.judged(at=0.25)
        self.assertEqual(len(right.t_ns), 20)
        self.assertTrue(right.fits.all())
        self.assertGreater(right.near.mean(), 3.0)
        self.assertFalse(off.fits.any())
        self.assertLess(off.near.mean(), right.near.mean() - 1)

    def test_the_nearer_scale_is_the_likelier_one(self):
        means = [self.judged(scale).far.mean() for scale in (0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2)]
        self.assertEqual(means, [*sorted(means[:4]), *sorted(means[4:], reverse=True)])
        self.assertGreater(means[3], max(means[2], means[4]) + 0.3)

    def test_a_picture_is_turned(self):
        picture = (self.folder / "map/edges.png").read_bytes()
        for way, size in ((Image.Transpose.ROTATE_90, (360, 460)), (Image.Transpose.ROTATE_180, (460, 360)), (Image.Transpose.FLIP_LEFT_RIGHT, (460, 360))):
            turned = changes.Turned("map/edges.png", way)
            with Image.open(io.BytesIO(turned.apply(picture))) as image:
                self.assertEqual(image.size, size)
        self.assertEqual(turned.words(), "mirror (left and right) the picture")

    @unittest.skipUnless((BIN / "waymark-simulate").exists(), "no simulator here")
    def test_pictures_are_looked_at_once(self):
        (self.folder / "scenario.yaml").write_text(SCENARIO)
        drive, config = self.folder / "drive", self.folder / "robot.yaml"
        subprocess.run([BIN / "waymark-simulate", self.folder / "scenario.yaml", "--duration", "8", "--out", drive], check=True, capture_output=True)
        config.write_text("format: waymark-config/1\nestimator: edge_mcl\nsources:\n  - {name: edges, lateness_max_ms: 250}\nvision: {edges: {}}\n")
        robot = Robot.read(drive, config, {})
        seen = with_features(robot, self.folder)
        self.assertEqual(seen.floor_camera, (0.33, 0.0, 0.5))
        ends = [replay(r.files.recording, r.files.config) for r in (robot, seen)]
        self.assertEqual(*(len(e.innovations["t_ns"]) for e in ends))
        for axis in ("x_m", "y_m"):
            self.assertLess(abs(ends[0].trajectory[axis][-1] - ends[1].trajectory[axis][-1]), 0.01)
        self.assertFalse((seen.files.recording / "video").exists())
        # The fix is of the robot's own files: the detector finds the points anew.
        rows = {row.name: row for row in all_faults(seen)}
        for name, fixed, driven in (("pitch of points", "calibration.yaml", {"calibration.yaml", "points.csv"}), ("clock of points", "video/front.csv", {"points.csv"})):
            edits = rows[name].edits(rows[name].start[0])
            self.assertEqual({place.file for place in robot.files.places(edits)}, {fixed})
            self.assertEqual({edit.file for edit in changes.for_trial(edits)}, driven)

    def test_points_are_seen_anew_by_another_mounting(self):
        # 0.5 m above the floor; 2 m ahead is 14.04 degrees below the horizon, or 4.04 where it looks up by 10 degrees less.
        table = b"t_ns,x_m,y_m,arrival_ns\n5,2.1000,0.0000,7\n6,2.1000,1.0000,8\n"
        down = math.atan2(0.5, 2.0)
        for tilt in (-0.1, 0.2):
            seen = changes.Seen("f", ((0.1, 0, 0.5), (0, 0.3, 0)), ((0.1, 0, 0.5), (0, 0.3 + tilt, 0))).apply(table).decode().splitlines()
            self.assertAlmostEqual(float(seen[1].split(",")[1]), 0.1 + 0.5 / math.tan(down + tilt), places=3)
        higher = changes.Seen("f", ((0.1, 0, 0.5), (0, 0.3, 0)), ((0.1, 0, 0.75), (0, 0.3, 0))).apply(table).decode().splitlines()
        self.assertEqual(higher, ["t_ns,x_m,y_m,arrival_ns", "5,3.1000,0.0000,7", "6,3.1000,1.5000,8"])
        turned = changes.Seen("f", ((0.1, 0, 0.5), (0, 0.3, 0)), ((0.1, 0, 0.5), (0, 0.3, math.pi / 2))).apply(table).decode().splitlines()
        self.assertEqual(turned[1], "5,0.1000,2.0000,7")
        up = changes.Seen("f", ((0.1, 0, 0.5), (0, 0.3, 0)), ((0.1, 0, 0.5), (0, -0.3, 0))).apply(table)
        self.assertEqual(len(up.splitlines()), 1)  # what doesn't meet the floor is not seen


if __name__ == "__main__":
    unittest.main()
