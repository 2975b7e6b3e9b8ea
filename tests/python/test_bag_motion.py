#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Motion out of bags: the twists and the poses of odometry are compared, and what is right drives.

    test_bag_motion.py BIN_DIR"""

import unittest

import numpy as np
from bag_drives import DRIVE_S, END, SPEED, BagTest, in_plane, matrix, ns, place, times, turn_rate

from waymark.geometry import OPTICAL, from_rpy

NO_TWIST = lambda t: ((0, 0, 0), (0, 0, 0))  # noqa: E731


class FrameOfTheTwist(BagTest):
    """Twists on the axes of the odom frame, as simulators, legged robots and autopilots give them."""

    def test_it_is_turned_into_the_robot_s_axes(self):
        chance = np.random.default_rng(1)
        for name, offset, noise in (("from 0", 0.0, 0.0), ("from 90 degrees", np.pi / 2, 0.0), ("backwards", np.pi, 0.0), ("with noise", 0.0, 0.05),
                                    ("from -2 rad, with noise", -2.0, 0.05)):
            with self.subTest(name):
                turn = from_rpy(0, 0, offset)

                def way(t, turn=turn, noise=noise):
                    speed = SPEED * np.array([np.cos(place(t)[2]), np.sin(place(t)[2]), 0])
                    return turn @ speed + noise * chance.normal(size=3) * (1, 1, 0), (0, 0, turn_rate(t))

                pose = lambda t, turn=turn, offset=offset: (*(turn @ (*place(t)[:2], 0))[:2], place(t)[2] + offset)  # noqa: E731
                self.assert_taken(self.bag().drive(pose=pose, twist=way), "axes of the frame of its poses", delta=0.01 if not noise else 0.1)

    def test_one_on_the_robot_s_axes_stays_as_it_is(self):
        recording, _ = self.assert_taken(self.bag().drive(), never=("note: /odom", "finding"))
        self.assertEqual(recording.streams(), ["motion.csv"])
        np.testing.assert_array_equal(recording.table("motion.csv")["v_mps"], SPEED)


class EmptyParts(BagTest):
    """Twists of which a part is never filled."""

    def test_the_poses_fill_it(self):
        nan, none, forwards = (np.nan,) * 3, (0, 0, 0), (SPEED, 0, 0)
        kinds = {"angular 0": (lambda w: (forwards, none), {}, "angular part"), "angular NaN": (lambda w: (forwards, nan), {}, "angular part"),
                 "linear 0": (lambda w: (none, w), {}, "linear.x"), "all 0": (lambda w: (none, none), {}, "always 0"),
                 "all NaN": (lambda w: (nan, nan), {}, "not a number"),
                 "all infinite": (lambda w: ((np.inf,) * 3, (-np.inf,) * 3), {}, "its twist is not a number"),
                 "not measured by its variance": (lambda w: (forwards, (0, 0, 9.0)), {"variances": (0.1, 0.1, 1e9, 1e9, 1e9, 1e9)}, "angular part"),
                 "variance -1": (lambda w: ((7.0, 0, 0), w), {"variances": (-1, 0, 0, 0, 0, 0)}, "linear.x")}
        for name, (change, more, words) in kinds.items():
            with self.subTest(name):
                self.assert_taken(self.bag().drive(twist=lambda t, f=change: f((0, 0, turn_rate(t))), **more), words)

    def test_sideways_speed(self):
        """A base with mecanum wheels, whose driver gives linear.x alone: 1 m/s forwards and 0.5 m/s to the left."""
        bag = self.bag().drive(pose=lambda t: (t, 0.5 * t, 0), twist=lambda t: ((1.0, 0, 0), (0, 0, 0)))
        self.assert_taken(bag, "linear.y", end=(DRIVE_S, 0.5 * DRIVE_S, 0))

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
                    q = bag.items[-1][3].pose.pose.orientation
                    q.x, q.y, q.z, q.w = map(float, spoil(name, heading))
            with self.subTest(name):
                recording, said = self.take(bag)
                self.assertEqual("finding: /odom: its way turns by 8" in said, name in ("w first", "of degrees"), said)
                if name in ("right", "backwards"):
                    self.assert_end(recording, said, end=(back * END[0], END[1], back * END[2]))

    def test_rows_of_no_number_are_the_poses_differences(self):
        for is_none, count in ((lambda i: i % 50 == 7, 6), (lambda i: i < 20, 20)):
            for none in (np.nan, np.inf):
                twist = lambda t, f=is_none, v=none: ((v if f(round(20 * t)) else SPEED, 0, 0), (0, 0, turn_rate(t)))  # noqa: E731
                self.assert_taken(self.bag().drive(twist=twist), f"{count} of its 301 messages have no number")

    def test_poses_alone_are_increments_and_beside_a_gyro_twists(self):
        for gyro, stream in ((False, "increments.csv"), (True, "motion.csv")):
            bag = self.bag().drive(twist=NO_TWIST)
            recording, _ = self.assert_taken(bag.turns() if gyro else bag)
            self.assertIn(stream, recording.streams())

    def test_poses_that_never_turn_or_stand_do_not_drive(self):
        for name, pose in (("no orientation", lambda t: (place(t)[0], place(t)[1], 0)), ("stands", lambda t: (0, 0, 0))):
            with self.subTest(name):
                self.assert_taken(self.bag().drive(pose=pose), "the twist is used")


class SensorsWithALever(BagTest):
    """Odometry of a frame that is not the robot's own."""

    def put(self, sensor, tf, child="vo_link"):
        turn = sensor[:3, :3].T
        bag = self.bag()
        tf(bag)
        return bag.drive(pose=lambda t: in_plane(place(t)) @ sensor, child=child, twist=lambda t: (
            turn @ (np.array([SPEED, 0, 0]) + np.cross((0, 0, turn_rate(t)), sensor[:3, 3])), turn @ (0, 0, turn_rate(t))))

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
                self.assert_taken(self.put(sensor, tf), "lever")

    def test_its_poses_alone_are_moved_too(self):
        ahead = matrix((1, 0, 0.4))
        bag = self.bag()
        bag.tf("base_link", "vo_link", ahead)
        self.assert_taken(bag.drive(pose=lambda t: in_plane(place(t)) @ ahead, twist=NO_TWIST, child="vo_link"))

    def test_a_frame_without_a_place_is_named(self):
        self.assert_taken(self.put(np.eye(4), lambda bag: None, child="camera_pose_frame"), "camera_pose_frame")

    def test_a_lever_that_nobody_states_is_named(self):
        for ahead in (1.0, -0.4):
            recording, said = self.take(self.put(matrix((ahead, 0, 0.4)), lambda bag: None, child="base_link"))
            self.assertIn(f"{abs(ahead):.2f} m {'ahead of' if ahead > 0 else 'behind'} the axle", said)
            self.assertIn("motion6.csv", recording.streams())

    def test_frames_whose_names_say_that_z_is_down(self):
        for child in ("base_link_frd", "base_link_ned", "base_footprint_frd"):
            bag = self.bag().drive(pose=lambda t: place(t) * np.array([1, -1, -1]), twist=lambda t: ((SPEED, 0, 0), (0, 0, -turn_rate(t))),
                                   frame="odom_ned", child=child)
            self.assert_taken(bag, f"motion of '{child}'")

    def test_frames_whose_names_say_that_z_is_ahead(self):
        """Poses of a camera's optical frame in a world on the same axes, as visual odometry gives them without tf."""
        optical = np.eye(4)
        optical[:3, :3] = OPTICAL
        for child, camera, words in (("camera_optical", np.eye(4), "on the axes that its name states"),
                                     ("left_optical_frame", matrix((0.5, 0, 0.3)), "with this lever")):
            bag = self.bag()
            if child == "left_optical_frame":
                bag.tf("base_link", "left_frame", camera)
            pose = lambda t, camera=camera: optical.T @ in_plane(place(t)) @ camera @ optical  # noqa: E731
            self.assert_taken(bag.drive(pose=pose, twist=NO_TWIST, child=child), words)

    def test_a_child_that_is_the_world_is_the_robot(self):
        self.assert_taken(self.bag().drive(child="odom"), "'odom', a frame of the world")

    def test_other_names_of_the_robot_s_frame(self):
        for child in ("base_footprint", "/base_link", "robot1/base_link", "chassis", ""):
            with self.subTest(child):
                self.assert_taken(self.bag().drive(child=child), never=("note: /odom",))


