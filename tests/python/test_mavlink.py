#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark mavlink` in a network of its own, against a decoder of MAVLink 2 that shares nothing with pymavlink (mavlink_wire.py), and
against node-mavlink where it is there (mavlink_judge.mjs).

    test_mavlink.py BIN_DIR       Skipped (77) without the right to a network namespace, without pymavlink, lcm or lcm-gen."""

import json
import math
import os
import pathlib
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import types
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "common"))
from in_a_network import begin  # noqa: E402

begin("pymavlink", "lcm", "serial")

from common import BIN, ROOT  # noqa: E402

sys.path.insert(0, str(ROOT / "tests/golden"))
os.environ.update(WM_BIN_DIR=str(BIN), WM_SOURCE_DIR=str(ROOT))

import lcm_tools  # noqa: E402
import mavlink_wire  # noqa: E402
import numpy as np  # noqa: E402
import waymark  # noqa: E402
from pymavlink.dialects.v20 import common as dialect  # noqa: E402
from waymark import mavlink  # noqa: E402

SECONDS = 6
PORT = 14550
BOOTED_NS = 77 * 10**9  # the autopilot's clock at the test's start
CONFIG = "format: waymark-config/1\nestimator: landmark_ekf\npublish: {rate_hz: 50}\nrealtime: {lock_memory: false}\n"
STEP = 1.2e-7  # of a float, of its value


def program(*words, **environment):
    """`waymark mavlink` as a process."""
    return subprocess.Popen([sys.executable, "-m", "waymark.mavlink", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                            env={**os.environ, "PYTHONPATH": str(ROOT / "tools/python/src"), **environment})


def end(process):
    """Its last line, and what it said of errors."""
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=20)
    assert process.returncode == 0, f"{process.returncode}\n{out}{err}"
    return out.splitlines()[-1], err


# ── conversions, written out anew ────────────────────────────────────────────────────────────────────────────────────
def about_x(a):
    return np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])


def about_y(a):
    return np.array([[math.cos(a), 0, math.sin(a)], [0, 1, 0], [-math.sin(a), 0, math.cos(a)]])


def about_z(a):
    return np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])


def matrix(w, x, y, z):
    """Of a unit quaternion."""
    v = np.array([x, y, z])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * cross


def xyzw(roll, pitch, yaw):
    """A quaternion, as a product of three."""
    def times(a, b):
        return np.array([a[0] * b[0] - a[1:] @ b[1:], *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])

    parts = [np.array([math.cos(angle / 2), *(math.sin(angle / 2) * axis)]) for angle, axis in zip((yaw, pitch, roll), np.eye(3)[::-1], strict=True)]
    w, x, y, z = times(times(parts[0], parts[1]), parts[2])
    return [x, y, z, w]


def down(north_deg):
    """Rows: the axes forward (or north), right (or east) and down, in the map."""
    forward = np.array([math.cos(math.radians(north_deg)), math.sin(math.radians(north_deg)), 0])
    return np.array([forward, np.cross([0, 0, -1.0], forward), [0, 0, -1]])


def some(chance, size):
    """A covariance."""
    root = chance.normal(size=(size, size)) * 0.02
    return root @ root.T + 1e-5 * np.eye(size)


class Conversions(unittest.TestCase):
    def test_places_and_attitudes_are_those_of_rotation_matrices(self):
        chance = np.random.default_rng(1)
        for _ in range(200):
            north, zero, position = chance.uniform(-180, 180), chance.uniform(-50, 50, 2), chance.uniform(-100, 100, 3)
            roll, pitch, yaw = chance.uniform([-3, -1.4, -3], [3, 1.4, 3])
            local = mavlink.Frame(north, tuple(zero)).local(position, xyzw(roll, pitch, yaw), np.eye(6))
            np.testing.assert_allclose(local.position, down(north) @ (position - [*zero, 0]), atol=1e-11)
            body = about_z(yaw) @ about_y(pitch) @ about_x(roll)  # columns: forward, left, up
            np.testing.assert_allclose(local.turn, down(north) @ np.column_stack([body[:, 0], -body[:, 1], -body[:, 2]]), atol=1e-12)

    def test_well_known_poses(self):
        """East, north, up; the robot looks east: north 0, east 3, its heading is 90 degrees."""
        local = mavlink.Frame(90).local([3, 0, 1], [0, 0, 0, 1], np.diag([4.0, 1, 0, 0, 0, 0.01]))
        np.testing.assert_allclose(local.position, [0, 3, -1], atol=1e-12)
        np.testing.assert_allclose(local.turn, about_z(math.pi / 2), atol=1e-12)
        np.testing.assert_allclose(np.diag(local.covariance), [1, 4, 0, 0, 0, 0.01], atol=1e-12)  # north first
        nose_up = mavlink.Frame(0).local([0, 0, 0], xyzw(0, -0.3, 0), np.zeros((6, 6)))
        np.testing.assert_allclose(nose_up.turn, about_y(0.3), atol=1e-12)

    def test_covariances_are_those_of_samples(self):
        chance = np.random.default_rng(2)
        for north, roll, pitch, yaw in ((0, 0, 0, 0.4), (37, 0.3, -0.5, 2.0), (-120, -0.8, 0.9, -1.0)):
            covariance, frame, count = some(chance, 6), mavlink.Frame(north), 20_000
            errors = chance.multivariate_normal(np.zeros(6), covariance, count)
            base, rows = about_z(yaw) @ about_y(pitch) @ about_x(roll), down(north)
            seen = np.empty((count, 6))
            for k, error in enumerate(errors):
                angle = np.linalg.norm(error[3:])
                axis = error[3:] / angle
                cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
                turned = rows @ base @ (np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross) @ np.diag([1, -1, -1])
                seen[k] = [*(rows @ error[:3]), math.atan2(turned[2, 1], turned[2, 2]), -math.asin(turned[2, 0]), math.atan2(turned[1, 0], turned[0, 0])]
            told = frame.local([0, 0, 0], xyzw(roll, pitch, yaw), covariance).covariance
            sigma = np.sqrt(np.diag(told))
            np.testing.assert_allclose(np.cov(seen.T) / np.outer(sigma, sigma), told / np.outer(sigma, sigma), atol=0.04)

    def test_there_and_back_is_the_same(self):
        chance = np.random.default_rng(3)
        for k in range(200):
            frame = mavlink.Frame(chance.uniform(-180, 180), tuple(chance.uniform(-50, 50, 2)))
            position, yaw = chance.uniform(-100, 100, 3), chance.uniform(-3, 3)
            roll, pitch = (0, 0) if k % 2 else chance.uniform(-1, 1, 2)
            covariance = np.zeros((6, 6))
            covariance[np.ix_([0, 1, 5], [0, 1, 5])] = some(chance, 3)
            local = frame.local(position, xyzw(roll, pitch, yaw), covariance)
            back = frame.planar(local._replace(covariance=mavlink.full(mavlink.upper(local.covariance))))
            np.testing.assert_allclose([*back.position, math.remainder(back.heading - yaw, 2 * math.pi)], [*position[:2], 0], atol=1e-9)
            np.testing.assert_allclose(back.covariance[:3], covariance[[0, 0, 1], [0, 1, 1]], atol=1e-9)
            if k % 2:  # level: the heading is the turn about the body's z
                np.testing.assert_allclose(back.covariance[3:], covariance[[0, 1, 5], [5, 5, 5]], atol=1e-9)

    def test_what_is_no_covariance_is_unknown(self):
        good = mavlink.upper(some(np.random.default_rng(4), 6))
        self.assertTrue(np.isfinite(mavlink.full(good)).all())
        for numbers in ([math.nan, *good[1:]], [0.0] * 21, [-good[0], *good[1:]]):
            self.assertTrue(np.isnan(mavlink.full(numbers)).all())


class Sent(unittest.TestCase):
    """What is sent, when, and with which counters, of poses of any state."""

    def outgoing(self, *words):
        return mavlink.Outgoing(dialect, mavlink.Frame(), mavlink._parser().parse_args(["--link", "udpout:a:1", *words]))

    def pose(self, k, **fields):
        (pose,) = waymark.build("pose_t", **{"t_ns": k * 10_000_000, "orientation_xyzw": [0, 0, 0, 1], "state": 1, "dof": 3, **fields})
        return pose

    def test_lost_and_searching_poses_are_not_sent(self):
        out = self.outgoing("--rate", "50")
        sent = [bool(out.take(self.pose(2 * k, state=state), 0)) for k, state in enumerate((0, 1, 2, 3, 4))]
        self.assertEqual([False, True, True, False, True], sent)
        self.assertIsNone(out.take(self.pose(20, position_m=[math.nan, 0, 0]), 0))
        self.assertEqual(3, out.counts["withheld"])

    def test_the_counter_counts_resets_jumps_and_gaps(self):
        out, seen = self.outgoing("--rate", "50"), []
        for k, fields in enumerate(({}, {}, {"jumps": 1}, {"jumps": 1}, {"jumps": 1, "resets": 1}, {"state": 3}, {"jumps": 1, "resets": 1})):
            message = out.take(self.pose(2 * k, **fields), 0)
            seen += [message.reset_counter] if message else []
        self.assertEqual([0, 0, 1, 1, 2, 3], [number - seen[0] for number in seen])
        for k in range(300):
            message = out.take(self.pose(20 + 2 * k, jumps=2 + k), 0)
        self.assertEqual((seen[-1] + 300) % 256, message.reset_counter)

    def test_the_rate_is_kept_with_stamps_that_jitter(self):
        chance = np.random.default_rng(5)
        for rate, every, least in ((50, 20, 49), (30, 20, 24), (25, 10, 24), (1, 20, 0.9)):
            out = self.outgoing("--rate", str(rate))
            count = sum(bool(out.take(self.pose(0, t_ns=int((k * every + chance.uniform(-2, 2)) * 1e6)), 0)) for k in range(10_000 // every))
            self.assertTrue(least * 10 <= count <= rate * 10 + 1, (rate, count))
        self.assertTrue(out.take(self.pose(0), 0))  # a recording begins anew

    def test_quality_is_of_state_and_probability(self):
        for state, lost, quality in ((1, 0.0, 100), (1, 0.25, 75), (4, 0.0, 50), (2, 1.0, 1), (1, math.nan, 0), (1, -1.0, 0), (1, 1.5, 0), (1, math.inf, 0)):
            self.assertEqual(quality, mavlink.quality(self.pose(0, state=state, lost_probability=lost)))


class Autopilot:
    """A side of a UDP link: hears, and answers TIMESYNC by its own clock."""

    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        self.peer, self.heard, self.bytes, self.begin_ns = None, [], b"", time.monotonic_ns()

    def clock_ns(self):
        return time.monotonic_ns() - self.begin_ns + BOOTED_NS

    def send(self, name, component=1, **fields):
        self.socket.sendto(mavlink_wire.encode(name, 1, component, **fields), self.peer)

    def hear(self, seconds, live=None, poses=None, run=None):
        """For so long, and until a run has ended."""
        until, asked = time.monotonic() + seconds, 0
        while time.monotonic() < until or run and run.poll() is None:
            ready = select.select([self.socket] + ([live.fileno()] if live else []), [], [], 0.05)[0]
            if self.socket in ready:
                data, self.peer = self.socket.recvfrom(4096)
                self.bytes += data
                for frame in mavlink_wire.decode(data):
                    self.heard.append((time.time_ns(), frame))
                    if frame.name == "TIMESYNC" and frame.fields["tc1"] == 0:
                        self.send("TIMESYNC", tc1=self.clock_ns(), ts1=frame.fields["ts1"])
            while live and (message := live.next(0)):
                poses[(message.data.t_ns + message.data.utc_offset_ns) // 1000] = message.data
            if self.peer and time.monotonic() > asked + 0.5:
                asked = time.monotonic()
                self.send("TIMESYNC", ts1=self.clock_ns())

    def of(self, name):
        return [(t, frame) for t, frame in self.heard if frame.name == name]


class OnTheWire(unittest.TestCase):
    """A real run before the program, its messages decoded by two others."""

    def heard(self, *words):
        """What an autopilot heard of a run, and the run's poses by their stamps in UTC, us."""
        folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-mavlink-"))
        self.addCleanup(shutil.rmtree, folder)
        lcm_tools.write_recording(folder / "rec", SECONDS)
        (folder / "robot.yaml").write_text(CONFIG)
        autopilot, live, poses = Autopilot(PORT), waymark.Live(kinds=("POSE",)), {}
        self.addCleanup(autopilot.socket.close)
        bridge = program("--link", f"udpout:127.0.0.1:{PORT}", *words)
        self.addCleanup(bridge.kill)
        self.assertIn(f"-> udpout:127.0.0.1:{PORT}", bridge.stdout.readline())
        run = lcm_tools.run(folder / "rec", folder / "robot.yaml", folder / "out")
        self.addCleanup(run.kill)
        autopilot.hear(1, live, poses, run)
        autopilot.hear(1, live, poses)  # what is under way
        lcm_tools.finish(run)
        line, err = end(bridge)
        print(line)
        self.assertEqual("", err)
        return autopilot, poses, line

    def check_covariance(self, numbers, pose, north):
        """Of a level pose: J P J', with yaw against the heading."""
        c, s = math.cos(math.radians(north)), math.sin(math.radians(north))
        by = np.array([[c, s, 0], [s, -c, 0], [0, 0, -1]])
        told = by @ np.asarray(pose.covariance)[np.ix_([0, 1, 5], [0, 1, 5])] @ by.T
        full = np.zeros((6, 6))
        full[np.ix_([0, 1, 5], [0, 1, 5])] = told
        row_by_row = [full[i, j] for i in range(6) for j in range(i, 6)]
        np.testing.assert_allclose(numbers, row_by_row, rtol=1e-6, atol=1e-9)
        self.assertGreater(numbers[0], 0)

    def check_heartbeats_and_clock(self, autopilot):
        beats = autopilot.of("HEARTBEAT")
        self.assertTrue(3 <= len(beats) <= (beats[-1][0] - beats[0][0]) / 1e9 + 2.5, len(beats))  # a loaded computer leaves some out
        self.assertEqual((1, 197, 18, 8, 4), (beats[0][1].system, beats[0][1].component, *(beats[0][1].fields[k] for k in ("type", "autopilot", "system_status"))))
        answers = [(t, frame.fields) for t, frame in autopilot.of("TIMESYNC") if frame.fields["tc1"]]
        self.assertGreaterEqual(len(answers), 3)
        for t, fields in answers:  # its clock is UTC, of which the poses' stamps are
            self.assertTrue(BOOTED_NS <= fields["ts1"] <= autopilot.clock_ns() and abs(fields["tc1"] - t) < 5e9, fields)

    def test_odometry_is_the_run_s_pose(self):
        north = 25.0
        autopilot, poses, line = self.heard("--frame", "ned", "--north", str(north), "--zero", "1,-2", "--rate", "50")
        told, last, rows = autopilot.of("ODOMETRY"), None, down(north)
        self.assertGreater(len(told), 0.7 * len(poses))  # LCM and UDP may lose some on a loaded computer
        self.assertGreater(len(told), 20 * SECONDS)
        self.assertLessEqual(abs(int(line.split()[0]) - len(told)), 3, line)
        for t, frame in told:
            f, pose = frame.fields, poses[frame.fields["time_usec"]]
            self.assertEqual((1, 12, 2), (f["frame_id"], f["child_frame_id"], f["estimator_type"]))  # LOCAL_NED, BODY_FRD, VISION
            np.testing.assert_allclose([f["x"], f["y"], f["z"]], rows @ (np.array(pose.position_m) - [1, -2, 0]), atol=2e-6)
            x, y, z, w = pose.orientation_xyzw
            np.testing.assert_allclose(matrix(*f["q"]), rows @ matrix(w, x, y, z) @ np.diag([1, -1, -1]), atol=1e-6)
            np.testing.assert_allclose([f["vx"], f["vy"], f["vz"]], np.array(pose.velocity_mps) * [1, -1, -1], atol=1e-6)
            np.testing.assert_allclose([f["rollspeed"], f["pitchspeed"], f["yawspeed"]], np.array(pose.rate_radps) * [1, -1, -1], atol=1e-6)
            self.check_covariance(f["pose_covariance"], pose, north)
            self.assertTrue(math.isnan(f["velocity_covariance"][0]))
            state = (pose.resets, pose.jumps)
            if last:
                self.assertEqual(last[1] == f["reset_counter"], last[0] == state)
            last = state, f["reset_counter"]
            share = (1 - pose.lost_probability) * (50 if pose.state == 4 else 100)
            self.assertLessEqual(abs(f["quality"] - share), 1)
            self.assertTrue(-1e9 < t - f["time_usec"] * 1000 < 5e9)
        self.check_heartbeats_and_clock(autopilot)
        self.check_by_node(autopilot)

    def check_by_node(self, autopilot):
        """The same frames by node-mavlink."""
        folder = ROOT / ".cache/node/node_modules"
        if not shutil.which("node") or not (folder / "node-mavlink").is_dir():
            print("node-mavlink is not there (mavlink_judge.mjs): not asked")
            return
        done = subprocess.run(["node", ROOT / "tests/python/mavlink_judge.mjs", folder], input=autopilot.bytes, capture_output=True, check=True)
        theirs = [json.loads(line) for line in done.stdout.splitlines()]
        ours = [frame for _, frame in autopilot.heard]
        self.assertEqual([frame.name for frame in ours], [frame["name"] for frame in theirs])
        for frame, other in zip(ours, theirs, strict=True):
            self.assertEqual((frame.system, frame.component), (other["system"], other["component"]))
            for name, value in frame.fields.items():
                if name in other["fields"]:
                    np.testing.assert_array_equal(np.array(value, dtype=float), np.array(other["fields"][name], dtype=float), name)
        print(f"node-mavlink decodes {len(theirs)} frames alike")

    def test_vision_is_the_run_s_pose(self):
        autopilot, poses, _ = self.heard("--as", "vision")
        told = autopilot.of("VISION_POSITION_ESTIMATE")
        self.assertTrue(15 * SECONDS < len(told) <= 31 * SECONDS, len(told))
        for _, frame in told:
            f, pose = frame.fields, poses[frame.fields["usec"]]
            heading = 2 * math.atan2(pose.orientation_xyzw[2], pose.orientation_xyzw[3])
            np.testing.assert_allclose([f["x"], f["y"], f["z"]], [pose.position_m[0], -pose.position_m[1], -pose.position_m[2]], atol=2e-6)
            np.testing.assert_allclose([f["roll"], f["pitch"], math.remainder(f["yaw"] + heading, 2 * math.pi)], 0, atol=1e-6)
            self.check_covariance(f["covariance"], pose, 0)
            self.assertGreater(f["reset_counter"], 0)
        self.check_by_node(autopilot)

    def test_global_is_the_run_s_place_on_the_earth(self):
        autopilot, poses, _ = self.heard("--as", "global", "--north", "60", "--origin", "48.1,11.6,520")
        told = autopilot.of("GLOBAL_POSITION_SENSOR")
        self.assertGreater(len(told), 15 * SECONDS)
        stamps = np.array(sorted(poses))
        for _, frame in told:
            f = frame.fields
            stamp = f["time_usec"] - f["processing_time"]
            pose = poses[int(stamps[np.argmin(abs(stamps - stamp))])]
            self.assertLess(abs(stamp - stamps).min(), 3)
            north, east, _ = down(60) @ np.array(pose.position_m)
            metres = 111_194.9  # of a degree on a sphere of 6371 km: 0.5 % of some metres
            off = [(f["lat"] / 1e7 - 48.1) * metres - north, (f["lon"] / 1e7 - 11.6) * metres * math.cos(math.radians(48.1)) - east]
            self.assertLess(math.hypot(*off), 0.02 + 0.005 * math.hypot(north, east))
            self.assertTrue(f["source"] == 6 and math.isnan(f["alt"]) and math.isnan(f["alt_ellipsoid"]))
            self.assertAlmostEqual(f["eph"], math.sqrt(max(np.linalg.eigvalsh(np.array(pose.covariance)[:2, :2]))), delta=1e-6)

    def test_a_second_run_by_the_poses_of_the_first(self):
        """Run, MAVLink, MAVLink, run: the second one has no other data."""
        folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-mavlink-"))
        self.addCleanup(shutil.rmtree, folder)
        lcm_tools.write_recording(folder / "rec", SECONDS)
        (folder / "robot.yaml").write_text(CONFIG)
        (folder / "second.yaml").write_text(
            "format: waymark-config/1\nestimator: landmark_ekf\ncalibration: rec/calibration.yaml\nlandmarks: rec/landmarks.csv\n"
            f"realtime: {{lock_memory: false}}\npublish: {{lcm_url: '{lcm_tools.URL}', channel_prefix: SECOND_}}\n"
            "initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\nmerge: {horizon_ms: 3000, lateness_max_ms: 3000}\n"
            "devices: {lcm: [{stream: localizer}]}\n")  # late: on a loaded computer
        to, taking = program("--link", "udpout:127.0.0.1:14551", "--frame", "ned", "--north", "-70"), program(
            "--link", "udpin:127.0.0.1:14551", "--north", "-70", "--take", "197", "--component", "198", "--prefix", "SECOND_")
        second = subprocess.Popen([BIN / "waymark", "run", "--config", folder / "second.yaml", "--out", folder / "second"],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for process in (to, taking, second):
            self.addCleanup(process.kill)
        for bridge in (to, taking):
            self.assertTrue(bridge.stdout.readline())
        poses, live = [], waymark.Live(kinds=("POSE",))
        time.sleep(1)
        first = lcm_tools.run(folder / "rec", folder / "robot.yaml", folder / "out")
        self.addCleanup(first.kill)
        until = time.monotonic() + SECONDS + 20
        while first.poll() is None and time.monotonic() < until:
            if message := live.next(0.05):
                poses.append(message.data)
        time.sleep(3.5)
        lcm_tools.finish(first)
        second.send_signal(signal.SIGINT)
        lcm_tools.finish(second)
        line, err = end(taking)
        print(line)
        end(to)
        self.assertIn(" 0 refused", line)
        self.assertEqual("", err)
        source = json.loads((folder / "second/health.json").read_text())["sources"]["localizer"]
        self.assertGreater(source["fused"], 15 * SECONDS)
        self.assertEqual(0, source["malformed"])
        table = np.array([[p.t_ns + p.utc_offset_ns, *p.position_m[:2], 2 * math.atan2(*p.orientation_xyzw[2:])] for p in poses])
        way, track = math.hypot(*(table[-1, 1:3] - table[0, 1:3])), waymark.Run(folder / "second").trajectory
        utc_ns = track["t_ns"] + (time.time_ns() - time.monotonic_ns())
        seen = (utc_ns > table[0, 0] + 1.5e9) & (utc_ns < table[-1, 0] - 0.2e9)
        off = [track[name] - np.interp(utc_ns, table[:, 0], table[:, k]) for k, name in enumerate(("x_m", "y_m"), 1)]
        turn = 2 * np.arctan2(track["qz"], track["qw"]) - np.interp(utc_ns, table[:, 0], np.unwrap(table[:, 3]))
        far, askew = np.hypot(*off)[seen], abs((turn[seen] + np.pi) % (2 * np.pi) - np.pi)
        print(f"{len(far)} poses of the second run, {source['fused']} fused: at most {far.max():.3f} m and {askew.max():.4f} rad off after {way:.1f} m")
        self.assertGreater(len(far), 30)
        self.assertGreater(way, 1.5)
        self.assertLess(far.max(), 0.1)
        self.assertLess(askew.max(), 0.1)


class Taken(unittest.TestCase):
    """Poses of another component."""

    GOOD = types.MappingProxyType({"frame_id": 20, "child_frame_id": 12, "x": 3.0, "y": -4.0, "q": [1.0, 0, 0, 0], "quality": 90, "reset_counter": 7,
                                   "pose_covariance": [0.04, 0.01, 0, 0, 0, 0.002, 0.09, 0, 0, 0, -0.003, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.01]})

    def setUp(self):
        self.autopilot = Autopilot(PORT)
        self.addCleanup(self.autopilot.socket.close)
        self.live = waymark.Live(kinds=())
        import lcm

        self.node, self.rows = lcm.LCM(lcm_tools.URL), []
        self.node.subscribe("WAYMARK_LOCALIZER", lambda _, data: self.rows.append((time.monotonic_ns(), waymark.localizer_t.decode(data))))

    def after(self, messages, *words):
        """Rows of the run, the last line and the errors after such messages (name, component, fields)."""
        bridge = program("--link", f"udpout:127.0.0.1:{PORT}", *words)
        self.addCleanup(bridge.kill)
        self.assertTrue(bridge.stdout.readline())
        self.autopilot.hear(2.5)
        for name, component, fields in messages:
            self.autopilot.send(name, component, **{field: value() if callable(value) else value for field, value in fields.items()})
        until = time.monotonic() + 1.5
        while time.monotonic() < until:
            self.node.handle_timeout(50)
        return self.rows, *end(bridge)

    def test_a_pose_is_the_run_s_localizer(self):
        stamps = []
        rows, line, err = self.after([("ODOMETRY", 191, {**self.GOOD, "time_usec": lambda: stamps.append(time.time_ns() // 1000 - 100_000) or stamps[0]}),
                                      ("VISION_POSITION_ESTIMATE", 191, {"usec": lambda: self.autopilot.clock_ns() // 1000, "x": 1.0, "yaw": 0.5})],
                                     "--take", "191", "--zero", "10,20")
        self.assertEqual(2, len(rows), err)
        self.assertIn("2 taken, 0 refused", line)
        row = rows[0][1]
        np.testing.assert_allclose([*row.position_m, row.heading_rad, row.reset], [13, 24, 0, 7], atol=1e-6)  # left is minus right
        # x alike, y and heading against y and yaw
        np.testing.assert_allclose(row.covariance, [0.04, -0.01, 0.09, -0.002, -0.003, 0.01], rtol=1e-6)
        self.assertLess(abs(row.t_ns - (stamps[0] * 1000 - time.time_ns() + time.monotonic_ns())), 5e7)
        np.testing.assert_allclose([*rows[1][1].position_m, rows[1][1].heading_rad], [11, 20, -0.5], atol=1e-6)
        self.assertTrue(np.isnan(rows[1][1].covariance).all())
        self.assertIn("component 191 stamps by a clock that is unknown", err)  # 191 doesn't answer TIMESYNC: 1 does

    def test_an_autopilot_s_clock_is_known(self):
        stamps = []
        rows, _, err = self.after([("ODOMETRY", 1, {**self.GOOD, "time_usec": lambda: stamps.append(self.autopilot.clock_ns() - 200_000_000) or stamps[0] // 1000})],
                                  "--take", "1")
        self.assertEqual("", err)
        self.assertLess(abs(rows[0][1].t_ns - (stamps[0] - BOOTED_NS + self.autopilot.begin_ns)), 1e8)

    def test_what_is_not_understood_is_named_once(self):
        wrong = [{"frame_id": 12}, {"frame_id": 12}, {"frame_id": 4}, {"frame_id": 99}, {"quality": -1}, {"q": [2.0, 0, 0, 0]}, {"x": math.nan}]
        rows, line, err = self.after([("ODOMETRY", 191, {**self.GOOD, **fields}) for fields in wrong], "--take", "191")
        self.assertEqual([], rows)
        self.assertIn(" 0 taken, 7 refused", line)
        for words in ("MAV_FRAME_BODY_FRD", "MAV_FRAME_LOCAL_ENU", "MAV_FRAME 99", "its quality is -1", "the quaternion's length is not 1", "the pose is not finite"):
            self.assertEqual(1, err.count(words), f"{words}\n{err}")

    def test_what_is_not_asked_for_is_not_taken(self):
        rows, line, err = self.after([("ODOMETRY", 191, self.GOOD), ("ODOMETRY", 197, self.GOOD)])
        self.assertEqual([], rows)
        self.assertIn(" 0 taken, 0 refused", line)
        self.assertIn("--take 191 sends it to the run as localizer", err)
        self.assertIn("component 197 is another sender, too: --component N takes another number", err)


class Errors(unittest.TestCase):
    def fails(self, code, text, *words, **environment):
        process = program(*words, "--duration", "1", **environment)
        out, err = process.communicate(timeout=30)
        self.assertEqual((code, True), (process.returncode, text in err), f"{words}: {process.returncode}\n{out}{err}")
        self.assertNotIn("Traceback", err)

    def test_a_wrong_command_line_is_named(self):
        link = ("--link", "udpout:127.0.0.1:9")
        self.fails(2, "'nothing' is no link", "--link", "nothing")
        self.fails(2, "--link", "--rate", "30")
        self.fails(2, "51 is not in range [1 - 50]", *link, "--rate", "51")
        self.fails(2, "'nan' is not a finite number", *link, "--north", "nan")
        self.fails(2, "0 is not in range [1 - 255]", *link, "--component", "0")
        self.fails(2, "--frame ned needs --north", *link, "--frame", "ned")
        self.fails(2, "--as global needs --origin", *link, "--as", "global", "--north", "0")
        self.fails(2, "has 1 numbers, not 2", *link, "--zero", "1")
        self.fails(2, "--take 197 is this program's own component", *link, "--take", "197")

    def test_no_way_in_is_named(self):
        self.fails(1, "tcp:127.0.0.1:9: [Errno 111] Connection refused", "--link", "tcp:127.0.0.1:9")
        self.fails(1, "/dev/nothing", "--link", "/dev/nothing:57600")
        self.fails(1, "--link udpout:no.such.host:14550: ", "--link", "udpout:no.such.host:14550")
        self.fails(1, "--link udpin:1.2.3.4:14550: [Errno 99]", "--link", "udpin:1.2.3.4:14550")
        self.fails(1, "no connection on udpx://nothing", "--link", "udpout:127.0.0.1:9", "--url", "udpx://nothing")

    def test_a_library_that_is_missing_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("pymavlink", "lcm"):
                (pathlib.Path(folder) / f"{name}.py").write_text(f"raise ModuleNotFoundError(\"No module named '{name}'\", name='{name}')\n")
                path = f"{folder}:{ROOT / 'tools/python/src'}"
                self.fails(1, f"{name}", "--link", "udpout:127.0.0.1:9", PYTHONPATH=path)
                self.fails(1, "pip install 'waymark[mavlink]'", "--link", "udpout:127.0.0.1:9", PYTHONPATH=path)
                (pathlib.Path(folder) / f"{name}.py").unlink()

    def test_the_other_side_goes(self):
        with socket.create_server(("127.0.0.1", 0)) as server:
            process = program("--link", f"tcp:127.0.0.1:{server.getsockname()[1]}")
            there, _ = server.accept()
            data = there.recv(4096)
            self.assertEqual("HEARTBEAT", mavlink_wire.decode(data[:21])[0].name)
            there.shutdown(socket.SHUT_WR)
            _, err = process.communicate(timeout=20)
            self.assertEqual((1, True), (process.returncode, "closed by the other side" in err), err)
            there.close()

    def test_a_serial_line(self):
        ours, theirs = os.openpty()
        import tty

        tty.setraw(theirs)
        process = program("--link", f"{os.ttyname(theirs)}:57600", "--duration", "3")
        time.sleep(2.5)
        self.assertIn("HEARTBEAT", [frame.name for frame in mavlink_wire.decode(os.read(ours, 4096))])
        self.assertEqual(0, process.wait(timeout=20), process.stderr.read())
        os.close(ours)
        os.close(theirs)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[1:])
