#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The Python package: tables, recordings, runs, and the MCAP that `waymark export` writes, read back by other software.

    test_package.py BIN_DIR"""

import io
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from common import ROOT, Drive, Folder
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from PIL import Image
from rosbags.highlevel import AnyReader

import waymark
from waymark.export import export
from waymark.export import main as export_main
from waymark.geometry import from_rpy, pose, quaternion, rotation, to_rpy
from waymark.mcapio.estimates import hypotheses, particles
from waymark.recording import can_line
from waymark.ros import Messages


class Tables(Folder):
    def test_values_go_through_without_a_loss(self):
        numbers = np.array([0.1, -0.0, 1e-300, np.pi, np.nan])
        table = {"t_ns": np.array([1, 2**61, 3, 4, 5]), "sensor": np.array(["a", "", "c", "d", "e"]), "x_m": numbers}
        waymark.write_table(self.folder / "a.csv", table)
        again = waymark.read_table(self.folder / "a.csv")
        for name, column in table.items():
            np.testing.assert_array_equal(again[name], column)

    def test_an_empty_identity_is_absent(self):
        (self.folder / "a.csv").write_text("t_ns,id,range_m\n1,,\n2,7,3\n")
        table = waymark.read_table(self.folder / "a.csv")
        self.assertEqual(table["id"].tolist(), [-1, 7])
        self.assertTrue(np.isnan(table["range_m"][0]))

    def test_errors_name_file_and_line(self):
        for text, where in (("t_ns,x_m\n1,2\n2,abc\n", "a.csv:3: 'abc'"), ("t_ns\n1\n1.5\n", "a.csv:3: '1.5'"),
                            ("t_ns\n1,2\n", "a.csv:2: 2 fields"), ("", "a.csv:1: there is no header")):
            (self.folder / "a.csv").write_text(text)
            with self.assertRaises(ValueError) as caught:
                waymark.read_table(self.folder / "a.csv")
            self.assertIn(where, str(caught.exception))


class Geometry(unittest.TestCase):
    def test_angles_and_quaternions_invert(self):
        chance = np.random.default_rng(1)
        for _ in range(200):
            rpy = chance.uniform([-3, -1.5, -3], [3, 1.5, 3])
            np.testing.assert_allclose(to_rpy(from_rpy(*rpy)), rpy, atol=1e-9)
            np.testing.assert_allclose(rotation(quaternion(from_rpy(*rpy))), from_rpy(*rpy), atol=1e-12)
        np.testing.assert_allclose(from_rpy(0, 0, np.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-15)
        np.testing.assert_allclose(from_rpy(0, np.pi / 2, 0) @ [1, 0, 0], [0, 0, -1], atol=1e-15)


def points_of(cloud):
    """Columns of a PointCloud2 by its fields' names, offsets and types."""
    kinds = {7: "<f4", 8: "<f8"}
    form = np.dtype({"names": [f.name for f in cloud.fields], "formats": [kinds[f.datatype] for f in cloud.fields],
                     "offsets": [f.offset for f in cloud.fields], "itemsize": cloud.point_step})
    return np.frombuffer(cloud.data.tobytes(), dtype=form)


def jpeg(grey, size=(64, 48)):
    out = io.BytesIO()
    Image.new("L", size, grey).save(out, "JPEG")
    return out.getvalue()


