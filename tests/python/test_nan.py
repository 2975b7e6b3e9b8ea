#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A NaN in each number that a public function of the package takes: it comes out as a NaN, or ValueError refuses it.

    test_nan.py BIN_DIR"""

import copy
import inspect
import math
import shutil
import sys
import tempfile
import unittest
import warnings
from pathlib import Path

import common  # noqa: F401  (puts the package on the path)
import numpy as np

import waymark
from waymark import geometry, maps, recording, run, tables

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


def written_picture(t_ns, arrival_ns):
    folder = Path(tempfile.mkdtemp(dir=FOLDER))
    with waymark.RecordingWriter(folder / "r") as writer:
        writer.picture("front", t_ns, np.zeros((8, 8), dtype=np.uint8), arrival_ns)
    return [(frame.t_ns, frame.arrival_ns) for frame in waymark.Recording(folder / "r").frames("front")]


def map_text(resolution=0.05, x=0.0, negate=0.0, free=0.196, occupied=0.65):
    return (f"image: plan.png\nresolution: {resolution}\norigin: [{x}, 0, 0]\nnegate: {negate}\n"
            f"free_thresh: {free}\noccupied_thresh: {occupied}\n").replace("nan", ".nan")


ROTATION = geometry.from_rpy(0.1, 0.2, 0.3)
PLANE = {f"cov_{name}": np.array([1.0]) for name in ("xx", "xy", "yy", "xt", "yt", "tt")}
CASES = {
    "rotation": (geometry.rotation, [[0.0, 0.0, 0.6, 0.8]]),
    "quaternion": (geometry.quaternion, [ROTATION]),
    "from_rpy": (geometry.from_rpy, [0.1, 0.2, 0.3]),
    "to_rpy": (geometry.to_rpy, [ROTATION]),
    "pose": (geometry.pose, [[1.0, 2.0, 3.0], [0.0, 0.0, 0.6, 0.8]]),
    "planar": (geometry.planar, [1.0, 2.0, 0.5]),
    "rotations": (geometry.rotations, [np.array([[0.0, 0.0, 0.6, 0.8], [0.0, 0.0, 0.0, 1.0]])]),
    "rotation_vectors": (geometry.rotation_vectors, [np.stack([ROTATION, ROTATION])]),
    "turned": (geometry.turned, [np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])]),
    "earth_centred": (geometry.earth_centred, [48.1, 11.5, 500.0]),
    "tangent_plane": (geometry.tangent_plane, [[48.1, 11.5, 500.0], 48.2, 11.6, 510.0]),
    "place_of": (geometry.place_of, [[48.1, 11.5, 500.0], 10.0, 20.0]),
    "cell_of": (PLAN.cell_of, [np.array([0.01, 0.02]), np.array([0.01, 0.02])]),
    "centre_of": (PLAN.centre_of, [np.array([0.0, 1.0]), np.array([0.0, 1.0])]),
    "write_floor_plan": (written_plan, [0.05, [0.0, 0.0, 0.0], np.zeros((2, 3)), np.zeros((2, 3)), np.ones((2, 3))]),
    "read_floor_plan": (lambda *numbers: read_plan(map_text(*numbers)), [0.05, 0.0, 0.0, 0.196, 0.65]),
    "write_landmarks": (written_landmarks, [landmarks(z_m=np.array([0.0, 1.0]), sigma_m=np.array([0.1, 0.2]), yaw_rad=np.array([0.1, 0.2]))]),
    "write_landmarks with covariances": (written_landmarks, [landmarks(cov_xx=np.ones(2), cov_xy=np.zeros(2), cov_yy=np.ones(2))]),
    "covariances by sigmas": (maps.covariances, [{"id": np.array([1]), "sigma_m": np.array([0.1])}]),
    "covariances": (maps.covariances, [{"id": np.array([1]), "cov_xx": np.ones(1), "cov_xy": np.zeros(1), "cov_yy": np.ones(1)}]),
    "covariance": (run.covariance, [{"t_ns": np.array([1]), **PLANE}]),
    "field_text": (lambda value: float(tables.field_text(value) or "nan"), [0.5]),
    "write_table": (written_table, [{"t_ns": np.array([1.0, 2.0]), "x_m": np.array([1.0, 2.0]), "id": np.array([1.0, 2.0])}]),
    "RecordingWriter.table": (written_recording, [{"t_ns": np.array([1.0, 2.0]), "v_mps": np.array([1.0, 2.0]), "w_radps": np.array([0.0, 0.0]),
                                                    "arrival_ns": np.array([1.0, 2.0])}]),
    "as_column": (lambda values: tables.as_column("x_m", values, "a"), [np.array([1.0, 2.0])]),
    "as_table": (lambda table: tables.as_table(table, "a"), [{"t_ns": np.array([1.0]), "x_m": np.array([2.0])}]),
    "RecordingWriter.picture": (written_picture, [1.0, 2.0]),
}
WITHOUT_NUMBERS = {
    "is_integer", "is_text", "read_table", "read_landmarks",                            # take a path or a name
    "jpeg_size", "jpeg_of", "can_line",                                                 # bytes, uint8 and integers
}


def with_nan(value):
    """Copies of a value, each with a NaN in the place of one number."""
    if isinstance(value, dict):
        for key in value:
            for changed in with_nan(value[key]):
                yield {**value, key: changed}
    elif isinstance(value, list):
        for i, part in enumerate(value):
            for changed in with_nan(part):
                yield value[:i] + [changed] + value[i + 1:]
    elif isinstance(value, np.ndarray) and value.dtype.kind == "f":
        for i in range(value.size):
            changed = value.copy()
            changed.flat[i] = np.nan
            yield changed
    elif isinstance(value, float):
        yield math.nan


def has_nan(value):
    if isinstance(value, dict):
        return any(map(has_nan, value.values()))
    if isinstance(value, (list, tuple)):
        return any(map(has_nan, value))
    array = np.asarray(value)
    return array.dtype.kind == "f" and bool(np.isnan(array).any())


class Numbers(unittest.TestCase):
    def tearDown(self):
        for path in FOLDER.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()

    def test_the_cases_work_without_a_nan(self):
        for name, (function, arguments) in CASES.items():
            with self.subTest(name):
                self.assertFalse(has_nan(function(*copy.deepcopy(arguments))))

    def test_a_nan_comes_out_or_is_refused(self):
        count = 0
        for name, (function, arguments) in CASES.items():
            for changed in with_nan(arguments):
                count += 1
                with self.subTest(name, arguments=changed), warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    try:
                        out = function(*changed)
                    except ValueError as error:
                        self.assertGreater(len(str(error)), 10)
                        continue
                    self.assertTrue(has_nan(out), f"{name} makes {out} of it")
        self.assertGreater(count, 90)

    def test_each_function_of_the_modules_has_a_case(self):
        for module in (geometry, maps, run, tables, recording):
            for name, function in inspect.getmembers(module, inspect.isfunction):
                if function.__module__ == module.__name__ and not name.startswith("_"):
                    self.assertTrue(name in CASES or name in WITHOUT_NUMBERS, f"{module.__name__}.{name} has no case here")


def tearDownModule():
    shutil.rmtree(FOLDER)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[1:])
