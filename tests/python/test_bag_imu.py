#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""IMUs and transforms out of bags: sign, unit, axis and zeros by the motion and by gravity; mountings along the graph of tf.

    test_bag_imu.py BIN_DIR"""

import unittest

import numpy as np
from bag_drives import DRIVE_S, STILL, BagTest, matrix, ns, place, times, turn_rate

from waymark.geometry import OPTICAL, from_rpy

TURNED = matrix((0.1, 0, 0.2), (np.pi / 2, 0, 0))  # an IMU's place that tf states, by 90 degrees about x


class ImuTest(BagTest):
    """A drive with its odometry, and an IMU as a test wants it."""

    def with_imu(self, change=lambda t, gyro, acceleration: (gyro, acceleration), rate_hz=50.0, mounted=None, tf=True, **more):
        bag = self.bag()
        bag.drive()
        turn = np.eye(3) if mounted is None else mounted
        frame = "base_link" if mounted is None else "imu_link"
        if mounted is not None and tf:
            bag.tf("base_link", "imu_link", np.block([[turn, np.zeros((3, 1))], [0, 0, 0, 1]]))
        for t in times(rate_hz):
            gyro, acceleration = change(t, turn.T @ (0, 0, turn_rate(t)), turn.T @ STILL)
            bag.imu(ns(t), ns(t) + 1_000_000, gyro, acceleration, frame=frame, **more)
        return bag

    def assert_imu(self, bag, *words, delta=0.02, **more):
        recording, said = self.assert_taken(bag, *words, delta=delta, **more)
        self.assertIn("imu.csv", recording.streams())
        return recording, said

    def turn(self, recording):
        """The mounting's axes."""
        return from_rpy(*np.radians(recording.calibration["imu"]["mounting"]["rpy_deg"]))