class Recordings(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-recording-")) / "drive"

    def test_what_is_written_is_read(self):
        pictures = [waymark.Frame(10**9 * i, 10**9 * i + 5, jpeg(20 * i)) for i in range(7)]
        frames = [waymark.CanFrame(1000, "can0", 0x123, False, b"\x01\x02"), waymark.CanFrame(2000, "can1", 0x18FF0001, True, b""),
                  waymark.CanFrame(3000, "can0", 0x7, False, bytes(range(12)), flags=1),
                  waymark.CanFrame(4000, "can0", 0x7, False, b"", remote=True)]
        with waymark.RecordingWriter(self.folder) as writer:
            for picture in pictures:
                writer.frame("front", picture)
            for frame in frames:
                writer.can(frame)
            writer.table("motion.csv", {"t_ns": np.array([2, 1]), "v_mps": np.array([0.5, 0.25]), "w_radps": np.zeros(2)})
            writer.calibration["sensors"] = {"front": {"mounting": {"xyz_m": [1, 0, 0]}}}
        again = waymark.Recording(self.folder)
        self.assertEqual(list(again.frames("front")), pictures)
        self.assertEqual(list(again.can()), frames)
        self.assertEqual(again.table("motion.csv")["v_mps"].tolist(), [0.25, 0.5])
        self.assertEqual(again.meta["streams"], ["calibration.yaml", "can.log", "motion.csv", "video/front.avi", "video/front.csv"])
        self.assertEqual(again.calibration["sensors"]["front"]["mounting"]["xyz_m"], [1, 0, 0])

    def test_a_writer_that_fails_leaves_no_recording(self):
        with self.assertRaises(ZeroDivisionError), waymark.RecordingWriter(self.folder):
            raise ZeroDivisionError
        with self.assertRaises(FileNotFoundError):
            waymark.Recording(self.folder)

    def test_pictures_of_two_sizes_and_names_outside_are_refused(self):
        with self.assertRaisesRegex(ValueError, "64 x 48"), waymark.RecordingWriter(self.folder) as writer:
            writer.frame("front", waymark.Frame(1, None, jpeg(1)))
            writer.frame("front", waymark.Frame(2, None, jpeg(1, (32, 32))))
        with self.assertRaisesRegex(ValueError, "outside"), waymark.RecordingWriter(self.folder.with_name("b")) as writer:
            writer.file("../../c", b"")

    def test_a_video_that_was_cut_off_ends_with_its_last_whole_picture(self):
        with waymark.RecordingWriter(self.folder) as writer:
            for i in range(5):
                writer.frame("front", waymark.Frame(i, None, jpeg(i)))
        video = self.folder / "video/front.avi"
        video.write_bytes(video.read_bytes()[:-10])
        self.assertEqual(len(list(waymark.Recording(self.folder).frames("front"))), 4)


class Export(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive()
        cls.addClassCleanup(cls.drive.close)
        cls.estimate, cls.recording = waymark.Run(cls.drive.run), waymark.Recording(cls.drive.recording)
        cls.file = cls.drive.folder / "run.mcap"
        export(cls.estimate, cls.file, cls.recording, pictures=True, can=True)

    def messages(self, topic):
        with AnyReader([self.file]) as bag:
            chosen = [connection for connection in bag.connections if connection.topic == topic]
            return [bag.deserialize(raw, connection.msgtype) for connection, _, raw in bag.messages(chosen)]

    def test_every_message_is_read_by_two_readers(self):
        with self.file.open("rb") as file:
            first = sum(1 for _ in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
        with AnyReader([self.file]) as bag:
            second = sum(bag.deserialize(raw, connection.msgtype) is not None for connection, _, raw in bag.messages())
            topics = {connection.topic for connection in bag.connections}
        self.assertEqual(first, second)
        self.assertGreater(first, 1000)
        self.assertLessEqual({"/tf", "/tf_static", "/waymark/pose", "/waymark/odom", "/waymark/fused_pose", "/waymark/status", "/waymark/bound",
                              "/diagnostics", "/landmarks", "/truth/pose", "/can0/frames", "/recording/sightings"}, topics)

    def test_poses_and_covariances_are_the_run_s(self):
        table, covariance = self.estimate.trajectory, waymark.covariance(self.estimate.trajectory)
        poses = self.messages("/waymark/fused_pose")
        self.assertEqual([p.header.stamp.sec * 10**9 + p.header.stamp.nanosec for p in poses], table["t_ns"].tolist())
        np.testing.assert_allclose([p.pose.pose.position.x for p in poses], table["x_m"], atol=1e-12)
        np.testing.assert_allclose([p.pose.covariance.reshape(6, 6) for p in poses], covariance, atol=1e-15)

    def test_frames_make_the_pose_and_odom_does_not_jump(self):
        def matrix(t):
            r = t.transform.rotation
            return pose((t.transform.translation.x, t.transform.translation.y, t.transform.translation.z), (r.x, r.y, r.z, r.w))

        last = None
        for frames, message in zip(self.messages("/tf"), self.messages("/waymark/pose"), strict=True):
            odom_in_map, base_in_odom = frames.transforms
            self.assertEqual([odom_in_map.child_frame_id, base_in_odom.child_frame_id], ["odom", "base_link"])
            base = matrix(odom_in_map) @ matrix(base_in_odom)
            np.testing.assert_allclose(base[:2, 3], [message.pose.pose.position.x, message.pose.pose.position.y], atol=1e-9)
            place = matrix(base_in_odom)[:2, 3]
            self.assertTrue(last is None or np.linalg.norm(place - last) < 0.1)
            last = place

    def test_points_are_those_of_paths_and_landmarks(self):
        for topic, places in (("/waymark/path", lambda m: [pose.pose.position for pose in m.poses]),
                              ("/truth/path", lambda m: [pose.pose.position for pose in m.poses]),
                              ("/landmarks", lambda m: [marker.pose.position for marker in m.markers if marker.ns == "landmarks"])):
            drawn, clouds = self.messages(topic), self.messages(topic + "/points")
            self.assertEqual(len(drawn), len(clouds), topic)
            self.assertTrue(drawn, topic)
            for message, cloud in zip(drawn, clouds, strict=True):
                self.assertEqual([cloud.header.frame_id, cloud.height, cloud.point_step * cloud.width],
                                 ["map", 1, len(cloud.data)])
                table = points_of(cloud)
                np.testing.assert_allclose(np.column_stack([table["x"], table["y"], table["z"]]),
                                           [(p.x, p.y, p.z) for p in places(message)], rtol=1e-6, atol=1e-6)
        names = [marker.text for marker in self.messages("/landmarks")[0].markers if marker.text]
        self.assertEqual([str(int(n)) for n in points_of(self.messages("/landmarks/points")[0])["id"]], names)

    def test_command_line(self):
        out = self.drive.folder / "b.mcap"
        self.assertEqual(export_main([str(self.drive.run), "--mcap", str(out)]), 0)
        with self.assertRaises(SystemExit):
            export_main([str(self.drive.run), "--mcap", str(out)])
        self.assertEqual(export_main([str(self.drive.recording), "--mcap", str(self.drive.folder / "c.mcap")]), 1)
        self.assertFalse((self.drive.folder / "c.mcap").exists())


class Particles(unittest.TestCase):
    def test_points_of_a_cloud_and_of_hypotheses_a_stamp(self):
        chance, n = np.random.default_rng(1), 7
        table = {"t_ns": np.array([5, 5, 5, 9, 9, 9, 9]), **{name: chance.uniform(-2, 2, n) for name in (
            "x_m", "y_m", "heading_rad", "weight", "cov_xx", "cov_xy", "cov_yy")}}
        for make, topic, columns in ((particles, "/waymark/particles", ["heading", "weight"]), (hypotheses, "/waymark/hypotheses", ["weight"])):
            items = [item for item in make(Messages(), table) if item.topic == topic + "/points"]
            self.assertEqual([item.log_ns for item in items], [5, 9])
            for item, rows in zip(items, (slice(0, 3), slice(3, 7)), strict=True):
                points = points_of(item.message)
                self.assertEqual(list(points.dtype.names), ["x", "y", "z", *columns])
                for name, column in (("x", "x_m"), ("y", "y_m"), ("weight", "weight")):
                    np.testing.assert_array_equal(points[name], table[column][rows].astype(np.float32))


class CandumpLines(unittest.TestCase):
    def test_lines_are_candump_s(self):
        self.assertEqual(can_line(waymark.CanFrame(1_500_000_001_000, "can0", 0x12, False, b"\xab")), "(1500.000001) can0 012#AB\n")
        self.assertEqual(can_line(waymark.CanFrame(0, "can0", 0x12, True, b"", flags=1)), "(0.000000) can0 00000012##1\n")


class Wheel(unittest.TestCase):
    def test_it_is_built_and_small(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder], cwd=ROOT / "tools/python",
                           check=True, capture_output=True)
            (wheel,) = pathlib.Path(folder).glob("*.whl")
            self.assertLess(wheel.stat().st_size, 6e6)


if __name__ == "__main__":
    unittest.main()
