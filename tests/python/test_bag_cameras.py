#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark import`: cameras of bags. Names of drivers, lenses by camera_info, encodings of pictures; each with the right value.

    test_bag_cameras.py BIN_DIR"""

import io
import re
import unittest
from types import SimpleNamespace

import numpy as np
from bag_files import M, START_NS, BagTest, Events, camera_info, grey_ramp, image
from PIL import Image

import waymark
from waymark.bag.cameras import Cameras

STEP_NS = 100_000_000
SIZE = (64, 48)
K, P = (50, 51, 32, 24), (45, 46, 31, 23)


def jpeg(picture, form="JPEG", **options):
    out = io.BytesIO()
    Image.fromarray(picture).save(out, form, **options)
    return out.getvalue()


def compressed(t_ns, frame, data, form="jpeg"):
    return M.make("CompressedImage", header=M.header(t_ns, frame), format=form, data=np.frombuffer(data, dtype=np.uint8))


# Of each driver the topics of pictures, taken or not: frame, encoding ("jpeg" and others of compressed ones), focal length of the lens (None: no
# camera_info), the name of the camera that comes out (None: not taken), and the topic of camera_info, where it is not the one beside the picture.
CAMERAS = {
    "RealSense, ROS 1": [
        ("/camera/color/image_raw", "color_optical", "rgb8", 60, "color"),
        ("/camera/infra1/image_rect_raw", "infra1_optical", "mono8", 61, "infra1"),
        ("/camera/infra2/image_rect_raw", "infra2_optical", "mono8", 62, "infra2"),
        ("/camera/depth/image_rect_raw", "depth_optical", "16UC1", 63, None),
        ("/camera/aligned_depth_to_color/image_raw", "color_optical", "16UC1", 64, None)],
    "RealSense, ROS 2": [
        ("/camera/camera/color/image_raw/compressed", "color_optical", "jpeg", 60, "color"),
        ("/camera/camera/infra1/image_rect_raw/compressed", "i1", "jpeg", 61, "infra1"),
        ("/camera/camera/depth/image_rect_raw/compressedDepth", "d", "depth", 63, None)],
    "two RealSense": [("/front/color/image_raw", "f", "rgb8", 60, "front_color"), ("/rear/color/image_raw", "r", "rgb8", 61, "rear_color")],
    "ZED, wrapper 3": [
        ("/zed/zed_node/left/image_rect_color", "zed_left", "bgra8", 60, "zed_zed_node_left"),
        ("/zed/zed_node/right/image_rect_color", "zed_right", "bgra8", 61, "zed_zed_node_right"),
        ("/zed/zed_node/depth/depth_registered", "zed_left", "32FC1", 62, None)],
    "ZED, raw beside rectified": [
        ("/zed/left_raw/image_raw_color", "zed_left", "bgra8", 60, "zed_left"), ("/zed/left/image_rect_color", "zed_left", "bgra8", 61, None)],
    "ZED, wrapper 5": [
        ("/zed/zed_node/rgb/color/rect/image", "zed_left", "bgra8", 60, None),
        ("/zed/zed_node/rgb/gray/rect/image", "zed_left", "mono8", 60, "zed_zed_node_rgb")],
    "OAK": [
        ("/oak/rgb/image_raw", "oak_rgb", "bgr8", 60, "oak_rgb"), ("/oak/left/image_rect", "oak_left", "mono8", 61, "oak_left"),
        ("/oak/stereo/image_raw", "oak_rgb", "16UC1", 62, None)],
    "usb_cam": [("/image_raw", "usb", "yuv422_yuy2", 60, "camera")],
    "usb_cam, raw and compressed": [("/usb_cam/image_raw", "usb", "rgb8", 60, "usb_cam"), ("/usb_cam/image_raw/compressed", "usb", "jpeg", 60, None)],
    "camera_ros": [("/camera/image_raw", "camera", "bgr8", 60, "camera")],
    "image_proc": [
        ("/cam/image_raw", "cam", "bayer_rggb8", 60, "cam"), ("/cam/image_mono", "cam", "mono8", 60, None),
        ("/cam/image_color", "cam", "rgb8", 60, None), ("/cam/image_rect", "cam", "mono8", 60, None),
        ("/cam/image_rect_color", "cam", "rgb8", 60, None)],
    "stereo_image_proc": [("/stereo/left/image_raw", "s", "mono8", 60, "stereo_left"), ("/stereo/right/image_raw", "s", "mono8", 61, "stereo_right")],
    "Nav2 in Gazebo": [("/rgbd_camera/image", "rgbd", "rgb8", 60, "rgbd_camera"), ("/rgbd_camera/depth_image", "rgbd", "32FC1", 60, None)],
    "a colour camera that is called depth": [
        ("/intel_realsense_r200_depth/image_raw", "r200", "rgb8", 60, "intel_realsense_r200_depth"),
        ("/intel_realsense_r200_depth/depth/image_raw", "r200", "32FC1", 61, None)],
    "by the frame alone": [
        ("/left_cam", "left_optical", "mono8", 60, "left_cam", "/calib/l/camera_info"),
        ("/right_cam", "right_optical", "mono8", 61, "right_cam", "/calib/r/camera_info")],
    "two pictures beside each other": [
        ("/image_left", "l", "mono8", 60, "left", "/camera_info_left"), ("/image_right", "r", "mono8", 61, "right", "/camera_info_right")],
    "the rectified one's own camera_info": [
        (None, "l", None, 60, None, "/left/camera_info"), ("/left/image_rect", "l", "mono8", 61, "left", "/left/camera_info_rect")],
    "one name twice": [("/camera/left/image_raw", "a", "mono8", 60, "camera_left"), ("/left/image_raw", "b", "mono8", 61, "left")],
    "nuScenes": [
        ("/CAM_FRONT/image_rect_compressed", "f", "jpeg", 60, "CAM_FRONT"), ("/CAM_BACK/image_rect_compressed", "b", "jpeg", 61, "CAM_BACK")],
    "Kinect v2: infrared in the encoding of depth": [
        ("/kinect2/sd/image_ir", "ir", "16UC1", 60, "kinect2_sd_ir"), ("/kinect2/sd/image_depth", "ir", "mono16", 60, None)],
    "TurtleBot 4": [("/oakd/rgb/preview/image_raw", "o", "bgr8", 60, "oakd_rgb_preview")],
    "Spot": [("/camera/frontleft/image", "l", "mono8", 60, "frontleft"), ("/camera/frontright/image", "r", "mono8", 61, "frontright")],
    "pictures that a detector draws on": [
        ("/detection/camera/image_raw", "c", "mono8", 60, "detection"), ("/apriltag/debug_image", "c", "bgr8", None, None),
        ("/tag_detections_image", "c", "bgr8", None, None), ("/yolo/annotated/compressed", "c", "jpeg", None, None)],
    "nothing but pictures that a detector draws on": [("/detector/result_image", "c", "bgr8", 60, "detector_result")],
    "Pylon": [("/my_camera/pylon_ros2_camera_node/image_raw", "p", "bayer_rggb8", 60, "my_camera_pylon_ros2_camera_node")],
    "Azure Kinect": [
        ("/rgb/image_raw", "rgb", "bgra8", 60, "rgb"), ("/ir/image_raw", "d", "mono16", 61, "ir"), ("/depth/image_raw", "d", "16UC1", 61, None)],
    "Autoware": [
        ("/sensing/camera/camera0/image_rect_color/compressed", "c0", "jpeg", 60, "sensing_camera0"),
        ("/sensing/camera/camera1/image_rect_color/compressed", "c1", "jpeg", 61, "sensing_camera1")],
    "RealSense's own recorder": [
        ("/device_0/sensor_1/Color_0/image/data", "0", "rgb8", 60, "device_0_sensor_1_Color_0_data", "/device_0/sensor_1/Color_0/info/camera_info"),
        ("/device_0/sensor_0/Infrared_1/image/data", "0", "mono8", 62, "device_0_sensor_0_Infrared_1_data", "/device_0/sensor_0/Infrared_1/info/camera_info")],
    "no camera_info": [("/front/image_raw", "f", "mono8", None, "front")],
    "compressed alone, others of its transports": [
        ("/cam/image_raw/compressed", "cam", "jpeg", 60, "cam"), ("/cam/image_raw/compressedDepth", "cam", "depth", 60, None),
        ("/cam/image_raw/h264", "cam", "h264", 60, None)],
}


def info_of(topic, own=None):
    """The topic of a picture's camera_info."""
    return own or "/".join([*re.sub("/(compressed|compressedDepth|h264)$", "", topic).split("/")[:-1], "camera_info"])


