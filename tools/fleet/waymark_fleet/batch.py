# SPDX-License-Identifier: Apache-2.0
"""`waymark batch`: recordings x configurations x programs, on all cores, resumed where it was stopped."""
import argparse
import concurrent.futures
import csv
import io
import json
import os
import pathlib
import signal
import sys
import time

from . import cell as cells_
from . import plan as plans
from .sums import Sums, of_text, write_whole

RESULTS_FORMAT = "waymark-results/1"
_NAMES = ["recording", "configuration", "program", "seed", "status", "sum", "cpu_s", "wall_s", "memory_mb", "error", "key"]
_PROGRESS_S = 0.2  # of a terminal; else a line each tenth
EXAMPLES = """examples:
  waymark batch nightly.yaml --out nightly
  waymark batch nightly.yaml --out nightly --part 3/16
  snakemake -s /usr/share/waymark-fleet/Snakefile --profile slurm --config plan=nightly.yaml out=nightly
docs/fleet.md has a plan to begin with. Exit code: 0 all cells are done, 1 some failed or it was stopped, 2 usage."""


class Progress:
    """How many cells are done, and the time left: by the bytes of the recordings and the time that each program took."""

    def __init__(self, waiting, cached, jobs):
        self.total, self.cached, self.jobs = len(waiting) + cached, cached, jobs
        self.done = self.failed = 0
        self.left, self.spent = {}, {}
        for cell, _ in waiting:
            self.left[cell.program] = self.left.get(cell.program, 0) + weight(cell)
        self.shown_s, self.tenth, self.is_terminal = 0, 0, sys.stderr.isatty()

    def take(self, cell, result):
        """One more cell is done."""
        self.done += 1
        self.failed += result["status"] != "done"
        self.left[cell.program] -= weight(cell)
        seconds, size = self.spent.get(cell.program, (0, 0))
        self.spent[cell.program] = (seconds + result["wall_s"], size + weight(cell))
        self.show()

    def left_s(self):
        """Time left in s. A program that has not run yet counts as the others."""
        seconds, size = (sum(values) for values in zip(*self.spent.values()))
        rate = {name: s / b for name, (s, b) in self.spent.items()}
        return sum(left * rate.get(name, seconds / size) for name, left in self.left.items()) / self.jobs

    def show(self):
        now = time.monotonic()
        done = self.cached + self.done
        tenth = 10 * done // max(self.total, 1)
        if done < self.total and (now - self.shown_s < _PROGRESS_S if self.is_terminal else tenth == self.tenth):
            return
        self.shown_s, self.tenth = now, tenth
        text = f"{done} of {self.total} cells" + (f", {self.failed} failed" if self.failed else "")
        if done < self.total:
            text += f", {duration(self.left_s())} left"
        print(f"\r\033[K{text}" if self.is_terminal else text, end="" if self.is_terminal else "\n", file=sys.stderr, flush=True)

    def end(self):
        if self.is_terminal:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


