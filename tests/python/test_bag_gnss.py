#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fixes of receivers out of bags: those that are none, altitudes that are absent, the exact tangent plane, the antenna's place.

    test_bag_gnss.py BIN_DIR"""

import copy
import unittest

import numpy as np
from bag_drives import BagTest, matrix, ns, place

from waymark.geometry import place_of, tangent_plane

ORIGIN = (52.5, 13.4, 34.0)
CONFIG = "format: waymark-config/1\nestimator: landmark_ekf\ninitial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\n"


class Fixes(BagTest):
    """The drive with a fix a second."""

    def fix(self, bag, t, where, altitude=34.0, status=0, variance=1e-4, kind=2, topic="/fix", frame="gps"):
        bag.put(topic, "NavSatFix", ns(t), bag.m.make(
            "NavSatFix", header=bag.m.header(ns(t), frame), status=bag.m.make("NavSatStatus", status=status), latitude=where[0], longitude=where[1],
            altitude=altitude, position_covariance=np.diag([variance] * 3).ravel(), position_covariance_type=kind))

    def drive(self, change=lambda i, where, altitude: (where, altitude, 0), antenna=(0.0, 0.0), frame="gps"):
        bag = self.bag().drive()
        for i, t in enumerate(np.arange(16.0)):
            x, y, heading = place(t)
            c, s = np.cos(heading), np.sin(heading)
            where = place_of(ORIGIN, x + c * antenna[0] - s * antenna[1], y + s * antenna[0] + c * antenna[1])
            where, altitude, status = change(i, where[:2], 34.0)
            self.fix(bag, t, where, altitude, status, frame=frame)
        return bag

    def resized(self, speed, way=1.0):
        """The drive whose odometry is so many times as fast, its poses so many times as far."""
        bag = self.drive()
        for *_, message in bag.items:
            if hasattr(message, "twist"):
                message.twist.twist.linear.x *= speed
                message.pose.pose.position.x *= way
                message.pose.pose.position.y *= way
        return bag

    def assert_driven(self, bag, *words, options=()):
        """These words are said, the plane begins at ORIGIN, and the drive with its fixes ends where it should."""
        recording, said = self.assert_taken(bag, *words, options=options, delta=0.1, config=CONFIG)
        np.testing.assert_allclose(recording.calibration["gnss"]["origin"], ORIGIN, atol=1e-6)
        return recording

    def test_those_that_are_none_are_left_out(self):
        nan = float("nan")
        kinds = {"zeros": lambda i, w, a: ((0.0, 0.0), a, 0), "status -1": lambda i, w, a: ((1.0, 2.0), a, -1), "not a number": lambda i, w, a: (
            (nan, nan), nan, 0), "zeros and status -1": lambda i, w, a: ((0.0, 0.0), 0.0, -1), "a latitude of 91": lambda i, w, a: ((91.0, 13.4), a, 0)}
        for name, bad in kinds.items():
            for first in (3, 1):
                with self.subTest(name, first=first):
                    bag = self.drive(lambda i, w, a, b=bad, n=first: b(i, w, a) if i < n else (w, a, 0))
                    recording = self.assert_driven(bag, f"{first} of its 16 messages")
                    self.assertEqual(len(recording.table("gnss.csv")["t_ns"]), 16 - first)

    def test_places_from_which_no_drive_leads_to_the_next_are_none(self):
        kinds = {"the last known place": lambda w: place_of(ORIGIN, -300, 40)[:2], "a receiver's default": lambda w: (31.2, 121.4),
                 "nearly zero": lambda w: (1e-9, -1e-9)}
        for name, stale in kinds.items():
            with self.subTest(name):
                self.assert_driven(self.drive(lambda i, w, a, s=stale: (s(w) if i < 3 else w, a, 0)), "finding: /fix: its first 3 fixes are of a place")

    def test_of_two_robots_one_has_all(self):
        bag = self.bag().drive(topic="/robot2/odom")
        for robot, away, variance in (("robot1", 40.0, 1e-5), ("robot2", 0.0, 1e-4)):
            bag.turns(topic=f"/{robot}/imu")
            for t in np.arange(16.0):
                self.fix(bag, t, place_of(ORIGIN, place(t)[0], place(t)[1] + away)[:2], variance=variance, topic=f"/{robot}/fix")
        self.assert_driven(bag, "/robot1/imu: the IMU is /robot2/imu", "/robot1/fix: positions come from /robot2/fix")

    def test_how_drivers_fill_latitude_and_longitude(self):
        minutes = lambda v: 100 * np.trunc(v) + 60 * (v - np.trunc(v))  # noqa: E731
        kinds = {"exchanged": lambda w: w[::-1], "in radians": lambda w: tuple(np.radians(w)), "ten-millionths": lambda w: tuple(1e7 * np.array(w)),
                 "in millionths": lambda w: tuple(1e6 * np.array(w)),
                 "degrees and minutes": lambda w: tuple(map(minutes, w)), "exchanged and in radians": lambda w: tuple(np.radians(w))[::-1]}
        for name, filled in kinds.items():
            with self.subTest(name):
                self.assert_driven(self.drive(lambda i, w, a, f=filled: (f(w), a, 0)), "finding: /fix: its latitude and longitude are", name)
        for slip in (1.0, 1.2):  # right ones stay, whatever the wheels say
            _, said = self.take(self.resized(slip), "--motion-by", "twists")
            self.assertNotIn("latitude and longitude are", said)

    def test_a_way_of_another_size_is_named(self):
        for size in (1.2, 3.6, 1 / 3.6, 100.0):
            _, said = self.take(self.resized(size, size))
            with self.subTest(size=size):
                self.assertEqual(f"finding: /fix: its way is {1 / size:.3g} times as long as that of /odom" in said, size != 1.2, said)

    def test_a_receiver_that_stands_while_the_robot_drives_is_a_base_station_s(self):
        bag = self.drive()
        for t in range(16):
            self.fix(bag, t, ORIGIN[:2], variance=1e-8, topic="/base/fix")
        self.assert_driven(bag, "not taken: /base/fix: it stands still while the robot drives")
        bag = self.bag().drive()
        for t in range(16):
            self.fix(bag, t, ORIGIN[:2])
        self.assertIn("is it the receiver of a base station", self.take(bag)[1])

    def test_fixes_that_are_sent_again_count_once(self):
        bag = self.drive()
        for log_ns, topic, kind, message in [item for item in bag.items if item[1] == "/fix"]:
            for k in range(1, 10):
                again = copy.deepcopy(message)
                again.header = bag.m.header(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec + k * 100_000_000, message.header.frame_id)
                bag.items.append((log_ns + k * 100_000_000, topic, kind, again))
        recording = self.assert_driven(bag, "91 % of its fixes repeat the one before", options=("--origin", *map(str, ORIGIN)))
        self.assertEqual(len(recording.table("gnss.csv")["t_ns"]), 16)

    def test_a_latitude_without_its_sign_is_named(self):
        recording, said = self.take(self.drive(lambda i, w, a: ((-w[0], w[1]), a, 0)))
        self.assertIn("finding: /fix: its way is the mirror image of that of /odom", said)
        np.testing.assert_allclose(recording.table("gnss.csv")["y_m"], [-place(t)[1] for t in np.arange(16.0)], atol=0.01)

    def test_a_status_that_nobody_set_is_no_missing_fix(self):
        recording, said = self.take(self.drive(lambda i, w, a: (w, a, -2)))
        self.assertEqual(len(recording.table("gnss.csv")["t_ns"]), 16, said)

    def test_an_outlier_on_the_way_stays(self):
        for at in (2, 7):
            recording = self.assert_driven(self.drive(lambda i, w, a, k=at: (place_of(ORIGIN, 5000, 40)[:2] if i == k else w, a, 0)))
            self.assertEqual(len(recording.table("gnss.csv")["t_ns"]), 16)

    def test_a_few_places_far_from_each_other_stay(self):
        bag = self.bag()
        for i in range(4):
            self.fix(bag, i, place_of(ORIGIN, 2000 * i, 1000 * i)[:2])
        recording, said = self.take(bag)
        self.assertEqual(len(recording.table("gnss.csv")["t_ns"]), 4, said)

    def test_an_altitude_that_is_absent(self):
        nan = float("nan")
        for name, change, empty in (("of the first three", lambda i, w, a: (w, nan if i < 3 else a, 0), 3), ("of some", lambda i, w, a: (
                w, nan if i % 4 == 2 else a, 0), 4), ("of all", lambda i, w, a: (w, nan, 0), 16), ("0 of the first", lambda i, w, a: (
                    w, 0.0 if i < 2 else a, 0), 2), ("infinite", lambda i, w, a: (w, np.inf if i == 5 else a, 0), 1), ("far off", lambda i, w, a: (
                        w, 1e9 if i < 9 else a, 0), 9), ("-1000 of the first", lambda i, w, a: (w, -1000.0 if i < 3 else a, 0), 3),
                                    ("-9999 of all", lambda i, w, a: (w, -9999.0, 0), 16)):
            with self.subTest(name):
                recording, _ = self.assert_taken(self.drive(change), delta=0.1, config=CONFIG)
                gnss = recording.table("gnss.csv")
                self.assertEqual(int(np.isnan(gnss["z_m"]).sum()), empty)
                self.assertEqual(int(np.isnan(gnss["sigma_z_m"]).sum()), empty)
                right = np.array([place(t)[:2] for t in np.arange(16.0)])
                np.testing.assert_allclose(np.column_stack([gnss["x_m"], gnss["y_m"]]), right, atol=1e-3)

    def test_a_receiver_that_never_has_a_fix(self):
        recording, said = self.take(self.drive(lambda i, w, a: ((0.0, 0.0), 0.0, -1)))
        self.assertIn("not taken: /fix: it never has a fix", said)
        self.assertNotIn("gnss.csv", recording.streams())

    def test_the_antenna_s_place(self):
        for name, parent, child, pose in (("ahead", "base_link", "gps", matrix((1.2, 0, 1.5))), ("to the left", "base_link", "gps", matrix((0, 0.8, 1.5))),
                                          ("inverse", "gps", "base_link", matrix((-1.2, 0, -1.5))), ("turned", "base_link", "gps", matrix(
                                              (-0.5, 0.3, 1), (0, 0, 1))), ("far behind", "base_link", "gps", matrix((-2.0, 0, 1)))):
            with self.subTest(name):
                right = (pose if parent == "base_link" else np.linalg.inv(pose))[:3, 3]
                bag = self.drive(antenna=right[:2])
                bag.tf(parent, child, pose)
                for origin in (("--origin", *ORIGIN), ()):  # else the robot's place at its start, not the antenna's
                    recording = self.assert_driven(bag, options=origin)
                    np.testing.assert_allclose(recording.calibration["gnss"]["mounting"]["xyz_m"], right, atol=1e-6)

    def test_an_antenna_without_a_place_is_named(self):
        recording, said = self.take(self.drive())
        self.assertIn("gnss: {mounting: {xyz_m", said)
        self.assertNotIn("mounting", recording.calibration["gnss"])

    def test_sigmas_by_the_covariance_and_its_kind(self):
        for variance, kind, status, sigma in ((4.0, 2, 0, 2.0), (4.0, 0, 0, 5.0), (0.0, 2, 0, 5.0), (-1.0, 2, 0, 5.0), (1e9, 1, 0, 5.0), (0.0, 0, 2, 0.5),
                                              (9.0, 3, 2, 3.0), (0.0, 0, 1, 2.0), (float("nan"), 2, 0, 5.0)):
            with self.subTest(variance=variance, kind=kind):
                bag = self.bag()
                for t in range(3):
                    self.fix(bag, t, (52.5, 13.4 + 1e-5 * t), status=status, variance=variance, kind=kind)
                recording, _ = self.take(bag)
                gnss = recording.table("gnss.csv")
                np.testing.assert_allclose(gnss["sigma_xy_m"], sigma)
                np.testing.assert_allclose(gnss["sigma_z_m"], sigma if sigma == np.sqrt(variance) else 2 * sigma)

    def test_the_receiver_before_a_filter_and_the_better_one_of_two(self):
        bag = self.bag()
        for t in np.arange(0, 3, 0.01):
            self.fix(bag, t, (52.5, 13.4), variance=1e-4, topic="/gps/filtered")
            self.fix(bag, t, (52.5, 13.4), variance=25.0, topic="/cheap/fix")
            self.fix(bag, t, (0.0, 0.0), variance=1e-6, status=-1, topic="/dead/fix")
        for t in range(3):
            self.fix(bag, t, (52.5, 13.4), variance=1.0, topic="/good/fix")
        recording, said = self.take(bag)
        self.assertEqual(len(recording.table("gnss.csv")["t_ns"]), 3, said)
        self.assertIn("not taken: /gps/filtered: positions come from /good/fix", said)


class TangentPlane(unittest.TestCase):
    """WGS84 onto the plane, against figures of PROJ 9.1 (+proj=cart, +proj=topocentric)."""

    def test_near_and_far(self):
        for origin, where, right in (((48.1, 11.5, 500), (48.11, 11.51, 510), (744.72519, 1112.06103, 9.85956)),
                                     ((48.1, 11.5, 500), (48.0, 11.4, 450), (-7463.05710, -11115.06175, -64.05335)),
                                     ((48.1, 11.5, 500), (49.1, 12.5, 500), (73027.19970, 111679.40707, -1396.10890)),
                                     ((48.1, 11.5, 500), (-48.1, -168.5, 0), (0, 42526.86509, -12733097.53055))):
            np.testing.assert_allclose(tangent_plane(origin, *where), right, atol=1e-4)

    def test_antimeridian_and_poles(self):
        # 0.02 degrees of longitude on the parallel of 60 degrees are 1116.0 m on either side of the line.
        over, plain = tangent_plane((60, 179.99, 0), 60, -179.99, 0), tangent_plane((60, 10, 0), 60, 10.02, 0)
        np.testing.assert_allclose(over, plain, atol=1e-6)
        self.assertAlmostEqual(over[0], 1116.0, delta=0.1)
        # 0.001 degrees from the pole are 111.69 m, in whichever direction.
        for longitude, right in ((0, (0, -111.69)), (90, (111.69, 0)), (180, (0, 111.69)), (-90, (-111.69, 0))):
            np.testing.assert_allclose(tangent_plane((90, 0, 0), 89.999, longitude, 0)[:2], right, atol=0.01)

    def test_back(self):
        for origin in (ORIGIN, (60, 179.99, 0), (-33, 151, 1000), (0, 0, 0)):
            for east, north in ((0, 0), (3, -4), (5000, 5000), (-2500, 100)):
                latitude, longitude, height = place_of(origin, east, north)
                np.testing.assert_allclose(tangent_plane(origin, latitude, longitude, height), (east, north, 0), atol=1e-6)


if __name__ == "__main__":
    unittest.main()