def picture_of(encoding, t_ns, frame):
    """A message of a picture in an encoding."""
    grey = grey_ramp()
    colour = np.repeat(grey[:, :, None], 3, axis=2)
    if encoding == "jpeg":
        return "CompressedImage", compressed(t_ns, frame, jpeg(grey))
    if encoding == "depth":
        return "CompressedImage", compressed(t_ns, frame, bytes(12) + jpeg(grey.astype(np.uint16), "PNG"), "16UC1; compressedDepth png")
    if encoding == "h264":
        return "CompressedImage", compressed(t_ns, frame, b"\0\0\0\1\x67\x42" + bytes(50), "h264")
    data = {"rgb8": colour, "bgr8": colour, "bgra8": np.dstack([colour, grey]), "16UC1": grey.astype(np.uint16), "mono16": grey.astype(np.uint16), "32FC1": grey.astype(np.float32),
            "mono8": grey, "bayer_rggb8": grey, "yuv422_yuy2": np.dstack([grey, np.full_like(grey, 128)])}[encoding]
    return "sensor_msgs/Image", image(t_ns, frame, data, encoding, width=SIZE[0])


class Names(BagTest):
    def test_pictures_and_lenses_meet(self):
        for name, rows in CAMERAS.items():
            with self.subTest(name):
                infos = {(info_of(topic, *own), frame): focal for topic, frame, _, focal, _, *own in rows if focal}
                pictures = [row for row in rows if row[0]]
                events = Events()
                for i in range(4):
                    t_ns = START_NS + i * STEP_NS
                    for (topic, frame), focal in infos.items():
                        events.put(topic, "CameraInfo", t_ns, camera_info(t_ns, frame, k=(focal, focal, 32, 24), p=(focal, focal, 32, 24)))
                    for topic, frame, encoding, *_ in pictures:
                        kind, message = picture_of(encoding, t_ns, frame)
                        events.put(topic, kind, t_ns, message)
                text, folder = self.take(events.mcap(self.folder / f"{name}.mcap"), out=f"out {name}")
                recording = waymark.Recording(folder)
                wanted = {camera: focal for _, _, _, focal, camera, *_ in pictures if camera}
                self.assertEqual(set(recording.cameras()), set(wanted), text)
                entries = recording.calibration.get("cameras", {})
                self.assertEqual({camera: entry["intrinsics"][0] for camera, entry in entries.items()},
                                 {camera: focal for camera, focal in wanted.items() if focal}, text)
                for topic, _, encoding, _, camera, *_ in pictures:
                    if camera:
                        self.assertEqual(len(list(recording.frames(camera))), 4)
                        self.assertNotIn(f"not taken: {topic}:", text)
                    else:
                        self.assertIn(f"not taken: {topic}: ", text)
                        if encoding in ("16UC1", "32FC1", "h264"):
                            self.assertIn(encoding, text)


