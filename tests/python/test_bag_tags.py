#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark import`: tags that other detectors reported, against our own detector on the same pictures. AprilTag's library draws the tags and
reports their corners itself; OpenCV's conventions are those of its documentation.

    test_bag_tags.py BIN_DIR"""

import csv
import ctypes
import json
import subprocess
import unittest

import numpy as np
from bag_files import BIN, M, START_NS, BagTest, Events, camera_info, corners_of, register
from PIL import Image

import waymark
from waymark.geometry import OPTICAL, quaternion

F, C, SIZE = 400.0, (159.5, 119.5), (320, 240)
TAG_M, STEP_NS = 0.16, 100_000_000
CALIBRATION = {"cameras": {"cam": {"model": "pinhole-radtan", "size": list(SIZE), "intrinsics": [F, F, *C], "distortion": [0, 0, 0, 0],
                                   "mounting": {"xyz_m": [0, 0, 0], "rpy_deg": [0, 0, 0]}}}}
# Our corners in a print's own plane, as a reader sees it: x to the right, y up, halves of the edge.
OURS = np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)], dtype=float)
# OpenCV's DICT_4X4_50, identity 0, a row of modules a line, 1 white (modules/objdetect/src/aruco/predefined_dictionaries.hpp: 181, 50).
ARUCO_0 = ["1011", "0101", "0011", "0010"]


class ImageU8(ctypes.Structure):
    _fields_ = [("width", ctypes.c_int32), ("height", ctypes.c_int32), ("stride", ctypes.c_int32), ("buf", ctypes.POINTER(ctypes.c_uint8))]


class Detection(ctypes.Structure):
    _fields_ = [("family", ctypes.c_void_p), ("id", ctypes.c_int), ("hamming", ctypes.c_int), ("margin", ctypes.c_float), ("H", ctypes.c_void_p),
                ("c", ctypes.c_double * 2), ("p", ctypes.c_double * 8)]


class Zarray(ctypes.Structure):
    _fields_ = [("el_sz", ctypes.c_size_t), ("size", ctypes.c_int), ("alloc", ctypes.c_int), ("data", ctypes.c_void_p)]


class AprilTag:
    """AprilTag's library, which Waymark is built with."""

    def __init__(self):
        self.lib = ctypes.CDLL("libapriltag.so.3")
        for name in ("apriltag_detector_create", "apriltag_to_image", "apriltag_detector_detect"):
            getattr(self.lib, name).restype = ctypes.c_void_p

    def family(self, name):
        create = getattr(self.lib, f"{name}_create")
        create.restype = ctypes.c_void_p
        return ctypes.c_void_p(create())

    def picture(self, name, identity):
        """The library's own picture of a tag: modules, 0 black, 255 white."""
        image = ctypes.cast(self.lib.apriltag_to_image(self.family(name), identity), ctypes.POINTER(ImageU8)).contents
        rows = np.ctypeslib.as_array(image.buf, (image.height, image.stride))
        return rows[:, : image.width].copy()

    def detect(self, name, picture):
        """Identity and corners p[0..3] of each tag."""
        detector = ctypes.c_void_p(self.lib.apriltag_detector_create())
        ctypes.cast(ctypes.c_void_p(detector.value + 4), ctypes.POINTER(ctypes.c_float))[0] = 1.0  # quad_decimate: every pixel
        self.lib.apriltag_detector_add_family_bits(detector, self.family(name), 2)
        data = np.ascontiguousarray(picture)
        image = ImageU8(SIZE[0], SIZE[1], SIZE[0], data.ctypes.data_as(ctypes.POINTER(ctypes.c_uint8)))
        found = ctypes.cast(self.lib.apriltag_detector_detect(detector, ctypes.byref(image)), ctypes.POINTER(Zarray)).contents
        items = ctypes.cast(found.data, ctypes.POINTER(ctypes.POINTER(Detection)))
        return [(items[i].contents.id, [float(v) for v in items[i].contents.p]) for i in range(found.size)]


def pose(yaw_deg=25, tilt_deg=-35, roll_deg=20, place=(0.05, -0.03, 0.8)):
    """A print before the camera: rotation with columns x to its right, y up, z out of it, and place, in the optical frame."""
    yaw, tilt, roll = np.radians((yaw_deg, tilt_deg, roll_deg))
    facing = np.diag([1.0, -1.0, -1.0])  # x right, y up, z towards the camera
    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    lean = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    about = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    return turn @ lean @ facing @ about, np.array(place)


def pixels(rotation, place, plane):
    """Pixels of points of the print's plane, (n, 2) in metres."""
    p = np.column_stack([plane, np.zeros(len(plane))]) @ rotation.T + place
    return p[:, :2] / p[:, 2:] * F + C


