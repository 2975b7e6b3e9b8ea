#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A live run by the Python package and by a viewer of Foxglove's protocol, in a network of its own.

    test_live.py BIN_DIR       Skipped (77) without the right to a network namespace, without lcm-gen or foxglove-sdk."""

import asyncio
import json
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from socket import create_server

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "common"))
from in_a_network import begin  # noqa: E402

begin("foxglove", "websockets")

from common import BIN, ROOT  # noqa: E402

sys.path.insert(0, str(ROOT / "tests/golden"))
os.environ.update(WM_BIN_DIR=str(BIN), WM_SOURCE_DIR=str(ROOT))

import lcm_tools  # noqa: E402
import numpy as np  # noqa: E402
import waymark  # noqa: E402
import websockets  # noqa: E402
from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: E402

SECONDS = 6
PORT = 8765
CONFIG = "format: waymark-config/1\nestimator: landmark_ekf\npublish: {rate_hz: 50}\n"
STEADY = {"/tf", "/waymark/pose", "/waymark/odom", "/waymark/status", "/waymark/bound", "/waymark/innovations/sightings_eye/bearing",
          "/waymark/innovations/sightings_eye/range", "/recording/sightings", "/diagnostics", "/waymark/path", "/waymark/path/points",
          "/landmarks", "/landmarks/points"}


class Viewer:
    """Subscribes to all that a server of Foxglove's protocol offers, and keeps what came by topic."""

    def __init__(self):
        self.messages, self.schemas = {}, {}

    async def watch(self, late_s):
        await asyncio.sleep(late_s)
        async with websockets.connect(f"ws://127.0.0.1:{PORT}", subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
            topics = {}
            try:
                while True:
                    data = await asyncio.wait_for(socket.recv(), 4)
                    if isinstance(data, bytes):
                        if data[0] == 1:
                            number, log_ns = struct.unpack_from("<IQ", data, 1)
                            self.messages.setdefault(topics[number], []).append((log_ns, data[13:]))
                        continue
                    for channel in json.loads(data).get("channels", []):
                        topics[channel["id"]] = channel["topic"]
                        self.schemas[channel["topic"]] = (channel["schemaName"], channel["schema"])
                        await socket.send(json.dumps({"op": "subscribe", "subscriptions": [
                            {"id": channel["id"], "channelId": channel["id"]}]}))
            except (asyncio.TimeoutError, websockets.ConnectionClosed):
                return

    def decoded(self, topic):
        """Messages of a topic by the definition that the server gave."""
        name, definition = self.schemas[topic]
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(definition, name))
        return [(log_ns, store.deserialize_cdr(data, name)) for log_ns, data in self.messages[topic]]