def lens(d=(), model="plumb_bob", k=K, p=P, size=SIZE, shown=SIZE, topic="image_raw", **more):
    """Events of a camera with this camera_info, whose pictures have the size `shown`."""
    events = Events()
    for i in range(2):
        t_ns = START_NS + i * STEP_NS
        events.put("/cam/camera_info", "CameraInfo", t_ns, camera_info(t_ns, "cam", size, k, d, model, p, **more))
        events.put(f"/cam/{topic}", "sensor_msgs/Image", t_ns, image(t_ns, "cam", grey_ramp(shown[1], shown[0]), "mono8"))
    return events


def roi(x, y, width, height):
    return M.make("RegionOfInterest", x_offset=x, y_offset=y, width=width, height=height)


# camera_info, and the model, intrinsics and distortion that are right.
RADTAN, EQUI = "pinhole-radtan", "equidistant"
LENSES = {
    "plumb_bob, no distortion": (lens(), RADTAN, K, [0, 0, 0, 0]),
    "plumb_bob, four": (lens((0.1, 0.02, 0.003, 0.004)), RADTAN, K, [0.1, 0.02, 0.003, 0.004]),
    "plumb_bob, k3": (lens((-0.3, 0.12, 0.0005, -0.0003, -0.022)), RADTAN, K, [-0.3, 0.12, 0.0005, -0.0003, -0.022]),
    "no name": (lens((0.1, 0.02, 0, 0, 0), ""), RADTAN, K, [0.1, 0.02, 0, 0]),
    "rational_polynomial that is none": (lens((0.1, 0.02, 0.003, 0.004, 0.005, 0, 0, 0), "rational_polynomial"), RADTAN, K, [0.1, 0.02, 0.003, 0.004, 0.005]),
    "equidistant": (lens((0.01, 0.002, 0.0003, 0.0004), "equidistant"), EQUI, K, [0.01, 0.002, 0.0003, 0.0004]),
    "fisheye": (lens((0.01, 0.002, 0.0003, 0.0004), "fisheye"), EQUI, K, [0.01, 0.002, 0.0003, 0.0004]),
    "equidistant without coefficients": (lens((0, 0, 0, 0), "equidistant"), EQUI, K, [0, 0, 0, 0]),
    "other names of them": (lens((0.01, 0.002, 0.0003, 0.0004), "KB4"), EQUI, K, [0.01, 0.002, 0.0003, 0.0004]),
    "radial-tangential": (lens((0.1, 0.02, 0.003, 0.004), "radial-tangential"), RADTAN, K, [0.1, 0.02, 0.003, 0.004]),
    "rectified, K of zeros": (lens(k=(0, 0, 0, 0), topic="image_rect"), RADTAN, P, [0, 0, 0, 0]),
    "none": (lens((), "None"), RADTAN, K, [0, 0, 0, 0]),
    "rectified: P, and no distortion": (lens((0.1, 0.02, 0, 0, 0), topic="image_rect"), RADTAN, P, [0, 0, 0, 0]),
    "rectified in colour": (lens((0.1, 0.02, 0, 0, 0), topic="image_rect_color"), RADTAN, P, [0, 0, 0, 0]),
    "rectified fisheye": (lens((0.1, 0.02, 0, 0), "equidistant", topic="image_rect"), RADTAN, P, [0, 0, 0, 0]),
    "rectified, P of zeros": (lens((0.1, 0.02, 0, 0, 0), p=None, topic="image_rect"), RADTAN, K, [0, 0, 0, 0]),
    "region of interest": (lens(k=(100, 100, 64, 48), size=(128, 96), roi=roi(20, 10, 64, 48)), RADTAN, (100, 100, 44, 38), [0, 0, 0, 0]),
    "binning": (lens(k=(100, 102, 64, 48), size=(128, 96), binning_x=2, binning_y=2), RADTAN, (50, 51, 32, 24), [0, 0, 0, 0]),
    "binning one way": (lens(k=(100, 51, 64, 24), size=(128, 48), binning_x=2), RADTAN, (50, 51, 32, 24), [0, 0, 0, 0]),
    "binning of a region": (lens(k=(100, 100, 64, 48), size=(256, 192), roi=roi(20, 10, 128, 96), binning_x=2, binning_y=2), RADTAN, (50, 50, 22, 19),
                            [0, 0, 0, 0]),
    "rectified region": (lens(k=(90, 90, 60, 40), p=(100, 100, 64, 48), size=(128, 96), roi=roi(20, 10, 64, 48), topic="image_rect"), RADTAN,
                         (100, 100, 44, 38), [0, 0, 0, 0]),
    "region of the whole size, offset 0": (lens(roi=roi(0, 0, 64, 48)), RADTAN, K, [0, 0, 0, 0]),
    "a region that the pictures don't have": (lens(k=(50, 50, 32, 24), roi=roi(10, 8, 32, 24)), RADTAN, (50, 50, 32, 24), [0, 0, 0, 0]),
    # Half the size by scaling: the picture's edge, at -0.5, stays.
    "scaled pictures": (lens(k=(100, 100, 63.5, 47.5), size=(128, 96)), RADTAN, (50, 50, 31.5, 23.5), [0, 0, 0, 0]),
    "camera_info without a size": (lens(size=(0, 0)), RADTAN, K, [0, 0, 0, 0]),
}
# camera_info that gives no lens, and what is said.
NO_LENS = {
    "K of zeros": (lens(k=(0, 0, 0, 0), p=None), "not calibrated"),
    "K of ones": (lens(k=(1, 1, 0, 0), p=(1, 1, 0, 0)), "not calibrated"),
    "P alone, raw pictures": (lens(k=(0, 0, 0, 0)), "P, the lens of rectified pictures, alone"),
    "K is no number": (lens(k=(np.nan, np.nan, 32, 24), p=None), "not calibrated"),
    "a region beyond its centre": (lens(size=(256, 48), roi=roi(127, 0, 64, 48)), "a centre at -95 px of a picture of 64 x 48"),
    "another shape": (lens(size=(100, 48)), "its camera_info is of 100 x 48, its pictures have 64 x 48"),
    "an unknown model": (lens((0.1, 0.2, 0.3, 0.4), "double_sphere"), "'double_sphere' is unknown"),
    "a tilted sensor": (lens(tuple(0.01 * i for i in range(1, 15)), "rational_polynomial"), "tilted sensor"),
    "distortion is no number": (lens((np.nan, 0, 0, 0, 0)), "is no number"),
}


