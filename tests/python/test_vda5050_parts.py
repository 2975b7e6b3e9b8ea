#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Parts of `waymark vda5050` without a run and a broker: the position of any pose, archives that nobody should send, bounds.

    test_vda5050_parts.py BIN_DIR       Skipped (77) where the standard's schemas can't be fetched."""

import io
import json
import math
import pathlib
import sys
import tarfile
import tempfile
import threading
import time
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "common"))
import in_a_network
import vda5050_fleet

if why := vda5050_fleet.fetch():
    in_a_network.skip(why)

import common  # noqa: F401 (the package on the path)

import waymark
from waymark.vda5050 import actions, maps, protocol, run

BLANK = {"orderId": "", "orderUpdateId": 0, "lastNodeId": "", "lastNodeSequenceId": 0, "nodeStates": [], "edgeStates": [], "driving": False, "actionStates": [],
         "batteryState": {"batteryCharge": 0, "charging": False}, "operatingMode": "MANUAL", "errors": [], "safetyState": {"eStop": "NONE", "fieldViolation": False}}


class Position(unittest.TestCase):
    """The position of a pose in any state, without a run."""

    def after(self, *messages, old_s=0.0):
        of = run.Run(None, "", "")
        for kind, (message,) in messages:
            of.take(waymark.live.Message(kind, message, time.monotonic_ns() - int(old_s * 1e9)))
        body = of.position(["ground", "first"])
        for topic in ("state", "visualization"):
            vda5050_fleet.validators()[topic].validate({**json.loads(protocol.Heads("A", "1").message(topic, body)), **BLANK})
        return body["agvPosition"], "velocity" in body, [error.kind for error in of.errors()]

    def pose(self, **fields):
        return "POSE", waymark.build("pose_t", **{"orientation_xyzw": [0, 0, 0, 1], "state": 1, "position_m": [3, 4, 0], "lost_probability": 0.25, **fields})

    def bound(self, **fields):
        return "POSE_BOUND", waymark.build("bound_t", **{"horizontal_m": 0.5, "usable": 1, **fields})

    def test_what_is_known_is_sent(self):
        place, moves, errors = self.after(self.pose(), self.bound())
        self.assertEqual({"x": 3, "y": 4, "theta": 0, "mapId": "ground", "positionInitialized": True, "localizationScore": 0.75, "deviationRange": 0.5}, place)
        self.assertEqual((True, []), (moves, errors))
        self.assertEqual("first", self.after(self.pose(status_flags=2 << 16))[0]["mapId"])
        self.assertAlmostEqual(math.pi / 2, self.after(self.pose(orientation_xyzw=[0, 0, math.sqrt(0.5), math.sqrt(0.5)]))[0]["theta"])

    def test_what_is_not_known_is_left_out(self):
        self.assertNotIn("localizationScore", self.after(self.pose(lost_probability=math.nan), self.bound())[0])
        self.assertNotIn("deviationRange", self.after(self.pose(), self.bound(horizontal_m=math.inf))[0])
        zeros = {"x": 0, "y": 0, "theta": 0, "mapId": "ground", "positionInitialized": False, "localizationScore": 0}
        self.assertEqual((zeros, False, ["localizationSilent"]), self.after())
        self.assertEqual((zeros, False, []), self.after(self.pose(position_m=[math.nan, 0, 0])))
        self.assertEqual((zeros, False, []), self.after(self.pose(velocity_mps=[math.nan, 0, 0])))

    def test_doubt_is_named(self):
        for state, is_there, error in ((0, False, "localizationLost"), (1, True, None), (2, True, None), (3, False, "localizationLost"), (4, True, "localizationDoubt")):
            place, _, errors = self.after(self.pose(state=state), self.bound())
            self.assertEqual((is_there, [error] if error else []), (place["positionInitialized"], errors))
            self.assertEqual((3, 0.75 if is_there else 0), (place["x"], place["localizationScore"]))
        self.assertEqual(["positionUnusable"], self.after(self.pose(), self.bound(usable=0, unusable=5))[2])
        self.assertEqual(["localizationSilent"], self.after(self.pose(), self.bound(), old_s=4)[2])
        self.assertFalse(self.after(self.pose(), self.bound(), old_s=4)[0]["positionInitialized"])

    def test_sources_that_fail_are_named(self):
        health = waymark.health_t()
        health.source_count = 3
        for source, device, stale in zip(health.sources, (2, 1, 0), (0, 1, 0)):
            source.name, source.device, source.stale = b"eye".ljust(48, b"\0"), device, stale
        self.assertEqual(["sourceFailed", "sourceSilent"], self.after(self.pose(), self.bound(), ("HEALTH", [health]))[2])
        refused = waymark.build("refused_t", source="eye", count=1, reason="a stamp of the future")
        self.assertEqual(["dataRefused"], self.after(self.pose(), self.bound(), ("REFUSED", refused), ("REFUSED", refused))[2])


class Buildings(unittest.TestCase):
    def test_floors_and_versions_of_any_folder(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            self.assertEqual([], maps.Building(folder, 1).maps())
            (folder / "landmarks.csv").write_text("")
            self.assertEqual([("ground", "unversioned", True)], maps.Building(folder, 1).maps())
            (folder / "site.yaml").write_text("floors: [{name: hall}, {name: first}]")
            of = maps.Building(folder / "first", 1)
            self.assertEqual((folder, "first", ["hall", "first"]), (of.folder, of.floor, of.enabled_floors()))
            with self.assertRaisesRegex(protocol.Refused, "is enabled; enable another"):
                of.delete("hall", "unversioned")
            (folder / "site.yaml").write_text("floors: 5")
            self.assertEqual([], of.maps())


class Archives(unittest.TestCase):
    """What a file from the network may hold."""

    def refuses(self, words, names, **members):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            with tarfile.open(folder / "a.tar", "w") as tar:
                for key, content in {"version.yaml": json.dumps({"files": dict.fromkeys(names, "0")}).encode(), **members}.items():
                    info = content if isinstance(content, tarfile.TarInfo) else tarfile.TarInfo("v/" + key)
                    info.size = 0 if info is content else len(content)
                    tar.addfile(info, io.BytesIO(b"" if info is content else content))
            (folder / "robot").mkdir()
            with self.assertRaisesRegex(protocol.Refused, words):
                maps.Building(folder / "robot", 10_000)._unpack(folder / "a.tar", folder / "robot/deep/version")
            self.assertFalse((folder / "robot/outside").exists())

    def test_files_outside_links_and_bombs_are_refused(self):
        outside = tarfile.TarInfo("v/../../outside")
        self.refuses("lies outside", ["../../outside"], outside=outside)
        self.refuses("no version of a building", ["gone"])
        self.refuses("is too large", ["big"], big=bytes(20_000))
        self.refuses("is too large", ["a", "b"], a=bytes(6_000), b=bytes(6_000))
        link_to = tarfile.TarInfo("v/link")
        link_to.type, link_to.linkname = tarfile.SYMTYPE, "/etc/passwd"
        self.refuses("is no plain file", ["link"], link=link_to)
        self.refuses("no version of a building", ["a"], **{"deeper/version.yaml": b"{}"})


class Bounds(unittest.TestCase):
    def test_a_flood_of_actions_is_bounded(self):
        done = actions.Actions({"stateRequest": lambda _: ""}, {})
        for i in range(100):
            self.assertTrue(done.take(protocol.Wish(str(i), "stateRequest", False, {})))
        with self.assertRaisesRegex(protocol.Refused, "100 actions wait"):
            done.take(protocol.Wish("more", "stateRequest", False, {}))
        for i in range(100, 400):
            until = time.monotonic() + 10
            while not done.step():
                self.assertLess(time.monotonic(), until)
                time.sleep(0.001)
            done.take(protocol.Wish(str(i), "stateRequest", False, {}))
        self.assertLess(len(done.entries()), 205)

    def test_an_action_that_fails_by_itself_is_not_finished(self):
        done, hook = actions.Actions({"stateRequest": lambda _: 1 // 0}, {}), threading.excepthook
        threading.excepthook = lambda _: None
        self.addCleanup(setattr, threading, "excepthook", hook)
        done.take(protocol.Wish("a", "stateRequest", False, {}))
        while not (ended := done.step()):
            time.sleep(0.001)
        self.assertEqual(("FAILED", True), (ended[0].status, "log" in ended[0].result))

    def test_long_texts_are_cut(self):
        error = protocol.Error("a", "WARNING", "x" * 10000, references=(("orderId", "y" * 10000),)).entry()
        self.assertLess(len(json.dumps(error)), 1000)
        with self.assertRaisesRegex(protocol.Refused, "actionId: has 201 characters"):
            protocol.wishes_of({"actions": [{"actionId": "x" * 201, "actionType": "stateRequest", "blockingType": "NONE"}]})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[1:])
