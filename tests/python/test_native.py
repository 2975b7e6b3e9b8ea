#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The Python package over libwaymark.so: replays in the process give the bits of `waymark replay`; event logs as arrays.

    test_native.py BIN_DIR       Skipped (77) where the build has no libwaymark.so (sanitizers)."""

import os
import unittest

import numpy as np
from common import BIN, Drive, use_library

use_library()
os.environ["PATH"] = f"{BIN.resolve()}:{os.environ['PATH']}"

import waymark  # noqa: E402


class Replays(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive()
        cls.addClassCleanup(cls.drive.close)
        cls.run_of_program = waymark.Run(cls.drive.run)

    def same(self, mine, theirs):
        for name, column in mine.items():
            np.testing.assert_array_equal(column, theirs[name], err_msg=name)

    def test_ten_lines_replay_a_log_to_the_same_bits(self):
        again = waymark.replay(self.drive.run / "events.wmlog")
        self.assertGreater(len(again.trajectory["t_ns"]), 5000)
        self.same(again.trajectory, self.run_of_program.trajectory)

    def test_a_recording_gives_the_program_s_run(self):
        told = []
        again = waymark.replay(self.drive.recording, self.drive.folder / "robot.yaml", note=told.append, progress=told.append)
        self.same(again.trajectory, self.run_of_program.trajectory)
        published = self.run_of_program.published
        for name in ("t_ns", "made_ns", "x_m", "cov_xx", "state", "cause", "resets"):
            np.testing.assert_array_equal(again.published[name], published[name], err_msg=name)
        theirs = self.run_of_program.innovations
        for name in ("t_ns", "landmark", "residual", "verdict"):
            np.testing.assert_array_equal(again.innovations[name], theirs[name], err_msg=name)
        np.testing.assert_allclose(again.innovations["nis"], theirs["nis"], rtol=1e-5)
        self.assertEqual(waymark.covariance(again.trajectory).shape[1:], (6, 6))

    def test_a_changed_value_changes_the_poses(self):
        changed = waymark.replay(self.drive.run / "events.wmlog", changes={"sightings.noise.bearing_factor": 3})
        self.assertTrue((changed.trajectory["x_m"] != self.run_of_program.trajectory["x_m"]).any())
        with self.assertRaisesRegex(waymark.WaymarkError, "bearing_facto"):
            waymark.replay(self.drive.run / "events.wmlog", changes={"sightings.noise.bearing_facto": 3})

    def test_files_are_a_run_and_eval_judges_it(self):
        waymark.replay(self.drive.recording, self.drive.folder / "robot.yaml", out=self.drive.folder / "mine")
        mine = (self.drive.folder / "mine/trajectory.csv").read_bytes()
        self.assertEqual(mine, (self.drive.run / "trajectory.csv").read_bytes())
        self.assertLess(waymark.eval(self.drive.folder / "mine", self.drive.recording)["position_rmse_m"], 0.1)
        with self.assertRaises(ValueError):
            waymark.eval(self.drive.folder, self.drive.recording)

    def test_observations_of_a_log_can_be_withheld(self):
        log = self.drive.run / "events.wmlog"
        whole = waymark.replay(log).innovations
        middle = int(np.median(whole["t_ns"]))
        early = waymark.replay(log, keeps=lambda event: event.t_ns < middle)
        np.testing.assert_array_equal(early.innovations["observed"], whole["observed"][whole["t_ns"] < middle])
        self.assertGreater(early.trajectory["t_ns"].max(), middle)  # the motion goes on
        with self.assertRaisesRegex(waymark.WaymarkError, "from an event log alone"):
            waymark.replay(self.drive.recording, self.drive.folder / "robot.yaml", keeps=lambda event: True)

    def test_parameters_have_values_defaults_and_limits(self):
        found = waymark.parameters("format: waymark-config/1\nestimator: landmark_ekf\nmotion: {noise: {speed_mps: 0.5}}\n")
        speed = found["motion.noise.speed_mps"]
        self.assertEqual((speed["value"], speed["initial"], speed["min"]), (0.5, 0.02, 0.0))
        self.assertFalse([key for key in found if key.split(".")[0] not in ("motion", "sightings", "positions", "markers", "localizer", "landmark_ekf")])
        with self.assertRaisesRegex(waymark.WaymarkError, "estimator: is missing"):
            waymark.parameters("format: waymark-config/1\n")
        with self.assertRaisesRegex(waymark.WaymarkError, "sped_mps"):
            waymark.parameters("format: waymark-config/1\nestimator: landmark_ekf\nmotion: {noise: {sped_mps: 0.5}}\n")

    def test_errors_have_the_library_s_text(self):
        with self.assertRaisesRegex(waymark.WaymarkError, "nowhere"):
            waymark.replay("/nowhere/events.wmlog", self.drive.folder / "robot.yaml")
        with self.assertRaises(waymark.WaymarkError):
            waymark.EventLog(self.drive.folder / "robot.yaml")

    def test_event_logs_are_arrays(self):
        log = waymark.EventLog(self.drive.run / "events.wmlog")
        self.assertEqual((log.estimator, log.sensors, log.sources), ("landmark_ekf", ["front"], ["can", "sightings:front"]))
        table = waymark.Recording(self.drive.recording).table("sightings.csv")
        seen = log.events("sighting")
        np.testing.assert_array_equal(np.sort(seen["t_ns"]), np.sort(table["t_ns"]))
        np.testing.assert_array_equal(np.sort(seen["range_m"]), np.sort(table["range_m"]))
        self.assertEqual(log.kinds(), ["quantities", "sighting"])
        stamps = np.concatenate([log.events(kind)["t_ns"] for kind in log.kinds()])
        self.assertEqual(log.span(), (stamps.min(), stamps.max()))
        with self.assertRaisesRegex(ValueError, "quantities"):
            log.events("sonar")


if __name__ == "__main__":
    unittest.main()