class Contradictions(BagTest):
    """Poses and twists of one message that say different things."""

    def test_the_poses_drive_and_the_size_is_said(self):
        kinds = {"degrees": (1, 180 / np.pi, "degrees"), "half the turn": (1, 0.5, "half"), "other sign": (1, -1, "-1 times"),
                 "km/h": (3.6, 1, "3.6 times"), "twice the speed": (2, 1, "twice"), "10 % too slow": (0.9, 1, "0.9 times"),
                 "backwards": (-1, 1, "-1 times")}
        for name, (speed, turn, words) in kinds.items():
            with self.subTest(name):
                bag = self.bag().drive(twist=lambda t, v=speed, w=turn: ((v * SPEED, 0, 0), (0, 0, w * turn_rate(t))))
                self.assert_taken(bag, "finding: /odom", words, "--motion-by twists")
                recording, _ = self.take(bag, "--motion-by", "twists")
                self.assertEqual(recording.table("motion.csv")["v_mps"][0], speed * SPEED)

    def test_poses_of_other_units_do_not_drive(self):
        for unit, size, words in (("mm", (1000, 1000, 1), "mm in place of m"),
                                  ("degrees", (1, 1, 180 / np.pi), "finding: /odom: its poses turn 57.3 times as far as its twist")):
            with self.subTest(unit):
                self.assert_taken(self.bag().drive(pose=lambda t, size=size: place(t) * np.array(size)), words)

    def test_poses_that_are_reset_go_on(self):
        since = np.linalg.inv(in_plane(place(12)))
        for name, twist in (("twists", SPEED), ("poses alone", 0.0)):
            with self.subTest(name):
                bag = self.bag().drive(pose=lambda t: since @ in_plane(place(t)) if t >= 12 else place(t),
                                       twist=lambda t, v=twist: ((v, 0, 0), (0, 0, v * turn_rate(t))))
                recording, _ = self.assert_taken(bag, "its poses leap by 11.85 m at 11.95 s", never=("finding",))
                if not twist:
                    self.assertLess(np.abs(recording.table("increments.csv")["dx_m"]).max(), 0.06)

    def test_noise_is_no_contradiction(self):
        chance = np.random.default_rng(3)
        recording, said = self.take(self.bag().drive(
            pose=lambda t: place(t) + 0.002 * chance.normal(size=3),
            twist=lambda t: ((SPEED + 0.03 * chance.normal(), 0, 0), (0, 0, turn_rate(t) + 0.02 * chance.normal()))))
        self.assertNotIn("finding", said)
        self.assertEqual(recording.streams(), ["motion.csv"])

    def test_a_twist_that_is_a_running_mean_yields_to_the_poses(self):
        """Turns to the left and to the right; the twist is their mean over 1 s."""
        bag, heading, rates = self.bag(), 0.0, []
        for t in times(10):
            rates.append(0.6 * np.sin(1.5 * t))
            bag.odometry(ns(t), ns(t), (0, 0, heading), (0, 0, 0), (0, 0, np.mean(rates[-10:])))
            heading += 0.1 * rates[-1]
        self.assert_taken(bag, "0.50 s later than its poses", never=("finding",), end=(0, 0, heading - 0.1 * rates[-1]))

    def test_messages_that_repeat_are_said(self):
        then = lambda t: round(50 * t) // 5 / 10  # noqa: E731
        bag = self.bag().drive(50, pose=lambda t: place(then(t)), twist=lambda t: ((SPEED, 0, 0), (0, 0, turn_rate(then(t)))))
        self.assert_taken(bag, "80 % of its messages repeat", delta=0.15)