class Comparison(ImuTest):
    """The gyro against the turns of the odometry, and gravity."""

    def test_a_right_one_is_taken_without_a_word(self):
        chance = np.random.default_rng(5)
        for mounted in (None, from_rpy(np.pi / 2, 0, 0), from_rpy(np.pi, 0, 1.0), from_rpy(0, -np.pi / 2, 0.3)):
            bag = self.with_imu(lambda t, w, a: (w + 0.01 * chance.normal(size=3), a + 0.2 * chance.normal(size=3)), mounted=mounted)
            self.assert_imu(bag, never=("finding", "note: /imu/data"), delta=0.1)

    def test_the_other_sign(self):
        kinds = {"upright": lambda t, w, a: (-w, a), "without accelerations": lambda t, w, a: (-w, np.zeros(3)), "with a bias": lambda t, w, a: (
            -w + (0, 0, 0.0005), a), "z alone (north-east-down)": lambda t, w, a: (w * (1, 1, -1), a), "accelerations without gravity": lambda t, w, a: (
                -w, (0.01, 0, 0.02))}
        for name, change in kinds.items():
            with self.subTest(name):
                recording, _ = self.assert_imu(self.with_imu(change), "finding: /imu/data: its gyro turns to the other side", "--as-is", delta=0.3)
                self.assertGreater(recording.table("imu.csv")["wz_radps"][-1], 0.29)

    def test_as_it_is(self):
        recording, _ = self.take(self.with_imu(lambda t, w, a: (-w, a)), "--as-is")
        self.assertLess(recording.table("imu.csv")["wz_radps"][-1], -0.29)

    def test_upside_down_without_a_mounting(self):
        for name, mounted in (("about x", from_rpy(np.pi, 0, 0)), ("about y", from_rpy(0, np.pi, 0)), ("about y and turned", from_rpy(0, np.pi, 0.7))):
            with self.subTest(name):
                recording, _ = self.assert_imu(self.with_imu(mounted=mounted, tf=False), "-z axis upwards")
                np.testing.assert_allclose(self.turn(recording)[2], (0, 0, -1), atol=1e-6)

    def test_another_axis_is_up(self):
        kinds = {"y": (from_rpy(np.pi / 2, 0, 0), (0, 1, 0)), "-y": (from_rpy(-np.pi / 2, 0, 0), (0, -1, 0)), "x": (from_rpy(0, -np.pi / 2, 0), (1, 0, 0)),
                 "-x": (from_rpy(0, np.pi / 2, 0), (-1, 0, 0)), "optical": (OPTICAL, (0, -1, 0))}
        for name, (mounted, up) in kinds.items():
            for gravity in (1.0, 0.0):
                with self.subTest(name, gravity=gravity):
                    recording, said = self.take(self.with_imu(lambda t, w, a, g=gravity: (w, g * a), mounted=mounted, tf=False))
                    self.assertIn("axis upwards", said)
                    np.testing.assert_allclose(self.turn(recording)[2], up, atol=1e-6)
        self.assert_end(recording, said, 0.02)

    def test_a_transform_whose_values_are_none_is_named(self):
        for words, spoil in (("a quaternion of zeros", lambda it: setattr(it.rotation, "w", 0.0)), ("values that are no numbers", lambda it: setattr(it.translation, "x", np.nan))):
            bag = self.with_imu(tf=False)
            bag.tf("base_link", "imu_link", np.eye(4))
            spoil(bag.items[-1][3].transforms[0].transform)
            _, said = self.take(bag)
            self.assertIn(f"note: tf: 'imu_link' in 'base_link' comes with {words}: it is left out", said)
            self.assertNotIn("the bag has no tf", said)

    def test_tf_that_gravity_and_turns_contradict(self):
        bag = self.with_imu(lambda t, w, a: (np.roll(w, -1), np.roll(a, -1)), mounted=np.eye(3))
        self.assert_imu(bag, "finding: /imu/data: its gyro and its accelerometer show its +y axis upwards", "'imu_link'")

    def test_the_direction_about_the_vertical_by_accelerations(self):
        """A drive that speeds up and brakes; the IMU's y is up, its z looks backwards."""
        mounted = from_rpy(np.pi / 2, 0, -np.pi / 2)
        speed = lambda t: 1.0 - np.cos(1.5 * t)  # noqa: E731
        seen = lambda t, gyro, _: (mounted.T @ gyro, mounted.T @ (1.5 * np.sin(1.5 * t), speed(t) * gyro[2], 9.81))  # noqa: E731
        recording, said = self.weaving(seen, 20, 0.3, speed, noise=0, frame="imu")
        self.assertIn("by the accelerations of the drive", said)
        np.testing.assert_allclose(self.turn(recording), mounted, atol=1e-6)

    def test_units(self):
        kinds = {"degrees": (lambda t, w, a: (np.degrees(w), a), "degrees in place of radians"), "radians taken for degrees": (
            lambda t, w, a: (np.radians(w), a), "radians taken for degrees"), "twice": (lambda t, w, a: (2 * w, a), "twice"), "half": (
                lambda t, w, a: (w / 2, a), "half"), "degrees, other sign": (lambda t, w, a: (-np.degrees(w), a), "degrees")}
        for name, (change, word) in kinds.items():
            with self.subTest(name):
                self.assert_imu(self.with_imu(change), "finding: /imu/data", word)

    def test_another_scale_is_named_and_kept(self):
        recording, said = self.take(self.with_imu(lambda t, w, a: (0.6 * w, a)))
        self.assertIn("0.6 times the turn rate of /odom", said)
        self.assertAlmostEqual(recording.table("imu.csv")["wz_radps"][-1], 0.18)

    def test_accelerations_in_other_units(self):
        for name, scale, word in (("g", 1 / 9.80665, "in g,"), ("mg", 1000 / 9.80665, "thousandths of g"), ("cm/s2", 100, "cm/s2"),
                                  ("gravity itself, in place of the force against it", -1, "shows gravity downwards")):
            with self.subTest(name):
                recording, said = self.take(self.with_imu(lambda t, w, a, s=scale: (w, a * s)))
                self.assertIn(word, said)
                self.assertAlmostEqual(recording.table("imu.csv")["az_mps2"][0], 9.81, places=6)

    def weaving(self, change, duration_s=30, pace=0.4, speed=lambda t: 1.0, noise=1, **more):
        """A drive that turns to both sides, 0.4 rad/s at most, and a gyro of its own zero and noise that is changed at a time, s."""
        bag, x, heading, chance = self.bag(), np.zeros(2), 0.0, np.random.default_rng(3)
        for i, t in enumerate(np.arange(0, duration_s, 0.02)):
            turn = 0.4 * np.sin(pace * t)
            if i % 2 == 0:
                bag.odometry(ns(t), ns(t), (*x, heading), (speed(t), 0, 0), (0, 0, turn))
            gyro, acceleration = chance.normal(size=3), chance.normal(size=3)
            bag.imu(ns(t), ns(t), *change(t, (0, 0, turn) + 0.003 * noise * gyro, STILL + 0.02 * noise * acceleration), **more)
            x, heading = x + 0.02 * speed(t) * np.array([np.cos(heading), np.sin(heading)]), heading + 0.02 * turn
        return self.take(bag)

    def test_a_gyro_that_repeats_its_last_value(self):
        for begin_s, end_s in ((9.0, 30.0), (12.0, 18.0)):
            with self.subTest(end_s):
                held = []

                def change(t, gyro, acceleration, begin_s=begin_s, end_s=end_s, held=held):
                    held[:] = held if begin_s <= t < end_s and held else [gyro, acceleration]
                    return held
                recording, said = self.weaving(change)
                findings = [line for line in said.splitlines() if "/imu/data: its" in line]
                self.assertEqual(len(findings), 1, said)
                self.assertRegex(findings[0], rf"its gyro repeats \(.*\) from {begin_s - 0.02:.2f} to {end_s - 0.02:.2f} s after its first message \(at most 1 in a row else\)")
                self.assertEqual(len(recording.table("imu.csv")["t_ns"]), 1500 - round(50 * (end_s - begin_s)))

    def test_a_gyro_that_saturates(self):
        for most in (0.15, 0.3):
            with self.subTest(most):
                recording, said = self.weaving(lambda t, gyro, acceleration, most=most: (np.clip(gyro, -most, most), acceleration))
                findings = [line for line in said.splitlines() if "/imu/data: its" in line]
                self.assertEqual(len(findings), 1, said)
                self.assertRegex(findings[0], rf"its gyro stays at its largest rate, {most} rad/s, for .* s in which the turn rate of /odom is 0.3\d* rad/s")
                self.assertLess(np.abs(recording.table("imu.csv")["wz_radps"]).max(), most)
        _, said = self.weaving(lambda t, gyro, acceleration: (gyro, acceleration))
        self.assertNotIn("/imu/data: its", said)

    def test_zeros(self):
        _, said = self.take(self.with_imu(lambda t, w, a: (np.zeros(3), a)))
        self.assertIn("zeros in all of its 751 messages", said)
        bag = self.with_imu(lambda t, w, a: ((0.001, 0, 0), a))
        recording, said = self.take(bag)
        self.assertIn("shows no turn", said)
        self.assertNotIn("imu.csv", recording.streams())
        self.assert_end(recording, said)

    def test_every_other_message_of_zeros(self):
        for every in (2, 3):
            bag = self.with_imu(lambda t, w, a, n=every: (np.zeros(3) if round(50 * t) % n == 1 else w + (0.001, 0, 0), a))
            self.assert_imu(bag, "zeros between others", never=("finding: /imu/data: its gyro is",))

    def test_short_runs_of_zeros(self):
        chance = np.random.default_rng(3)
        noisy = lambda t, w, a: (np.zeros(3) if round(t * 50) % 3 else w + 0.002 * chance.normal(size=3), a)  # noqa: E731
        recording, _ = self.assert_imu(self.with_imu(noisy), "67 % of its messages have a gyro of zeros", delta=0.1)
        self.assertEqual(np.count_nonzero(recording.table("imu.csv")["wz_radps"]), 251)

    def test_a_quiet_gyro_of_coarse_steps_keeps_its_zeros(self):
        step, chance = 0.001, np.random.default_rng(3)
        coarse = lambda t, w, a: (np.round((w + 0.0006 * chance.normal(size=3)) / step) * step, a)  # noqa: E731
        recording, _ = self.assert_imu(self.with_imu(coarse), never=("zeros",))
        self.assertEqual(len(recording.table("imu.csv")["t_ns"]), 751)

    def test_accelerations_of_zeros_are_left_empty(self):
        recording, _ = self.assert_imu(self.with_imu(lambda t, w, a: (w, a if round(t * 50) % 2 else np.zeros(3))), "accelerations of zeros")
        self.assertAlmostEqual(np.nanmin(recording.table("imu.csv")["az_mps2"][1:-1]), 9.81)

    def test_a_bias_is_subtracted(self):
        bias = np.array([0.05, -0.02, 0.1])
        stood = lambda t, w, a: (w + bias, a)  # noqa: E731
        recording, _ = self.assert_imu(self.with_imu(stood), "finding: /imu/data: its gyro shows (0.050, -0.020, 0.100)", "--as-is")
        np.testing.assert_allclose(recording.table("imu.csv")["wz_radps"][:400], 0, atol=1e-3)
        for small in (bias / 10, bias * 0):
            _, said = self.take(self.with_imu(lambda t, w, a, b=small: (w + b, a)))
            self.assertNotIn("bias", said)

    def test_counts_of_the_sensor_are_scaled(self):
        chance = np.random.default_rng(3)
        counts = lambda t, w, a: (np.round(np.degrees(w) * 16.4 + chance.normal(size=3)), np.round(a / 9.81 * 16384))  # noqa: E731
        recording, _ = self.assert_imu(self.with_imu(counts), "its accelerometer shows 1.638e+04 at rest", "is 940 times the turn rate")
        np.testing.assert_allclose(recording.table("imu.csv")["az_mps2"], 9.80665, atol=1e-3)

    def test_accelerations_of_another_vertical_than_the_turns_are_left_out(self):
        for name, change in (("its gyro on another axis", lambda t, w, a: (w[[2, 0, 1]], a)), ("its accelerometer on another axis", lambda t, w, a: (w, a[[2, 0, 1]]))):
            with self.subTest(name):
                recording, _ = self.assert_imu(self.with_imu(change), "its accelerations are left out")
                self.assertNotIn("az_mps2", recording.table("imu.csv"))

    def test_all_of_it_with_z_down_is_said_to_be_possible(self):
        bag = self.bag().drive(pose=lambda t: place(t) * np.array([1, -1, -1]), twist=lambda t: ((1, 0, 0), (0, 0, -turn_rate(t))))
        for t in times(50):
            bag.imu(ns(t), ns(t), (0, 0, -turn_rate(t)), -STILL)
        self.assertIn("the drive is its mirror image", self.take(bag)[1])

    def test_nothing_in_common(self):
        chance = np.random.default_rng(7)
        self.assert_taken(self.with_imu(lambda t, w, a: (chance.normal(size=3), a)), "nothing in common")

    def test_turns_that_come_late_are_named(self):
        bag = self.bag().drive(pose=lambda t: (0, 0, 0.5 * (1 - np.cos(t))), twist=lambda t: ((0, 0, 0), (0, 0, 0.5 * np.sin(t))))
        for t in times(50):
            bag.imu(ns(t), ns(t), (0, 0, 0.5 * np.sin(max(t - 0.75, 0))))
        _, said = self.take(bag)
        self.assertIn("its turns come 0.75 s after", said)

    def test_a_drive_without_turns_shows_gravity_alone(self):
        for roll_deg in (90.0, 180.0):
            with self.subTest(roll_deg):
                bag, mounted = self.bag().drive(pose=lambda t: (t, 0, 0), twist=lambda t: ((1, 0, 0), (0, 0, 0))), from_rpy(np.radians(roll_deg), 0, 0)
                for t in times():
                    bag.imu(ns(t), ns(t), mounted.T @ (0, 0, 0.001 * np.sin(t)), mounted.T @ STILL, frame="imu_link")
                _, said = self.take(bag)
                self.assertIn(f"rpy_deg: [{roll_deg}, 0.0, 0.0]", said)


