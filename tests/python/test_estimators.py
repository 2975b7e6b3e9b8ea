#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A run of each estimator through `waymark export` and back: read by mcap and rosbags, judged by evo, cut off, imported again.

    test_estimators.py BIN_DIR Features      simulated features: seconds
    test_estimators.py BIN_DIR Pictures      detectors on rendered pictures, more cuts: a minute"""

import io
import json
import os
import random
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
from common import BIN, ROOT
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

import waymark
from waymark.bag.command import main as import_main
from waymark.export import export

CHUNK = 6  # opcode of MCAP
AGREE_M = 1e-6


def run(*command):
    """What a program printed; its error as an exception."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{command}\n{done.stdout}{done.stderr}")
    return done.stdout


def by_mcap(file):
    """{topic: [(log time, message)]} by the library of MCAP's makers."""
    out = {}
    with file.open("rb") as stream:
        for _, channel, message, decoded in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            out.setdefault(channel.topic, []).append((message.log_time, decoded))
    return out


def by_rosbags(file):
    """The same by rosbags."""
    out = {}
    with AnyReader([file]) as bag:
        for connection, log_ns, raw in bag.messages():
            out.setdefault(connection.topic, []).append((log_ns, bag.deserialize(raw, connection.msgtype)))
    return out


def plain(value):
    """A message of either library as nested lists, in the order of its fields' names; floats as their bits."""
    if hasattr(value, "__slots__") and not isinstance(value, np.generic) or hasattr(value, "__dataclass_fields__"):
        names = getattr(value, "__dataclass_fields__", None) or value.__slots__
        return [(name, plain(getattr(value, name))) for name in sorted(names) if name.islower() and not name.startswith("_")]
    if isinstance(value, float):
        return struct.pack("<d", value)
    if isinstance(value, (list, tuple, np.ndarray, bytes)):
        return [plain(item) for item in (value.tolist() if isinstance(value, np.ndarray) else value)]
    return value


def ends_of_chunks(data):
    """[(offset behind a chunk, messages until there)]."""
    at, count, out = 8, 0, []
    while at + 9 <= len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, at)
        at += 9 + length
        if opcode == CHUNK:
            chunk = next(StreamReader(io.BytesIO(data[at - 9 - length:at]), skip_magic=True, emit_chunks=True).records)
            count += sum(isinstance(record, Message) for record in breakup_chunk(chunk))
            out.append((at, count))
    return out


def readable(data):
    """How many messages a reader gets of a file that has no end."""
    count = 0
    try:
        for record in StreamReader(io.BytesIO(data)).records:
            count += isinstance(record, Message)
    except (McapError, EOFError, struct.error):
        pass
    return count


def is_bent(truth):
    """Whether a way is off its straight line by more than 1 cm rms."""
    where = np.column_stack([truth["x_m"], truth["y_m"]])
    return bool(np.linalg.svd(where - where.mean(axis=0), compute_uv=False)[1] > 0.01 * np.sqrt(len(where)))


