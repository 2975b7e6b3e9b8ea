#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark import` of bags that were changed at random: fields, types, stamps, counts, bytes. No crash, no text of a library, and a part that is
bad doesn't cost the others. What is written, the reader takes.

    test_bag_sweep.py BIN_DIR      WAYMARK_MUTANTS: how many (12), WAYMARK_MUTANT: that one alone, or FIRST-LAST, WAYMARK_SEED: of their numbers (1)"""

import copy
import dataclasses
import io
import os
import random
import re
import shutil
import subprocess
import traceback
import unittest

import numpy as np
from bag_files import BIN, M, START_NS, BagTest, Events, camera_info, grey_ramp, image, imported
from mcap.writer import CompressionType
from PIL import Image
from rosbags.rosbag2 import StoragePlugin

import waymark

COUNT = int(os.environ.get("WAYMARK_MUTANTS", "12"))
ALONE = os.environ.get("WAYMARK_MUTANT")
SEED = int(os.environ.get("WAYMARK_SEED", "1"))
# What a person must not read: names of libraries and their exceptions, types and addresses of Python.
LIBRARY = re.compile(r"Traceback|Error\b|Exception|rosbags|numpy|PIL\.|struct\.|zstandard|sqlite3\.|<class|object at 0x|<_io|cannot reshape|out of bounds|"
                     r"NoneType|ndarray|dtype|np\.|index .* is out of|invalid literal|could not convert|unpack|broadcast|codec can't")
CONFIG = "format: waymark-config/1\nestimator: odometry\n"
# Topics of the drive, and the file that each makes.
FILES = {"/odom": ("motion.csv", "motion6.csv", "increments.csv"), "/imu": ("imu.csv",), "/fix": ("gnss.csv",), "/front/image_raw": ("video/front.csv",),
         "/rear/image_raw/compressed": ("video/rear.csv",), "/front/detections": ("marker-corners.csv", "marker-corners-front.csv"), "/can0/frames": ("can.log",)}


def drive():
    """A short drive with a message of each kind that is taken."""
    events = Events().drive(30)
    out = io.BytesIO()
    Image.fromarray(grey_ramp()).save(out, "JPEG")
    jpeg = np.frombuffer(out.getvalue(), dtype=np.uint8)
    body = np.eye(4)
    body[:3, 3] = 0.3, 0, 0.5
    for topic in ("/tf_static", "/tf"):
        transforms = [M.transform(START_NS, "base_link", name, body) for name in ("front_optical", "imu", "gps")]
        events.put(topic, "TFMessage", START_NS, M.make("TFMessage", transforms=transforms))
    for i in range(30):
        t_ns = START_NS + i * 50_000_000
        header = M.header(t_ns, "front_optical")
        events.put("/imu", "Imu", t_ns, M.make("Imu", header=M.header(t_ns, "imu"), angular_velocity=M.make("Vector3", z=0.001 * (i % 3) + 0.0005),
                                               linear_acceleration=M.make("Vector3", x=0.01 * (i % 5), z=9.81)))
        events.put("/can0/frames", "can_msgs/Frame", t_ns, M.make("can_msgs/Frame", header=header, id=0x123, dlc=2))
        if i % 3 == 0:
            events.put("/fix", "NavSatFix", t_ns, M.make("NavSatFix", header=M.header(t_ns, "gps"), latitude=48.0, longitude=11.0 + i * 3.4e-7, altitude=500.0,
                                                         position_covariance_type=2, position_covariance=np.diag([1.0, 1, 2]).ravel()))
            events.put("/front/image_raw", "sensor_msgs/Image", t_ns, image(t_ns, "front_optical", grey_ramp(), "mono8"))
            events.put("/front/camera_info", "CameraInfo", t_ns, camera_info(t_ns, "front_optical", d=(0.1, 0.01, 0, 0, 0), p=(49, 50, 32, 24)))
            events.put("/rear/image_raw/compressed", "CompressedImage", t_ns, M.make("CompressedImage", header=M.header(t_ns, "rear"), format="jpeg", data=jpeg))
            events.tags("/front/detections", t_ns, "front_optical", ((10, 30), (30, 31), (31, 10), (11, 9)))
    events.items.sort(key=lambda item: item[0])
    return events


def leaves(message, path=()):
    """Fields of a message that are no messages: their holder, name and value."""
    for field in dataclasses.fields(message):
        value = getattr(message, field.name)
        if field.name == "__msgtype__":
            continue
        if dataclasses.is_dataclass(value):
            yield from leaves(value)
        else:
            yield message, field.name, value
            if isinstance(value, list):
                for item in value:
                    if dataclasses.is_dataclass(item):
                        yield from leaves(item)


def changed(value, chance):
    """Another value of a field's type."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, float):
        return chance.choice([float("nan"), float("inf"), -float("inf"), 0.0, -value, 1e30, 1e9, -1.0, value * 57.29578])
    if isinstance(value, int):
        return chance.choice([0, 1, 2, 100, 127])  # fits the integers of all fields that are changed
    if isinstance(value, str):
        return chance.choice(["", "/", "x" * 300, "mono16", "\N{SNOWMAN}", "16UC1", "base_link", "front_optical"])
    if isinstance(value, np.ndarray):
        if value.flags.writeable is False:
            value = value.copy()
        how = chance.randrange(4)
        if how == 0:
            return np.zeros_like(value)
        if how == 1 and value.dtype.kind == "f":
            return np.full_like(value, chance.choice([np.nan, np.inf, -1.0, 1e300]))
        if how == 2 and value.size not in (9, 12, 36, 8, 4):  # arrays of a fixed length keep it
            return value[: chance.randrange(value.size + 1)]
        out = value.copy()
        if out.size:
            out[chance.randrange(out.size)] = 0
        return out
    if isinstance(value, list):
        return [] if chance.random() < 0.5 and len(value) != 4 else value
    return value