class LiveRun(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-live-"))
        cls.addClassCleanup(shutil.rmtree, folder)
        lcm_tools.write_recording(folder / "rec", SECONDS)
        (folder / "robot.yaml").write_text(CONFIG)
        live = waymark.Live()
        server = subprocess.Popen([BIN / "waymark", "watch", "--foxglove", str(PORT), "--config", folder / "robot.yaml", "--recording",
                                   folder / "rec", "--duration", str(SECONDS + 6)], stdout=subprocess.PIPE, text=True,
                                  env=cls.environment(folder))
        cls.addClassCleanup(server.kill)
        cls.line = server.stdout.readline()
        viewer, run = Viewer(), lcm_tools.run(folder / "rec", folder / "robot.yaml", folder / "out")
        cls.addClassCleanup(run.kill)
        cls.live, cls.viewer = [], viewer
        asyncio.run(cls.both(live, viewer, run))
        lcm_tools.finish(run)
        cls.rest = server.communicate(timeout=20)[0]
        cls.server_code = server.returncode
        cls.localized = waymark.Run(folder / "out")
        cls.malformed = live.malformed

    @staticmethod
    def environment(folder):
        """With the program of the package in PATH, as pip puts it there."""
        program = folder / "waymark-foxglove"
        program.write_text(f"#!/bin/sh\nexec {sys.executable} -m waymark.foxglove_server \"$@\"\n")
        program.chmod(0o755)
        return {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT / "tools/python/src")}

    @classmethod
    async def both(cls, live, viewer, run):
        watching = asyncio.create_task(viewer.watch(1.0))
        end = time.monotonic() + SECONDS + 20
        while run.poll() is None and time.monotonic() < end:
            message = await asyncio.to_thread(live.next, 0.2)
            if message:
                cls.live.append(message)
        await watching

    def test_poses_in_python_are_those_of_the_run(self):
        published = {int(t): i for i, t in enumerate(self.localized.published["t_ns"])}
        poses = [message.data for message in self.live if message.kind == "POSE"]
        self.assertGreaterEqual(len(poses), 0.8 * len(published))  # LCM may lose some on a loaded computer
        for pose in poses:
            i = published[pose.t_ns]
            self.assertEqual(pose.position_m[0], self.localized.published["x_m"][i])
        self.assertEqual({"POSE", "POSE_BOUND", "HEALTH", "INNOVATION", "OBSERVATIONS", "LANDMARKS"}, {message.kind for message in self.live})
        self.assertEqual({}, dict(self.malformed))

    def test_types_have_lcm_s_names(self):
        from waymark import health_t, pose_t

        self.assertEqual(pose_t.STATE_TRACKING, 1)
        self.assertIsInstance(health_t().sources[0], waymark.source_health_t)

    def test_a_viewer_gets_every_topic(self):
        self.assertLessEqual(STEADY, set(self.viewer.messages))
        self.assertIn("/tf_static", self.viewer.messages)
        others = {topic + end for topic in ("/waymark/particles", "/waymark/hypotheses", "/waymark/landmarks") for end in ("", "/points")}
        self.assertLessEqual(set(self.viewer.schemas), STEADY | {"/tf_static", "/map"} | others)
        for topic in self.viewer.messages:
            self.assertTrue(self.viewer.decoded(topic), topic)

    def test_poses_in_the_viewer_are_those_of_the_run(self):
        published = self.localized.published
        by_stamp = {int(t): i for i, t in enumerate(published["t_ns"])}
        offset = None
        poses = self.viewer.decoded("/waymark/pose")
        self.assertGreaterEqual(len(poses), 0.4 * len(by_stamp))  # it came a second later, and is told of the channels
        x = {round(float(value), 12): i for i, value in enumerate(published["x_m"])}
        for _, message in poses:
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            i = x[round(message.pose.pose.position.x, 12)]
            offset = offset if offset is not None else stamp - int(published["t_ns"][i])
            self.assertEqual(stamp - offset, int(published["t_ns"][i]))
            self.assertIn(stamp - offset, by_stamp)
            self.assertGreater(message.pose.covariance[0], 0)
        odom = [message for _, message in self.viewer.decoded("/waymark/odom")]
        steps = np.diff([message.pose.pose.position.x for message in odom])
        times_s = np.diff([message.header.stamp.sec + message.header.stamp.nanosec / 1e9 for message in odom])
        self.assertLess((abs(steps) - 0.6 * abs(times_s)).max(), 0.02)  # the robot drives at 0.5 m/s

    def test_it_listens_on_this_computer_and_names_the_layout(self):
        self.assertIn(f"ws://localhost:{PORT}", self.line)
        layout = json.loads(pathlib.Path(self.line.split("layout: ")[1].strip()).read_text())
        self.assertIn("3D!waymark", layout["configById"])
        self.assertEqual(0, self.server_code, self.rest)