def rendered(modules, edge, rotation, place):
    """The picture of a print: `modules` with the print's upper row first, of which `edge` ones make TAG_M."""
    fine = 2
    steps = (np.arange(fine) + 0.5) / fine - 0.5
    u, v = np.meshgrid((np.arange(SIZE[0])[:, None] + steps).ravel(), (np.arange(SIZE[1])[:, None] + steps).ravel())
    rays = np.stack([(u - C[0]) / F, (v - C[1]) / F, np.ones_like(u)])
    normal = rotation[:, 2]
    points = rays * (place @ normal) / np.tensordot(normal, rays, 1) - place[:, None, None]
    x, y = np.tensordot(rotation[:, 0], points, 1), np.tensordot(rotation[:, 1], points, 1)
    module = TAG_M / edge
    column, row = np.floor(x / module + modules.shape[1] / 2).astype(int), np.floor(modules.shape[0] / 2 - y / module).astype(int)
    inside = (column >= 0) & (column < modules.shape[1]) & (row >= 0) & (row < modules.shape[0])
    grey = np.where(inside, modules[np.clip(row, 0, modules.shape[0] - 1), np.clip(column, 0, modules.shape[1] - 1)] * 0.8 + 25, 200)
    return grey.reshape(SIZE[1], fine, SIZE[0], fine).mean((1, 3)).round().astype(np.uint8)


def aruco_modules():
    """OpenCV's picture of DICT_4X4_50, identity 0, in a white rim of a module."""
    out = np.zeros((8, 8), dtype=np.uint8)
    out[[0, -1]] = out[:, [0, -1]] = 255
    out[2:6, 2:6] = [[255 * int(bit) for bit in row] for row in ARUCO_0]
    return out


def pose_of(corners):
    """Place and the yaw of the upper edge, in the camera's body frame, of our four corners: by the homography of the print's plane."""
    plane, there = OURS * TAG_M / 2, (np.reshape(corners, (4, 2)) - C) / F
    rows = []
    for (x, y), (u, v) in zip(plane, there):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y, -u], [0, 0, 0, x, y, 1, -v * x, -v * y, -v]]
    h = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)
    h /= np.linalg.norm(h[:, 0]) * np.sign(h[2, 2])
    upper = OPTICAL @ h[:, 0]
    return OPTICAL @ h[:, 2], float(np.arctan2(upper[1], upper[0]))


# Family, modules along the edge that a size is of, and whether the library draws it as our reader sees it.
FAMILIES = {"tag16h5": 6, "tag25h9": 7, "tag36h10": 8, "tag36h11": 8, "tagStandard41h12": 5, "tagCircle21h7": 5, "tagCustom48h12": 6}
POSES = [pose(), pose(-20, -40, 160, (-0.06, 0.05, 0.7)), pose(10, 35, -70, (0.1, 0.04, 0.75))]


def with_lens():
    """The camera_info of the camera that sees."""
    events = Events()
    events.put("/cam/camera_info", "CameraInfo", START_NS, camera_info(START_NS, "cam_optical", SIZE, (F, F, *C)))
    return events


