# SPDX-License-Identifier: Apache-2.0
"""waymark compare: verdicts on made batches with a known difference, intervals that cover, and the page. test_compare.py BIN"""
import json
import math
import pathlib
import random
import subprocess
import tempfile
import unittest

from common import BIN, ROOT, Fleet, call
from waymark_fleet import comparison, statistics


def row(recording, position_m, seed=1, cpu_s=1.0, **more):
    figures = {"position_rmse_m": position_m, "heading_rmse_deg": 0.5, "nees_mean": 3.0, "anees_dof": 3, "lost_s": 0.0, "duration_s": 60.0,
               "correct_p90_us": 8.0}
    return {"recording": recording, "configuration": "c", "program": "p", "seed": seed, "status": "done", "sum": "s", "cpu_s": cpu_s,
            "key": "k", "data": "/none", "truth": None, "figures": figures | more}


def fleet(source, drives, factor=1.0, spread=0.1, **more):
    """Two batches of drives, of which the second differs by a factor and by chance."""
    first = [row(f"d{i}", math.exp(source.gauss(-3, 0.7)), **more) for i in range(drives)]
    second = [row(r["recording"], r["figures"]["position_rmse_m"] * factor * math.exp(source.gauss(0, spread)), **more) for r in first]
    return first, second


def verdict(pairs, name="position", **options):
    return next(v for v in comparison.judge(pairs, **options) if v["figure"] == name)


class Statistics(unittest.TestCase):
    def test_signed_ranks_against_tables(self):
        # P(W <= 1) of six is 2/64; of all signs of nine, by counting.
        self.assertAlmostEqual(statistics.signed_rank([1, 2, 3, 4, 5, -0.5]), 4 / 64)
        self.assertAlmostEqual(statistics.signed_rank([0.0] * 9), 1.0)
        values = [3, -1, 4, 10, -5, 9, 2, 6, -5.5]
        ranks = {abs(v): k for k, v in enumerate(sorted(values, key=abs), start=1)}
        smaller = min(sum(ranks[abs(v)] for v in values if v > 0), sum(ranks[abs(v)] for v in values if v < 0))
        below = sum(sum(k for k in range(1, 10) if signs >> (k - 1) & 1) <= smaller for signs in range(2 ** 9))
        self.assertAlmostEqual(statistics.signed_rank(values), min(1, 2 * below / 2 ** 9))
        # Ties, and too many for the exact distribution: as the normal one. 60 of 90 equal steps go up: z = 3.16.
        self.assertAlmostEqual(statistics.signed_rank([0.01] * 60 + [-0.01] * 30), 0.0016, delta=2e-4)

    def test_holm_and_the_sign_test(self):
        self.assertEqual(statistics.holm([0.01, 0.04, 0.03]), [0.03, 0.06, 0.06])
        self.assertAlmostEqual(statistics.sign_test(1, 9), 22 / 1024)
        self.assertEqual(statistics.sign_test(0, 0), 1.0)

    def test_intervals_cover_a_skewed_distribution(self):
        source = random.Random(5)
        covered = 0
        for _ in range(100):
            low, high = statistics.bca_interval([source.expovariate(1) for _ in range(40)], comparison._mean)
            covered += low <= 1 <= high
        self.assertGreaterEqual(covered, 88)  # of 95 expected: three sigma of a hundred trials, less 1 for n = 40


class Verdicts(unittest.TestCase):
    def test_three_per_cent_over_200_drives_are_found(self):
        source = random.Random(11)
        for _ in range(5):
            found = verdict(list(zip(*fleet(source, 200, 1.03))))
            self.assertEqual(found["verdict"], "worse")
            self.assertLess(found["p_holm"], 0.01)
            self.assertTrue(found["low"] < 0.03 < found["high"], found)

    def test_no_change_is_not_flagged_in_20_trials(self):
        source = random.Random(12)
        for _ in range(20):
            verdicts = comparison.judge(list(zip(*fleet(source, 200))))
            self.assertEqual([v["figure"] for v in verdicts if v["verdict"] in ("worse", "better")], [])

    def test_a_few_drives_that_become_much_worse_are_found(self):
        first, second = fleet(random.Random(13), 200, spread=0.02)
        for spoilt in second[:15]:
            spoilt["figures"]["position_rmse_m"] *= 5
        pairs = list(zip(first, second))
        self.assertEqual(verdict(pairs)["verdict"], "no difference found")
        self.assertEqual(verdict(pairs, "position_large")["verdict"], "worse")

    def test_lost_drives_and_tolerances(self):
        first, second = fleet(random.Random(14), 200, spread=0)
        for spoilt in second[:12]:
            spoilt["figures"]["lost_s"] = 6.0
        pairs = list(zip(first, second))
        self.assertEqual(verdict(pairs, "lost")["verdict"], "worse")
        self.assertAlmostEqual(verdict(pairs, "lost")["change"], 0.1 * 12 / 200)
        self.assertEqual(verdict(pairs, "lost", tolerances={"lost": 0.01})["verdict"], "no difference found")

    def test_times_of_two_batches_have_a_verdict_only_with_a_tolerance(self):
        first, second = fleet(random.Random(17), 200, spread=0)
        for slower in second:
            slower["cpu_s"] = 1.4
        pairs = list(zip(first, second))
        self.assertEqual(verdict(pairs, "cpu")["verdict"], "worse")
        self.assertEqual(verdict(pairs, "cpu", is_apart=True)["verdict"], "two batches")
        self.assertEqual(verdict(pairs, "cpu", is_apart=True, tolerances={"cpu": 0.3})["verdict"], "worse")
        self.assertEqual(verdict(pairs, "cpu", is_apart=True, tolerances={"cpu": 0.5})["verdict"], "no difference found")

    def test_a_figure_that_is_not_there_is_not_measured(self):
        pairs = list(zip(*fleet(random.Random(15), 20, nees_mean=None, heading_rmse_deg=None)))
        self.assertEqual(verdict(pairs, "nees")["verdict"], "not measured")
        self.assertEqual(verdict(pairs, "heading")["verdict"], "not measured")

    def test_pairs_are_of_one_recording_seed_and_configuration(self):
        first = [{**row("d1", 1), "configuration": c} for c in ("a", "b")]
        second = [{**row("d1", 2), "configuration": c, "program": "new"} for c in ("b", "a", "c")]
        self.assertEqual([(one["configuration"], two["configuration"]) for one, two in comparison.pairs_of(first, second)],
                         [("a", "a"), ("b", "b")])


