#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Clocks of bags: set back and forth, a sensor's own, missing, coarse and doubled stamps.

    test_bag_clocks.py BIN_DIR"""

import unittest

import bag_files
import numpy as np
from bag_drives import SPEED, BagTest, ns, place, times, turn_rate
from bag_files import image
from rosbags.rosbag2 import StoragePlugin

import waymark

S = 1_000_000_000


def dark(bag, stamp, log):
    """A small picture."""
    bag.put("/cam/image_raw", "sensor_msgs/Image", log, image(stamp, "cam", np.zeros((8, 8), np.uint8), "mono8"))


class Steps(BagTest):
    """Stamps that jump while the log goes on."""

    def test_they_are_mended_and_said(self):
        kinds = {
            "back by 2 s": (lambda t: ns(t) - (2 * S if t > 5 else 0), "back by 2.00 s at 5.05 s"),
            "forward by 2 s": (lambda t: ns(t) + (2 * S if t > 5 else 0), "forward by 2.00 s at 5.05 s"),
            "back by 0.4 s in the turn": (lambda t: ns(t) - (2 * S // 5 if t > 12 else 0), "back by 0.400 s at 12.05 s"),
            "back and forth": (lambda t: ns(t) - (3 * S if 4 < t < 8 else 0), "forward by 3.00 s"),
            "back by an hour": (lambda t: ns(t) - (3600 * S if t > 11 else 0), "back by 3600 s"),
            "1970 for 3 s": (lambda t: ns(t) if t > 3 else int((t + 10) * S), "forward by 1699999990 s at 3.05 s"),
            "1970 for two messages": (lambda t: ns(t) if t > 0.05 else int((t + 10) * S), "forward by 1699999990 s at 0.10 s"),
            "0 at first": (lambda t: ns(t) if t > 0.2 else 0, "5 of its 301 messages have no stamp"),
            "a negative second of the sensor's": (lambda t: ns(t) + (S if t < 2 else 0), "back by 1.00 s at 2.00 s")}
        for name, (stamp, words) in kinds.items():
            with self.subTest(name):
                recording, _ = self.assert_taken(self.bag().drive(stamp=stamp), words)
                t_ns = recording.table("motion.csv")["t_ns"]
                np.testing.assert_allclose(np.diff(t_ns), S // 20, atol=3_000_000)

    def test_a_stall_of_the_recorder_is_no_step(self):
        recording, said = self.take(self.bag().drive(log=lambda t: ns(max(t, 9.0)) + round(20 * t) if 6 < t <= 9 else ns(t) + 1_000_000))
        self.assertNotIn("note", said)
        np.testing.assert_array_equal(recording.table("motion.csv")["t_ns"], [ns(t) for t in times()])

    def test_a_gap_of_a_sensor_is_no_step(self):
        _, said = self.take(self.bag().drive(when=lambda t: not 5 < t < 8))
        self.assertNotIn("note", said)

    def test_a_pause_of_all_that_the_odometry_drives_through(self):
        bag = self.bag().drive(late_ns=0, when=lambda t: not 5 < t < 7)
        for t in (1.3, 2.2, 3.1, 4.0, 4.9, 7.1, 8.0, 8.9, 9.8, 10.7):  # an answer, seldom: it steps there as everywhere
            bag.pose(ns(t), "/amcl_pose", place(t))
        self.assert_taken(bag, never=("the clock was set",))

    def test_all_clocks_jump(self):
        for name, jump in (("an hour", 3600 * S), ("a minute and a half", 90 * S), ("fifty years", 50 * 365 * 86400 * S)):
            with self.subTest(name):
                move = lambda t, j=jump: ns(t) + (j if t > 5 else 0) - (j if j > 1e18 else 0)  # noqa: E731
                bag = self.bag().drive(stamp=move, log=lambda t, f=move: f(t) + 2_000_000).turns(stamp=move, log=move)
                recording, _ = self.assert_taken(bag, "the clock was set; the later times are moved back", delta=0.03)
                self.assertLess(recording.meta["duration_s"], 15.2)

    def test_they_jump_twice(self):
        move = lambda t: ns(t) + (600 * S if t > 4 else 0) + (7200 * S if t > 11 else 0)  # noqa: E731
        self.assert_taken(self.bag().drive(stamp=move, log=move), "7200 s")

    def test_a_pause_of_the_recorder_stays(self):
        """The robot is elsewhere when the recorder goes on."""
        then = lambda t: ns(t) + (600 * S if t > 5 else 0)  # noqa: E731
        recording, said = self.take(self.bag().drive(stamp=then, log=then, pose=lambda t: place(t) + np.array([20 if t > 5 else 0, 0, 0])))
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
                    recording, said = self.assert_taken(self.drive(by_s, plugin), never=("spread evenly",), delta=0.03)
                    self.assertRegex(said, "set back by|the clock was set; the later times are moved back")
                    self.assertEqual(len(recording.table("imu.csv")["t_ns"]), 751)

    def test_parts_in_another_order_are_no_clock_that_was_set(self):
        bag = self.bag()
        bag.is_sorted = False
        for begin, end in ((0, 4), (8, 12), (4, 8), (12, 15.1)):
            bag.drive(when=lambda t, begin=begin, end=end: begin <= t < end)
        self.assert_taken(bag, never=("clock",))


class Recorded(BagTest):
    """Bags that were not recorded on the robot while it drove."""

    def test_a_log_at_another_pace_than_all_stamps_is_no_clock(self):
        paces = {"played twice as fast": (lambda t: ns(0) + 3600 * S + int(t * S / 2), "0.5 times"), "at half the pace": (
            lambda t: ns(0) + 5 * S + int(2 * t * S), "2 times"), "converted, 20 s later": (lambda t: ns(0) + 20 * S + int(0.02 * t * S), "0.02 times"),
            "one time of the log": (lambda t: ns(15), "at once"), "no time of the log": (lambda t: 0, "at once")}
        for name, (log, words) in paces.items():
            with self.subTest(name):
                bag = self.bag().drive(log=log).turns(log=log)
                for t in times():
                    bag.put("/cmd_vel", "Twist", log(t), bag.twist((1, 0, 0), (0, 0, 0)))
                recording, _ = self.assert_taken(bag, words, never=("finding", "/odom: ", "/imu/data: "), delta=0.02)
                np.testing.assert_array_equal(recording.table("imu.csv")["t_ns"], [ns(t) for t in times(50)])
                self.assertNotIn("arrival_ns", recording.table("motion.csv"))

    def test_a_file_out_of_order_is_no_clock_that_was_set(self):
        for step_s, chunking in ((0.5, False), (3, False), (3, True)):
            with self.subTest(step_s=step_s, chunking=chunking):
                bag, chance = self.bag().drive().turns(), np.random.default_rng(1)
                bag.items.sort(key=lambda item: item[0] + step_s * S * chance.uniform())
                path = bag.mcap(self.folder / "order.mcap", chunking=chunking)
                said, out = bag_files.BagTest.take(self, path, out=f"order-{step_s}-{chunking}")
                self.assertNotIn("clock", said)
                self.assert_end(waymark.Recording(out), said, 0.02)


class OwnClocks(BagTest):
    """A sensor whose stamps are not the computer's."""

    def with_imu(self, stamp, late=lambda t: 1_000_000):
        chance = np.random.default_rng(2)
        return self.bag().drive().turns(stamp=stamp, log=lambda t: ns(t) + late(t) + int(2e6 * chance.exponential()))

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
                recording, said = self.assert_taken(self.with_imu(stamp), delta=0.02)
                self.assertRegex(said, "(finding|note): /imu/data: its (clock is|stamps)")
                self.assertLess(np.abs(recording.table("imu.csv")["t_ns"] - [ns(t) for t in times(50)]).max(), 20_000_000, said)
        bag = self.bag().drive(stamp=lambda t: ns(0.98 * t), late_ns=1_000_000).turns()  # the odometry's own
        self.assert_taken(bag, "finding: /odom: its clock is 2 % too slow", delta=0.02)

    def test_a_drift_that_nothing_else_shows_is_named(self):
        for share, words in ((0.98, "a clock that runs 2 % slow"), (1.02, "its clock runs 2 % fast; its stamps are mended")):
            recording, said = self.take(self.bag().drive(stamp=lambda t, share=share: ns(share * t), late_ns=1_000_000))
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
        bag = self.bag().drive()
        for t in times(10):
            dark(bag, int((7 + t) * S), ns(t) + 2_000_000)
        recording, said = self.take(bag)
        self.assertIn("/cam/image_raw: its stamps are of a clock of its own", said)
        stamps = [frame.t_ns for frame in recording.frames("cam")]
        self.assertLess(np.abs(np.array(stamps) - [ns(t) for t in times(10)]).max(), 3_000_000)

    def test_a_simulator_s_time_stays(self):
        simulated = lambda t: int((30 + t) * S)  # noqa: E731
        bag = self.bag().drive(stamp=simulated, late_ns=0).turns(stamp=simulated, late_ns=0)
        for t in times(50):
            bag.put("/cmd_vel", "Twist", ns(t), bag.twist((1, 0, 0), (0, 0, 0)))
        recording, _ = self.assert_taken(bag, "simulated time", delta=0.02)
        self.assertEqual(recording.table("motion.csv")["t_ns"][0], 30 * S)