class WhichTopic(BagTest):
    """Measured before commanded; no count decides."""

    def command(self, bag, topic, kind="Twist", rate_hz=50.0, factor=1.2, frame="base_link"):
        for t in times(rate_hz):
            twist = bag.twist((factor * SPEED, 0, 0), (0, 0, factor * turn_rate(t)))
            if kind == "TwistWithCovarianceStamped":
                twist = bag.m.make("TwistWithCovariance", twist=twist)
            bag.put(topic, kind, ns(t), twist if kind == "Twist" else bag.m.make(kind, header=bag.m.header(ns(t), frame), twist=twist))
        return bag

    def test_measured_motion_before_commands(self):
        for topic, kind in (("/cmd_vel", "Twist"), ("/diff_drive/cmd_vel", "TwistStamped"), ("/teleop/twist", "Twist"), ("/cmd_vel_mux/out", "Twist"),
                            ("/robot1/cmd_vel_nav", "TwistStamped"), ("/nav_vel", "Twist"), ("/velocity", "Twist")):
            with self.subTest(topic):
                self.assert_taken(self.command(self.bag().drive(), topic, kind), f"not taken: {topic}")

    def test_a_measured_twist_without_a_stamp_before_commands_with_one(self):
        for topic in ("/cmd_vel", "/a/setpoint/velocity"):
            with self.subTest(topic):
                bag = self.command(self.bag(), "/wheel_twist", "Twist", 20, factor=1.0)
                self.assert_taken(self.command(bag, topic, "TwistStamped"), f"not taken: {topic}: commands")

    def test_a_twist_with_a_covariance_is_measured(self):
        bag = self.command(self.bag(), "/a/vel", "TwistStamped")
        self.command(bag, "/vehicle/twist", "TwistWithCovarianceStamped", 20, factor=1.0)
        self.assert_taken(
            bag, "not taken: /a/vel: motion comes from /vehicle/twist (its speed is 1.2 times that one's, its turn rate is 1.2 times that one's)")

    def test_commands_alone_are_taken_and_said_to_be_commands(self):
        self.assert_taken(self.command(self.bag(), "/cmd_vel", factor=1.0), "twist: commands")

    def test_a_sensor_before_a_filter_and_before_the_truth(self):
        for topic in ("/odometry/filtered", "/ground_truth/state", "/odometry/global", "/ekf/odom", "/p3d_base_controller"):
            with self.subTest(topic):
                bag = self.bag().drive(10)
                bag.drive(100, pose=lambda t: (0, 0, 0), twist=lambda t: ((2, 0, 0), (0, 0, 0)), topic=topic)
                self.assert_taken(bag, f"not taken: {topic}")

    def test_one_that_stands_still_or_ends_early_does_not_drive(self):
        bag = self.bag().drive(10)
        bag.drive(100, pose=lambda t: (0, 0, 0), twist=NO_TWIST, topic="/a_still")
        self.assert_taken(bag.drive(100, when=lambda t: t < 2, topic="/b_short"))

    def test_poses_are_motion_where_the_user_says_so(self):
        bag = self.bag()
        for t in times():
            bag.pose(ns(t), "/vo/pose", place(t))
        _, said = self.take(bag, code=1)
        self.assertIn("--motion /vo/pose", said)
        recording, said = self.take(bag, "--motion", "/vo/pose")
        self.assert_end(recording, said)

    def test_a_speed_whose_direction_turns_as_it_does_is_of_axes_that_stay(self):
        def along(t, first=0.0):
            heading = place(t)[2] + first
            return (SPEED * np.cos(heading), SPEED * np.sin(heading), 0), (0, 0, turn_rate(t))
        for frame, first in (("base_link", 0.0), ("odom", 2.0)):
            with self.subTest(frame):
                bag = self.bag()
                for t in times():
                    twist = bag.twist(*along(t, first))
                    bag.put("/vel", "TwistStamped", ns(t), bag.m.make("TwistStamped", header=bag.m.header(ns(t), frame), twist=twist))
                self.assert_taken(bag, "on axes that stay")
        self.assert_taken(self.bag().drive(pose=lambda t: (0, 0, 0), twist=along), "on axes that stay")
        crab = self.bag()  # sideways in the turn, and about an axle that lies behind
        for t in times():
            v = (SPEED * np.cos(0.4 * turn_rate(t)), SPEED * np.sin(0.4 * turn_rate(t)) + 0.5 * turn_rate(t), 0)
            crab.put("/vel", "TwistStamped", ns(t), crab.m.make("TwistStamped", header=crab.m.header(ns(t), "base_link"), twist=crab.twist(v, (0, 0, turn_rate(t)))))
        self.assertNotIn("finding", self.take(crab)[1])

    def test_poses_and_twists_in_millimetres_are_named(self):
        bag = self.bag().drive(pose=lambda t: place(t) * np.array([1000, 1000, 1]), twist=lambda t: ((1000 * SPEED, 0, 0), (0, 0, turn_rate(t))))
        self.assertIn("finding: /odom: its largest speed is 1000 m/s, of no robot: is it in another unit", self.take(bag)[1])

    def test_joints_are_named_with_what_to_record(self):
        bag = self.bag().drive()
        bag.put("/joint_states", "sensor_msgs/JointState", ns(0), bag.m.make("sensor_msgs/JointState", name=["left"], position=np.ones(1), velocity=np.ones(1), effort=np.ones(1)))
        self.assertIn("not taken: /joint_states: sensor_msgs/msg/JointState: angles and speeds of joints: record the odometry", self.take(bag)[1])

    def test_motion_that_tf_alone_has_is_named(self):
        bag = self.bag()
        for t in times():
            bag.tf("odom", "base_link", in_plane(place(t)), topic="/tf", stamp=ns(t), log=ns(t))
            bag.imu(ns(t), ns(t), (0, 0, turn_rate(t)))
        self.assertIn("finding: tf: 'base_link' moves in 'odom', and no topic has that motion", self.take(bag)[1])

    def test_twists_in_a_frame_of_the_world_are_named(self):
        _, said = self.take(self.command(self.bag(), "/local/velocity", "TwistStamped", 20, factor=1.0, frame="map"))
        self.assertIn("finding: /local/velocity", said)


if __name__ == "__main__":
    unittest.main()