class Corners(BagTest):
    def detected(self, name, pictures, family, size_m=TAG_M):
        """What `waymark detect` finds: rows of its table."""
        folder = self.folder / name
        folder.mkdir()
        for i, picture in enumerate(pictures):
            Image.fromarray(picture).save(folder / f"{i}.png")
        (self.folder / "calibration.yaml").write_text(json.dumps(CALIBRATION))
        done = subprocess.run([BIN / "waymark-detect", folder, "--detector", "apriltag", "--calibration", self.folder / "calibration.yaml", "--set",
                               f"family={family}", "--set", f"size_m={size_m}", "--out", self.folder / f"{name}-seen"], capture_output=True, text=True,
                              check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        (table,) = (self.folder / f"{name}-seen/detections").glob("*.csv")
        with table.open() as file:
            return list(csv.DictReader(file))

    def agree(self, row, place, yaw, middle, name):
        """Our detector's row and an imported tag."""
        seen = np.array([float(row[key]) for key in ("x_m", "y_m", "z_m")])
        self.assertLess(np.linalg.norm(seen - place), 0.03 * np.linalg.norm(place), name)
        off = (float(row["yaw_rad"]) - yaw + np.pi) % (2 * np.pi) - np.pi
        self.assertLess(abs(off), 0.1, f"{name}: the upper edge by detect {row['yaw_rad']}, imported {yaw}")
        if middle is not None:
            self.assertLess(np.hypot(float(row["u_px"]) - middle[0], float(row["v_px"]) - middle[1]), 0.25, name)

    def test_apriltag_s_library(self):
        library = AprilTag()
        for family, edge in FAMILIES.items():
            with self.subTest(family):
                modules = library.picture(family, 7)
                pictures = [rendered(modules, edge, *p) for p in POSES]
                own = self.detected(family, pictures, family)
                events = with_lens()
                for i, picture in enumerate(pictures):
                    (found,) = library.detect(family, picture)
                    events.tags("/cam/detections", START_NS + i * STEP_NS, "cam_optical", np.reshape(found[1], (4, 2)), family, found[0])
                text, folder = self.take(events.mcap(self.folder / f"{family}.mcap"), out=f"out-{family}")
                table = waymark.Recording(folder).table("marker-corners.csv")
                self.assertEqual(table["id"].tolist(), [7] * 3, text)
                for i, row in enumerate(own):
                    corners = corners_of(table, i)
                    self.assertEqual(int(row["id"]), 7)
                    self.agree(row, *pose_of(corners), pixels(*POSES[i], np.zeros((1, 2)))[0], f"{family} {i}")
                    # The corners themselves are those of the print, in some turn of it; the library's edges are good to some tenths of a pixel.
                    print_corners = pixels(*POSES[i], OURS * TAG_M / 2)
                    self.assertLess(min(np.abs(np.roll(print_corners, k, axis=0) - corners).max() for k in range(4)), 0.45)
                shift = np.mean([corners_of(table, i).mean(0) - pixels(*POSES[i], OURS * TAG_M / 2).mean(0) for i in range(3)], axis=0)
                self.assertLess(np.abs(shift).max(), 0.12)  # no half pixel is left

    def test_corners_that_begin_elsewhere(self):
        """Nodes that turn the list of corners: the homography beside it, which maps (-1, 1) to the library's first one, has the print's way up."""
        square, want = np.array([(-1, 1), (1, 1), (1, -1), (-1, -1.0)]), None
        library_order = OURS[::-1] * TAG_M / 2  # of the families that are drawn as OpenCV's readers see them
        for first, filled in ((0, True), (1, True), (2, True), (3, True), (0, False), (2, "other")):
            events = with_lens()
            for i in range(3):
                corners = pixels(*POSES[i], library_order) + 0.5
                rows = [row for (x, y), (u, v) in zip(square, corners) for row in ((x, y, 1, 0, 0, 0, -u * x, -u * y, -u), (0, 0, 0, x, y, 1, -v * x, -v * y, -v))]
                h = np.linalg.svd(np.array(rows))[2][-1] * (filled is not False)
                h = np.linalg.inv(h.reshape(3, 3)).ravel() if filled == "other" else h
                events.tags("/cam/detections", START_NS + i * STEP_NS, "cam_optical", np.roll(corners, first, axis=0), "tagStandard41h12", homography=h)
            text, folder = self.take(events.mcap(self.folder / f"{first}{filled}.mcap"), out=f"out-{first}{filled}")
            table = waymark.Recording(folder).table("marker-corners.csv")
            got = np.array([corners_of(table, i) for i in range(3)])
            want = got if want is None else want
            with self.subTest(first=first, filled=filled):
                self.assertEqual("corners begin" in text, first > 0 and filled is True, text)
                if filled != "other":
                    np.testing.assert_allclose(got, want, atol=1e-6)

    def test_nvidia_s(self):
        """The library's corners the other way round, and a pose whose z axis is in the print; corners that its pose contradicts are none."""
        library, kind = AprilTag(), "isaac_ros_apriltag_interfaces"
        register({f"{kind}/msg/AprilTagDetection": "string family\nint32 id\ngeometry_msgs/Point center\ngeometry_msgs/Point[4] corners\n"
                                                   "geometry_msgs/PoseWithCovarianceStamped pose\n",
                  f"{kind}/msg/AprilTagDetectionArray": f"std_msgs/Header header\n{kind}/AprilTagDetection[] detections\n"})
        for family in ("tag36h11", "tagStandard41h12"):
            modules = library.picture(family, 7)
            pictures = [rendered(modules, FAMILIES[family], *p) for p in POSES]
            own = self.detected(family, pictures, family)
            for turn in (0, 1, 2, "the library's order"):
                events = with_lens()
                for i, (picture, (rotation, place)) in enumerate(zip(pictures, POSES)):
                    (found,) = library.detect(family, picture)
                    t_ns, points = START_NS + i * STEP_NS, np.reshape(found[1], (4, 2))
                    points = points if isinstance(turn, str) else np.roll(points[::-1], turn, axis=0)
                    x, y, z, w = map(float, quaternion(rotation @ np.diag([1.0, -1.0, -1.0])))
                    seen = M.make("Pose", position=M.point(place), orientation=M.make("Quaternion", x=x, y=y, z=z, w=w))
                    header = M.header(t_ns, "cam_optical")
                    tag = M.make(f"{kind}/AprilTagDetection", family=family, id=found[0], center=M.point((0, 0, 0)), corners=[M.point((*map(float, p), 0)) for p in points],
                                 pose=M.make("PoseWithCovarianceStamped", header=header, pose=M.make("PoseWithCovariance", pose=seen)))
                    events.put("/tag_detections", f"{kind}/AprilTagDetectionArray", t_ns, M.make(f"{kind}/AprilTagDetectionArray", header=header, detections=[tag]))
                text, folder = self.take(events.mcap(self.folder / f"isaac-{turn}.mcap"), out=f"isaac-{family}-{turn}")
                if turn:
                    self.assertIn("go round the other way" if isinstance(turn, str) else "contradict each other", text)
                    continue
                tables = waymark.Recording(folder).table("marker-corners.csv")
            for i, row in enumerate(own):
                self.agree(row, *pose_of(corners_of(tables, i)), pixels(*POSES[i], np.zeros((1, 2)))[0], f"{family} {i}")

    def test_opencv_s_aruco(self):
        pictures = [rendered(aruco_modules(), 6, *p) for p in POSES]
        own = self.detected("aruco", pictures, "aruco_4x4_50")
        self.assertEqual([int(row["id"]) for row in own], [0, 0, 0])
        events = with_lens()
        for i, p in enumerate(POSES):
            t_ns, at = START_NS + i * STEP_NS, pixels(*p, OURS * TAG_M / 2)  # upper left first, clockwise; a pixel's middle is whole
            fields = {f"{axis}{k}": float(at[k]["xy".index(axis)]) for k in range(4) for axis in "xy"}
            events.put("/fiducial_vertices", "FiducialArray", t_ns, M.make(
                "FiducialArray", header=M.header(t_ns, "cam_optical"), fiducials=[M.make("Fiducial", fiducial_id=0, **fields)]))
        _, folder = self.take(events.mcap(self.folder / "a.mcap"))
        table = waymark.Recording(folder).table("marker-corners.csv")
        for i, row in enumerate(own):
            np.testing.assert_allclose(corners_of(table, i), pixels(*POSES[i], OURS * TAG_M / 2), atol=1e-9)
            self.agree(row, *pose_of(corners_of(table, i)), pixels(*POSES[i], np.zeros((1, 2)))[0], f"aruco {i}")

    def test_poses_of_each_library(self):
        library = AprilTag()
        aruco = self.detected("aruco", [rendered(aruco_modules(), 6, *p) for p in POSES], "aruco_4x4_50")
        april = self.detected("april", [rendered(library.picture("tag36h11", 7), 8, *p) for p in POSES], "tag36h11")

        def quaternion_of(rotation):
            x, y, z, w = map(float, quaternion(rotation))
            return M.make("Quaternion", x=x, y=y, z=z, w=w)

        def ros_pose(rotation, place):
            return M.make("Pose", position=M.point(place), orientation=quaternion_of(rotation))

        # The print's axes x, y, z (to the right, up, out) as the library's: what are its axes?
        opencv = np.eye(3)
        apriltag = np.diag([1.0, -1.0, -1.0])  # y down, z into the print
        aruco_ros = np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]])  # x to the left, y out, z up
        cases = {
            "aruco_msgs/MarkerArray": (aruco, opencv, lambda h, p: M.make("aruco_msgs/MarkerArray", header=h, markers=[M.make(
                "aruco_msgs/Marker", header=h, id=0, pose=M.make("PoseWithCovariance", pose=p))])),
            "aruco_msgs/MarkerArray of aruco_ros": (aruco, aruco_ros, lambda h, p: M.make("aruco_msgs/MarkerArray", header=h, markers=[M.make(
                "aruco_msgs/Marker", header=h, id=0, pose=M.make("PoseWithCovariance", pose=p))])),
            "aruco_opencv_msgs/ArucoDetection": (aruco, opencv, lambda h, p: M.make("ArucoDetection", header=h, markers=[M.make(
                "MarkerPose", marker_id=0, pose=p)])),
            "fiducial_msgs/FiducialTransformArray": (aruco, opencv, lambda h, p: M.make("FiducialTransformArray", header=h, transforms=[M.make(
                "FiducialTransform", fiducial_id=0, transform=M.make("geometry_msgs/Transform", rotation=p.orientation, translation=M.make(
                    "Vector3", x=p.position.x, y=p.position.y, z=p.position.z)))])),
            "vision_msgs/Detection2DArray": (aruco, opencv, lambda h, p: M.make("Detection2DArray", header=h, detections=[M.make(
                "Detection2D", header=h, results=[M.make("ObjectHypothesisWithPose", hypothesis=M.make("ObjectHypothesis", class_id="0"), pose=M.make(
                    "PoseWithCovariance", pose=p))])])),
            "vision_msgs/Detection3DArray": (aruco, apriltag, lambda h, p: M.make("Detection3DArray", header=h, detections=[M.make(
                "Detection3D", header=h, results=[M.make("ObjectHypothesisWithPose", hypothesis=M.make("ObjectHypothesis", class_id="aruco_0"),
                                                         pose=M.make("PoseWithCovariance", pose=p))])])),
        }
        register({"ar_track_alvar_msgs/msg/AlvarMarker": "std_msgs/Header header\nuint32 id\nuint32 confidence\ngeometry_msgs/PoseStamped pose\n",
                  "ar_track_alvar_msgs/msg/AlvarMarkers": "std_msgs/Header header\nar_track_alvar_msgs/AlvarMarker[] markers\n",
                  "ros2_aruco_interfaces/msg/ArucoMarkers": "std_msgs/Header header\nint64[] marker_ids\ngeometry_msgs/Pose[] poses\n"})
        cases |= {
            "ar_track_alvar_msgs/AlvarMarkers": (aruco, opencv, lambda h, p: M.make("ar_track_alvar_msgs/AlvarMarkers", header=M.header(START_NS, ""), markers=[M.make(
                "ar_track_alvar_msgs/AlvarMarker", header=h, id=0, pose=M.make("PoseStamped", header=h, pose=p))])),
            "ros2_aruco_interfaces/ArucoMarkers": (aruco, opencv, lambda h, p: M.make("ros2_aruco_interfaces/ArucoMarkers", header=h, marker_ids=np.array([0]), poses=[p])),
        }
        for name, (own, axes, make) in cases.items():
            with self.subTest(name):
                events = Events()
                for i, (rotation, place) in enumerate(POSES):
                    t_ns = START_NS + i * STEP_NS
                    events.put("/cam/tags", name.split(" ")[0], t_ns, make(M.header(t_ns, "cam_optical"), ros_pose(rotation @ axes, place)))
                text, folder = self.take(events.mcap(self.folder / "a.mcap"), out=f"out-{name.replace('/', '-')}")
                table = waymark.Recording(folder).table("markers.csv")
                for i, row in enumerate(own):
                    place = np.array([table[key][i] for key in ("x_m", "y_m", "z_m")])
                    np.testing.assert_allclose(place, OPTICAL @ POSES[i][1], atol=1e-9)
                    self.agree(row, place, table["yaw_rad"][i], None, f"{name} {i}\n{text}")
        self.april_ros_1(april, ros_pose)

    def april_ros_1(self, own, ros_pose):
        """apriltag_ros for ROS 1: the library's way up of tag36h11; x to the right, y up, z out of the picture that it draws."""
        many = {"id": np.array([7], dtype=np.int32), "size": np.array([TAG_M])}
        for package, fields, values, stamped in (
                ("apriltag_ros", "int32[] id\nfloat64[] size\ngeometry_msgs/PoseWithCovarianceStamped pose\n", many, "PoseWithCovarianceStamped"),
                ("apriltags2_ros", "int32[] id\nfloat64[] size\ngeometry_msgs/PoseWithCovarianceStamped pose\n", many, "PoseWithCovarianceStamped"),
                ("apriltags_ros", "int32 id\nfloat64 size\ngeometry_msgs/PoseStamped pose\n", {"id": 7, "size": TAG_M}, "PoseStamped")):
            register({f"{package}/msg/AprilTagDetection": fields,
                      f"{package}/msg/AprilTagDetectionArray": f"std_msgs/Header header\n{package}/AprilTagDetection[] detections\n"})
            events = Events()
            for i, p in enumerate(POSES):
                t_ns = START_NS + i * STEP_NS
                header, inner = M.header(t_ns, "cam_optical"), ros_pose(*p)
                pose = M.make(stamped, header=header, pose=inner if stamped == "PoseStamped" else M.make("PoseWithCovariance", pose=inner))
                tag = M.make(f"{package}/AprilTagDetection", pose=pose, **values)
                events.put("/tag_detections", f"{package}/AprilTagDetectionArray", t_ns,
                           M.make(f"{package}/AprilTagDetectionArray", header=header, detections=[tag]))
            text, folder = self.take(events.mcap(self.folder / "a.mcap"), out=f"out-{package}")
            self.assertIn("tag36h11", text)
            table = waymark.Recording(folder).table("markers.csv")
            for i, row in enumerate(own):
                self.agree(row, np.array([table[key][i] for key in ("x_m", "y_m", "z_m")]), table["yaw_rad"][i], None, f"{package} {i}")


