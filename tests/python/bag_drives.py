# SPDX-License-Identifier: Apache-2.0
"""Bags of a drive whose end is known: 10 m straight at 1 m/s, then 5 s at 1 m/s and 0.3 rad/s. It ends at (10 + sin(1.5)/0.3, (1 - cos(1.5))/0.3)
with a heading of 1.5 rad."""

import shutil
import subprocess

import bag_files
import numpy as np
from bag_files import BIN, START_NS, M
from rosbags.rosbag2 import StoragePlugin

import waymark
from waymark.geometry import from_rpy, quaternion

STRAIGHT_S, DRIVE_S, SPEED, TURN = 10.0, 15.0, 1.0, 0.3
END = (10 + np.sin(1.5) / 0.3, (1 - np.cos(1.5)) / 0.3, 1.5)
CONFIG = "format: waymark-config/1\nestimator: odometry\ninitial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\n"
STILL = np.array([0, 0, 9.81])


def place(t):
    """x, y and heading after t seconds."""
    a = TURN * max(t - STRAIGHT_S, 0.0)
    return (min(t, STRAIGHT_S) + SPEED * np.sin(a) / TURN, SPEED * (1 - np.cos(a)) / TURN, a)


def turn_rate(t):
    """At t seconds, held until the next sample."""
    return TURN if t >= STRAIGHT_S - 1e-9 else 0.0


def times(rate_hz=20.0):
    """Seconds of samples; the last is the drive's end."""
    return np.arange(int(DRIVE_S * rate_hz) + 1) / rate_hz


def ns(t):
    """A stamp."""
    return START_NS + int(round(t * 1e9))


def matrix(xyz, rpy=(0, 0, 0)):
    """A pose."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = from_rpy(*rpy), xyz
    return out


def in_plane(pose):
    """A pose as a matrix, of x, y and heading."""
    return matrix((pose[0], pose[1], 0), (0, 0, pose[2]))


class Bag(bag_files.Events):
    """A bag of ROS 2 that is written message by message."""

    m = M

    def __init__(self, path):
        super().__init__()
        self.path, self.is_sorted, self.plugin = path, True, StoragePlugin.MCAP  # by the log; else in the order in which they were put

    def put(self, topic, kind, log_ns, message):
        """Adds a message."""
        super().put(topic, kind, log_ns, message, late_ns=0)

    def write(self):
        """Writes the bag, once."""
        if self.path.exists():
            return self.path
        if self.is_sorted:
            self.items.sort(key=lambda item: item[0])
        return self.folder(self.path, self.plugin)

    def vector(self, xyz):
        """A Vector3."""
        return self.m.make("Vector3", **{name: float(value) for name, value in zip("xyz", xyz)})

    def twist(self, v, w):
        """A Twist by its two vectors."""
        return self.m.make("Twist", linear=self.vector(v), angular=self.vector(w))

    def odometry(self, stamp, log, pose, v, w, topic="/odom", frame="odom", child="base_link", variances=(0,) * 6):
        """A message of odometry: its pose as (4, 4) or (x, y, heading)."""
        pose = pose if np.shape(pose) == (4, 4) else in_plane(pose)
        self.put(topic, "Odometry", log, self.m.make(
            "Odometry", header=self.m.header(stamp, frame), child_frame_id=child, pose=self.m.make("PoseWithCovariance", pose=self.m.pose_of(pose)),
            twist=self.m.make("TwistWithCovariance", twist=self.twist(v, w), covariance=np.diag(variances).ravel().astype(float))))

    def imu(self, stamp, log, gyro, acceleration=STILL, topic="/imu/data", frame="base_link", gyro_variance=0.0, acceleration_variance=0.0,
            turn=None):
        """An Imu; `turn`: its orientation as a matrix."""
        x, y, z, w = (0.0, 0.0, 0.0, 1.0) if turn is None else map(float, quaternion(turn))
        self.put(topic, "Imu", log, self.m.make(
            "Imu", header=self.m.header(stamp, frame), angular_velocity=self.vector(gyro), linear_acceleration=self.vector(acceleration),
            orientation=self.m.make("Quaternion", x=x, y=y, z=z, w=w),
            orientation_covariance=np.diag([-1.0 if turn is None else 1e-4, 0, 0]).ravel(),
            angular_velocity_covariance=np.diag([gyro_variance, 0, 0]).ravel(),
            linear_acceleration_covariance=np.diag([acceleration_variance, 0, 0]).ravel()))

    def tf(self, parent, child, pose, topic="/tf_static", stamp=0, log=START_NS):
        """A transform."""
        self.put(topic, "TFMessage", log, self.m.make("TFMessage", transforms=[self.m.transform(stamp, parent, child, pose)]))

    def drive(self, rate_hz=20.0, late_ns=2_000_000, stamp=ns, log=None, pose=place, twist=lambda t: ((SPEED, 0, 0), (0, 0, turn_rate(t))),
              when=lambda t: True, **more):
        """The odometry of the drive as it should be, but for what is given as functions of the time. `log`: late_ns after it."""
        for t in filter(when, times(rate_hz)):
            self.odometry(stamp(t), log(t) if log else ns(t) + late_ns, pose(t), *twist(t), **more)
        return self

    def turns(self, rate_hz=50.0, late_ns=1_000_000, stamp=ns, log=None, factor=1, **more):
        """A gyro that turns as the drive does, times a factor."""
        for t in times(rate_hz):
            self.imu(stamp(t), log(t) if log else ns(t) + late_ns, (0, 0, factor * turn_rate(t)), **more)
        return self

    def pose(self, stamp, topic, pose):
        """A PoseStamped in the map: x, y, heading."""
        self.put(topic, "PoseStamped", stamp, self.m.make("PoseStamped", header=self.m.header(stamp, "map"), pose=self.m.pose_of(in_plane(pose))))


class BagTest(bag_files.BagTest):
    """Tests that import bags of their own."""

    def setUp(self):
        super().setUp()
        self.count = 0

    def bag(self):
        """A new bag."""
        self.count += 1
        return Bag(self.folder / f"bag-{self.count}")

    def take(self, bag, *options, code=0):
        """Imports a bag: the recording and what was said."""
        out = self.folder / f"recording-{self.count}"
        shutil.rmtree(out, ignore_errors=True)
        said, out = super().take(bag.write(), *options, code=code, out=out)
        return (waymark.Recording(out) if code == 0 else None), said

    def end(self, recording, config=CONFIG):
        """x, y and heading at the end of a replay."""
        setup = self.folder / "robot.yaml"
        setup.write_text(config)
        run = self.folder / "run"
        shutil.rmtree(run, ignore_errors=True)
        done = subprocess.run([BIN / "waymark", "replay", recording.path, "--config", setup, "--out", run], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        last = [float(v) for v in (run / "trajectory.tum").read_text().splitlines()[-1].split()]
        return last[1], last[2], 2 * np.arctan2(last[6], last[7])

    def assert_end(self, recording, said, delta=0.01, end=END, config=CONFIG):
        """The pose at the end of a replay."""
        for got, right in zip(self.end(recording, config), end):
            self.assertAlmostEqual(got, right, delta=delta, msg=said)

    def assert_taken(self, bag, *words, never=(), options=(), **more):
        """Imports a bag: these words are said, those never, and a replay ends where assert_end() wants it."""
        recording, said = self.take(bag, *options)
        for word in words:
            self.assertIn(word, said)
        for word in never:
            self.assertNotIn(word, said)
        self.assert_end(recording, said, **more)
        return recording, said