class Page(unittest.TestCase):
    def test_a_page_of_1000_drives_is_small(self):
        with tempfile.TemporaryDirectory() as folder:
            first, second = fleet(random.Random(16), 1000, 1.03)
            second[7] |= {"status": "failed", "error": "out of memory"}
            for name, rows in (("one", first), ("two", second)):
                place = pathlib.Path(folder) / name
                place.mkdir()
                (place / "results.json").write_text(json.dumps({"format": "waymark-results/1", "cells": rows}))
            page = pathlib.Path(folder) / "page.html"
            code, text = call("compare", f"{folder}/one", f"{folder}/two", "--out", page, "--no-reports")
            self.assertEqual(code, 1, text)
            self.assertIn("position error               worse", text)
            self.assertIn("1 drives now fail: d7: out of memory", text)
            self.assertLess(page.stat().st_size, 2_000_000)
            self.assertEqual(page.read_text().count("<circle"), 999)
            code, text = call("compare", f"{folder}/one", f"{folder}/one", "--json", "--out", page, "--no-reports")
            self.assertEqual((code, json.loads(text)["same_bits"]), (0, 1000))
            code, text = call("compare", f"{folder}/one:program=q", f"{folder}/two")
            self.assertEqual((code, "no run has the program 'q'; there are p" in text), (2, True))

    def test_drives_of_a_monte_carlo_are_compared(self):
        config = (ROOT / "config/datasets/crossing-points.yaml").read_text()
        with tempfile.TemporaryDirectory() as folder:
            too_sure = config.replace("correlated: {slots: 0}", "correlated: {slots: 0}\n  noise: {bearing_factor: 0.1}")
            for name, text in (("before", config), ("after", too_sure)):
                (pathlib.Path(folder) / "points.yaml").write_text(text)
                subprocess.run([BIN / "waymark-montecarlo", ROOT / "config/worlds/crossing.yaml", "--config", f"{folder}/points.yaml", "--landmarks", "2",
                                "--drives", "30", "--out", f"{folder}/{name}"], check=True, stdout=subprocess.DEVNULL)
            words = "--json", "--out", f"{folder}/page.html"
            code, text = call("compare", f"{folder}/before", f"{folder}/before", *words)
            self.assertEqual((code, json.loads(text)["drives"]), (0, 30))
            code, text = call("compare", f"{folder}/before", f"{folder}/after", *words)
            verdicts = {v["figure"]: v["verdict"] for v in json.loads(text)["verdicts"]}
            self.assertEqual((code, verdicts["nees"], verdicts["cpu"]), (1, "worse", "not measured"))

    def test_the_worst_drives_have_reports_and_their_first_difference(self):
        made = Fleet(7)
        try:
            code, text = call("batch", made.plan(), "--out", made.folder / "out")
            self.assertEqual(code, 0, text)
            page = made.folder / "page.html"
            out = made.folder / "out"
            code, text = call("compare", f"{out}:configuration=plain", f"{out}:configuration=noisy", "--json", "--out", page)
            self.assertIn(code, (0, 1), text)
            worst = json.loads(text)["worst"]
            self.assertTrue(worst)
            self.assertRegex(worst[0]["began"], r"^[0-9.]+ s after the start, in innovations.csv: source sightings:front")
            for link in worst[0]["reports"].values():
                self.assertIn("<title>", (made.folder / link).read_text())
        finally:
            made.close()


if __name__ == "__main__":
    unittest.main()
