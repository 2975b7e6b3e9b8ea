#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Motion out of bags: the twists and the poses of odometry are compared, and what is right drives.

    test_bag_motion.py BIN_DIR"""

import unittest

import numpy as np
from bag_drives import DRIVE_S, END, SPEED, BagTest, matrix, ns, place, times, turn_rate

from waymark.geometry import OPTICAL, from_rpy


class FrameOfTheTwist(BagTest):
    """Twists on the axes of the odom frame, as simulators, legged robots and autopilots give them."""

    def test_it_is_turned_into_the_robot_s_axes(self):
        chance = np.random.default_rng(1)
        for name, offset, noise in (("from 0", 0.0, 0.0), ("from 90 degrees", np.pi / 2, 0.0), ("backwards", np.pi, 0.0), ("with noise", 0.0, 0.05),
                                    ("from -2 rad, with noise", -2.0, 0.05)):
            with self.subTest(name):
                bag = self.bag()
                for t in times():
                    x, y, heading = place(t)
                    turn = from_rpy(0, 0, offset)
                    way = turn @ (SPEED * np.cos(heading), SPEED * np.sin(heading), 0) + noise * chance.normal(size=3) * (1, 1, 0)
                    bag.odometry(ns(t), ns(t), (*(turn @ (x, y, 0))[:2], heading + offset), way, (0, 0, turn_rate(t)))
                recording, said = self.take(bag)
                self.assertIn("axes of the frame of its poses", said)
                self.assert_end(recording, said, 0.01 if not noise else 0.1)

    def test_one_on_the_robot_s_axes_stays_as_it_is(self):
        bag = self.bag()
        bag.drive()
        recording, said = self.take(bag)
        self.assertNotIn("note: /odom", said)
        self.assertNotIn("finding", said)
        self.assertEqual(recording.streams(), ["motion.csv"])
        np.testing.assert_array_equal(recording.table("motion.csv")["v_mps"], SPEED)
        self.assert_end(recording, said)


class EmptyParts(BagTest):
    """Twists of which a part is never filled."""

    def put(self, change, **more):
        bag = self.bag()
        for t in times():
            bag.odometry(ns(t), ns(t), place(t), *change((SPEED, 0, 0), (0, 0, turn_rate(t))), **more)
        return bag

    def test_the_poses_fill_it(self):
        nan = (np.nan,) * 3
        kinds = {"angular 0": (lambda v, w: (v, (0, 0, 0)), {}, "angular part"), "angular NaN": (lambda v, w: (v, nan), {}, "angular part"),
                 "linear 0": (lambda v, w: ((0, 0, 0), w), {}, "linear.x"), "all 0": (lambda v, w: ((0, 0, 0), (0, 0, 0)), {}, "always 0"),
                 "all NaN": (lambda v, w: (nan, nan), {}, "not a number"),
                 "not measured by its variance": (lambda v, w: (v, (0, 0, 9.0)), {"variances": (0.1, 0.1, 1e9, 1e9, 1e9, 1e9)}, "angular part"),
                 "variance -1": (lambda v, w: ((7.0, 0, 0), w), {"variances": (-1, 0, 0, 0, 0, 0)}, "linear.x")}
        for name, (change, more, words) in kinds.items():
            with self.subTest(name):
                recording, said = self.take(self.put(change, **more))
                self.assertIn(words, said)
                self.assert_end(recording, said)

    def test_sideways_speed(self):
        """A base with mecanum wheels, whose driver gives linear.x alone: 1 m/s forwards and 0.5 m/s to the left."""
        bag = self.bag()
        for t in times():
            bag.odometry(ns(t), ns(t), (t, 0.5 * t, 0), (1.0, 0, 0), (0, 0, 0))
        recording, said = self.take(bag)
        self.assertIn("linear.y", said)
        self.assert_end(recording, said, end=(DRIVE_S, 0.5 * DRIVE_S, 0))

    def test_headings_that_do_not_turn_as_the_way_does_are_named(self):
        """Poses alone: a quaternion with w first, or made of degrees; begun anywhere, and driven backwards, it is none of these."""
        def spoil(message, heading):
            return {"w first": (np.cos(heading / 2), 0, 0, np.sin(heading / 2)), "of degrees": (0, 0, np.sin(np.degrees(heading) / 2), np.cos(np.degrees(heading) / 2))}[message]

        for name in ("right", "backwards", "w first", "of degrees"):
            bag, back = self.bag(), -1 if name == "backwards" else 1
            for t in times():
                x, y, heading = place(t)
                bag.odometry(ns(t), ns(t), (5 + back * x, y - 3, back * heading), (0, 0, 0), (0, 0, 0))
                if name in ("w first", "of degrees"):
                    q = bag._rows[-1][4].pose.pose.orientation
                    q.x, q.y, q.z, q.w = map(float, spoil(name, heading))
            with self.subTest(name):
                recording, said = self.take(bag)
                self.assertEqual("finding: /odom: its way turns by 8" in said, name in ("w first", "of degrees"), said)
                if name in ("right", "backwards"):
                    self.assert_end(recording, said, end=(back * END[0], END[1], back * END[2]))

    def test_rows_of_no_number_are_the_poses_differences(self):
        for is_none, count in ((lambda i: i % 50 == 7, 6), (lambda i: i < 20, 20)):
            for none in (np.nan, np.inf):
                bag = self.bag()
                for i, t in enumerate(times()):
                    bag.odometry(ns(t), ns(t), place(t), (none if is_none(i) else SPEED, 0, 0), (0, 0, turn_rate(t)))
                recording, said = self.take(bag)
                self.assertIn(f"{count} of its 301 messages have no number", said)
                self.assert_end(recording, said)

    def test_a_twist_of_infinity_is_none(self):
        bag = self.bag()
        for t in times():
            bag.odometry(ns(t), ns(t), place(t), (np.inf,) * 3, (-np.inf,) * 3)
        recording, said = self.take(bag)
        self.assertIn("its twist is not a number", said)
        self.assert_end(recording, said)

    def test_poses_alone_are_increments_and_beside_a_gyro_twists(self):
        for gyro, stream in ((False, "increments.csv"), (True, "motion.csv")):
            bag = self.put(lambda v, w: ((0, 0, 0), (0, 0, 0)))
            for t in times(50) if gyro else []:
                bag.imu(ns(t), ns(t), (0, 0, turn_rate(t)))
            recording, said = self.take(bag)
            self.assertIn(stream, recording.streams())
            self.assert_end(recording, said)

    def test_poses_that_never_turn_or_stand_do_not_drive(self):
        for name, pose in (("no orientation", lambda t: (place(t)[0], place(t)[1], 0)), ("stands", lambda t: (0, 0, 0))):
            with self.subTest(name):
                bag = self.bag()
                for t in times():
                    bag.odometry(ns(t), ns(t), pose(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
                recording, said = self.take(bag)
                self.assertIn("the twist is used", said)
                self.assert_end(recording, said)


class SensorsWithALever(BagTest):
    """Odometry of a frame that is not the robot's own."""

    def put(self, sensor, tf, child="vo_link"):
        bag = self.bag()
        tf(bag)
        for t in times():
            x, y, heading = place(t)
            turn = sensor[:3, :3].T
            v = turn @ (np.array([SPEED, 0, 0]) + np.cross((0, 0, turn_rate(t)), sensor[:3, 3]))
            bag.odometry(ns(t), ns(t), matrix((x, y, 0), (0, 0, heading)) @ sensor,
                         v, turn @ (0, 0, turn_rate(t)), child=child)
        return bag

    def test_its_motion_is_moved_to_the_robot(self):
        ahead, side, back = matrix((1, 0, 0.4)), matrix((0.2, 0.5, 0.3), (0, 0, np.pi / 2)), matrix((-0.4, 0.1, 0.2), (0, 0, np.pi))
        optical = matrix((0.3, -0.2, 0.5))
        optical[:3, :3] = OPTICAL
        kinds = {
            "1 m ahead": (ahead, lambda bag: bag.tf("base_link", "vo_link", ahead)),
            "to the left, turned": (side, lambda bag: bag.tf("base_link", "vo_link", side)),
            "behind, looking back, by its inverse": (back, lambda bag: bag.tf("vo_link", "base_link", np.linalg.inv(back))),
            "optical axes": (optical, lambda bag: bag.tf("base_link", "vo_link", optical)),
            "over two links and a sibling": (side @ ahead, lambda bag: (bag.tf("base_footprint", "base_link", matrix((0, 0, 0.1))), bag.tf(
                "base_footprint", "mast", matrix((0, 0, 0.1)) @ side), bag.tf("mast", "vo_link", ahead)))}
        for name, (sensor, tf) in kinds.items():
            with self.subTest(name):
                recording, said = self.take(self.put(sensor, tf))
                self.assertIn("lever", said)
                self.assert_end(recording, said)

    def test_its_poses_alone_are_moved_too(self):
        ahead = matrix((1, 0, 0.4))
        bag = self.bag()
        bag.tf("base_link", "vo_link", ahead)
        for t in times():
            x, y, heading = place(t)
            bag.odometry(ns(t), ns(t), matrix((x, y, 0), (0, 0, heading)) @ ahead, (0, 0, 0), (0, 0, 0), child="vo_link")
        recording, said = self.take(bag)
        self.assert_end(recording, said)

    def test_a_frame_without_a_place_is_named(self):
        recording, said = self.take(self.put(np.eye(4), lambda bag: None, child="camera_pose_frame"))
        self.assertIn("camera_pose_frame", said)
        self.assert_end(recording, said)

    def test_a_lever_that_nobody_states_is_named(self):
        for ahead in (1.0, -0.4):
            recording, said = self.take(self.put(matrix((ahead, 0, 0.4)), lambda bag: None, child="base_link"))
            self.assertIn(f"{abs(ahead):.2f} m {'ahead of' if ahead > 0 else 'behind'} the axle", said)
            self.assertIn("motion6.csv", recording.streams())

    def test_frames_whose_names_say_that_z_is_down(self):
        for child in ("base_link_frd", "base_link_ned", "base_footprint_frd"):
            bag = self.bag()
            for t in times():
                x, y, heading = place(t)
                bag.odometry(ns(t), ns(t), (x, -y, -heading), (SPEED, 0, 0), (0, 0, -turn_rate(t)), frame="odom_ned", child=child)
            recording, said = self.take(bag)
            self.assertIn(f"motion of '{child}'", said)
            self.assert_end(recording, said)

    def test_frames_whose_names_say_that_z_is_ahead(self):
        """Poses of a camera's optical frame in a world on the same axes, as visual odometry gives them without tf."""
        world = np.eye(4)
        world[:3, :3] = OPTICAL.T
        optical = np.eye(4)
        optical[:3, :3] = OPTICAL
        for child, place_of_camera in (("camera_optical", None), ("left_optical_frame", matrix((0.5, 0, 0.3)))):
            bag, camera = self.bag(), np.eye(4) if place_of_camera is None else place_of_camera
            if place_of_camera is not None:
                bag.tf("base_link", "left_frame", camera)
            for t in times():
                x, y, heading = place(t)
                bag.odometry(ns(t), ns(t), world @ matrix((x, y, 0), (0, 0, heading)) @ camera @ optical, (0, 0, 0), (0, 0, 0), child=child)
            recording, said = self.take(bag)
            self.assertIn("on the axes that its name states" if place_of_camera is None else "with this lever", said)
            self.assert_end(recording, said)

    def test_a_child_that_is_the_world_is_the_robot(self):
        bag = self.bag()
        bag.drive(child="odom")
        recording, said = self.take(bag)
        self.assertIn("'odom', a frame of the world", said)
        self.assert_end(recording, said)

    def test_other_names_of_the_robot_s_frame(self):
        for child in ("base_footprint", "/base_link", "robot1/base_link", "chassis", ""):
            with self.subTest(child):
                bag = self.bag()
                bag.drive(child=child)
                recording, said = self.take(bag)
                self.assertNotIn("note: /odom", said)
                self.assert_end(recording, said)