def mutate_fields(events, chance, topic):
    """One field of some of a topic's messages."""
    items = [item for item in events.items if item[1] == topic]
    names = sorted({name for _, name, _ in leaves(items[0][3])})
    name = chance.choice(names)
    for item in items if chance.random() < 0.5 else chance.sample(items, min(3, len(items))):
        found = [leaf for leaf in leaves(item[3]) if leaf[1] == name]
        if found:
            holder, _, value = chance.choice(found)
            setattr(holder, name, changed(value, chance))


def mutate_stamps(events, chance, topic):
    """Stamps of a topic: zero, jumps, whole seconds, twice, backwards, another clock."""
    how = chance.randrange(7)
    items = [item for item in events.items if item[1] == topic and hasattr(item[3], "header")]
    order = list(range(len(items)))[::-1]
    first = items[0][3].header.stamp if items else None
    origin = first.sec * 10**9 + first.nanosec if first else 0
    for i, (_, _, _, message) in enumerate(items):
        t_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        new = [0, t_ns + (3600 * 10**9 if i > 5 else 0), t_ns // 10**9 * 10**9, origin, origin + order[i] * 50_000_000, t_ns - origin + 10**9,
               chance.randrange(2**31) * 10**9][how]
        message.header.stamp = M.time(new)
        if how == 6:
            message.header.stamp.nanosec = chance.choice([0, 2**32 - 1])


def mutate_counts(events, chance, topic):
    """Messages of a topic: one alone, none, each twice, in another order of the log."""
    how = chance.randrange(4)
    items = [item for item in events.items if item[1] == topic]
    others = [item for item in events.items if item[1] != topic]
    if how == 3:
        logs = [item[0] for item in items]
        chance.shuffle(logs)
        items = [(log, *item[1:]) for log, item in zip(logs, items)]
    events.items = others + [items[:1], [], items + items, items][how]


def mutate_types(events, chance, topic):
    """A topic whose type says another one: its bytes don't fit it."""
    kinds = sorted({item[2] for item in events.items})
    events.renamed = chance.choice(kinds)