class Unclear(BagTest):
    """What could be one thing or another is named, and not guessed."""

    def test_two_camera_infos_that_are_alike(self):
        for focal, clear in ((80, False), (50, True)):
            events = Events()
            for i in range(4):
                t_ns = START_NS + i * STEP_NS
                events.put("/left/image_raw", "sensor_msgs/Image", t_ns, image(t_ns, "cam", RAMP, "mono8"))
                for topic, f in (("/l/camera_info", 50), ("/r/camera_info", focal)):
                    events.put(topic, "CameraInfo", t_ns, camera_info(t_ns, "cam", size=RAMP.shape[::-1], k=(f, f, 32, 24)))
            text, folder = self.take(events.mcap(self.folder / "a.mcap"), out=f"out{focal}")
            entries = waymark.Recording(folder).calibration.get("cameras", {})
            self.assertEqual("/l/camera_info and /r/camera_info both have its frame and size, and other lenses" in text, not clear, text)
            self.assertEqual("left" in entries, clear, entries)

    def test_pictures_of_one_stamp(self):
        events = Events()
        for i in range(40):
            t_ns = START_NS + i * STEP_NS
            for k in range(2 if i == 17 else 1):
                events.put("/cam/image_raw", "sensor_msgs/Image", t_ns, image(t_ns, "cam", RAMP, "mono8"), 3_000_000 + k)
        text, _ = self.take(events.mcap(self.folder / "a.mcap"))
        self.assertIn("note: /cam/image_raw: 1 of its pictures have the stamp of another one: a run takes the first", text)


