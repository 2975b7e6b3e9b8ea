# SPDX-License-Identifier: Apache-2.0
"""waymark batch: pure cells, kept by what they depend on, killed and resumed. test_batch.py BIN [--kills N]"""
import csv
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import unittest

from common import BIN, ROOT, Fleet, call

from bench import Bench
from replays import Refused

KILLS = int(sys.argv.pop(sys.argv.index("--kills") + 1)) if "--kills" in sys.argv else 3
sys.argv = [word for word in sys.argv if word != "--kills"]


def sum_of(text):
    return text.split("sum ")[1].split(";")[0].split()[0]


class Batch(unittest.TestCase):
    def setUp(self):
        self.fleet = Fleet(3)
        self.out = self.fleet.folder / "out"

    def tearDown(self):
        self.fleet.close()

    def batch(self, *words, plan=None):
        code, text = call("batch", plan or self.fleet.plan(), "--out", self.out, *words)
        self.assertEqual(code, 0, text)
        return text

    def rows(self):
        with (self.out / "results.csv").open() as file:
            return list(csv.DictReader(file))

    def keys(self):
        return {path.name for path in (self.out / "cells").iterdir()}

    def test_results_are_a_row_a_cell_and_are_kept(self):
        first = self.batch()
        rows = self.rows()
        self.assertEqual([(r["recording"], r["configuration"]) for r in rows],
                         [(f"drive-{i}", c) for i in (1, 2, 3) for c in ("plain", "noisy")])
        self.assertTrue(all(r["status"] == "done" and float(r["position_rmse_m"]) < 0.1 and float(r["cpu_s"]) > 0 for r in rows))
        whole = json.loads((self.out / "results.json").read_text())
        self.assertEqual(whole["sum"], sum_of(first))
        stamps = {key: (self.out / "cells" / key / "cell.json").stat().st_mtime_ns for key in self.keys()}
        self.assertEqual(sum_of(self.batch()), sum_of(first))
        self.assertEqual(stamps, {key: (self.out / "cells" / key / "cell.json").stat().st_mtime_ns for key in self.keys()})
        other = self.fleet.folder / "other"
        code, text = call("batch", self.fleet.plan(), "--out", other, "--jobs", 1)
        self.assertEqual((code, sum_of(text)), (0, sum_of(first)))

    def test_tables_of_accuracy_are_batches(self):
        """Judged runs of tests/contract: kept, named by their titles, compared."""
        drive, config = self.fleet.folder / "drives/drive-1", self.fleet.folder / "plain.yaml"
        runs = Bench(BIN, self.out)
        figures, run = runs.judge("drive-1, from 3 s on", drive, config, ("--from", 3))
        self.assertTrue((run / "trajectory.csv").is_file())
        written = (run.parent / "cell.json").stat().st_mtime_ns
        again = Bench(BIN, self.out)
        self.assertEqual(again.judge("drive-1, from 3 s on", drive, config, ("--from", 3))[0], figures)
        self.assertEqual((run.parent / "cell.json").stat().st_mtime_ns, written)
        self.assertNotEqual(again.judge("drive-1", drive, config)[0]["duration_s"], figures["duration_s"])
        (self.fleet.folder / "wrong.yaml").write_text("format: waymark-config/1\nestimator: none_such\n")
        with self.assertRaisesRegex(Refused, "none_such"):
            again.judge("refused", drive, self.fleet.folder / "wrong.yaml")
        again.write_results("test")
        self.assertEqual([(r["recording"], r["status"]) for r in self.rows()],
                         [("drive-1", "done"), ("drive-1, from 3 s on", "done"), ("refused", "failed")])
        code, text = call("compare", self.out, self.out, "--out", self.fleet.folder / "page.html", "--no-reports")
        self.assertEqual((code, text.splitlines()[0]), (0, "3 drives, 2 with the same bits"))

    def test_a_configuration_that_is_written_anew_is_another_one(self):
        drive, config = self.fleet.folder / "drives/drive-1", self.fleet.folder / "plain.yaml"
        runs = Bench(BIN, self.out)
        first, _ = runs.judge("first", drive, config)
        self.fleet.configure("plain", "sightings: {noise: {range_factor: 0.3}}\n")
        second, _ = runs.judge("second", drive, config)
        self.assertNotEqual(first["position_rmse_m"], second["position_rmse_m"])

    def test_only_what_changed_runs_again(self):
        self.batch()
        before = self.keys()
        # A file that the configuration names is part of it; one that it does not name is not.
        (self.fleet.folder / "unrelated.txt").write_text("1")
        self.batch()
        self.assertEqual(self.keys(), before)
        self.fleet.configure("noisy", "sightings: {noise: {range_factor: 0.4}}\n")
        self.batch()
        self.assertEqual(len(self.keys() - before), 3)
        before = self.keys()
        with (self.fleet.folder / "drives/drive-2/sightings.csv").open("a") as file:
            file.write("\n")
        self.batch()
        self.assertEqual(len(self.keys() - before), 2)
        before = self.keys()
        shutil.copy(self.fleet.folder / "drives/drive-1/landmarks.csv", self.fleet.folder / "map.csv")
        self.fleet.configure("noisy", "landmarks: map.csv\n")
        self.batch()
        self.assertEqual(len(self.keys() - before), 3)
        with (self.fleet.folder / "map.csv").open("a") as file:
            file.write("900,50,50,0,0.1\n")
        before = self.keys()
        self.batch()
        self.assertEqual(len(self.keys() - before), 3)

    def test_killed_at_any_time_it_goes_on_with_the_same_results(self):
        code, text = call("batch", self.fleet.plan(), "--out", self.fleet.folder / "whole")
        self.assertEqual(code, 0, text)
        source = random.Random(7)
        command = [sys.executable, BIN / "waymark-batch", self.fleet.plan(), "--out", self.out]
        for _ in range(KILLS):
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(source.uniform(0.1, 0.6))
            process.send_signal(source.choice([signal.SIGKILL, signal.SIGTERM, signal.SIGINT]))
            process.wait()
        again = self.batch()
        self.assertEqual(sum_of(again), sum_of(text))
        self.assertEqual([name for name in self.keys() if name.startswith(".part")], [])

    def test_a_cell_that_fails_is_named_and_tried_again(self):
        self.fleet.configure("noisy", "estimaator: 1\n")
        code, text = call("batch", self.fleet.plan(), "--out", self.out)
        self.assertEqual(code, 1)
        self.assertIn("3 failed: ", text)
        self.assertIn("estimaator", text)
        rows = self.rows()
        self.assertEqual([r["status"] for r in rows], ["done", "failed"] * 3)
        self.fleet.configure("noisy", "")
        self.batch()
        for truth in (self.fleet.folder / "drives").glob("*/truth.csv"):
            truth.write_text("t_ns\n")
        self.assertEqual(call("batch", self.fleet.plan(), "--out", self.out)[0], 1)
        said = "".join(file.read_text() for file in (self.out / "failed").iterdir())
        self.assertIn("written to run\n", said)  # the cell's folder is gone
        self.assertNotIn(".part", said)

    def test_parts_make_up_the_whole(self):
        whole = self.batch("--jobs", 1)
        shutil.rmtree(self.out)
        plan = self.fleet.plan()
        for part in ("1/2", "2/2"):
            self.batch("--part", part)
            self.assertFalse((self.out / "results.csv").exists())
        self.assertEqual(len(self.keys()), 6)
        self.assertEqual(sum_of(self.batch(plan=plan)), sum_of(whole))
        listed = json.loads(self.batch("--list"))
        self.assertEqual({row["key"] for row in listed}, self.keys())

    def test_event_logs_and_a_second_program(self):
        run = self.fleet.folder / "run"
        subprocess.run([BIN / "waymark", "replay", self.fleet.folder / "drives/drive-1", "--config", self.fleet.folder / "plain.yaml", "--out", run],
                       check=True, capture_output=True)
        wrapper = self.fleet.folder / "wrapper"
        wrapper.write_text(f'#!/bin/sh\nexec "{BIN}/waymark" "$@"\n')
        wrapper.chmod(0o755)
        plan = self.fleet.plan(f"programs: {{built: {BIN}/waymark, wrapped: [env, ./wrapper]}}",
                               "[{path: run/events.wmlog, truth: drives/drive-1}]")
        text = self.batch(plan=plan)
        self.assertIn("built and wrapped: the same bits in 1 of 1 runs", text)
        rows = self.rows()
        self.assertEqual([(r["recording"], r["configuration"], r["program"]) for r in rows],
                         [("events", "own", "built"), ("events", "own", "wrapped")])
        self.assertTrue(all(0 < float(r["position_rmse_m"]) < 0.1 for r in rows))

    def test_mistakes_in_plans(self):
        for text, said in (("configurations: [nowhere.yaml]", "nowhere.yaml: there is no such file"), ("", "needs one"),
                           ("configurations: [plain.yaml]\nprogramms: {}", "programms: unknown key; known here"),
                           ("configurations: [plain.yaml]\nseeds: one", "write a list of whole numbers"),
                           ("configurations: [plain.yaml]\nprograms: {arm: [qemu-none, ./none]}", "neither a file nor in PATH")):
            code, answer = call("batch", self.fleet.plan(text), "--out", self.out)
            self.assertEqual(code, 2, answer)
            self.assertIn(said, answer)
        code, answer = call("batch", self.fleet.plan(recordings="[nothing/*]"), "--out", self.out)
        self.assertEqual((code, "neither a recording nor an event log is there" in answer), (2, True))
        code, answer = call("batch", self.fleet.folder / "none.yaml", "--out", self.out)
        self.assertEqual((code, "docs/fleet.md" in answer), (2, True))


class Sums(unittest.TestCase):
    def test_a_program_s_libraries_are_part_of_its_sum(self):
        from waymark_fleet import sums
        with_libraries = sums._libraries(BIN / "waymark", None)
        self.assertTrue(any("libc.so" in path.name for path in with_libraries), with_libraries)
        needed = sums._needed_by(BIN / "waymark")
        self.assertIn("libc.so.6", needed)
        self.assertEqual(sums._needed_by(ROOT / "README.md"), [])
        self.assertTrue(os.access(BIN / "waymark", os.X_OK))


if __name__ == "__main__":
    unittest.main()
