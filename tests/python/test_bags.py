#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark import`: bags that other software wrote, and files of `waymark export`, as recordings.

    test_bags.py BIN_DIR"""

import functools
import io
import subprocess
import unittest

import numpy as np
from bag_files import BIN, M, START_NS, BagTest, Events, camera_info, corners_of, image, imported, register, write_mcap
from common import Drive
from PIL import Image
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin

import waymark
from waymark.export import export
from waymark.geometry import OPTICAL, from_rpy


def robot_bag(folder, plugin, twist=True, late_ns=3_000_000):
    """A bag as a robot with ROS 2 records it: odometry, camera, GNSS, tags, CAN, mountings, and what nobody takes."""
    events = Events()
    put = functools.partial(events.put, late_ns=late_ns)
    body = np.eye(4)
    body[:3, :3], body[:3, 3] = from_rpy(0, 0.2, 0.5) @ OPTICAL, (0.3, 0.1, 0.4)
    turned = np.eye(4)
    turned[:3, :3] = from_rpy(np.pi, 0, 0)
    put("/tf_static", "TFMessage", START_NS, M.make("TFMessage", transforms=[
        M.transform(0, "base_link", "front_optical", body), M.transform(0, "base_link", "imu", turned)]))
    for i in range(50):
        t_ns, header = START_NS + i * 20_000_000, M.header(START_NS + i * 20_000_000, "front_optical")
        speed = M.make("TwistWithCovariance")
        if twist:
            speed.twist.linear.x, speed.twist.angular.z = 0.5, 0.1 + i / 1000
        place = M.make("PoseWithCovariance", pose=M.pose((0.01 * i, 0, 0), (0, 0, 0, 1)))
        put("/odom", "Odometry", t_ns, M.make("Odometry", header=M.header(t_ns, "odom"), pose=place, twist=speed))
        picture = np.full((48, 64, 3), (5 * i, 40, 40), dtype=np.uint8)
        put("/front/image_raw", "sensor_msgs/Image", t_ns, image(t_ns, "front_optical", picture, "rgb8", width=64))
        put("/front/camera_info", "CameraInfo", t_ns, camera_info(t_ns, "front_optical", d=(0.1, 0, 0, 0, 0)))
        put("/fix", "NavSatFix", t_ns, M.make("NavSatFix", header=header, latitude=48.0 + i * 1e-6, longitude=11.0 + i * 1e-6, altitude=500.0,
                                              position_covariance_type=2, position_covariance=np.diag([4.0, 4, 9]).ravel()))
        events.tags("/front/detections", t_ns, "front_optical", ((1, 4), (3, 4), (3, 2), (1, 2)), late_ns=late_ns)
        put("/can0/frames", "can_msgs/Frame", t_ns, M.make("can_msgs/Frame", header=header, id=0x123, dlc=2,
                                                           data=np.array([1, 2, 0, 0, 0, 0, 0, 0], dtype=np.uint8)))
        put("/imu", "Imu", t_ns, M.make(
            "Imu", header=M.header(t_ns, "imu"), angular_velocity=M.make("Vector3", z=-0.1),
            angular_velocity_covariance=np.diag([1e-4, 1e-4, 1e-4]).ravel(), linear_acceleration_covariance=np.full(9, -1.0)))
        put("/scan", "LaserScan", t_ns, M.make("LaserScan", header=header))
        put("/vicon", "PoseStamped", t_ns, M.make("PoseStamped", header=header, pose=M.pose((1, 2, 0), (0, 0, 0, 1))))
    return events.folder(folder, plugin)


class Robots(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = Drive()
        cls.addClassCleanup(cls.drive.close)
        cls.bags = {name: robot_bag(cls.drive.folder / name, plugin)
                    for name, plugin in (("mcap", StoragePlugin.MCAP), ("sqlite", StoragePlugin.SQLITE3))}

    def out(self, name):
        return self.drive.folder / f"{self.id()}-{name}"

    def test_all_that_a_recording_has_a_place_for_is_taken(self):
        for name, bag in self.bags.items():
            code, text = imported(bag, "--out", self.out(name), "--truth", "/vicon")
            self.assertEqual(code, 0, text)
            recording = waymark.Recording(self.out(name))
            motion, gnss, corners = (recording.table(f"{kind}.csv") for kind in ("motion", "gnss", "marker-corners"))
            np.testing.assert_allclose(motion["w_radps"], 0.1 + np.arange(50) / 1000)
            self.assertEqual(motion["t_ns"][1] - START_NS, 20_000_000)
            self.assertEqual((motion["arrival_ns"] - motion["t_ns"]).tolist(), [3_000_000] * 50)
            # One degree of latitude is 111 195 m at 48 degrees, one of longitude 74 626 m (WGS84, at 500 m).
            self.assertAlmostEqual(gnss["y_m"][-1], 49e-6 * 111_203.5, delta=5e-4)
            self.assertAlmostEqual(gnss["x_m"][-1], 49e-6 * 74_634.6, delta=5e-4)
            self.assertEqual((gnss["sigma_xy_m"][0], gnss["sigma_z_m"][0]), (2, 3))
            # The library draws tag36h11 the other way up, and its pixels' middles are at a half.
            self.assertEqual(corners_of(corners).tolist(), [[2.5, 3.5], [0.5, 3.5], [0.5, 1.5], [2.5, 1.5]])
            camera = recording.calibration["cameras"]["front"]
            self.assertEqual(camera["intrinsics"], [50, 51, 32, 24])
            np.testing.assert_allclose(camera["mounting"]["rpy_deg"], np.degrees([0, 0.2, 0.5]), atol=1e-6)
            np.testing.assert_allclose(camera["mounting"]["xyz_m"], [0.3, 0.1, 0.4])
            frames = list(recording.frames("front"))
            self.assertEqual(len(frames), 50)
            grey = np.asarray(Image.open(io.BytesIO(frames[40].jpeg)))
            self.assertAlmostEqual(float(grey.mean()), 0.299 * 200 + 0.701 * 40, delta=1.5)
            self.assertEqual([frame.data for frame in recording.can()], [b"\x01\x02"] * 50)
            imu = recording.table("imu.csv")
            self.assertEqual(list(imu), ["t_ns", "wx_radps", "wy_radps", "wz_radps", "sigma_wx_radps", "sigma_wy_radps",
                                         "sigma_wz_radps", "arrival_ns"])
            self.assertEqual((imu["wz_radps"][0], imu["sigma_wz_radps"][0]), (-0.1, 0.01))
            self.assertEqual(abs(recording.calibration["imu"]["mounting"]["rpy_deg"][0]), 180)
            self.assertEqual(len(recording.table("truth.csv")["t_ns"]), 50)
            self.assertIn("not taken: /scan", text)

    def test_the_same_bag_makes_the_same_bytes(self):
        for name in "ab":
            self.assertEqual(imported(self.bags["mcap"], "--out", self.out(name))[0], 0)
        done = subprocess.run(["diff", "-r", "-x", "recording.yaml", self.out("a"), self.out("b")], capture_output=True, check=False)
        self.assertEqual((done.returncode, done.stdout), (0, b""))

    def test_odometry_without_a_twist_has_its_poses_differences(self):
        bag = robot_bag(self.drive.folder / "still", StoragePlugin.MCAP, twist=False)
        code, text = imported(bag, "--out", self.out("a"))
        self.assertEqual(code, 0, text)
        np.testing.assert_allclose(waymark.Recording(self.out("a")).table("motion.csv")["v_mps"], 0.5, atol=1e-12)
        self.assertIn("differences of its poses", text)

    def test_stamps_of_a_simulator_s_clock_have_no_arrivals(self):
        bag = robot_bag(self.drive.folder / "simulated", StoragePlugin.MCAP, late_ns=10**15)
        code, text = imported(bag, "--out", self.out("a"))
        self.assertEqual(code, 0, text)
        recording = waymark.Recording(self.out("a"))
        for table in ("motion.csv", "gnss.csv", "imu.csv", "marker-corners.csv"):
            self.assertNotIn("arrival_ns", recording.table(table), table)
        self.assertEqual({frame.arrival_ns for frame in recording.frames("front")} - {frame.t_ns for frame in recording.frames("front")}, set())
        self.assertIn("note: /odom: its stamps are of another clock", text)

    def test_a_topic_that_is_not_there_is_named(self):
        code, text = imported(self.bags["mcap"], "--out", self.out("a"), "--motion", "/odometry")
        self.assertEqual(code, 1)
        self.assertIn("/odom", text)
        self.assertFalse(self.out("a").exists())


class Hostile(BagTest):
    """Bags whose container is whole and whose messages are not what they say."""

    def import_one(self, topic, kind, definition, data):
        """What `waymark import` says to a bag with this one message."""
        text, out = self.take(write_mcap(self.folder / "bag.mcap", [(START_NS, topic, "cdr", kind, "ros2msg", definition, data)]), code=1)
        self.assertFalse(out.exists(), text)
        return text

    def test_another_type_by_the_same_name_is_named(self):
        kind = "nav_msgs2/msg/Odometry"
        register({kind: "std_msgs/Header header\nfloat64 speed\n"})
        data = M.encode(M.make(kind, header=M.header(START_NS, "odom"), speed=1.0), kind)
        text = self.import_one("/odom", "nav_msgs/msg/Odometry", M.definition(kind).replace(b"nav_msgs2", b"nav_msgs"), data)
        self.assertIn("/odom", text)
        self.assertIn("nav_msgs/msg/Odometry", text)

    def test_a_definition_that_is_none(self):
        self.assertIn("waymark import: ", self.import_one("/odom", "nav_msgs/msg/Odometry", b"float63 x[[[\n", b"\0\1\0\0"))

    def test_sizes_that_the_bytes_don_t_have(self):
        picture, kind = image(START_NS, "front", np.zeros((48, 64), dtype=np.uint8), "mono8"), "sensor_msgs/msg/Image"
        whole = M.encode(picture, kind)
        length = whole.index((48 * 64).to_bytes(4, "little"))
        huge_data = whole[:length] + b"\xff\xff\xff\xff" + whole[length + 4:]
        picture.height = 4_000_000_000
        for data in (huge_data, M.encode(picture, kind), whole[:60], b""):
            text = self.import_one("/front/image_raw", kind, M.definition(kind), data)
            self.assertIn("/front/image_raw", text)


class OwnExports(unittest.TestCase):
    def test_a_recording_of_an_export_gives_the_same_poses(self):
        drive = Drive()
        self.addCleanup(drive.close)
        export(waymark.Run(drive.run), drive.folder / "run.mcap", waymark.Recording(drive.recording), pictures=True, can=True)
        code, text = imported(drive.folder / "run.mcap", "--out", drive.folder / "again")
        self.assertEqual(code, 0, text)
        drive.replay(drive.folder / "again", drive.folder / "run-again")
        self.assertEqual((drive.run / "trajectory.csv").read_bytes(), (drive.folder / "run-again/trajectory.csv").read_bytes())
        done = subprocess.run([BIN / "waymark", "check", drive.folder / "robot.yaml", drive.folder / "again", "--quick"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_frames_of_errors_and_axes_of_mounted_sensors_stay_what_they_are(self):
        drive = Drive()
        self.addCleanup(drive.close)
        kept = waymark.Recording(drive.recording)
        lines = ["20000080#0000080000000000", "100##1" + "11" * 12, "100#" + "22" * 12, "102#R"]
        last = list(kept.can())[-1].t_ns // 1000
        with (drive.recording / "can.log").open("a") as log:
            log.writelines(f"({(last + k) // 10**6}.{(last + k) % 10**6:06d}) can0 {line}\n" for k, line in enumerate(lines))
        with (drive.recording / "calibration.yaml").open("a") as calibration:
            calibration.write("imu: {mounting: {rpy_deg: [180, 0, 90]}}\ngnss: {mounting: {xyz_m: [0.1, -0.2, 1.5]}}\n")
        waymark.write_table(drive.recording / "imu.csv", {"t_ns": np.array([last * 1000]), **{f"w{axis}_radps": np.zeros(1) for axis in "xyz"}})
        meta = drive.recording / "recording.yaml"
        meta.write_text(meta.read_text().replace("streams: [", "streams: [imu.csv, "))
        export(waymark.Run(drive.run), drive.folder / "run.mcap", waymark.Recording(drive.recording), can=True)
        read = {}
        with AnyReader([drive.folder / "run.mcap"], default_typestore=M.store) as bag:
            for connection, _, data in bag.messages():
                read.setdefault(connection.topic, []).append(bag.deserialize(data, connection.msgtype))
        mounted = {t.child_frame_id: t for message in read["/tf_static"] for t in message.transforms}
        turn = mounted["imu_link"].transform.rotation  # Rz(90) Rx(180): half a turn about (1, 1, 0)
        np.testing.assert_allclose(np.abs([turn.x, turn.y, turn.z, turn.w]), [0.5**0.5, 0.5**0.5, 0, 0], atol=1e-9)
        self.assertGreater(turn.x * turn.y, 0)
        place = mounted["gnss_link"].transform.translation
        np.testing.assert_allclose([place.x, place.y, place.z], [0.1, -0.2, 1.5], atol=1e-12)
        self.assertEqual({message.header.frame_id for message in read["/recording/imu"]}, {"imu_link"})
        self.assertEqual([message.id for message in read["/can0/frames"] if message.is_error], [0x80])
        self.assertEqual(imported(drive.folder / "run.mcap", "--out", drive.folder / "again")[0], 0)
        frames = lambda folder: [(f.id, f.extended, f.error, f.remote, f.data) for f in waymark.Recording(folder).can()]  # noqa: E731
        self.assertEqual(sorted(frames(drive.recording)), sorted(frames(drive.folder / "again")))


if __name__ == "__main__":
    unittest.main()
