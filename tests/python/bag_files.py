# SPDX-License-Identifier: Apache-2.0
"""What the tests of `waymark import` share: bags of any kind, written here, and the import as it is called."""

import contextlib
import io

import numpy as np
from common import BIN, Folder  # noqa: F401  (the package's path)
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from waymark.bag.command import main as import_main
from waymark.ros import Messages

START_NS = 1_700_000_000_000_000_000
M = Messages()


def imported(*arguments):
    """Exit code and what was printed."""
    out, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        code = import_main([str(argument) for argument in arguments])
    return code, out.getvalue() + errors.getvalue()


def register(definitions):
    """Makes types known that the package doesn't know: name to definition."""
    for name, text in definitions.items():
        M.store.register(get_types_from_msg(text, name))
        M._names[name.replace("/msg/", "/")] = name  # as Messages.type takes it


class Events:
    """Messages of topics with the times of their log: (log ns, topic, type, message)."""

    def __init__(self):
        self.items = []

    def put(self, topic, kind, t_ns, message, late_ns=3_000_000):
        self.items.append((t_ns + late_ns, topic, M.type(kind), message))

    def drive(self, count=20, step_ns=50_000_000, topic="/odom"):
        """Odometry of 0.5 m/s, so that there is something to import."""
        for i in range(count):
            t_ns = START_NS + i * step_ns
            twist = M.make("TwistWithCovariance")
            twist.twist.linear.x = 0.5
            place = M.make("PoseWithCovariance", pose=M.pose((0.5 * i * step_ns / 1e9, 0, 0), (0, 0, 0, 1)))
            self.put(topic, "Odometry", t_ns, M.make("Odometry", header=M.header(t_ns, "odom"), child_frame_id="base_link", pose=place, twist=twist))
        return self

    def tags(self, topic, t_ns, frame, points, family="tag36h11", identity=7, homography=(0.0,) * 9, **late):
        """AprilTag's detection of one tag: its corners p[0..3]."""
        corners = [M.make("apriltag_msgs/Point", x=float(x), y=float(y)) for x, y in points]
        tag = M.make("AprilTagDetection", family=family, id=identity, homography=np.array(homography), corners=corners)
        self.put(topic, "AprilTagDetectionArray", t_ns, M.make("AprilTagDetectionArray", header=M.header(t_ns, frame), detections=[tag]), **late)

    def mcap(self, path, compression=CompressionType.ZSTD, chunk_size=1 << 14, chunking=True, encode=bytes, kinds=(), **options):
        """An MCAP file of ROS 2. `kinds`: types that topics are said to have in the place of their own."""
        rows = ((log_ns, topic, "cdr", said, "ros2msg", M.definition(said), encode(M.encode(message, kind)))
                for log_ns, topic, kind, message in self.items for said in (dict(kinds).get(topic, kind),))
        return write_mcap(path, rows, chunk_size=chunk_size, compression=compression, use_chunking=chunking, **options)

    def folder(self, path, plugin=StoragePlugin.MCAP):
        """A folder of rosbag2."""
        with Ros2Writer(path, version=9, storage_plugin=plugin) as bag:
            topics = {}
            for log_ns, topic, kind, message in self.items:
                if topic not in topics:
                    topics[topic] = bag.add_connection(topic, kind, typestore=M.store)
                bag.write(topics[topic], log_ns, M.store.serialize_cdr(message, kind))
        return path

    def ros1(self, path, compression=None):
        """A bag of ROS 1; the messages' fields by name, CameraInfo's in capitals."""
        store = get_typestore(Stores.ROS1_NOETIC)
        bag = Ros1Writer(path)
        if compression:
            bag.set_compression(compression)
        with bag:
            topics = {}
            for log_ns, topic, kind, message in self.items:
                if topic not in topics:
                    topics[topic] = bag.add_connection(topic, kind, typestore=store)
                bag.write(topics[topic], log_ns, store.serialize_ros1(as_ros1(message, kind, store), kind))
        return path


def write_mcap(path, rows, profile="ros2", **options):
    """An MCAP file, each message by log time, topic, encoding, type, encoding of the type's definition (empty: none), definition and bytes."""
    with path.open("wb") as file:
        writer = McapWriter(file, **options)
        writer.start(profile=profile, library="test")
        channels = {}
        for log_ns, topic, wire, kind, style, definition, data in rows:
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, wire, writer.register_schema(kind, style, definition) if style else 0)
            writer.add_message(channels[topic], log_ns, data, log_ns)
        writer.finish()
    return path


def corners_of(table, row=0):
    """A tag's corners in marker-corners.csv, (4, 2)."""
    return np.array([[table[f"{axis}{k}_px"][row] for axis in "uv"] for k in range(4)])


def as_ros1(message, kind, store):
    """A message of ROS 2 as that of ROS 1: headers have a sequence, and some fields are in capitals."""
    fields = {}
    for name, (node, what) in store.get_msgdef(kind).fields:
        value = getattr(message, name, getattr(message, name.lower(), 0))
        if node.name == "NAME":
            value = as_ros1(value, what, store)
        elif node.name in ("ARRAY", "SEQUENCE") and what[0][0].name == "NAME":
            value = [as_ros1(item, what[0][1], store) for item in value]
        fields[name] = value
    return store.types[kind](**fields)


class BagTest(Folder):
    """A test that imports bags."""

    def take(self, path, *options, code=0, out="out"):
        """Imports a bag; what was printed, and the recording's folder."""
        said, text = imported(path, "--out", self.folder / out, *options)
        self.assertEqual(said, code, text)
        self.assertNotIn("Traceback", text)
        return text, self.folder / out


def grey_ramp(height=48, width=64):
    """A picture whose grey levels rise along the rows, uint8."""
    return np.tile(np.linspace(20, 230, width).round().astype(np.uint8), (height, 1))


def image(t_ns, frame, picture, encoding, step=0, big=0, height=None, width=None):
    """A sensor_msgs/Image of an array."""
    data = np.ascontiguousarray(picture)
    rows = data.shape[0]
    return M.make("sensor_msgs/Image", header=M.header(t_ns, frame), height=height or rows, width=width or data.shape[1], encoding=encoding,
                  step=step or data.nbytes // rows, is_bigendian=big, data=data.view(np.uint8).ravel())


def camera_info(t_ns, frame, size=(64, 48), k=(50, 51, 32, 24), d=(), model="plumb_bob", p=None, r=np.eye(3).ravel(), **more):
    """A sensor_msgs/CameraInfo; k and p as fx, fy, cx, cy."""
    fx, fy, cx, cy = k
    px = (0, 0, 0, 0) if p is None else p
    return M.make("CameraInfo", header=M.header(t_ns, frame), width=size[0], height=size[1], distortion_model=model, d=np.array(d, dtype=float),
                  k=np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1.0 if fx else 0.0]), r=r,
                  p=np.array([px[0], 0, px[2], 0, 0, px[1], px[3], 0, 0, 0, 1.0, 0]), **more)