class WhichImu(ImuTest):
    """Several topics, and parts that are not there."""

    def test_gyro_and_accelerometer_apart_are_joined(self):
        nothing = np.zeros(3)
        for gyro, acceleration in (("/camera/gyro/sample", "/camera/accel/sample"), ("/imu/gyro", "/imu/accel"), ("/a/gyro/data", "/b/accel/data"),
                                   ("/t265/gyro/sample", "/t265/accel/sample"), ("/z_gyro", "/a_accel")):
            with self.subTest(gyro):
                bag = self.bag().drive().turns(acceleration=nothing, topic=gyro, acceleration_variance=-1.0)
                bag.turns(63, factor=0, topic=acceleration, gyro_variance=-1.0)
                recording, _ = self.assert_imu(bag, f"accelerometer is that of {acceleration}")
                self.assertAlmostEqual(recording.table("imu.csv")["az_mps2"][100], 9.81)

    def test_an_accelerometer_on_other_axes_is_turned_onto_the_gyro_s(self):
        bag = self.bag().drive()
        bag.tf("base_link", "gyro_frame", matrix((0, 0, 0), (np.pi / 2, 0, 0)))
        bag.tf("base_link", "accel_frame", matrix((0, 0, 0), (0, np.pi / 2, 0)))
        for t in times(50):
            bag.imu(ns(t), ns(t), from_rpy(np.pi / 2, 0, 0).T @ (0, 0, turn_rate(t)), np.zeros(3), topic="/gyro", frame="gyro_frame",
                    acceleration_variance=-1.0)
            bag.imu(ns(t), ns(t), np.zeros(3), from_rpy(0, np.pi / 2, 0).T @ STILL, topic="/accel", frame="accel_frame", gyro_variance=-1.0)
        recording, _ = self.assert_imu(bag)
        self.assertAlmostEqual(recording.table("imu.csv")["ay_mps2"][100], 9.81)

    def test_orientations_alone_are_turn_rates(self):
        bag = self.bag().drive()
        for t in times(50):
            bag.imu(ns(t), ns(t), np.zeros(3), np.zeros(3), gyro_variance=-1.0, acceleration_variance=-1.0, turn=from_rpy(0, 0, 1.0 + place(t)[2]))
        self.assert_imu(bag, "orientations alone")

    def test_covariances_by_their_convention(self):
        """-1: not measured; 0: unknown; 1e9: not measured."""
        for variance, is_there in ((-1.0, False), (0.0, True), (1e9, False), (1e-4, True), (1e6, False)):
            with self.subTest(variance):
                recording, said = self.take(self.with_imu(lambda t, w, a: (w, a), gyro_variance=variance))
                self.assertEqual("imu.csv" in recording.streams(), is_there, said)
                if variance == 1e-4:
                    self.assertAlmostEqual(recording.table("imu.csv")["sigma_wx_radps"][0], 0.01)
                elif is_there:
                    self.assertNotIn("sigma_wx_radps", recording.table("imu.csv"))

    def test_the_one_that_fits_is_taken_not_the_one_with_more_messages(self):
        for name, factor in (("other sign", -1), ("twice", 2), ("no turn", 0.01), ("degrees", 57.3), ("zeros", 0)):
            with self.subTest(name):
                recording, said = self.take(self.bag().drive().turns(topic="/z/good").turns(200, factor=factor, topic="/a/bad"))
                self.assertEqual(len(recording.table("imu.csv")["t_ns"]), int(DRIVE_S * 50) + 1, said)
                self.assertIn("not taken: /a/bad", said)
                self.assertNotIn("finding", said)