def april_events(points, family="tag36h11", info=None):
    """Two messages of the library's corners, p[0..3]."""
    events = Events()
    for i in range(2):
        t_ns = START_NS + i * STEP_NS
        if info:
            events.put("/cam/camera_info", "CameraInfo", t_ns, camera_info(t_ns, "cam_optical", SIZE, **info))
        events.tags("/cam/detections", t_ns, "cam_optical", points, family)
    return events


class Rectified(BagTest):
    POINTS = np.array([(50.5, 190.5), (90.5, 195.5), (95.5, 150.5), (55.5, 145.5)])

    def corners(self, info, *options, out="out"):
        text, folder = self.take(april_events(self.POINTS, info=info).mcap(self.folder / "a.mcap"), *options, out=out)
        return text, corners_of(waymark.Recording(folder).table("marker-corners.csv" if info else "marker-corners-cam.csv"))

    def test_corners_without_a_lens_are_kept_aside(self):
        text, found = self.corners(None)
        np.testing.assert_allclose(found, (self.POINTS - 0.5)[[1, 0, 3, 2]], atol=1e-9)
        self.assertIn("marker-corners-cam.csv", text)
        self.assertFalse((self.folder / "out/marker-corners.csv").exists())

    def test_corners_of_the_rectified_picture_become_the_raw_one_s(self):
        from waymark.bag.lens_fit import equidistant, radtan
        as_read = (self.POINTS - 0.5)[[1, 0, 3, 2]]
        for name, bend, d, model in (("plumb_bob", radtan, (-0.3, 0.1, 0.001, -0.001, -0.01), "plumb_bob"),
                                     ("equidistant", equidistant, (-0.02, 0.004, 0, 0), "equidistant")):
            info = {"k": (150, 151, 160, 120), "d": d, "model": model, "p": (140, 141, 155, 118)}
            text, found = self.corners(info, out=name)
            rays = (as_read - (155, 118)) / (140, 141)
            np.testing.assert_allclose(found, bend(d, rays) * (150, 151) + (160, 120), atol=1e-9)
            self.assertIn("--tags raw", text)
            _, found = self.corners(info, "--tags", "raw", out=f"{name}-raw")
            np.testing.assert_allclose(found, as_read, atol=1e-9)

    def test_corners_are_refused_where_the_rectification_is_no_number(self):
        lens = {"k": (150, 150, 160, 120), "d": (-0.3, 0.1, 0, 0, 0)}
        for name, info in (("p", lens | {"p": (np.nan, 141, 155, 118)}), ("r", lens | {"p": (140, 141, 155, 118), "r": np.full(9, np.nan)})):
            text, folder = self.take(april_events(self.POINTS, info=info).mcap(self.folder / "a.mcap"), out=name)
            self.assertIn("P or R of its camera's camera_info is not a number", text)
            self.assertEqual(list(folder.glob("marker-corners*.csv")), [])

    def test_where_both_pictures_are_the_same_nothing_is_done(self):
        as_read = (self.POINTS - 0.5)[[1, 0, 3, 2]]
        for i, info in enumerate(({"k": (150, 150, 160, 120)}, {"k": (150, 150, 160, 120), "p": (150, 150, 160, 120)},
                                  {"k": (150, 150, 160, 120), "d": (-0.3, 0.1, 0, 0, 0)})):  # the last: P of zeros, nothing is rectified
            text, found = self.corners(info, out=str(i))
            np.testing.assert_allclose(found, as_read, atol=1e-9)
            self.assertNotIn("--tags raw", text)


