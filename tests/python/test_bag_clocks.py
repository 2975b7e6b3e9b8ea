#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Clocks of bags: set back and forth, a sensor's own, missing, coarse and doubled stamps.

    test_bag_clocks.py BIN_DIR"""

import unittest

import numpy as np
from bag_drives import END, SPEED, STILL, BagTest, matrix, ns, place, times, turn_rate
from rosbags.rosbag2 import StoragePlugin

S = 1_000_000_000


class Steps(BagTest):
    """Stamps that jump while the log goes on."""

    def put(self, stamp, log=lambda i, t: ns(t) + 2_000_000, rate_hz=20.0):
        bag = self.bag()
        for i, t in enumerate(times(rate_hz)):
            bag.odometry(stamp(i, t), log(i, t), place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        return bag

    def test_they_are_mended_and_said(self):
        kinds = {
            "back by 2 s": (lambda i, t: ns(t) - (2 * S if t > 5 else 0), "back by 2.00 s at 5.05 s"),
            "forward by 2 s": (lambda i, t: ns(t) + (2 * S if t > 5 else 0), "forward by 2.00 s at 5.05 s"),
            "back by 0.4 s in the turn": (lambda i, t: ns(t) - (2 * S // 5 if t > 12 else 0), "back by 0.400 s at 12.05 s"),
            "back and forth": (lambda i, t: ns(t) - (3 * S if 4 < t < 8 else 0), "forward by 3.00 s"),
            "back by an hour": (lambda i, t: ns(t) - (3600 * S if t > 11 else 0), "back by 3600 s"),
            "1970 for 3 s": (lambda i, t: ns(t) if t > 3 else int((t + 10) * S), "forward by 1699999990 s at 3.05 s"),
            "1970 for two messages": (lambda i, t: ns(t) if i > 1 else int((t + 10) * S), "forward by 1699999990 s at 0.10 s"),
            "0 at first": (lambda i, t: ns(t) if i > 4 else 0, "5 of its 301 messages have no stamp"),
            "a negative second of the sensor's": (lambda i, t: ns(t) + (S if t < 2 else 0), "back by 1.00 s at 2.00 s")}
        for name, (stamp, words) in kinds.items():
            with self.subTest(name):
                recording, said = self.take(self.put(stamp))
                self.assertIn(words, said)
                self.assert_end(recording, said)
                t_ns = recording.table("motion.csv")["t_ns"]
                np.testing.assert_allclose(np.diff(t_ns), S // 20, atol=3_000_000)

    def test_a_stall_of_the_recorder_is_no_step(self):
        bag = self.put(lambda i, t: ns(t), lambda i, t: ns(max(t, 9.0)) + i if 6 < t <= 9 else ns(t) + 1_000_000)
        recording, said = self.take(bag)
        self.assertNotIn("note", said)
        np.testing.assert_array_equal(recording.table("motion.csv")["t_ns"], [ns(t) for t in times()])

    def test_a_gap_of_a_sensor_is_no_step(self):
        bag = self.bag()
        for t in times():
            if not 5 < t < 8:
                bag.odometry(ns(t), ns(t), place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        _, said = self.take(bag)
        self.assertNotIn("note", said)

    def test_a_pause_of_all_that_the_odometry_drives_through(self):
        bag = self.bag()
        for t in times():
            if not 5 < t < 7:
                bag.odometry(ns(t), ns(t), place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        for t in (1.3, 2.2, 3.1, 4.0, 4.9, 7.1, 8.0, 8.9, 9.8, 10.7):  # an answer, seldom: it steps there as everywhere
            x, y, heading = place(t)
            bag.put("/amcl_pose", "PoseStamped", ns(t), bag.m.make("PoseStamped", header=bag.m.header(ns(t), "map"),
                                                                   pose=bag.m.pose_of(matrix((x, y, 0), (0, 0, heading)))))
        recording, said = self.take(bag)
        self.assertNotIn("the clock was set", said)
        self.assert_end(recording, said)

    def test_all_clocks_jump(self):
        for name, jump in (("an hour", 3600 * S), ("a minute and a half", 90 * S), ("fifty years", 50 * 365 * 86400 * S)):
            with self.subTest(name):
                move = lambda t, j=jump: ns(t) + (j if t > 5 else 0) - (j if j > 1e18 else 0)  # noqa: E731
                bag = self.put(lambda i, t, f=move: f(t), lambda i, t, f=move: f(t) + 2_000_000)
                for t in times(50):
                    bag.imu(move(t), move(t), (0, 0, turn_rate(t)))
                recording, said = self.take(bag)
                self.assertIn("the clock was set; the later times are moved back", said)
                self.assertLess(recording.meta["duration_s"], 15.2)
                self.assert_end(recording, said, 0.03)

    def test_they_jump_twice(self):
        move = lambda t: ns(t) + (600 * S if t > 4 else 0) + (7200 * S if t > 11 else 0)  # noqa: E731
        recording, said = self.take(self.put(lambda i, t: move(t), lambda i, t: move(t)))
        self.assertIn("7200 s", said)
        self.assert_end(recording, said)

    def test_a_pause_of_the_recorder_stays(self):
        """The robot is elsewhere when the recorder goes on."""
        moved = self.bag()
        for t in times():
            x, y, heading = place(t)
            then = ns(t) + (600 * S if t > 5 else 0)
            moved.odometry(then, then, (x + (20 if t > 5 else 0), y, heading), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        recording, said = self.take(moved)
        self.assertIn("a pause of the recorder", said)
        self.assertGreater(recording.meta["duration_s"], 600)


class OfTheRecorder(BagTest):
    """The clock of stamps and log is set while it records."""

    def drive(self, by_s, plugin=StoragePlugin.MCAP):
        bag = self.bag()
        bag.is_sorted, bag.plugin = False, plugin
        for t, sensor in sorted([(t, 0) for t in times()] + [(t, 1) for t in times(50)]):
            now = ns(t) + (int(by_s * S) if t > 6 else 0)
            if sensor:
                bag.imu(now, now + 1_000_000, (0, 0, turn_rate(t)))
            else:
                bag.odometry(now, now + 2_000_000, place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        return bag

    def test_what_comes_later_continues_what_came_before(self):
        for by_s in (-2, -30, -3600, 3, 30, 40_000_000):
            for plugin in (StoragePlugin.MCAP, StoragePlugin.SQLITE3):
                with self.subTest(by_s=by_s, plugin=plugin.name):
                    recording, said = self.take(self.drive(by_s, plugin))
                    self.assertRegex(said, "set back by|the clock was set; the later times are moved back")
                    self.assertNotIn("spread evenly", said)
                    self.assert_end(recording, said, 0.03)
                    self.assertEqual(len(recording.table("imu.csv")["t_ns"]), 751)

    def test_parts_in_another_order_are_no_clock_that_was_set(self):
        bag = self.bag()
        bag.is_sorted = False
        for begin, end in ((0, 4), (8, 12), (4, 8), (12, 15.1)):
            for t in times():
                if begin <= t < end:
                    bag.odometry(ns(t), ns(t) + 2_000_000, place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        recording, said = self.take(bag)
        self.assertNotIn("clock", said)
        self.assert_end(recording, said)


class OwnClocks(BagTest):
    """A sensor whose stamps are not the computer's."""

    def with_imu(self, stamp, late=lambda t: 1_000_000):
        bag = self.bag()
        bag.drive()
        chance = np.random.default_rng(2)
        for t in times(50):
            delay = late(t) + int(2e6 * chance.exponential())
            bag.imu(stamp(t), ns(t) + delay, (0, 0, turn_rate(t)), STILL)
        return bag

    def test_it_is_moved_onto_the_others(self):
        kinds = {"since its boot": lambda t: int((100 + t) * S), "an hour ahead": lambda t: ns(t) + 3600 * S, "a leap second's GPS time": lambda t: ns(
            t) - 315_964_782 * S, "1.5 s ahead": lambda t: ns(t) + 3 * S // 2, "200 ppm fast": lambda t: int((100 + t * 1.0002) * S),
            "a day behind": lambda t: ns(t) - 86400 * S}
        for name, stamp in kinds.items():
            with self.subTest(name):
                recording, said = self.take(self.with_imu(stamp))
                self.assertIn("note: /imu/data: its stamps are of a clock of its own", said)
                self.assertLess(np.abs(recording.table("imu.csv")["t_ns"] - [ns(t) for t in times(50)]).max(), 8_000_000)
                self.assertLess(recording.meta["duration_s"], 15.1)
        self.assert_end(recording, said, 0.02)

    def test_turns_tell_a_clock_from_a_delay(self):
        """Stamps behind the log are late, or of a clock that is off: the turns of both topics say which."""
        kinds = {"2 % slow": lambda t: ns(0.98 * t), "2 % fast": lambda t: ns(1.02 * t), "0.4 s behind": lambda t: ns(t) - 4 * S // 10,
                 "3 s behind": lambda t: ns(t) - 3 * S, "microseconds for nanoseconds": lambda t: int((100 + t) * 1e6),
                 "since its boot, 2 % slow": lambda t: int((100 + 0.98 * t) * S)}
        for name, stamp in kinds.items():
            with self.subTest(name):
                recording, said = self.take(self.with_imu(stamp))
                self.assertRegex(said, "(finding|note): /imu/data: its (clock is|stamps)")
                self.assertLess(np.abs(recording.table("imu.csv")["t_ns"] - [ns(t) for t in times(50)]).max(), 20_000_000, said)
                self.assert_end(recording, said, 0.02)
        bag = self.bag()  # the odometry's own
        for t in times():
            bag.odometry(ns(0.98 * t), ns(t) + 1_000_000, place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        for t in times(50):
            bag.imu(ns(t), ns(t) + 1_000_000, (0, 0, turn_rate(t)))
        recording, said = self.take(bag)
        self.assertIn("finding: /odom: its clock is 2 % too slow", said)
        self.assert_end(recording, said, 0.02)

    def test_a_drift_that_nothing_else_shows_is_named(self):
        for share, words in ((0.98, "a clock that runs 2 % slow"), (1.02, "its clock runs 2 % fast; its stamps are mended")):
            bag = self.bag()
            for t in times():
                bag.odometry(ns(share * t), ns(t) + 1_000_000, place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
            recording, said = self.take(bag)
            self.assertIn(words, said)
        self.assert_end(recording, said, 0.02)

    def test_drift_is_taken_out(self):
        """Two minutes with a clock that is 500 ppm fast: 60 ms at the end."""
        bag = self.bag()
        for t in np.arange(0, 120, 0.1):
            bag.odometry(ns(t), ns(t) + 1_000_000, (t, 0, 0), (1, 0, 0), (0, 0, 0))
            bag.imu(int((50 + t * 1.0005) * S), ns(t) + 1_000_000, (0, 0, 0.001))
        recording, said = self.take(bag)
        self.assertIn("500 ppm too fast", said)
        self.assertLess(np.abs(recording.table("imu.csv")["t_ns"] - [ns(t) for t in np.arange(0, 120, 0.1)]).max(), 3_000_000)

    def test_delays_are_no_clock(self):
        recording, said = self.take(self.with_imu(ns, late=lambda t: 300_000_000))
        self.assertNotIn("note: /imu/data: its stamps", said)
        np.testing.assert_array_equal(recording.table("imu.csv")["t_ns"], [ns(t) for t in times(50)])

    def test_a_queue_that_nobody_empties_is_named(self):
        bag = self.bag()
        for t in np.arange(0, 60, 0.05):
            bag.odometry(ns(t), ns(t * 1.05), (t, 0, 0), (1, 0, 0), (0, 0, 0))
        _, said = self.take(bag)
        self.assertIn("a queue that is read too slowly", said)

    def test_pictures_and_tags_follow_their_clock(self):
        bag = self.bag()
        bag.drive()
        for t in times(10):
            bag.put("/cam/image_raw", "sensor_msgs/Image", ns(t) + 2_000_000, bag.m.make(
                "sensor_msgs/Image", header=bag.m.header(int((7 + t) * S), "cam"), height=8, width=8, encoding="mono8", step=8, data=np.zeros(64, np.uint8)))
        recording, said = self.take(bag)
        self.assertIn("/cam/image_raw: its stamps are of a clock of its own", said)
        stamps = [frame.t_ns for frame in recording.frames("cam")]
        self.assertLess(np.abs(np.array(stamps) - [ns(t) for t in times(10)]).max(), 3_000_000)

    def test_a_simulator_s_time_stays(self):
        bag = self.bag()
        for t in times():
            bag.odometry(int((30 + t) * S), ns(t), place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        for t in times(50):
            bag.imu(int((30 + t) * S), ns(t), (0, 0, turn_rate(t)))
            bag.put("/cmd_vel", "Twist", ns(t), bag.twist((1, 0, 0), (0, 0, 0)))
        recording, said = self.take(bag)
        self.assertIn("simulated time", said)
        self.assertEqual(recording.table("motion.csv")["t_ns"][0], 30 * S)
        self.assert_end(recording, said, 0.02)


class Coarse(BagTest):
    """Stamps of a coarse clock, and rows that come twice."""

    def test_messages_of_one_stamp_get_the_log_s_times(self):
        for step in (S, S // 10, S // 5, S // 2, 2 * S):
            with self.subTest(step):
                bag = self.bag()
                for t in times():
                    bag.odometry(ns(t) // step * step, ns(t) + 1_000_000, place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
                recording, said = self.take(bag)
                self.assertIn(f"steps of {step // 1_000_000} ms", said)
                self.assertIn("times of the log are used", said)
                self.assertNotIn("jump", said)
                self.assert_end(recording, said, 0.03)

    def test_without_a_finer_log_they_are_spread(self):
        bag = self.bag()
        for t in times():
            stamp = ns(t) // S * S
            bag.odometry(stamp, stamp, place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        recording, said = self.take(bag)
        self.assertIn("spread evenly", said)
        self.assert_end(recording, said, 0.1)

    def test_messages_that_were_read_at_once_came_before(self):
        for late_ns, words in ((1_000_000, "spread evenly"), (None, "times of the log are used")):
            bag = self.bag()
            bag.drive()
            for i, t in enumerate(times(100)):
                read = ns(i // 5 * 5 / 100 + 0.04)
                bag.imu(read, ns(t) + 50_000_000 if late_ns is None else read + late_ns, (0, 0, turn_rate(t)))
            recording, said = self.take(bag)
            self.assertIn(words, said)
            imu = recording.table("imu.csv")
            np.testing.assert_allclose(imu["t_ns"][10:], [ns(t) for t in times(100)][10:], atol=11_000_000 if late_ns is None else 1)

    def test_milliseconds_in_place_of_nanoseconds(self):
        bag = self.bag()
        for t in times():
            bag.odometry(ns(t) // S * S + ns(t) % S // 1_000_000, ns(t) + 2_000_000, place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        recording, said = self.take(bag)
        self.assertIn("come in bursts", said)
        self.assertNotIn("jump", said)
        self.assert_end(recording, said)

    def test_steps_of_16_ms_are_named(self):
        bag = self.bag()
        for t in times():
            bag.odometry(ns(t) // 16_000_000 * 16_000_000, ns(t) + 1_000_000, place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        recording, said = self.take(bag)
        self.assertIn("steps of 16 ms", said)
        self.assert_end(recording, said, 0.05)

    def test_an_exact_rate_is_no_coarse_clock(self):
        bag = self.bag()
        bag.drive(50)
        _, said = self.take(bag)
        self.assertNotIn("steps", said)

    def test_rows_that_come_twice_count_once(self):
        for name, again in (("at once", 0), ("later", 500_000_000)):
            with self.subTest(name):
                bag = self.bag()
                bag.drive()
                bag.drive(late_ns=2_000_000 + again)
                recording, said = self.take(bag)
                self.assertIn("301 of its 602 messages come twice", said)
                self.assertEqual(len(recording.table("motion.csv")["t_ns"]), 301)
                self.assert_end(recording, said)

    def test_unstamped_twists_have_the_log_s_times(self):
        bag = self.bag()
        for t in times():
            bag.put("/wheel_twist", "Twist", ns(t), bag.twist((SPEED, 0, 0), (0, 0, turn_rate(t))))
        recording, said = self.take(bag)
        self.assertIn("no stamp", said)
        self.assert_end(recording, said, end=END)

    def test_headers_without_a_stamp_have_the_log_s_times(self):
        bag = self.bag()
        for t in times():
            bag.odometry(0, ns(t) + 2_000_000, place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
        recording, said = self.take(bag)
        self.assertIn("note: /odom: its messages have no stamp: the times of the log are used", said)
        self.assert_end(recording, said)

    def test_stamps_that_never_change_are_none(self):
        bag = self.bag()
        for t in times():
            bag.odometry(ns(0), ns(t) + 2_000_000, place(t), (SPEED, 0, 0), (0, 0, turn_rate(t)))
            bag.put("/cam/image_raw", "sensor_msgs/Image", ns(t) + 2_000_000, bag.m.make(
                "sensor_msgs/Image", header=bag.m.header(ns(0), "cam"), height=8, width=8, encoding="mono8", step=8, data=np.zeros(64, np.uint8)))
        recording, said = self.take(bag)
        for topic in ("/odom", "/cam/image_raw"):
            self.assertIn(f"note: {topic}: its stamps never change: the times of the log are used", said)
        self.assertEqual([frame.t_ns for frame in recording.frames("cam")], [ns(t) + 2_000_000 for t in times()])
        self.assert_end(recording, said)


if __name__ == "__main__":
    unittest.main()