def duration(seconds):
    """A time in words."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


_weights = {}


def weight(cell):
    """Bytes of a recording, by which the time of its cells is estimated."""
    if cell.data not in _weights:
        files = [cell.data] if cell.data.is_file() else [path for path in cell.data.rglob("*") if path.is_file()]
        _weights[cell.data] = 1 + sum(path.stat().st_size for path in files)
    return _weights[cell.data]


def run_cells(store, keyed, jobs, progress=None):
    """Runs the cells that are not in the store. Returns all results in the order of `keyed`; ends early by cells_.Stopped."""
    results = {key: result for _, key in keyed if (result := store.result(key))}
    waiting = list({key: (cell, key) for cell, key in keyed if key not in results}.values())
    shown = progress(waiting, len(results), jobs) if progress else None
    # The largest recordings first: none is left over at the end, when the other cores are idle. Cells of one recording stay together.
    waiting.sort(key=lambda one: -weight(one[0]))
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        begun = {pool.submit(store.run, cell, key): (cell, key) for cell, key in waiting}
        for future in concurrent.futures.as_completed(begun):
            cell, key = begun[future]
            results[key] = future.result()
            if shown:
                shown.take(cell, results[key])
    if shown:
        shown.end()
    return [row_of(cell, results[key]) for cell, key in keyed]


def row_of(cell, result):
    """A result with the names of its cell: another cell of the same files may have made it."""
    names = {name: getattr(cell, name) for name in ("recording", "configuration", "program", "seed")}
    return {**result, **names, "data": str(cell.data), "truth": str(cell.truth) if cell.truth else None}


def results_sum(results):
    """Sum of all that is the same in each batch of this plan: names, files and figures, without times."""
    lines = sorted(f"{r['recording']} {r['configuration']} {r['seed']} {r['program']} {r.get('sum')} {r['status']} "
                   f"{json.dumps({k: v for k, v in r.get('figures', {}).items() if not k.endswith('_us')}, sort_keys=True)}\n" for r in results)
    return of_text("".join(lines))[:32]


def agreements(results):
    """For each two programs, how many of their runs are the same in every bit."""
    runs = {}
    for result in results:
        if result["status"] == "done":
            runs.setdefault(result["program"], {})[result["recording"], result["configuration"], result["seed"]] = result["sum"]
    names = list(runs)
    for i, one in enumerate(names):
        for other in names[i + 1:]:
            both = runs[one].keys() & runs[other].keys()
            same = sum(runs[one][at] == runs[other][at] for at in both)
            yield f"{one} and {other}: the same bits in {same} of {len(both)} runs"


def write_results(out, results, plan):
    """results.csv and results.json."""
    figures = list(dict.fromkeys(name for result in results for name in result.get("figures", {})))
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(_NAMES + figures)
    for result in results:
        row = [result.get(name) for name in _NAMES] + [result.get("figures", {}).get(name) for name in figures]
        table.writerow(["" if value is None else value for value in row])
    write_whole(out / "results.csv", text.getvalue())
    whole = {"format": RESULTS_FORMAT, "plan": str(plan), "sum": results_sum(results), "cells": results}
    write_whole(out / "results.json", json.dumps(whole, indent=1))


def part_of(text):
    """(I, N) of "I/N"."""
    part, _, count = text.partition("/")
    if not part.isdigit() or not count.isdigit() or not 1 <= int(part) <= int(count):
        raise argparse.ArgumentTypeError(f"'{text}': write I/N, as 3/16")
    return int(part), int(count)


def parser():
    """The command line."""
    out = argparse.ArgumentParser(prog="waymark batch", formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLES,
                                  description="Replays and judges each recording of a plan with each configuration and program, on all cores. "
                                              "The same command goes on where it was stopped, and repeats only what has changed.")
    out.add_argument("plan", metavar="PLAN", help="recordings, configurations and programs (YAML)")
    out.add_argument("--out", metavar="FOLDER", required=True, help="cells, results.csv and results.json")
    out.add_argument("--jobs", metavar="N", type=int, default=len(os.sched_getaffinity(0)), help="at once; all cores by default")
    out.add_argument("--part", metavar="I/N", type=part_of, help="only this part of the cells, without results: for a cluster")
    out.add_argument("--list", action="store_true", help="the cells as JSON, with their keys; nothing is run")
    return out


def main(argv=None, beside=None):
    """The program."""
    given = parser().parse_args(argv)
    beside = beside or pathlib.Path(sys.argv[0]).resolve().parent
    out = pathlib.Path(given.out)
    try:
        cells = plans.read(given.plan, beside)
        out.mkdir(parents=True, exist_ok=True)
        return _run(given, cells, out)
    except (plans.PlanError, OSError) as error:
        print(f"waymark batch: {error}", file=sys.stderr)
        return 2


def _run(given, cells, out):
    sums = Sums(out / "sums.json")
    keyed = [(cell, cell.key(sums)) for cell in cells]
    if given.list:
        print(json.dumps([{"key": key, "recording": cell.recording, "configuration": cell.configuration, "program": cell.program,
                           "seed": cell.seed} for cell, key in keyed], indent=1))
        return 0
    if given.part is None:
        sums.keep()
    else:
        keyed = keyed[given.part[0] - 1::given.part[1]]
    store = cells_.Store(out)
    store.tidy()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: cells_.stop_all())
    begun = time.monotonic()
    try:
        results = run_cells(store, keyed, max(1, given.jobs), Progress)
    except cells_.Stopped:
        print(f"\nstopped; what is done is kept in {out}: the same command goes on from there", file=sys.stderr)
        return 1
    if given.part is None:
        write_results(out, results, given.plan)
    return _summary(given, results, out, time.monotonic() - begun)


def _summary(given, results, out, took_s):
    failed = [result for result in results if result["status"] != "done"]
    errors = {}
    for result in failed:
        errors.setdefault(result["error"], []).append(result)
    for error, rows in list(errors.items())[:10]:
        first = rows[0]
        print(f"{len(rows)} failed: {error}; the first is {first['recording']}, {first['configuration']}, {first['program']}: "
              f"{out}/failed/{first['key']}.txt", file=sys.stderr)
    if given.part is None:
        for text in agreements(results):
            print(text)
    print(f"{len(results)} cells, {len(failed)} failed, in {duration(took_s)}; sum {results_sum(results)}"
          + ("" if given.part else f"; written to {out}/results.csv"))
    return 1 if failed else 0