MUTATIONS = {"fields": mutate_fields, "stamps": mutate_stamps, "counts": mutate_counts, "types": mutate_types}


def write(events, path, chance):
    """One of the containers."""
    how = chance.choice(["zstd", "plain", "sqlite", "loose"])
    if how == "sqlite":
        return events.folder(path, StoragePlugin.SQLITE3)
    return events.mcap(path.with_suffix(".mcap"), CompressionType.NONE if how == "plain" else CompressionType.ZSTD, chunking=how != "loose")


def spoil(path, chance):
    """Bytes of the file: flipped, zeroed, cut, doubled."""
    file = path if path.is_file() else next(p for p in path.iterdir() if p.name != "metadata.yaml")
    data = bytearray(file.read_bytes())
    how = chance.randrange(4)
    if how == 0:
        data = data[: chance.randrange(len(data))]
    elif how == 1:
        at = chance.randrange(len(data))
        data[at : at + chance.randrange(2000)] = bytes(chance.randrange(2000))
    else:
        for _ in range(1 if how == 2 else 30):
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    file.write_bytes(bytes(data))


class Sweep(BagTest):
    def one(self, number, base):
        chance = random.Random(f"{SEED} {number}")
        kind = chance.choice([*MUTATIONS, "bytes"])
        events, topic = Events(), chance.choice([*FILES, "/tf_static", "/tf", "/front/camera_info"])
        events.items = copy.deepcopy(base.items)
        if kind != "bytes":
            MUTATIONS[kind](events, chance, topic)
            if kind == "types":
                path = events.mcap(self.folder / f"{number}.mcap", kinds={topic: events.renamed})
            else:
                path = write(events, self.folder / str(number), chance)
        else:
            path = write(events, self.folder / str(number), chance)
            spoil(path, chance)
        out = self.folder / f"out-{number}"
        name = f"mutant {number}: {kind}" + ("" if kind == "bytes" else f" of {topic}")
        try:
            code, text = imported(path, "--out", out)
        except Exception:
            self.fail(f"{name}: {traceback.format_exc()[-1500:]}")
        self.assertIn(code, (0, 1), name)
        self.assertIsNone(LIBRARY.search(text.replace(str(self.folder), "")), f"{name}\n{text}")
        if kind != "bytes":
            self.assertEqual(code, 0, f"{name}\n{text}")
            for other, files in FILES.items():
                if other != topic:
                    self.assertTrue(any((out / file).exists() for file in files), f"{name}: {other} is lost\n{text}")
        if code == 0:
            self.is_readable(out, name, text)
        shutil.rmtree(out, ignore_errors=True)
        shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink()

    def is_readable(self, out, name, text):
        """What was written is read: by the package, and by the command."""
        recording = waymark.Recording(out)
        for table in recording.streams():
            recording.table(table)
        for camera in recording.cameras():
            self.assertGreater(len(list(recording.frames(camera))), 0, name)
        list(recording.can())
        if recording.calibration and "marker-corners.csv" in recording.streams():  # the size of prints is the user's to write
            (out / "calibration.yaml").write_text((out / "calibration.yaml").read_text() + "markers: {family: tag36h11, size_m: 0.1}\n")
        (self.folder / "robot.yaml").write_text(CONFIG)
        done = subprocess.run([BIN / "waymark", "check", self.folder / "robot.yaml", out, "--quick"], capture_output=True, text=True, check=False)
        if "vehicle.dbc: is not there, but needed" not in done.stdout:  # what frames mean is the user's to write, where nothing else drives
            self.assertNotIn("refused-input", done.stdout, f"{name}\n{text}")
        self.assertIn(done.returncode, (0, 1, 2), f"{name}: check died\n{done.stderr}")
        self.assertNotRegex(done.stderr, "Sanitizer|runtime error", name)

    def test_mutants(self):
        base = drive()
        first, _, last = (ALONE or f"0-{COUNT - 1}").partition("-")
        for number in range(int(first), int(last or first) + 1):
            with self.subTest(number):
                self.one(number, base)


if __name__ == "__main__":
    unittest.main()