def seen(class_id, detection="", place=(0.1, 0, 1), frame="cam_optical"):
    """A detection of vision_msgs, with a pose."""
    events = Events()
    pose = M.make("PoseWithCovariance", pose=M.pose(place, (1, 0, 0, 0)))
    events.put("/cam/seen", "Detection2DArray", START_NS, M.make("Detection2DArray", header=M.header(START_NS, "cam_optical"), detections=[M.make(
        "Detection2D", header=M.header(START_NS, frame), id=detection, results=[M.make("ObjectHypothesisWithPose", hypothesis=M.make(
            "ObjectHypothesis", class_id=class_id), pose=pose)])]))
    return events


class Siblings(BagTest):
    """Tags of other families, detectors and pictures than those above."""

    AS_READ = Rectified.POINTS - 0.5
    LENS = {"k": (F, F, *C)}

    def found(self, events, name, out=None):
        text, folder = self.take(events.mcap(self.folder / "a.mcap"), out=out or name)
        return text, waymark.Recording(folder).table(name)

    def test_families_as_they_are_spelt(self):
        for family, order, is_known in (("tag36_11", [1, 0, 3, 2], True), ("DICT_APRILTAG_36h11", [1, 0, 3, 2], True), ("TAG25H9", [1, 0, 3, 2], True),
                                        ("tagStandard52h13", [3, 2, 1, 0], True), ("tagCircle49h12", [3, 2, 1, 0], True), ("tag25h7", [3, 2, 1, 0], False),
                                        ("", [3, 2, 1, 0], False)):
            text, table = self.found(april_events(Rectified.POINTS, family=family, info=self.LENS), "marker-corners.csv", out=f"of-{family}")
            np.testing.assert_allclose(corners_of(table), self.AS_READ[order], atol=1e-9, err_msg=family)
            self.assertEqual("no family whose way up is known" not in text, is_known, text)
        self.assertIn("- tag36h11\n", (self.folder / "of-tag36_11/calibration.yaml").read_text())

    def test_corners_of_a_mirrored_print_are_none(self):
        """As of a node that fills AprilTag's messages by OpenCV's detector."""
        text, _ = self.take(april_events(Rectified.POINTS[::-1], info=self.LENS).mcap(self.folder / "a.mcap"))
        self.assertIn("all 2 messages are bad", text)
        self.assertIn("corners go round the other way", text)

    def test_pictures_of_another_size_than_the_lens_s(self):
        for scale, count, said in ((2, 1, "2 of 2 tags have corners beyond the 320 x 240 pixels"), (0.5, 50, "all of 100 tags lie in the upper left quarter"), (1, 50, "")):
            events = april_events(Rectified.POINTS * scale, info=self.LENS)
            events.items = events.items * count
            text, _ = self.take(events.mcap(self.folder / "a.mcap"), out=f"by-{scale}")
            self.assertIn(said, text)
            self.assertEqual("finding: /cam/detections" in text, bool(said), text)

    def test_numbers_of_classes(self):
        for class_id, detection, number in (("tag36h11:5", "", 5), ("tag36h11_00005", "", 5), ("5 (36h11)", "", 5), ("tag36h11", "7", 7), ("aruco_4x4_50", "7", 7),
                                            ("id7_0.16m", "", 7), ("DICT_4X4_50/7", "", 7)):
            _, table = self.found(seen(class_id, detection), "markers.csv", out=f"{class_id.replace('/', '-')} {detection}")
            self.assertEqual(list(table["id"]), [number], class_id)
        for class_id, detection in (("tag36h11", ""), ("-1", "3"), ("person", "3")):
            text, _ = self.take(seen(class_id, detection).mcap(self.folder / "a.mcap"), code=1, out=f"none {class_id}")
            self.assertIn("no number of a tag", text)

    def test_poses_elsewhere(self):
        text, _ = self.take(seen("5", frame="map").mcap(self.folder / "a.mcap"), code=1)
        self.assertIn("its poses are in 'map'", text)
        text, _ = self.found(seen("5", place=(100, 0, 900)), "markers.csv")
        self.assertIn("more than 900 m away", text)