class Lenses(BagTest):
    def test_lenses(self):
        for name, (events, model, intrinsics, distortion) in LENSES.items():
            with self.subTest(name):
                text, folder = self.take(events.mcap(self.folder / "a.mcap"), out=f"out {name}")
                entry = waymark.Recording(folder).calibration["cameras"]["cam"]
                self.assertEqual((entry["model"], entry["size"]), (model, [64, 48]), text)
                np.testing.assert_allclose(entry["intrinsics"], intrinsics, atol=1e-9)
                np.testing.assert_allclose(entry["distortion"], distortion, atol=1e-12)

    def test_camera_infos_that_are_no_lens(self):
        for name, (events, said) in NO_LENS.items():
            with self.subTest(name):
                text, folder = self.take(events.mcap(self.folder / "a.mcap"), out=f"out {name}")
                self.assertNotIn("cameras", waymark.Recording(folder).calibration)
                self.assertIn(said, text)
                self.assertEqual(len(list(waymark.Recording(folder).frames("cam"))), 2)

    def test_the_first_lens_that_is_one_counts(self):
        events = lens(k=(0, 0, 0, 0), p=None)
        later = lens(k=K)
        other = lens(k=(70, 70, 32, 24))
        for batch, shift in ((later, 10), (other, 20)):
            for log_ns, topic, kind, message in batch.items:
                message.header = M.header(log_ns + shift * STEP_NS, "cam")
                events.items.append((log_ns + shift * STEP_NS, topic, kind, message))
        text, folder = self.take(events.mcap(self.folder / "a.mcap"))
        self.assertEqual(waymark.Recording(folder).calibration["cameras"]["cam"]["intrinsics"], list(map(float, K)))
        self.assertIn("its camera_info changes at 1700000002.003 s", text)
        self.assertIn("the first 2 messages of /cam/camera_info are of a camera that is not calibrated", text)

    def test_a_definition_without_a_field_costs_its_messages(self):
        with self.assertRaises(AttributeError):
            Cameras().camera_info("/cam/camera_info", SimpleNamespace(header=M.header(0, "c"), k=np.full(9, 50.0), p=np.full(12, 50.0), d=np.zeros(5)), 0)

    def test_a_lens_without_pictures_is_that_of_its_tags(self):
        events = Events().drive()
        for i in range(3):
            t_ns = START_NS + i * STEP_NS
            events.put("/front/camera_info", "CameraInfo", t_ns, camera_info(t_ns, "front_optical"))
            events.put("/front/image_raw", "sensor_msgs/Image", t_ns, image(t_ns, "front_optical", RAMP.astype(np.uint16), "16UC1"))
            events.put("/rear/image_raw", "sensor_msgs/Image", t_ns, image(t_ns, "rear_optical", RAMP, "mono8"))
            events.tags("/front/detections", t_ns, "front_optical", ((10, 30), (30, 31), (31, 10), (11, 9)))
        _, folder = self.take(events.mcap(self.folder / "a.mcap"))
        recording = waymark.Recording(folder)
        self.assertEqual(set(recording.table("marker-corners.csv")["sensor"]), {"front"})
        self.assertEqual(list(recording.calibration["cameras"]), ["front"])

    def test_ros_1_spells_it_in_capitals(self):
        for compression in (None,):
            text, folder = self.take(lens((-0.3, 0.1, 0, 0, 0)).ros1(self.folder / "a.bag", compression))
            entry = waymark.Recording(folder).calibration["cameras"]["cam"]
            self.assertEqual((entry["intrinsics"], entry["distortion"][:2]), (list(map(float, K)), [-0.3, 0.1]), text)

    def test_a_rational_lens_is_fitted_and_its_error_said(self):
        # Of a wide lens as cameras for depth have it (Azure Kinect's colour camera: eight coefficients), for a picture of 640 x 480.
        d = np.array([0.6, -2.7, 0.0007, -0.0003, 1.6, 0.48, -2.5, 1.5])
        k = (305.0, 305.0, 320.0, 240.0)
        text, folder = self.take(lens(tuple(d), "rational_polynomial", k, None, (640, 480), (640, 480)).mcap(self.folder / "a.mcap"))
        entry = waymark.Recording(folder).calibration["cameras"]["cam"]
        self.assertRegex(text, r"nearest .* off by 0\.\d+ px in the mean and \d\.\d+ px at most")
        from waymark.bag.lens_fit import equidistant, radtan, rational
        bend = {RADTAN: radtan, EQUI: equidistant}[entry["model"]]
        fx, fy, cx, cy = entry["intrinsics"]
        # Newton's method from pixels to rays of the true lens, then by the fitted one to pixels again.
        u, v = (a.ravel() for a in np.meshgrid(np.linspace(20, 620, 25), np.linspace(20, 460, 19)))
        wanted = np.column_stack([(u - 320) / 305, (v - 240) / 305])
        rays = wanted.copy()
        for _ in range(60):
            rays += wanted - rational(d, rays)
        np.testing.assert_allclose(rational(d, rays), wanted, atol=1e-9)
        there = bend(entry["distortion"], rays) * (fx, fy) + (cx, cy)
        off = np.linalg.norm(there - np.column_stack([u, v]), axis=1)
        said_px = float(text.split("px in the mean and ")[1].split(" px")[0])
        self.assertLess(off.max(), said_px + 0.05)
        self.assertLess(off.mean(), 0.5)


def ramp16(bits, low=False):
    return (grey_ramp().astype(np.uint16) << (bits - 8)) | (3 if low else 0)