class Late(unittest.TestCase):
    """A viewer that was refused when a channel appeared: it does not subscribe to what it is told of first."""

    def test_a_channel_without_a_subscriber_is_offered_once_more(self):
        from waymark.foxglove_server import FoxgloveServer
        from waymark.mcapio.writer import Item
        from waymark.ros import Messages

        messages = Messages()
        server = FoxgloveServer(messages, "127.0.0.1", 0)
        self.addCleanup(server.stop)
        item = Item(1, "/late", "geometry_msgs/msg/Point", messages.make("Point", x=1.0))
        told = asyncio.run(asyncio.wait_for(self.view(server, item), 30))
        self.assertEqual(len(set(told)), 2)
        for _ in range(5):
            server.serve_late()
        self.assertEqual(server._offered, {})

    @staticmethod
    async def view(server, item):
        """Numbers of the channel until a message has come."""
        told = []
        async with websockets.connect(f"ws://127.0.0.1:{server.port}", subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
            async def send():
                while True:
                    server.write(item)
                    server.serve_late()
                    await asyncio.sleep(0.05)

            sending = asyncio.create_task(send())
            while True:
                data = await socket.recv()
                if isinstance(data, bytes):
                    sending.cancel()
                    return told
                for channel in json.loads(data).get("channels", []):
                    if channel["topic"] != item.topic:
                        continue
                    told.append(channel["id"])
                    if len(told) > 1:
                        await socket.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": channel["id"]}]}))


class Errors(unittest.TestCase):
    def watch(self, *words):
        done = subprocess.run([sys.executable, "-m", "waymark.foxglove_server", *words, "--duration", "1"], capture_output=True,
                              text=True, check=False, env={**os.environ, "PYTHONPATH": str(ROOT / "tools/python/src")})
        return done.returncode, done.stderr

    def test_what_is_wrong_is_named(self):
        code, text = self.watch("--foxglove", "http")
        self.assertEqual((2, True), (code, "neither PORT nor ADDRESS:PORT" in text))
        code, text = self.watch("--foxglove", "0", "--config", "/nowhere/robot.yaml")
        self.assertEqual((1, True), (code, "/nowhere/robot.yaml" in text))
        with create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            code, text = self.watch("--foxglove", str(port))
            self.assertEqual((1, True), (code, f"127.0.0.1:{port} can't be listened on: Address already in use" in text), text)
        code, text = self.watch("--foxglove", "0", "--url", "udpx://nothing")
        self.assertEqual((1, True), (code, "no connection on udpx://nothing" in text), text)


class Foreign(unittest.TestCase):
    def test_a_foreign_message_is_counted(self):
        import lcm

        live = waymark.Live(prefix="OTHER_")
        sender = lcm.LCM(lcm_tools.URL)
        sender.publish("OTHER_POSE", b"no pose")
        sender.publish("OTHER_HEALTH", b"")
        self.assertIsNone(live.next(0.5))
        self.assertEqual({"OTHER_POSE": 1, "OTHER_HEALTH": 1}, dict(live.malformed))


class Fields(unittest.TestCase):
    def test_lists_of_any_length_become_messages_and_come_back(self):
        ids = list(range(150))
        messages = waymark.build("observations_t", t_ns=5, sensor="fr\u00f6nt", landmark_id=ids, bearing_rad=np.full(150, 0.1))
        self.assertEqual([64, 64, 22], [message.count for message in messages])
        back = [waymark.plain(waymark.observations_t.decode(message.encode())) for message in messages]
        self.assertEqual(ids, [number for part in back for number in part["landmark_id"]])
        self.assertEqual({("fr\u00f6nt", 5)}, {(part["sensor"], part["t_ns"]) for part in back})
        self.assertTrue(np.isnan(back[2]["range_m"]).all() and len(back[2]["range_m"]) == 22)  # not given: absent
        (told,) = waymark.build("set_pose_t", position_m=(1, 2, 0), orientation_xyzw=[0, 0, 0, 1], sigma_xy_m=0.1)
        self.assertEqual([1, 2, 0], waymark.plain(waymark.set_pose_t.decode(told.encode()))["position_m"])

    def test_parts_are_cut_to_their_counts(self):
        health = waymark.health_t()
        health.source_count, health.sources[1].name, health.sources[1].late = 2, b"eye".ljust(48, b"\0"), 7
        read = waymark.plain(health)
        self.assertEqual((2, "eye", 7, []), (len(read["sources"]), read["sources"][1]["name"], read["sources"][1]["late"], read["calibration"]))

    def test_what_does_not_fit_is_named(self):
        for kind, fields, words in (("observations_t", {"sensor": "x" * 32}, "sensor has 31 bytes at most"), ("nose_t", {}, "'nose_t' is not"),
                                    ("observations_t", {"sensr": "x"}, "has no field 'sensr'"),
                                    ("observations_t", {"landmark_id": [1], "range_m": [1.0, 2.0]}, "landmark_id 1, range_m 2"),
                                    ("set_pose_t", {"position_m": [1]}, "position_m has 3 values, 1 are given")):
            with self.assertRaisesRegex(ValueError, words):
                waymark.build(kind, **fields)

    def test_a_run_takes_what_is_built(self):
        import lcm

        folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-built-"))
        self.addCleanup(shutil.rmtree, folder)
        lcm_tools.write_recording(folder / "site", 1)
        (folder / "robot.yaml").write_text("format: waymark-config/1\nestimator: landmark_ekf\ncalibration: site/calibration.yaml\n"
                                           "landmarks: site/landmarks.csv\ninitial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\n"
                                           "realtime: {lock_memory: false}\ndevices: {lcm: [{stream: motion}], sightings: lcm}\n"
                                           f"publish: {{lcm_url: '{lcm_tools.URL}'}}\n")
        run = subprocess.Popen([BIN / "waymark", "run", "--config", folder / "robot.yaml", "--out", folder / "out"], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
        self.addCleanup(run.kill)
        lcm_tools.wait_for_listener()
        node = lcm.LCM(lcm_tools.URL)
        time.sleep(0.7)
        for _ in range(20):
            now_ns = time.monotonic_ns()
            for channel, kind, fields in (("MOTION", "motion_t", {"v_mps": 0.0}),
                                          ("SIGHTINGS", "observations_t", {"sensor": "eye", "landmark_id": [0, *range(100, 199)], "range_m": [5.0] * 100})):
                for message in waymark.build(kind, t_ns=now_ns, **fields):
                    node.publish("WAYMARK_" + channel, message.encode())
            time.sleep(0.05)
        time.sleep(0.5)
        run.send_signal(signal.SIGINT)
        lcm_tools.finish(run)
        seen = waymark.Run(folder / "out").health["sources"]["sightings"]
        self.assertEqual((2000, 0), (seen["received"], seen["malformed"]), seen)
        self.assertGreater(seen["fused"], 10)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