class Several(BagTest):
    """Several tags in a message, of which one is bad; several cameras in a topic; several hypotheses of a tag."""

    @staticmethod
    def events(make, *, lenses=("cam",)):
        """Three messages of make(stamp, place to pose)."""
        events = Events()
        for name in lenses:
            events.put(f"/{name}/camera_info", "CameraInfo", START_NS, camera_info(START_NS, f"{name}_optical", SIZE, (F, F, *C)))
        for i in range(3):
            kind, message = make(START_NS + i * STEP_NS, lambda x, y=0.0: M.pose((x, y, 1), (1, 0, 0, 0)))
            events.put("/seen/tags", kind, START_NS + i * STEP_NS, message, late_ns=300_000_000)
        return events

    def rows(self, make, name="markers.csv", **more):
        self.count = getattr(self, "count", 0) + 1
        text, folder = self.take(self.events(make, **more).mcap(self.folder / "a.mcap"), out=f"out-{self.count}")
        table = waymark.Recording(folder).table(name)
        return text, table, [(identity, *np.round([x, y], 6)) for identity, x, y in zip(table["id"], table["x_m"], table["y_m"])][:3] if "x_m" in table else []

    def test_a_bad_tag_costs_itself(self):
        def arucos(tags):
            return lambda t_ns, pose: ("aruco_msgs/MarkerArray", M.make("aruco_msgs/MarkerArray", header=M.header(t_ns, "cam_optical"), markers=[
                M.make("aruco_msgs/Marker", header=M.header(t_ns, "cam_optical"), id=number, pose=M.make("PoseWithCovariance", pose=pose(x))) for number, x in tags]))

        for tags, why in (([(1, 0.1), (2, np.nan), (3, 0.3)], "the pose of tag 2 is none"), ([(1, 0.1), (4294967295, 0.2), (3, 0.3)], "a tag of the number 4294967295")):
            text, table, rows = self.rows(arucos(tags))
            self.assertIn(f"note: /seen/tags: 3 of its tags are left out; the first at 1700000000.000 s: {why}", text)
            self.assertEqual((table["id"].tolist(), rows[1]), ([1, 3] * 3, (3, 1.0, -0.3)))

    def test_a_bad_corner_costs_its_tag(self):
        def fiducials(t_ns, _):
            def tag(number, corners):
                return M.make("Fiducial", fiducial_id=number, **{f"{axis}{k}": float(corners[k]["xy".index(axis)]) for k in range(4) for axis in "xy"})
            square = [(100, 100), (140, 100), (140, 140), (100, 140)]
            return "FiducialArray", M.make("FiducialArray", header=M.header(t_ns, "cam_optical"), fiducials=[tag(1, square[::-1]), tag(2, square)])

        text, table, _ = self.rows(fiducials, "marker-corners.csv")
        self.assertIn("3 of its tags are left out", text)
        self.assertEqual((table["id"].tolist(), table["u2_px"].tolist()), ([2] * 3, [140.0] * 3))

    def test_the_likeliest_hypothesis_counts(self):
        def detections(t_ns, pose):
            header = M.header(t_ns, "cam_optical")
            results = [M.make("ObjectHypothesisWithPose", hypothesis=M.make("ObjectHypothesis", class_id=name, score=score), pose=M.make("PoseWithCovariance", pose=pose(x)))
                       for name, score, x in (("3", 0.2, 0.5), ("7", 0.9, 0.1), ("4", np.nan, 0.4))]
            return "Detection3DArray", M.make("Detection3DArray", header=header, detections=[M.make("Detection3D", header=header, results=results)])

        self.assertEqual(self.rows(detections)[2][0], (7, 1.0, -0.1))

    def test_two_cameras_in_a_topic(self):
        def april(t_ns, _):
            name = "back" if t_ns == START_NS + STEP_NS else "cam"
            corners = [M.make("apriltag_msgs/Point", x=float(x), y=float(y)) for x, y in Rectified.POINTS]
            return "AprilTagDetectionArray", M.make("AprilTagDetectionArray", header=M.header(t_ns, f"{name}_optical"), detections=[
                M.make("AprilTagDetection", family="tag36h11", id=7, corners=corners, homography=np.zeros(9))])

        self.assertEqual(self.rows(april, "marker-corners.csv", lenses=("cam", "back"))[1]["sensor"].tolist(), ["cam", "back", "cam"])

    def test_stamps_that_the_markers_alone_have(self):
        """As ar_track_alvar writes them."""
        register({"ar_track_alvar_msgs/msg/AlvarMarker": "std_msgs/Header header\nuint32 id\nuint32 confidence\ngeometry_msgs/PoseStamped pose\n",
                  "ar_track_alvar_msgs/msg/AlvarMarkers": "std_msgs/Header header\nar_track_alvar_msgs/AlvarMarker[] markers\n"})

        def alvar(t_ns, pose):
            marker = M.make("ar_track_alvar_msgs/AlvarMarker", header=M.header(t_ns, "cam_optical"), id=9, pose=M.make("PoseStamped", header=M.header(0, ""), pose=pose(0.1)))
            return "ar_track_alvar_msgs/AlvarMarkers", M.make("ar_track_alvar_msgs/AlvarMarkers", header=M.header(0, ""), markers=[marker])

        self.assertEqual(self.rows(alvar)[1]["t_ns"].tolist(), [START_NS + i * STEP_NS for i in range(3)])

    def test_boards_are_named(self):
        def boards(t_ns, pose):
            return "ArucoDetection", M.make("ArucoDetection", header=M.header(t_ns, "cam_optical"), markers=[M.make("MarkerPose", marker_id=4, pose=pose(0.1))],
                                            boards=[M.make("aruco_opencv_msgs/BoardPose", board_name="a", pose=pose(0.2))])

        text, table, _ = self.rows(boards)
        self.assertIn("/seen/tags: its boards are not taken", text)
        self.assertEqual(table["id"].tolist(), [4] * 3)


class Bad(BagTest):
    def test_what_gives_no_tag_is_named(self):
        nan = np.array([(np.nan, 1.0)] * 4)
        poses = Events()
        poses.put("/markers", "aruco_msgs/MarkerArray", START_NS, M.make("aruco_msgs/MarkerArray", header=M.header(START_NS, "base_link"), markers=[
            M.make("aruco_msgs/Marker", id=4, pose=M.make("PoseWithCovariance", pose=M.pose((0.1, 0, 1), (1, 0, 0, 0))))]))
        for name, events, said in (("a box", seen("7", place=(0, 0, 0)), "a box alone gives no corners"), ("a word", seen("person"), "'person'"),
                                   ("behind", seen("7", place=(0, 0, -1)), "before the camera"), ("no number", april_events(nan), "a corner is no number"),
                                   ("another frame", poses, "no camera's optical frame")):
            with self.subTest(name):
                text, _ = self.take(events.mcap(self.folder / "a.mcap"), code=1, out=f"out-{name}")
                self.assertIn(said, text)


if __name__ == "__main__":
    unittest.main()