def bayer(red, green, blue, pattern):
    """A mosaic of one colour."""
    out = np.empty((48, 64), dtype=np.uint8)
    for i, channel in enumerate(pattern):
        out[i // 2 :: 2, i % 2 :: 2] = {"r": red, "g": green, "b": blue}[channel]
    return out


def padded(rows, step):
    out = np.full((rows.shape[0], step), 7, dtype=np.uint8)
    out[:, : rows.shape[1]] = rows
    return out


RAMP = grey_ramp()
GREY3 = np.repeat(RAMP[:, :, None], 3, axis=2)
RED = np.zeros((48, 64, 3), dtype=np.uint8) + np.array([200, 100, 50], dtype=np.uint8)
LUMA_OF_RED = 0.299 * 200 + 0.587 * 100 + 0.114 * 50  # ITU-R BT.601
HALF = np.full((24, 64), 128, dtype=np.uint8)
# Encoding, the data, options, and the grey levels that are right: an array or one number.
ENCODINGS = {
    "mono8": ("mono8", RAMP, {}, RAMP),
    "8UC1": ("8UC1", RAMP, {}, RAMP),
    "mono8, rows longer than the picture": ("mono8", padded(RAMP, 80), {"width": 64, "step": 80}, RAMP),
    "mono8, step 0": ("mono8", RAMP, {"step": -1}, RAMP),
    "rgb8": ("rgb8", RED, {"width": 64}, LUMA_OF_RED),
    "bgr8": ("bgr8", RED[:, :, ::-1], {"width": 64}, LUMA_OF_RED),
    "8UC3": ("8UC3", RED[:, :, ::-1], {"width": 64}, LUMA_OF_RED),
    "rgba8": ("rgba8", np.dstack([RED, RAMP]), {"width": 64}, LUMA_OF_RED),
    "bgra8": ("bgra8", np.dstack([RED[:, :, ::-1], RAMP]), {"width": 64}, LUMA_OF_RED),
    "rgb8, rows longer": ("rgb8", padded(GREY3.reshape(48, -1), 256), {"width": 64, "step": 256}, RAMP),
    "mono16 of 16 bits": ("mono16", ramp16(16, low=True), {}, RAMP),
    "mono16 of 12 bits": ("mono16", ramp16(12), {}, RAMP),
    "mono16 of 10 bits": ("mono16", ramp16(10), {}, RAMP),
    "mono16 of 8 bits": ("mono16", ramp16(8), {}, RAMP),
    "mono12": ("mono12", ramp16(12), {}, RAMP),
    "bayer_rggb10": ("bayer_rggb10", bayer(200, 100, 50, "rggb").astype(np.uint16) << 2, {}, (200 + 2 * 100 + 50) / 4),
    "bgra16": ("bgra16", np.dstack([RED[:, :, ::-1], RAMP]).astype(np.uint16) * 257, {"width": 64}, LUMA_OF_RED),
    "mono16, big endian": ("mono16", ramp16(12).astype(">u2"), {"big": 1}, RAMP),
    "yuv422 (UYVY)": ("yuv422", np.dstack([np.full_like(RAMP, 90), RAMP]), {"width": 64}, RAMP),
    "uyvy": ("uyvy", np.dstack([np.full_like(RAMP, 90), RAMP]), {"width": 64}, RAMP),
    "yuv422_yuy2 (YUYV)": ("yuv422_yuy2", np.dstack([RAMP, np.full_like(RAMP, 90)]), {"width": 64}, RAMP),
    "nv12": ("nv12", np.vstack([RAMP, HALF]), {"height": 48, "step": 64}, RAMP),
    "nv21": ("nv21", np.vstack([RAMP, HALF]), {"height": 48, "step": 64}, RAMP),
    "8UC2 of YUYV": ("8UC2", np.dstack([RAMP, np.full_like(RAMP, 120)]), {"width": 64}, RAMP),
    "8UC2 of UYVY": ("8UC2", np.dstack([np.full_like(RAMP, 120), RAMP]), {"width": 64}, RAMP),
    "yuyv422": ("yuyv422", np.dstack([RAMP, np.full_like(RAMP, 90)]), {"width": 64}, RAMP),
    "YVYU": ("YVYU", np.dstack([RAMP, np.full_like(RAMP, 90)]), {"width": 64}, RAMP),
    "nv12 whose height counts both planes": ("nv12", np.vstack([RAMP, HALF]), {}, RAMP),
    "I420 whose height counts all planes, rows longer": ("I420", np.hstack([np.vstack([RAMP, HALF]), np.zeros((72, 16), dtype=np.uint8)]),
                                                         {"width": 64}, RAMP),
    "GREY": ("GREY", RAMP, {}, RAMP),
    "Y16": ("Y16", ramp16(16), {}, RAMP),
    "a word behind it": ("bgr8; jpeg compressed bgr8", GREY3, {"width": 64}, RAMP),
    "argb8": ("argb8", np.dstack([RAMP, RED]), {"width": 64}, LUMA_OF_RED),
    "16UC3": ("16UC3", RED[:, :, ::-1].astype(np.uint16) * 257, {"width": 64}, LUMA_OF_RED),
    "BayerRG8": ("BayerRG8", bayer(200, 100, 50, "rggb"), {}, (200 + 2 * 100 + 50) / 4),
    "nv24": ("nv24", np.vstack([RAMP, RAMP, RAMP]), {"height": 48, "step": 64}, RAMP),
    "rgb16": ("rgb16", RED.astype(np.uint16) * 257, {"width": 64}, LUMA_OF_RED),
    **{f"bayer_{p}8": (f"bayer_{p}8", bayer(200, 100, 50, p), {}, (200 + 2 * 100 + 50) / 4) for p in ("rggb", "bggr", "gbrg", "grbg")},
    "bayer_rggb16": ("bayer_rggb16", bayer(200, 100, 50, "rggb").astype(np.uint16) << 4, {}, (200 + 2 * 100 + 50) / 4),
}
NOT_PICTURES = {"16UC1": RAMP.astype(np.uint16), "32FC1": RAMP.astype(np.float32), "bayer_rggb9": RAMP, "": RAMP}


class Pictures(BagTest):
    def events(self, encoding, data, options):
        events = Events()
        for i in range(2):
            t_ns = START_NS + i * STEP_NS
            message = image(t_ns, "cam", data, encoding, **{k: v for k, v in options.items() if v != -1})
            if options.get("step") == -1:
                message.step = 0
            events.put("/cam/image_raw", "sensor_msgs/Image", t_ns, message)
        return events

    def test_grey_levels_of_each_encoding(self):
        for name, (encoding, data, options, wanted) in ENCODINGS.items():
            with self.subTest(name):
                text, folder = self.take(self.events(encoding, data, options).mcap(self.folder / "a.mcap"), out=f"out {name}")
                frames = list(waymark.Recording(folder).frames("cam"))
                self.assertEqual(len(frames), 2, text)
                grey = np.asarray(Image.open(io.BytesIO(frames[1].jpeg))).astype(float)
                self.assertEqual(grey.shape, (48, 64))
                self.assertLess(np.abs(grey - wanted).max(), 3, name)

    def test_what_is_no_picture_is_named_with_its_encoding(self):
        for encoding, data in NOT_PICTURES.items():
            with self.subTest(encoding):
                text, _ = self.take(self.events(encoding, data, {}).mcap(self.folder / "a.mcap"), code=1, out=f"out {encoding}")
                self.assertIn("not taken: /cam/image_raw: ", text)
                self.assertIn(encoding, text)

    def test_a_mosaic_has_no_lattice_and_no_shift(self):
        from waymark.bag.pictures import _demosaiced
        edge = np.zeros((20, 20), dtype=np.uint8)
        edge[:, 10:] = 200
        grey = _demosaiced(edge).astype(int)
        self.assertEqual(grey[:, 8].tolist() + grey[:, 11].tolist(), [0] * 20 + [200] * 20)
        self.assertTrue((grey[:, 9] + grey[:, 10] == 200).all())  # the edge stays between columns 9 and 10

    def test_compressed_pictures(self):
        good = jpeg(RAMP, quality=95)
        filled = good[:2] + b"\xff\xff" + good[2:]  # a fill byte before a marker
        rgb = jpeg(RED, "PNG")
        out = io.BytesIO()
        Image.fromarray(GREY3).convert("CMYK").save(out, "JPEG", quality=95)
        inks = out.getvalue()
        cases = {
            "jpeg": ([good] * 3, "jpeg", 3, RAMP), "fill bytes": ([filled] * 3, "jpeg", 3, RAMP), "padding behind": ([good + bytes(64)] * 3, "jpeg", 3, RAMP),
            "a buffer's padding behind": ([good + bytes(20000)] * 3, "jpeg", 3, RAMP),
            "four inks": ([inks] * 3, "jpeg", 3, RAMP),
            "png": ([jpeg(RAMP, "PNG")] * 3, "png", 3, RAMP), "png of colour": ([rgb] * 3, "bgr8; png compressed bgr8", 3, LUMA_OF_RED),
            "png of 16 bits": ([jpeg(ramp16(12), "PNG")] * 3, "mono16; png compressed mono16", 3, RAMP),
            "webp": ([jpeg(GREY3, "WEBP", lossless=True)] * 3, "webp", 3, RAMP),
            "one empty": ([good, b"", good], "jpeg", 2, RAMP), "one cut": ([good, good[: len(good) // 2], good], "jpeg", 2, RAMP),
            "one is text": ([good, b"<html>no frame</html>", good], "jpeg", 2, RAMP), "one of its head alone": ([good, b"\xff\xd8", good], "jpeg", 2, RAMP),
            "a buffer's rest behind": ([good + b"\x55" * 9000] * 3, "jpeg", 3, RAMP),
            "the first of another size": ([jpeg(RAMP[:40]), good, good], "jpeg", 2, RAMP),
            "one of another size": ([good, jpeg(RAMP[:40]), good], "jpeg", 2, RAMP), "the first is empty": ([b"", good, good], "jpeg", 2, RAMP),
        }
        for name, (datas, form, count, wanted) in cases.items():
            with self.subTest(name):
                events = Events()
                for i, data in enumerate(datas):
                    t_ns = START_NS + i * STEP_NS
                    events.put("/cam/image_raw/compressed", "CompressedImage", t_ns, compressed(t_ns, "cam", data, form))
                text, folder = self.take(events.mcap(self.folder / "a.mcap"), out=f"out {name}")
                frames = list(waymark.Recording(folder).frames("cam"))
                self.assertEqual(len(frames), count, text)
                picture = Image.open(io.BytesIO(frames[-1].jpeg))
                self.assertNotEqual(picture.mode, "CMYK")
                self.assertLess(np.abs(np.asarray(picture.convert("L")).astype(float) - wanted).max(), 4)
                if count < 3:
                    at = START_NS / 1e9 + (0 if name.startswith("the first") else 0.1)
                    self.assertIn(f"note: /cam/image_raw/compressed: 1 of 3 messages is left out; the first at {at:.3f} s: ", text)

    def test_jpegs_in_a_message_for_raw_pictures(self):
        for encoding in ("jpeg", "mjpeg"):
            data = np.frombuffer(jpeg(RAMP, quality=95), dtype=np.uint8)
            text, folder = self.take(self.events(encoding, data.reshape(1, -1), {"width": 64, "height": 48}).mcap(self.folder / "a.mcap"), out=encoding)
            frames = list(waymark.Recording(folder).frames("cam"))
            self.assertEqual([frame.jpeg for frame in frames], [data.tobytes()] * 2, text)

    def test_one_short_picture_costs_itself(self):
        for spoil in (lambda m: setattr(m, "data", m.data[:500]), lambda m: setattr(m, "height", 4_000_000_000), lambda m: setattr(m, "width", 0),
                      lambda m: setattr(m, "step", 3)):
            events = self.events("mono8", RAMP, {})
            t_ns = START_NS + 5 * STEP_NS
            bad = image(t_ns, "cam", RAMP, "mono8")
            spoil(bad)
            events.put("/cam/image_raw", "sensor_msgs/Image", t_ns, bad)
            text, folder = self.take(events.mcap(self.folder / "a.mcap"), out=f"out{id(spoil)}")
            self.assertEqual(len(list(waymark.Recording(folder).frames("cam"))), 2, text)
            self.assertIn("note: /cam/image_raw: 1 of 3 messages is left out; the first at 1700000000.500 s: ", text)


# Topics of CAN frames, and the interface in can.log.
INTERFACES = {"/received_messages": "can0", "/sent_messages": "can0", "/can1/received_messages": "can1", "/from_can_bus": "can0",
              "/can0/from_can_bus": "can0", "/vehicle/can2/from_can_bus": "can2", "/a_bus_with_a_very_long_name/frames": "a_bus_with_a_ve"}


class Can(BagTest):
    def test_interfaces_that_the_reader_takes(self):
        for topic, wanted in INTERFACES.items():
            with self.subTest(topic):
                events = Events()
                events.put(topic, "can_msgs/Frame", START_NS, M.make("can_msgs/Frame", header=M.header(START_NS, ""), id=0x123, dlc=2,
                                                                     data=np.array([1, 2, 0, 0, 0, 0, 0, 0], dtype=np.uint8)))
                _, folder = self.take(events.mcap(self.folder / "a.mcap"), out="out" + topic.replace("/", "-"))
                self.assertEqual((folder / "can.log").read_text(), f"(1700000000.000000) {wanted} 123#0102\n")

    def test_two_long_names_stay_two(self):
        events = Events()
        for i, topic in enumerate(("/a_bus_with_a_long_name_1/frames", "/a_bus_with_a_long_name_2/frames")):
            events.put(topic, "can_msgs/Frame", START_NS + i, M.make("can_msgs/Frame", header=M.header(START_NS, ""), id=i, dlc=0))
        _, folder = self.take(events.mcap(self.folder / "a.mcap"))
        names = [line.split()[1] for line in (folder / "can.log").read_text().splitlines()]
        self.assertEqual(len(set(names)), 2)
        self.assertTrue(all(len(name) <= 15 for name in names))

    def test_frames_as_candump_writes_them(self):
        data = np.array([0, 0, 8, 0, 0, 0, 0, 0], dtype=np.uint8)
        cases = [(dict(id=0x88, is_error=True, dlc=8, data=data), "20000088#0000080000000000"),
                 (dict(id=0x20000088, dlc=8, data=data), "20000088#0000080000000000"),  # the flag left in the identifier
                 (dict(id=0x18FF1234, is_extended=True, dlc=1, data=data), "18FF1234#00"),
                 (dict(id=0x18FF1234, dlc=1, data=data), "18FF1234#00"),  # no 11 bits hold it
                 (dict(id=0x80000123, dlc=1, data=data), "00000123#00"), (dict(id=0x123, is_rtr=True, dlc=4), "123#R")]
        events = Events()
        for i, (fields, _) in enumerate(cases):
            t_ns = START_NS + i * 1_000_000
            events.put("/can0/frames", "can_msgs/Frame", t_ns, M.make("can_msgs/Frame", header=M.header(t_ns, ""), **fields))
        events.put("/can0/frames", "can_msgs/Frame", START_NS + 10**9, M.make("can_msgs/Frame", header=M.header(START_NS + 10**9, ""), id=1, dlc=200))
        text, folder = self.take(events.mcap(self.folder / "a.mcap"))
        lines = (folder / "can.log").read_text().splitlines()
        self.assertEqual([line.split()[2] for line in lines], [wanted for _, wanted in cases])
        self.assertIn("1 of 7 messages is left out; the first at 1700000001.000 s: a CAN frame of 200 bytes", text)
        read = list(waymark.Recording(folder).can())
        self.assertEqual([(frame.error, frame.id) for frame in read[:2]], [(True, 0x88)] * 2)
        self.assertEqual("".join(waymark.recording.can_line(frame) for frame in read), (folder / "can.log").read_text())


if __name__ == "__main__":
    unittest.main()