class Contradictions(BagTest):
    """Poses and twists of one message that say different things."""

    def test_the_poses_drive_and_the_size_is_said(self):
        kinds = {"degrees": (1, 180 / np.pi, "degrees"), "half the turn": (1, 0.5, "half"), "other sign": (1, -1, "-1 times"),
                 "km/h": (3.6, 1, "3.6 times"), "twice the speed": (2, 1, "twice"), "10 % too slow": (0.9, 1, "0.9 times"),
                 "backwards": (-1, 1, "-1 times")}
        for name, (speed, turn, words) in kinds.items():
            with self.subTest(name):
                bag = self.bag()
                for t in times():
                    bag.odometry(ns(t), ns(t), place(t), (speed * SPEED, 0, 0), (0, 0, turn * turn_rate(t)))
                recording, said = self.take(bag)
                self.assertIn("finding: /odom", said)
                self.assertIn(words, said)
                self.assertIn("--motion-by twists", said)
                self.assert_end(recording, said)
                recording, said = self.take(bag, "--motion-by", "twists")
                self.assertEqual(recording.table("motion.csv")["v_mps"][0], speed * SPEED)

    def test_poses_in_millimetres_do_not_drive(self):
        bag = self.bag()
        for t in times():
            x, y, heading = place(t)
            bag.odometry(ns(t), ns(t), (1000 * x, 1000 * y, heading), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        recording, said = self.take(bag)
        self.assertIn("mm in place of m", said)
        self.assert_end(recording, said)

    def test_headings_in_degrees_do_not_drive(self):
        bag = self.bag()
        for t in times():
            x, y, heading = place(t)
            bag.odometry(ns(t), ns(t), (x, y, np.degrees(heading)), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        recording, said = self.take(bag)
        self.assertIn("finding: /odom: its poses turn 57.3 times as far as its twist", said)
        self.assert_end(recording, said)

    def test_poses_that_are_reset_go_on(self):
        for name, twist in (("twists", SPEED), ("poses alone", 0.0)):
            with self.subTest(name):
                bag, reset = self.bag(), matrix((*place(12)[:2], 0), (0, 0, place(12)[2]))
                for t in times():
                    x, y, heading = place(t)
                    pose = matrix((x, y, 0), (0, 0, heading))
                    bag.odometry(ns(t), ns(t), np.linalg.inv(reset) @ pose if t >= 12 else pose, (twist, 0, 0), (0, 0, twist * turn_rate(t)))
                recording, said = self.take(bag)
                self.assertIn("its poses leap by 11.85 m at 11.95 s", said)
                self.assertNotIn("finding", said)
                self.assert_end(recording, said)
                if not twist:
                    self.assertLess(np.abs(recording.table("increments.csv")["dx_m"]).max(), 0.06)

    def test_noise_is_no_contradiction(self):
        chance = np.random.default_rng(3)
        bag = self.bag()
        for t in times():
            x, y, heading = place(t)
            bag.odometry(ns(t), ns(t), (x + 0.002 * chance.normal(), y + 0.002 * chance.normal(), heading + 0.002 * chance.normal()),
                         (SPEED + 0.03 * chance.normal(), 0, 0), (0, 0, turn_rate(t) + 0.02 * chance.normal()))
        recording, said = self.take(bag)
        self.assertNotIn("finding", said)
        self.assertEqual(recording.streams(), ["motion.csv"])

    def test_a_twist_that_is_a_running_mean_yields_to_the_poses(self):
        """Turns to the left and to the right; the twist is their mean over 1 s."""
        bag, heading, rates = self.bag(), 0.0, []
        for t in times(10):
            rates.append(0.6 * np.sin(1.5 * t))
            bag.odometry(ns(t), ns(t), (0, 0, heading), (0, 0, 0), (0, 0, np.mean(rates[-10:])))
            heading += 0.1 * rates[-1]
        recording, said = self.take(bag)
        self.assertIn("0.50 s later than its poses", said)
        self.assertNotIn("finding", said)
        self.assert_end(recording, said, end=(0, 0, heading - 0.1 * rates[-1]))

    def test_messages_that_repeat_are_said(self):
        bag = self.bag()
        for i, t in enumerate(times(50)):
            then = (i // 5) / 10
            bag.odometry(ns(t), ns(t), place(then), (SPEED, 0, 0), (0, 0, turn_rate(then)))
        recording, said = self.take(bag)
        self.assertIn("80 % of its messages repeat", said)
        self.assert_end(recording, said, 0.15)


class WhichTopic(BagTest):
    """Measured before commanded; no count decides."""

    def command(self, bag, topic, kind="Twist", rate_hz=50.0, factor=1.2):
        for t in times(rate_hz):
            twist = bag.twist((factor * SPEED, 0, 0), (0, 0, factor * turn_rate(t)))
            bag.put(topic, kind, ns(t), twist if kind == "Twist" else bag.m.make("TwistStamped", header=bag.m.header(ns(t), "base_link"), twist=twist))

    def test_measured_motion_before_commands(self):
        for topic, kind in (("/cmd_vel", "Twist"), ("/diff_drive/cmd_vel", "TwistStamped"), ("/teleop/twist", "Twist"), ("/cmd_vel_mux/out", "Twist"),
                            ("/robot1/cmd_vel_nav", "TwistStamped"), ("/nav_vel", "Twist"), ("/velocity", "Twist")):
            with self.subTest(topic):
                bag = self.bag()
                bag.drive()
                self.command(bag, topic, kind)
                recording, said = self.take(bag)
                self.assertIn(f"not taken: {topic}", said)
                self.assert_end(recording, said)

    def test_a_measured_twist_without_a_stamp_before_commands_with_one(self):
        for topic in ("/cmd_vel", "/a/setpoint/velocity"):
            with self.subTest(topic):
                bag = self.bag()
                self.command(bag, "/wheel_twist", "Twist", 20, factor=1.0)
                self.command(bag, topic, "TwistStamped")
                recording, said = self.take(bag)
                self.assertIn(f"not taken: {topic}: commands", said)
                self.assert_end(recording, said)

    def test_a_twist_with_a_covariance_is_measured(self):
        bag = self.bag()
        for t in times(50):
            bag.put("/a/vel", "TwistStamped", ns(t), bag.m.make("TwistStamped", header=bag.m.header(ns(t), "base_link"), twist=bag.twist(
                (1.2, 0, 0), (0, 0, 1.2 * turn_rate(t)))))
        for t in times():
            bag.put("/vehicle/twist", "TwistWithCovarianceStamped", ns(t), bag.m.make(
                "TwistWithCovarianceStamped", header=bag.m.header(ns(t), "base_link"), twist=bag.m.make("TwistWithCovariance", twist=bag.twist(
                    (SPEED, 0, 0), (0, 0, turn_rate(t))))))
        recording, said = self.take(bag)
        self.assertIn("not taken: /a/vel: motion comes from /vehicle/twist (its speed is 1.2 times that one's, its turn rate is 1.2 times that one's)", said)
        self.assert_end(recording, said)

    def test_commands_alone_are_taken_and_said_to_be_commands(self):
        bag = self.bag()
        self.command(bag, "/cmd_vel", factor=1.0)
        recording, said = self.take(bag)
        self.assertIn("twist: commands", said)
        self.assert_end(recording, said)

    def test_a_sensor_before_a_filter_and_before_the_truth(self):
        for topic in ("/odometry/filtered", "/ground_truth/state", "/odometry/global", "/ekf/odom", "/p3d_base_controller"):
            with self.subTest(topic):
                bag = self.bag()
                bag.drive(10)
                for t in times(100):
                    bag.odometry(ns(t), ns(t), (0, 0, 0), (2, 0, 0), (0, 0, 0), topic=topic)
                recording, said = self.take(bag)
                self.assertIn(f"not taken: {topic}", said)
                self.assert_end(recording, said)

    def test_one_that_stands_still_or_ends_early_does_not_drive(self):
        bag = self.bag()
        bag.drive(10)
        for t in times(100):
            bag.odometry(ns(t), ns(t), (0, 0, 0), (0, 0, 0), (0, 0, 0), topic="/a_still")
            if t < 2:
                bag.odometry(ns(t), ns(t), (t, 0, 0), (1, 0, 0), (0, 0, 0), topic="/b_short")
        recording, said = self.take(bag)
        self.assert_end(recording, said)

    def test_poses_are_motion_where_the_user_says_so(self):
        bag = self.bag()
        for t in times():
            x, y, heading = place(t)
            bag.put("/vo/pose", "PoseStamped", ns(t), bag.m.make("PoseStamped", header=bag.m.header(ns(t), "map"),
                                                                 pose=bag.m.pose_of(matrix((x, y, 0), (0, 0, heading)))))
        _, said = self.take(bag, code=1)
        self.assertIn("--motion /vo/pose", said)
        recording, said = self.take(bag, "--motion", "/vo/pose")
        self.assert_end(recording, said)

    def test_twists_in_a_frame_of_the_world_are_named(self):
        bag = self.bag()
        for t in times():
            bag.put("/local/velocity", "TwistStamped", ns(t), bag.m.make("TwistStamped", header=bag.m.header(ns(t), "map"), twist=bag.twist(
                (SPEED, 0, 0), (0, 0, turn_rate(t)))))
        _, said = self.take(bag)
        self.assertIn("finding: /local/velocity", said)


if __name__ == "__main__":
    unittest.main()