class Doors:
    """What holds for each drive; DRIVES are of configuration, world, seconds."""

    DRIVES = []
    CUTS = 20

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="waymark-estimators-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.drives = {}
        for config, world, seconds in cls.DRIVES:
            recording, out = cls.folder / f"{config}-recording", cls.folder / f"{config}-run"
            run(BIN / "waymark-simulate", ROOT / f"config/worlds/{world}.yaml", "--duration", seconds, "--out", recording)
            cls.add(config, recording)
            cls.replay(config, recording, out)
            cls.truth_at_the_stamps_of_poses(recording, waymark.Run(out))
            file = cls.folder / f"{config}.mcap"
            export(waymark.Run(out), file, waymark.Recording(recording), pictures=True, can=True)
            cls.drives[config] = recording, out, file

    @classmethod
    def add(cls, config, recording):
        """More streams for a drive."""

    @classmethod
    def replay(cls, config, recording, out):
        run(BIN / "waymark", "replay", recording, "--config", ROOT / f"config/{config}.yaml", "--out", out)

    @staticmethod
    def truth_at_the_stamps_of_poses(recording, estimate):
        """evo compares the nearest stamps and `eval` interpolates: with equal stamps both compare the same pairs of poses."""
        truth, stamps = waymark.read_table(recording / "truth.csv"), np.unique(estimate.trajectory["t_ns"])
        stamps = stamps[(stamps >= truth["t_ns"][0]) & (stamps <= truth["t_ns"][-1])]
        table = {"t_ns": stamps, **{name: np.interp(stamps - stamps[0], truth["t_ns"] - stamps[0], truth[name])
                                    for name in ("x_m", "y_m", "z_m")}}
        nearest = np.searchsorted(truth["t_ns"], stamps)
        table.update({name: truth[name][np.minimum(nearest, len(truth["t_ns"]) - 1)] for name in ("qx", "qy", "qz", "qw")})
        waymark.write_table(recording / "truth.csv", table)

    def test_every_message_is_the_same_by_two_readers(self):
        for config, (recording, out, file) in self.drives.items():
            with self.subTest(config):
                first, second = by_mcap(file), by_rosbags(file)
                self.assertEqual(first.keys(), second.keys())
                for topic, messages in first.items():
                    order = [t for t, _ in messages]
                    self.assertEqual(order, sorted(order), topic)
                    self.assertEqual([(t, plain(m)) for t, m in messages], [(t, plain(m)) for t, m in second[topic]], topic)
                rows = {"/waymark/fused_pose": "trajectory.csv", "/waymark/pose": "published.csv", "/tf": "published.csv"}
                for topic, table in rows.items():
                    self.assertEqual(len(first[topic]), len(waymark.read_table(out / table)["t_ns"]), topic)
                innovations = sum(len(messages) for topic, messages in first.items() if topic.startswith("/waymark/innovations/"))
                self.assertEqual(innovations, len(waymark.read_table(out / "innovations.csv")["t_ns"]))
                pictures = sum(len(messages) for topic, messages in first.items() if topic.endswith("/image/compressed"))
                given = waymark.Recording(recording)
                self.assertEqual(pictures, sum(len(list(given.frames(camera))) for camera in given.cameras()))

    def test_evo_and_eval_agree(self):
        for config, (recording, out, file) in self.drives.items():
            with self.subTest(config):
                planar = "cov_xrx" not in waymark.Run(out).trajectory
                for ours, evo_s in (("none", ["--no_warnings"]), ("se2" if planar else "se3", ["--align"])):
                    if ours != "none" and not is_bent(waymark.read_table(recording / "truth.csv")):
                        continue  # standing, or along a line: evo refuses to align it
                    judged = self.folder / "judged.zip"
                    run(Path(sys.executable).with_name("evo_ape"), "mcap", file, "/truth/pose", "/waymark/fused_pose", *evo_s,
                        *(["--project_to_plane", "xy"] if planar else []), "--save_results", judged)
                    theirs = json.loads(run(sys.executable, "-m", "zipfile", "-e", judged, self.folder / "judged") or
                                        (self.folder / "judged/stats.json").read_text(encoding="utf-8"))
                    judged.unlink()
                    said = json.loads(run(BIN / "waymark-eval", out, recording, "--json", "--align", ours))
                    for name, evo_name in (("rmse", "rmse"), ("mean", "mean"), ("median", "median"), ("max", "max")):
                        self.assertAlmostEqual(said[f"position_{name}_m"], theirs[evo_name], delta=AGREE_M, msg=f"{ours} {name}")
                    self.assertGreater(said["position_rmse_m"], 0)

    def test_a_file_that_was_cut_off_is_readable_up_to_the_cut(self):
        chance = random.Random(1)
        for config, (_, _, file) in self.drives.items():
            with self.subTest(config):
                data = file.read_bytes()
                ends = ends_of_chunks(data)
                self.assertEqual(readable(data), ends[-1][1])
                for _ in range(self.CUTS):
                    cut = chance.randrange(len(data))
                    self.assertEqual(readable(data[:cut]), max((count for at, count in ends if at <= cut), default=0))

    def test_the_import_replays_to_the_same_poses(self):
        for config, (recording, out, file) in self.drives.items():
            with self.subTest(config):
                again = self.folder / f"{config}-again"
                self.assertEqual(import_main([str(file), "--out", str(again)]), 0)
                self.replay(config, again, self.folder / f"{config}-run-again")
                first, second = waymark.Run(out).trajectory, waymark.Run(self.folder / f"{config}-run-again").trajectory
                self.assertEqual(first["t_ns"].tolist(), second["t_ns"].tolist())
                for name in first:
                    if name.endswith("_m"):
                        self.assertLessEqual(np.abs(first[name] - second[name]).max(), AGREE_M, name)


class Features(Doors, unittest.TestCase):
    DRIVES = [("crossing-odometry", "crossing", 20), ("crossing-points", "crossing", 20), ("loops-lines", "loops-lines", 10),
              ("loops-markers", "loops-markers", 10), ("loops-landmarks", "loops-landmarks", 10), ("seabed-points", "seabed-points", 20)]
    if os.environ.get("WM_GATE"):  # ./dev test: one in the plane, one in space
        DRIVES = [DRIVES[1], DRIVES[5]]

    @classmethod
    def add(cls, config, recording):
        """GNSS for the drive over the crossing: positions of 0.5 m, ten a second, 0.1 s late."""
        if config != "crossing-points":
            return
        truth, noise = waymark.read_table(recording / "truth.csv"), np.random.default_rng(1)
        rows = slice(0, len(truth["t_ns"]) - 20, 5)
        n = len(truth["t_ns"][rows])
        waymark.write_table(recording / "gnss.csv", {
            "t_ns": truth["t_ns"][rows], "x_m": truth["x_m"][rows] + noise.normal(0, 0.5, n),
            "y_m": truth["y_m"][rows] + noise.normal(0, 0.5, n), "z_m": np.zeros(n), "sigma_xy_m": np.full(n, 0.5),
            "sigma_z_m": np.ones(n), "arrival_ns": truth["t_ns"][rows] + 100_000_000})

    def test_positions_are_fused(self):
        rows = waymark.Run(self.drives["crossing-points"][1]).innovations
        self.assertGreater(int(((rows["source"] == "gnss") & (rows["verdict"] == "fused")).sum()), 100)


class Pictures(Doors, unittest.TestCase):
    CUTS = 100
    DRIVES = [("corridor", "corridor-low", 10), ("corridor-particles", "corridor-low", 10), ("crossing", "crossing-easy", 1),
              ("hall", "hall-easy", 4), ("office-walls", "office-walls", 2), ("seabed", "seabed-easy", 1)]


if __name__ == "__main__":
    unittest.main()
