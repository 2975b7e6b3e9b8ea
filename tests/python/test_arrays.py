#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps and recordings as arrays: written by the package, taken by the programs and by other software; and the package's types.

    test_arrays.py BIN_DIR"""

import json
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
import yaml
from common import BIN, CONFIG, ROOT, Drive, Folder
from PIL import Image

import waymark
from waymark.documents import read_yaml
from waymark.maps import FREE, OCCUPIED, UNKNOWN, covariances


def plan():
    """A room of 3 x 2 m: walls around, an unknown corner, edges along the walls."""
    cells = np.full((40, 60), FREE, dtype=np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = OCCUPIED, OCCUPIED
    cells[30:, 50:] = UNKNOWN
    edges = np.zeros(cells.shape, dtype=bool)
    edges[1, 1:-1] = True
    return waymark.FloorPlan(0.05, (-1.0, 2.0, 0.5), cells, edges, cells == FREE)


class Documents(unittest.TestCase):
    def test_numbers_are_those_that_the_programs_read(self):
        for text, value in (("1e-3", 0.001), ("1.5E+2", 150.0), (".5", 0.5), ("-3.", -3.0), ("010", 10), ("-7", -7), ("12:30:00", "12:30:00"), ("no", "no"),
                            ("2026-01-01", "2026-01-01"), ("true", True), ("~", None), ("", None), ("1_000", "1_000"), ("tag36h11", "tag36h11"), ("'1'", "1")):
            got = read_yaml(f"key: {text}")["key"]
            self.assertEqual((got, type(got)), (value, type(value)), text)
        self.assertTrue(np.isnan(read_yaml("key: .nan")["key"]))
        self.assertEqual(read_yaml("a: &a {x: 1}\nb: {<<: *a, y: 2}")["b"], {"x": 1, "y": 2})

    def test_a_calibration_s_small_numbers_are_numbers(self):
        folder = Path(tempfile.mkdtemp(prefix="waymark-documents-"))
        self.addCleanup(shutil.rmtree, folder)
        (folder / "recording.yaml").write_text("format: waymark-recording/1\n")
        (folder / "calibration.yaml").write_text("sensors: {eye: {bearing_sigma_rad: 1e-3}}\n")
        self.assertEqual(waymark.Recording(folder).calibration["sensors"]["eye"]["bearing_sigma_rad"], 0.001)


class FloorPlans(Folder):
    def test_what_is_written_is_read(self):
        waymark.write_floor_plan(self.folder, plan())
        again = waymark.read_floor_plan(self.folder / "map/map.yaml")
        self.assertEqual((again.resolution_m, again.origin), (0.05, (-1.0, 2.0, 0.5)))
        for name in ("cells", "edges", "drivable"):
            np.testing.assert_array_equal(getattr(again, name), getattr(plan(), name), name)
        about = yaml.safe_load((self.folder / "map/map.yaml").read_text())
        picture = np.asarray(Image.open(self.folder / "map" / about["image"]))
        self.assertEqual(int(picture[0, 55]), 205)  # the picture's first row is the map's uppermost

    def test_a_picture_of_16_bits_has_the_same_cells(self):
        (self.folder / "map.yaml").write_text("image: plan.png\nresolution: 0.05\norigin: [0, 0, 0]\n")
        grey = np.array([[0, 100, 205, 254]], dtype=np.uint16)
        for levels in (grey.astype(np.uint8), grey * 257):
            Image.fromarray(levels).save(self.folder / "plan.png")
            self.assertEqual(waymark.read_floor_plan(self.folder / "map.yaml").cells.tolist(), [[OCCUPIED, UNKNOWN, UNKNOWN, FREE]], levels.dtype)
        (self.folder / "plan.png").write_bytes(b"P5\n4 1\n65535\n" + (grey * 257).astype(">u2").tobytes())  # a PGM by its content
        self.assertEqual(waymark.read_floor_plan(self.folder / "map.yaml").cells.tolist(), [[OCCUPIED, UNKNOWN, UNKNOWN, FREE]])

    def test_what_is_transparent_is_unknown(self):
        (self.folder / "map.yaml").write_text("image: plan.png\nresolution: 0.05\norigin: [0, 0, 0]\n")
        Image.fromarray(np.array([[[0, 0, 0, 0], [0, 0, 0, 255]]], dtype=np.uint8)).save(self.folder / "plan.png")
        self.assertEqual(waymark.read_floor_plan(self.folder / "map.yaml").cells.tolist(), [[UNKNOWN, OCCUPIED]])

    def test_cells_and_places_invert(self):
        rows, columns = np.mgrid[0:40:7, 0:60:7]
        x, y = plan().centre_of(rows.ravel(), columns.ravel())
        np.testing.assert_array_equal(plan().cell_of(x, y), (rows.ravel(), columns.ravel()))
        # The first cell's outer corner is the origin; along a row the plan's own x axis, which is turned by 0.5 rad.
        x, y = plan().centre_of(0, 10)
        np.testing.assert_allclose((x, y), (-1 + 0.525 * np.cos(0.5) - 0.025 * np.sin(0.5), 2 + 0.525 * np.sin(0.5) + 0.025 * np.cos(0.5)))

    def test_the_simulator_s_map_is_the_same_after_a_copy(self):
        subprocess.run([BIN / "waymark-simulate", ROOT / "config/worlds/corridor-low.yaml", "--duration", "0.2", "--out", self.folder / "a"],
                       check=True, capture_output=True)
        first = waymark.Recording(self.folder / "a").floor_plan()
        self.assertGreater(int(first.edges.sum()), 1000)
        shutil.copytree(self.folder / "a", self.folder / "b")
        shutil.rmtree(self.folder / "b/map")
        waymark.write_floor_plan(self.folder / "b", first)
        for name in "ab":
            subprocess.run([BIN / "waymark", "replay", self.folder / name, "--config", ROOT / "config/datasets/corridor.yaml", "--out",
                            self.folder / f"run-{name}"], check=True, capture_output=True)
        self.assertEqual(*((self.folder / f"run-{name}/trajectory.csv").read_bytes() for name in "ab"))

    def test_errors_name_the_file(self):
        bad = {"a.yaml": "resolution: [", "b.yaml": "image: x.png\n", "c.yaml": "resolution: 0.1\norigin: [0, 0]\nimage: none.png\n",
               "d.yaml": "resolution: -1\norigin: [0, 0]\nimage: e.png\n", "f.yaml": "resolution: 1\norigin: [0, 0]\nimage: a.yaml\n"}
        Image.new("L", (4, 4)).save(self.folder / "e.png")
        for name, text in bad.items():
            (self.folder / name).write_text(text)
            with self.assertRaises((ValueError, FileNotFoundError)) as caught:
                waymark.read_floor_plan(self.folder / name)
            self.assertTrue(str(self.folder) in str(caught.exception) or "resolution" in str(caught.exception), caught.exception)
        with self.assertRaisesRegex(ValueError, "one shape"):
            waymark.FloorPlan(0.1, cells=np.zeros((2, 2), dtype=np.int8), edges=np.zeros((3, 2), dtype=bool))


class Landmarks(Folder):
    def test_a_run_s_map_becomes_a_map_to_drive_by(self):
        drive = Drive()
        self.addCleanup(drive.close)
        (drive.folder / "slam.yaml").write_text(CONFIG.replace("landmark_ekf", "slam"))
        subprocess.run([BIN / "waymark", "replay", drive.recording, "--config", drive.folder / "slam.yaml", "--out", drive.folder / "mapped"],
                       check=True, capture_output=True)
        made = waymark.Run(drive.folder / "mapped").map
        self.assertGreater(len(made["id"]), 5)
        self.assertGreater(float(np.linalg.eigvalsh(covariances(made)).min()), 0)
        turned = dict(made, x_m=-made["y_m"], y_m=made["x_m"])  # a quarter turn: the poses turn with the map
        for name in ("cov_xx", "cov_xy", "cov_yy", "yaw_rad", "cov_tt"):
            turned.pop(name)
        for name, table in (("plain", made), ("turned", turned)):
            waymark.write_landmarks(drive.folder / f"{name}.csv", table)
            start = "" if name == "plain" else "initial_pose: {x_m: 0, y_m: 0, heading_rad: 2.57}\n"
            (drive.folder / f"{name}.yaml").write_text(CONFIG + start)
            subprocess.run([BIN / "waymark", "replay", drive.recording, "--config", drive.folder / f"{name}.yaml", "--landmarks",
                            drive.folder / f"{name}.csv", "--out", drive.folder / name], check=True, capture_output=True)
        plain, other = (waymark.Run(drive.folder / name).trajectory for name in ("plain", "turned"))
        self.assertLess(float(np.hypot(other["x_m"] + plain["y_m"], other["y_m"] - plain["x_m"])[-1000:].max()), 0.1)

    def test_missing_columns_and_double_identities_are_refused(self):
        table = {"id": np.array([1, 2]), "x_m": np.zeros(2), "y_m": np.ones(2)}
        waymark.write_landmarks(self.folder / "a.csv", table)
        self.assertEqual(waymark.read_landmarks(self.folder / "a.csv")["sigma_m"].tolist(), [0.05, 0.05])
        for changed, text in (({"id": np.array([2, 2])}, "twice"), ({"id": np.array([1.5, 2])}, "whole"), ({"x_m": np.array([0, np.nan])}, "not finite")):
            with self.assertRaisesRegex(ValueError, text):
                waymark.write_landmarks(self.folder / "b.csv", {**table, **changed})
        with self.assertRaisesRegex(ValueError, "y_m"):
            waymark.write_landmarks(self.folder / "b.csv", {"id": table["id"], "x_m": table["x_m"]})


class Recordings(Folder):
    def test_a_rate_that_no_header_holds_is_refused(self):
        with waymark.RecordingWriter(self.folder / "rate") as writer:
            for rate_hz in (np.inf, 1e-9, 1e30):
                with self.subTest(rate_hz), self.assertRaisesRegex(ValueError, "rate"):
                    writer.picture("front", 1, np.zeros((8, 8), dtype=np.uint8), rate_hz=rate_hz)

    def test_a_table_of_ones_own_needs_no_stamps(self):
        with waymark.RecordingWriter(self.folder / "own") as writer:
            writer.table("mine.csv", {"arrival_ns": np.array([2, 1]), "x_m": np.array([1.0, 2.0])})
        self.assertEqual(waymark.Recording(self.folder / "own").table("mine.csv")["x_m"].tolist(), [2.0, 1.0])

    def test_a_recording_written_from_arrays_is_localized_and_checked(self):
        """A robot that drives along a circle of 2 m past six landmarks, in 20 lines of numpy."""
        t = np.arange(0, 20, 0.02)
        stamps, heading, chance = (1e9 * t).astype(np.int64), 0.25 * t, np.random.default_rng(1)
        x, y = 2 * np.sin(heading), 2 - 2 * np.cos(heading)
        marks = np.array([[3, 0], [3, 4], [-3, 4], [-3, 0], [0, 5], [0, -2.0]])
        rows = {name: [] for name in ("t_ns", "sensor", "id", "bearing_rad", "range_m")}
        for k in range(0, len(t), 5):
            for number, (mx, my) in enumerate(marks, start=1):
                bearing = np.remainder(np.arctan2(my - y[k], mx - x[k]) - heading[k] + np.pi, 2 * np.pi) - np.pi
                values = stamps[k], "front", number, bearing + chance.normal(0, 0.01), np.hypot(mx - x[k], my - y[k]) + chance.normal(0, 0.03)
                for column, value in zip(rows.values(), values):
                    column.append(value)
        with waymark.RecordingWriter(self.folder / "drive", about="a circle") as writer:
            writer.table("motion.csv", {"t_ns": stamps, "v_mps": np.full(len(t), 0.5), "w_radps": np.full(len(t), 0.25)})
            writer.table("sightings.csv", {name: np.array(column) for name, column in rows.items()})
            writer.landmarks({"id": np.arange(1, 7), "x_m": marks[:, 0], "y_m": marks[:, 1], "sigma_m": np.full(6, 0.01)})
            writer.table("truth.csv", {"t_ns": stamps, "x_m": x, "y_m": y, "z_m": 0 * t, "qx": 0 * t, "qy": 0 * t, "qz": np.sin(heading / 2),
                                       "qw": np.cos(heading / 2)})
            writer.floor_plan(plan())
            for k in range(0, len(t), 100):
                writer.picture("front", int(stamps[k]), np.full((48, 64), k % 200, dtype=np.uint8))
            writer.calibration["sensors"] = {"front": {"mounting": {"xyz_m": [0, 0, 0]}, "bearing_sigma_rad": 0.01, "range_sigma_m": 0.03}}
        (self.folder / "robot.yaml").write_text(CONFIG + "initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\n")
        subprocess.run([BIN / "waymark", "replay", self.folder / "drive", "--config", self.folder / "robot.yaml", "--out", self.folder / "run"],
                       check=True, capture_output=True)
        said = json.loads(subprocess.run([BIN / "waymark-eval", self.folder / "run", self.folder / "drive", "--json"], check=True,
                                         capture_output=True, text=True).stdout)
        self.assertLess(said["position_rmse_m"], 0.03)
        again = waymark.Recording(self.folder / "drive")
        self.assertEqual([len(again.landmarks()["id"]), again.floor_plan().shape, len(list(again.frames("front")))], [6, (40, 60), 10])
        with self.assertRaisesRegex(ValueError, "float64"), waymark.RecordingWriter(self.folder / "b") as writer:
            writer.picture("front", 1, np.zeros((4, 4)))


class Types(unittest.TestCase):
    def test_the_package_is_typed_strictly(self):
        done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", ROOT / "build/mypy", ROOT / "tools/python/src/waymark"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout[-4000:])

    def test_types_reach_those_who_use_it(self):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "use.py").write_text('import waymark\nreveal_type(waymark.Run("a").trajectory["x_m"])\nwaymark.Run(1)\n')
            done = subprocess.run([sys.executable, "-m", "mypy", "--cache-dir", ROOT / "build/mypy", "use.py"], cwd=folder, text=True,
                                  capture_output=True, check=False, env={"MYPYPATH": str(ROOT / "tools/python/src")})
        self.assertIn("ndarray", done.stdout)
        self.assertIn('use.py:3: error: Argument 1 to "Run" has incompatible type "int"', done.stdout)


if __name__ == "__main__":
    unittest.main()