class Coarse(BagTest):
    """Stamps of a coarse clock, and rows that come twice."""

    def test_messages_of_one_stamp_get_the_log_s_times(self):
        for step in (S, S // 10, S // 5, S // 2, 2 * S):
            with self.subTest(step):
                bag = self.bag().drive(stamp=lambda t, step=step: ns(t) // step * step, late_ns=1_000_000)
                self.assert_taken(bag, f"steps of {step // 1_000_000} ms", "times of the log are used", never=("jump",), delta=0.03)

    def test_without_a_finer_log_they_are_spread(self):
        second = lambda t: ns(t) // S * S  # noqa: E731
        self.assert_taken(self.bag().drive(stamp=second, log=second), "spread evenly", delta=0.1)

    def test_messages_that_were_read_at_once_came_before(self):
        read = lambda t: ns(round(100 * t) // 5 * 5 / 100 + 0.04)  # noqa: E731
        for log, words in ((lambda t: read(t) + 1_000_000, "spread evenly"), (lambda t: ns(t) + 50_000_000, "times of the log are used")):
            recording, said = self.take(self.bag().drive().turns(100, stamp=read, log=log))
            self.assertIn(words, said)
            np.testing.assert_allclose(recording.table("imu.csv")["t_ns"][10:], [ns(t) for t in times(100)][10:],
                                       atol=11_000_000 if words == "spread evenly" else 1)

    def test_milliseconds_in_place_of_nanoseconds(self):
        self.assert_taken(self.bag().drive(stamp=lambda t: ns(t) // S * S + ns(t) % S // 1_000_000), "come in bursts", never=("jump",))

    def test_steps_of_16_ms_are_named(self):
        self.assert_taken(self.bag().drive(stamp=lambda t: ns(t) // 16_000_000 * 16_000_000, late_ns=1_000_000), "steps of 16 ms", delta=0.05)

    def test_an_exact_rate_is_no_coarse_clock(self):
        _, said = self.take(self.bag().drive(50))
        self.assertNotIn("steps", said)

    def test_rows_that_come_twice_count_once(self):
        for name, again in (("at once", 0), ("later", 500_000_000)):
            with self.subTest(name):
                recording, _ = self.assert_taken(self.bag().drive().drive(late_ns=2_000_000 + again), "301 of its 602 messages come twice")
                self.assertEqual(len(recording.table("motion.csv")["t_ns"]), 301)

    def test_unstamped_twists_have_the_log_s_times(self):
        bag = self.bag()
        for t in times():
            bag.put("/wheel_twist", "Twist", ns(t), bag.twist((SPEED, 0, 0), (0, 0, turn_rate(t))))
        self.assert_taken(bag, "no stamp")

    def test_headers_without_a_stamp_have_the_log_s_times(self):
        self.assert_taken(self.bag().drive(stamp=lambda t: 0), "note: /odom: its messages have no stamp: the times of the log are used")

    def test_stamps_that_never_change_are_none(self):
        bag = self.bag().drive(stamp=lambda t: ns(0))
        for t in times():
            dark(bag, ns(0), ns(t) + 2_000_000)
        recording, _ = self.assert_taken(bag, *(f"note: {topic}: its stamps never change: the times of the log are used" for topic in (
            "/odom", "/cam/image_raw")))
        self.assertEqual([frame.t_ns for frame in recording.frames("cam")], [ns(t) + 2_000_000 for t in times()])


if __name__ == "__main__":
    unittest.main()
