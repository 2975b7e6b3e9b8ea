# SPDX-License-Identifier: Apache-2.0
"""waymark mine: black boxes of simulated faults, of which nine of ten causes have to be right. test_mine.py BIN [--boxes N]"""
import collections
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import faults
from common import BIN, ROOT, call
from waymark_fleet import incidents, mine, wmlog

BOXES = int(sys.argv.pop(sys.argv.index("--boxes") + 1)) if "--boxes" in sys.argv else 2 * len(faults.FAULTS)
sys.argv = [word for word in sys.argv if word != "--boxes"]


class Mine(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory(prefix="waymark-mine-")
        cls.folder = pathlib.Path(cls.temporary.name)
        config = cls.folder / "robot.yaml"
        config.write_text("format: waymark-config/1\nestimator: landmark_ekf\n")
        cls.truth = {}
        for number in range(BOXES):
            fault = faults.FAULTS[number % len(faults.FAULTS)]
            box = cls.folder / "fleet" / f"robot-{number:03d}" / "box"
            recording = cls.folder / "recording"
            at_s = faults.write(recording, fault, 1000 + number)
            box.mkdir(parents=True)
            subprocess.run([BIN.parent / "tests/fleet_boxes", recording, config, box, "60", *([str(at_s)] if fault.dies else [])], check=True)
            shutil.rmtree(recording)
            cls.truth[str(box)] = fault
        cls.code, cls.text = call("mine", cls.folder / "fleet", "--all", "--out", cls.folder / "out")
        cls.found = json.loads((cls.folder / "out/mine.json").read_text())

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_nine_of_ten_causes_are_right(self):
        self.assertEqual(self.code, 0, self.text)
        first = {}
        for one in (one for place in self.found["places"] for one in place["incidents"]):
            # Of a box, its first kept log; where nothing was kept, the present one.
            order = (one["kind"] not in ("lost", "died") or one["log"].endswith("/now.wmlog"), one["log"])
            if one["robot"] not in first or order < first[one["robot"]][0]:
                first[one["robot"]] = order, one
        wrong = collections.Counter()
        for box, fault in self.truth.items():
            cause = first[box][1]["cause"] if box in first else "nothing"
            if cause != fault.cause:
                wrong[fault.name, cause] += 1
        print(f"{BOXES - wrong.total()} of {BOXES} causes are right; wrong: {dict(wrong)}")
        self.assertLessEqual(wrong.total(), 0.1 * BOXES, wrong)

    def test_the_page_has_the_map_and_reports(self):
        page = (self.folder / "out/mine.html").read_text()
        self.assertEqual(page.count('<rect class="landmark" x="'), len(faults.small_robot.LANDMARKS) + 1)  # and the legend's
        self.assertIn("bearings-off", page)
        self.assertIn("docs/troubleshooting.md#source-silent", page)
        self.assertTrue((self.folder / "out" / self.found["places"][0]["report"]).is_file())
        self.assertEqual(sum(place["count"] for place in self.found["places"]), self.found["incidents"])

    def test_each_log_is_judged_once(self):
        log = next(self.folder.glob("fleet/*/box/lost-0001-now.wmlog"))
        code, text = call("mine", log, "--out", self.folder / "again", "--json")
        self.assertEqual(code, 0, text)
        known = list((self.folder / "again/known").iterdir())
        self.assertEqual(len(known), 1)
        known[0].write_text(known[0].read_text().replace('"cause": "', '"cause": "none", "was": "'))
        code, text = call("mine", log, "--out", self.folder / "again")
        self.assertIn("1 x none", text)

    def test_a_damaged_log_is_named_and_the_others_are_read(self):
        box = self.folder / "damaged"
        box.mkdir()
        (box / "lost-0003-now.wmlog").write_bytes(b"no log at all")
        code, text = call("mine", box, next(self.folder.glob("fleet/*/box/lost-0001-now.wmlog")), "--out", self.folder / "out2")
        self.assertEqual(code, 1, text)
        self.assertIn("lost-0003-now.wmlog: is not an event log", text)
        self.assertIn("1 incidents in 2 logs", text)
        code, text = call("mine", self.folder / "out", "--out", self.folder / "out2")
        self.assertEqual((code, "no log of a loss or a death is there" in text), (2, True))

    def test_a_log_is_cut_between_two_events(self):
        path = next(self.folder.glob("fleet/*/box/lost-0001-now.wmlog"))
        log = wmlog.read(path)
        self.assertEqual(log.sources, ["can", "sightings:front"])
        self.assertTrue(log.is_closed)
        middle_ns = log.events[len(log.events) // 2][0]
        wmlog.cut(log, path, self.folder / "cut.wmlog", middle_ns)
        part = wmlog.read(self.folder / "cut.wmlog")
        self.assertEqual([e[0] for e in part.events], [e[0] for e in log.events if e[0] <= middle_ns])
        self.assertFalse(part.is_closed)

    def test_each_cause_has_its_section(self):
        sections = (ROOT / "docs/troubleshooting.md").read_text()
        for cause, (_, anchor) in incidents.CAUSES.items():
            self.assertIn(f"## {anchor}\n", sections, cause)

    def test_a_chain_is_several_places(self):
        chain = [{"map": "m", "x_m": 1.5 * i, "y_m": 0.0, "cause": "silent", "about": "", "robot": "r"} for i in range(6)]
        places = mine.places_of([*chain, {**chain[0], "map": "n"}], 2.0)
        self.assertEqual(sorted(place["count"] for place in places), [1, 3, 3])


if __name__ == "__main__":
    unittest.main()