class Transforms(ImuTest):
    """Mountings along tf, whichever way it is built."""

    def mounted(self, tf, **more):
        """The mounting that an IMU gets, turned by 90 degrees about x."""
        bag, turn = self.bag().drive(**more), from_rpy(np.pi / 2, 0, 0)
        tf(bag)
        for t in times(50):
            bag.imu(ns(t), ns(t), turn.T @ (0, 0, turn_rate(t)), turn.T @ STILL, frame="imu_link")
        recording, said = self.assert_taken(bag, never=("finding",))
        np.testing.assert_allclose(self.turn(recording), turn, atol=1e-6)
        return said

    def test_ways(self):
        inverse, low = np.linalg.inv(TURNED), matrix((0, 0, -0.1))
        kinds = {
            "siblings": lambda bag: (bag.tf("base_footprint", "base_link", matrix((0, 0, 0.1))), bag.tf("base_footprint", "imu_link", TURNED)),
            "base_link is a child": lambda bag: bag.tf("imu_link", "base_link", inverse),
            "base_link over base_footprint": lambda bag: (bag.tf("base_link", "base_footprint", low), bag.tf("base_footprint", "imu_link", TURNED)),
            "with slashes": lambda bag: bag.tf("/base_link", "/imu_link", TURNED),
            "one on each topic": lambda bag: (bag.tf("base_link", "mast", low, topic="/tf"), bag.tf("mast", "imu_link", TURNED)),
            "static on /tf": lambda bag: [bag.tf("base_link", "imu_link", TURNED, "/tf", ns(t), ns(t)) for t in np.arange(0, 15, 0.1)],
            "a late message of tf_static": lambda bag: ([bag.tf("odom", "base_link", matrix((t, 0, 0)), "/tf", ns(t), ns(t)) for t in np.arange(
                0, 14, 0.005)], bag.tf("base_link", "imu_link", TURNED, log=ns(14.5))),
            "robot's namespace": lambda bag: bag.tf("base_link", "imu_link", TURNED, topic="/robot1/tf_static")}
        for name, tf in kinds.items():
            with self.subTest(name):
                self.mounted(tf)

    def test_other_names_of_the_robot_s_frame(self):
        for base in ("base_footprint", "chassis", "robot1/base_link", "base"):
            with self.subTest(base):
                said = self.mounted(lambda bag, base=base: bag.tf(base, "imu_link", TURNED), child=base)
                self.assertIn(f"'{base}' is taken as the robot's frame", said)

    def test_many_messages_with_moving_links(self):
        def tf(bag):
            for t in np.arange(0, 15, 0.01):
                bag.put("/tf", "TFMessage", ns(t), bag.m.make("TFMessage", transforms=[
                    bag.m.transform(ns(t), "odom", "base_link", matrix((t, 0, 0))), bag.m.transform(ns(t), "base_link", "wheel", matrix((0, 0, 0), (0, 5 * t, 0))),
                    bag.m.transform(ns(t), "base_link", "imu_link", TURNED)]))

        said = self.mounted(tf)
        self.assertIn("'wheel' moves in 'base_link'", said)
        self.assertNotIn("'base_link' moves", said)

    def test_the_last_of_two_static_transforms_counts(self):
        bag = self.with_imu(mounted=from_rpy(np.pi / 2, 0, 0))
        bag.tf("base_link", "imu_link", matrix((0, 0, 0)), log=ns(0) - 1)
        recording, _ = self.assert_imu(bag, "tf_static has 'imu_link' in 'base_link' with other values later", never=("moves",))
        np.testing.assert_allclose(recording.calibration["imu"]["mounting"]["rpy_deg"], (90, 0, 0), atol=1e-6)

    def test_a_moving_joint_on_the_way_is_named(self):
        bag = self.with_imu()
        for t in times():
            bag.tf("base_link", "head", matrix((0, 0, 1), (0, 0, 0.1 * t)), "/tf", ns(t), ns(t))
        bag.tf("head", "imu2", matrix((0, 0, 0)))
        _, said = self.take(bag.turns(topic="/imu2", frame="imu2"), "--imu", "/imu2")
        self.assertIn("has a joint that moves ('head' moves in 'base_link')", said)

    def test_cameras_by_convention_and_by_name(self):
        from waymark.bag.frames import camera_pose, mounting
        optical, body = np.eye(4), matrix((0.3, 0, 0.4), (0, 0.2, 0.5))
        optical[:3, :3], optical[:3, 3] = body[:3, :3] @ OPTICAL, body[:3, 3]
        down = np.eye(4)
        down[:3, :3] = from_rpy(0, np.pi / 2, 0) @ OPTICAL
        for frame, pose, rpy in (("front_optical_frame", optical, (0, 0.2, 0.5)), ("front", optical, (0, 0.2, 0.5)), ("front_link", body, (0, 0.2, 0.5)),
                                 ("floor_optical_frame", down, (0, np.pi / 2, 0)), ("camera", np.eye(4), (0, 0, 0))):
            with self.subTest(frame):
                np.testing.assert_allclose(from_rpy(*np.radians(mounting(camera_pose(frame, pose))["rpy_deg"])), from_rpy(*rpy), atol=1e-9)


if __name__ == "__main__":
    unittest.main()
