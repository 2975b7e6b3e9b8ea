#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A NaN in each number that a public function of the package or of libwaymark.so takes: it comes out as a NaN, or an error refuses it.

    test_nan.py BIN_DIR"""

import os
import shutil
import sys
import tempfile
import unittest
import warnings
from pathlib import Path

import common
import nans
import numpy as np

os.environ.setdefault("WAYMARK_LIBRARY", str(common.BIN.resolve().parent / "lib/libwaymark.so"))

import waymark
from waymark import geometry, maps, native, run, tables

FOLDER = Path(tempfile.mkdtemp(prefix="waymark-nan-"))
PLAN = maps.FloorPlan(0.05, (0.0, 0.0, 0.0), np.zeros((2, 3), dtype=np.int8))


def landmarks(**columns):
    return {"id": np.array([1.0, 2.0]), "x_m": np.array([1.0, 2.0]), "y_m": np.array([3.0, 4.0]), **columns}


def written_plan(resolution_m, origin, cells, edges, drivable):
    waymark.write_floor_plan(FOLDER / "map.yaml", waymark.FloorPlan(resolution_m, origin, cells, edges, drivable))
    plan = waymark.read_floor_plan(FOLDER / "map.yaml")
    return plan.resolution_m, plan.origin, plan.cells, plan.edges, plan.drivable


def read_plan(text):
    maps.Image.fromarray(np.array([[0, 100, 255]], dtype=np.uint8)).save(FOLDER / "plan.png")
    (FOLDER / "given.yaml").write_text(text)
    plan = waymark.read_floor_plan(FOLDER / "given.yaml")
    return plan.resolution_m, plan.origin, plan.cells


def written_landmarks(table):
    waymark.write_landmarks(FOLDER / "landmarks.csv", table)
    return waymark.read_landmarks(FOLDER / "landmarks.csv")


def written_table(table):
    waymark.write_table(FOLDER / "table.csv", table)
    return waymark.read_table(FOLDER / "table.csv")


def written_recording(table):
    folder = Path(tempfile.mkdtemp(dir=FOLDER))
    with waymark.RecordingWriter(folder / "r") as writer:
        writer.table("motion.csv", table)
    return waymark.Recording(folder / "r").table("motion.csv")


def written_picture(t_ns, arrival_ns, rate_hz=30.0):
    folder = Path(tempfile.mkdtemp(dir=FOLDER))
    with waymark.RecordingWriter(folder / "r") as writer:
        writer.picture("front", t_ns, np.zeros((8, 8), dtype=np.uint8), arrival_ns, rate_hz)
    return [(frame.t_ns, frame.arrival_ns) for frame in waymark.Recording(folder / "r").frames("front")]


def map_text(resolution=0.05, x=0.0, negate=0.0, free=0.196, occupied=0.65):
    return (f"image: plan.png\nresolution: {resolution}\norigin: [{x}, 0, 0]\nnegate: {negate}\n"
            f"free_thresh: {free}\noccupied_thresh: {occupied}\n").replace("nan", ".nan")


ROTATION = geometry.from_rpy(0.1, 0.2, 0.3)
PLANE = {f"cov_{name}": np.array([1.0]) for name in ("xx", "xy", "yy", "xt", "yt", "tt")}
CASES = {
    "geometry.rotation": (geometry.rotation, [[0.0, 0.0, 0.6, 0.8]]),
    "geometry.quaternion": (geometry.quaternion, [ROTATION]),
    "geometry.from_rpy": (geometry.from_rpy, [0.1, 0.2, 0.3]),
    "geometry.to_rpy": (geometry.to_rpy, [ROTATION]),
    "geometry.pose": (geometry.pose, [[1.0, 2.0, 3.0], [0.0, 0.0, 0.6, 0.8]]),
    "geometry.planar": (geometry.planar, [1.0, 2.0, 0.5]),
    "geometry.rotations": (geometry.rotations, [np.array([[0.0, 0.0, 0.6, 0.8], [0.0, 0.0, 0.0, 1.0]])]),
    "geometry.rotation_vectors": (geometry.rotation_vectors, [np.stack([ROTATION, ROTATION])]),
    "geometry.turned": (geometry.turned, [np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])]),
    "geometry.earth_centred": (geometry.earth_centred, [48.1, 11.5, 500.0]),
    "geometry.tangent_plane": (geometry.tangent_plane, [[48.1, 11.5, 500.0], 48.2, 11.6, 510.0]),
    "geometry.place_of": (geometry.place_of, [[48.1, 11.5, 500.0], 10.0, 20.0]),
    "maps.FloorPlan.cell_of": (PLAN.cell_of, [np.array([0.01, 0.02]), np.array([0.01, 0.02])]),
    "maps.FloorPlan.centre_of": (PLAN.centre_of, [np.array([0.0, 1.0]), np.array([0.0, 1.0])]),
    "maps.write_floor_plan": (written_plan, [0.05, [0.0, 0.0, 0.0], np.zeros((2, 3)), np.zeros((2, 3)), np.ones((2, 3))]),
    "maps.read_floor_plan": (lambda *numbers: read_plan(map_text(*numbers)), [0.05, 0.0, 0.0, 0.196, 0.65]),
    "maps.write_landmarks": (written_landmarks, [landmarks(z_m=np.array([0.0, 1.0]), sigma_m=np.array([0.1, 0.2]), yaw_rad=np.array([0.1, 0.2]))]),
    "maps.write_landmarks: with covariances": (written_landmarks, [landmarks(cov_xx=np.ones(2), cov_xy=np.zeros(2), cov_yy=np.ones(2))]),
    "maps.covariances: by sigmas": (maps.covariances, [{"id": np.array([1]), "sigma_m": np.array([0.1])}]),
    "maps.covariances": (maps.covariances, [{"id": np.array([1]), "cov_xx": np.ones(1), "cov_xy": np.zeros(1), "cov_yy": np.ones(1)}]),
    "run.covariance": (run.covariance, [{"t_ns": np.array([1]), **PLANE}]),
    "tables.field_text": (lambda value: float(tables.field_text(value) or "nan"), [0.5]),
    "tables.write_table": (written_table, [{"t_ns": np.array([1.0, 2.0]), "x_m": np.array([1.0, 2.0]), "id": np.array([1.0, 2.0])}]),
    "recording.RecordingWriter.table": (written_recording, [{"t_ns": np.array([1.0, 2.0]), "v_mps": np.array([1.0, 2.0]), "w_radps": np.array([0.0, 0.0]),
                                                    "arrival_ns": np.array([1.0, 2.0])}]),
    "tables.as_column": (lambda values: tables.as_column("x_m", values, "a"), [np.array([1.0, 2.0])]),
    "tables.as_table": (lambda table: tables.as_table(table, "a"), [{"t_ns": np.array([1.0]), "x_m": np.array([2.0])}]),
    "recording.RecordingWriter.picture": (written_picture, [1.0, 2.0]),
    "recording.RecordingWriter.frame": (lambda rate_hz: written_picture(1, 2, rate_hz), [30.0]),
}
# Functions of libwaymark.so through which numbers go, and where a NaN in each is tried. "out": they give them.
C_FUNCTIONS = {"waymark_push_row": "tests/unit/firmware/test_library_nan.c", "waymark_push_event": "tests/unit/firmware/test_library_nan.c",
               "waymark_replay": "here", "waymark_pose": "out", "waymark_bound": "out", "waymark_health": "out", "waymark_log_next": "out", "waymark_read_pose": "out",
               "waymark_read_bound": "out", "waymark_read_health": "out", "waymark_read_innovation": "out", "waymark_parameters": "out"}


def has_numbers(kind, seen=()):
    """Whether a type of cffi has a number of floating point in it, also behind pointers and in what is called back."""
    if kind in seen:
        return False
    inner = {"primitive": (), "pointer": "item", "array": "item"}.get(kind.kind)
    if kind.kind == "primitive":
        return kind.cname in ("double", "float")
    if kind.kind in ("struct", "union"):
        return any(has_numbers(field.type, (*seen, kind)) for _, field in kind.fields or ())
    if kind.kind == "function":
        return any(has_numbers(part, (*seen, kind)) for part in kind.args)
    return bool(inner) and has_numbers(getattr(kind, inner), (*seen, kind))


class Library(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.drive = common.Drive()
        cls.addClassCleanup(cls.drive.close)

    def test_a_part_from_nan_is_refused(self):
        for name in ("from_s", "until_s"):
            for given in (self.drive.recording, self.drive.run / "events.wmlog"):
                with self.subTest(name, given=given), self.assertRaisesRegex(waymark.WaymarkError, name):
                    waymark.replay(given, self.drive.folder / "robot.yaml", **{name: float("nan")})

    def test_a_part_behind_the_end_is_refused(self):
        with self.assertRaisesRegex(waymark.WaymarkError, "no datum in the part"):
            waymark.replay(self.drive.recording, self.drive.folder / "robot.yaml", from_s=1e6)

    def test_a_changed_value_of_nan_is_refused(self):
        for key in waymark.parameters(common.CONFIG):
            with self.subTest(key), self.assertRaisesRegex(waymark.WaymarkError, "finite"):
                waymark.replay(self.drive.run / "events.wmlog", changes={key: ".nan"})

    def test_each_function_with_numbers_is_known(self):
        library = native.library()
        kinds = {name: native.ffi.typeof(getattr(library, name)) for name in dir(library) if name.startswith("waymark_")}
        self.assertEqual({name for name, kind in kinds.items() if has_numbers(kind)}, set(C_FUNCTIONS))


class Numbers(unittest.TestCase):
    def tearDown(self):
        for path in FOLDER.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()

    def test_a_nan_comes_out_or_is_refused(self):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            nans.check(self, CASES, least=90)


def tearDownModule():
    shutil.rmtree(FOLDER)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[1:])
