#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Mutation score: would the tests notice a wrong sign? Changes one place of a source at a time, builds, and runs the tests of its room.

    score.py WORK [--room ROOM ...] [--sample N] [--seed S] [--jobs J] [--json FILE] [--file SOURCE] [--skip-headers] [--without-golden] [--again] [--list]

WORK gets a copy of the sources and a build of its own; nothing is changed outside of it. A run that was stopped goes on where it
was: results are kept in WORK/results.jsonl. After a change of the tests, --again judges those anew that survived. Exit code 0 where every room reaches its floor.

A mutant is killed by the tests that assert something (stage 1) or by the golden outputs alone (stage 2: some bit of a small drive
changed). One that the compiler refuses does not count. Survivors are listed: a test is missing, or the mutant changes nothing
(tests/mutants/equivalent.txt has those, with the reason)."""
import argparse
import collections
import json
import os
import pathlib
import random
import shutil
import subprocess
import sys
import time

from source_mutants import apply, mutants_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
EQUIVALENT = ROOT / "tests/mutants/equivalent.txt"
GOLDEN = ["golden_outputs"]
FLOOR = 0.9
# A test that takes this many times its usual time, and at least so long, hangs.
HANGS, HANGS_S = 10, 30

FILTERS = ["pose_step", "planar", "planar_parts", "plane_motion", "odometry", "landmark_ekf", "landmark_elevation", "landmark_lost", "priors", "delays", "wheel_heading",
           "slam", "slam_camera", "slam_lost", "noise_adaption"]
MOTION = ["motion", "commands", "motion_models", "motion_noise", "front_end_bounds", "plane_motion", "drives", "twist_and_gyro", "odometry", "wheel_heading", "delays", "space",
          "space_imu", "spatial_parts", "stuck_imu", "silent_parts", "priors", "planar", "planar_parts", "landmark_ekf"]


def estimator_tests(*names):
    return [f"test_estimator_{name}" for name in names]


# The folder or file of each room, and its tests, the quickest first.
ROOMS = {
    "core": (["estimator/filters/core"], [*estimator_tests(*FILTERS, "course_and_turn", "landmark_counts", "edge_mcl", "stereo_ekf"),
                                          "test_contract_monitor", "test_contract_estimators"]),
    "planar": (["estimator/filters/planar"], [*estimator_tests(*FILTERS), "test_contract_estimators"]),
    "motion": (["estimator/motion"], [*estimator_tests(*MOTION), "test_contract_estimators"]),
    "merge": (["firmware/fusion/merge.c", "firmware/fusion/predictor.c", "firmware/fusion/fuser.c"],
              ["firmware_merge", "firmware_predictor", "firmware_fuser", "run_replay"]),
    "can": (["drivers/can"], ["can_bits", "can_candump", "can_dbc", "wm_errors_can", "can_decode", "can_gnss", "can_bind", "can_queue", "can_device"]),
    "codec": (["msgs/src"], ["msgs_text", "msgs_lcm_read", "msgs_codec", "msgs_lcm_messages", "msgs_lcm_views", "firmware_eventlog", "firmware_lcm_stream"]),
}


class Workshop:
    """A copy of the sources with a release build, whose objects the compiler cache has, and its tests."""

    def __init__(self, work, jobs):
        # The build is in the sources, as everywhere: the compiler cache counts paths relative to them.
        self.source, self.build, self.jobs = work / "source", work / "source/build", jobs
        self.source.mkdir(parents=True, exist_ok=True)
        files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode().split("\0")
        for name in filter(None, files):
            self.put(name, (ROOT / name).read_bytes())
            shutil.copymode(ROOT / name, self.source / name)
        if not (self.source / ".cache").exists():
            (self.source / ".cache").symlink_to(ROOT / ".cache")
        self.environment = {**os.environ, "CCACHE_BASEDIR": str(self.source), "CCACHE_NOHASHDIR": "1"}
        self.run("cmake", "-G", "Ninja", "-S", self.source, "-B", self.build, "-DCMAKE_BUILD_TYPE=RelWithDebInfo", "-DWM_TESTS=ON")

    def run(self, *command, timeout=None):
        return subprocess.run([str(word) for word in command], env=self.environment, capture_output=True, text=True, timeout=timeout, check=True)

    def put(self, name, data):
        """Writes a file where it differs, so that ninja builds what changed and no more."""
        file = self.source / name
        file.parent.mkdir(parents=True, exist_ok=True)
        if not file.exists() or file.read_bytes() != data:
            file.write_bytes(data)

    def make(self, targets):
        """Whether these build."""
        try:
            self.run("cmake", "--build", self.build, "-j", self.jobs, "--target", *targets, timeout=1200)
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
            return False
        return True

    def test(self, name, limit_s):
        """Whether a test passes within this time."""
        return subprocess.run(["ctest", "--test-dir", self.build, "-R", f"^{name}$", "--timeout", str(int(limit_s))], env=self.environment,
                              capture_output=True, check=False).returncode == 0


def targets_of(names):
    extra = {"golden_outputs": ["waymark", "waymark-simulate"], "run_replay": ["run_replay", "waymark"]}
    return sorted({target for name in names for target in extra.get(name, [name])})


def usual_times(shop, names):
    """Builds the tests of the unchanged sources, and their times: one that fails here could kill nothing."""
    print(f"building {len(names)} tests of the unchanged sources", file=sys.stderr)
    if not shop.make(targets_of(names)):
        sys.exit("score.py: the unchanged sources do not build: see " + str(shop.build))
    times = {}
    for name in names:
        begin = time.monotonic()
        if not shop.test(name, 600):
            sys.exit(f"score.py: {name} fails without a mutant")
        times[name] = time.monotonic() - begin
    return times


def judge(shop, mutant, stages, times, killers):
    """(verdict, test): killed, golden, survived, or refused by the compiler. Tests are linked one by one, those first that killed mutants of
    this file before (`killers` counts them)."""
    original = (ROOT / mutant.file).read_text()
    shop.put(mutant.file, apply(original, mutant).encode())
    shop.environment["CCACHE_READONLY"] = "1"
    try:
        for verdict, names in stages:
            for name in sorted(names, key=lambda n: (-killers[mutant.file, n], times[n])):
                if not shop.make(targets_of([name])):
                    return "refused", ""
                if not shop.test(name, max(HANGS_S, HANGS * times[name])):
                    killers[mutant.file, name] += 1
                    return verdict, name
        return "survived", ""
    finally:
        shop.environment.pop("CCACHE_READONLY")
        shop.put(mutant.file, original.encode())


def sources(places):
    for place in places:
        path = ROOT / place
        yield from ([path] if path.is_file() else sorted(p for p in path.iterdir() if p.suffix in (".c", ".h", ".cpp", ".hpp")))


def chosen(room, options):
    """A sample of the room's mutants by the seed."""
    places = options.file if options.file else ROOMS[room][0]
    every = [m for path in sources(places) for m in mutants_of(str(path.relative_to(ROOT)), path.read_text())]
    every = [m for m in every if not (options.skip_headers and m.file.endswith((".h", ".hpp")))]
    return every if options.sample <= 0 else random.Random(f"{options.seed} {room}").sample(every, min(options.sample, len(every)))


def argued():
    """Names of the mutants that change nothing which a test could see."""
    return {line.split("  #")[0].strip() for line in EQUIVALENT.read_text().splitlines() if line.strip() and not line.startswith("#")}


def without_line(mutant):
    """A mutant's name without the number of its line, which other changes move."""
    return f"{mutant.file} {mutant.name().split(' ', 1)[1]}"


def table(results):
    """A row a room; whether all reach their floor."""
    rows, is_good = [("room", "mutants", "killed", "golden alone", "survived", "argued away", "refused", "score", "without golden")], True
    for room in ROOMS:
        count = collections.Counter(r["verdict"] for r in results if r["room"] == room)
        judged = count["killed"] + count["golden"] + count["survived"]
        if not judged:
            continue
        score = (count["killed"] + count["golden"]) / judged
        is_good = is_good and score >= FLOOR
        rows.append((room, judged, count["killed"], count["golden"], count["survived"], count["argued"], count["refused"], f"{score:.2f}",
                     f"{count['killed'] / judged:.2f}"))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
        if row is rows[0]:
            print("|" + " --- |" * len(row))
    return is_good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=pathlib.Path, metavar="WORK")
    parser.add_argument("--room", action="append", choices=list(ROOMS), help="all rooms where none is named")
    parser.add_argument("--file", action="append", help="only mutants of this source, judged by the tests of the one --room")
    parser.add_argument("--sample", type=int, default=20, help="mutants a room; 0: all")
    parser.add_argument("--without-golden", action="store_true", help="stage 1 alone, which takes less time")
    parser.add_argument("--skip-headers", action="store_true", help="none of headers: each is compiled into many objects")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--json", type=pathlib.Path, help="results of all mutants")
    parser.add_argument("--again", action="store_true", help="judges kept mutants that survived anew")
    parser.add_argument("--list", action="store_true", help="names the mutants and ends")
    options = parser.parse_args()
    rooms = options.room or list(ROOMS)
    if options.list:
        print("\n".join(m.name() for room in rooms for m in chosen(room, options)))
        return 0
    work = options.work.resolve()
    shop = Workshop(work, options.jobs)
    kept = work / "results.jsonl"
    done = {json.loads(line)["mutant"]: json.loads(line) for line in kept.read_text().splitlines()} if kept.exists() else {}
    done = {name: row for name, row in done.items() if not (options.again and row["verdict"] == "survived")}
    equivalent = argued()
    results, killers = [], collections.Counter((r["mutant"].split(":")[0], r["test"]) for r in done.values())
    for room in rooms:
        mutants = chosen(room, options)
        stages = [("killed", ROOMS[room][1])] + ([] if options.without_golden else [("golden", GOLDEN)])
        times = usual_times(shop, [name for _, names in stages for name in names]) if any(m.name() not in done and without_line(m) not in equivalent for m in mutants) else {}
        for number, mutant in enumerate(mutants, 1):
            if without_line(mutant) in equivalent:
                done[mutant.name()] = {"room": room, "mutant": mutant.name(), "kind": mutant.kind, "verdict": "argued", "test": ""}
            elif mutant.name() not in done:
                begin = time.monotonic()
                verdict, test = judge(shop, mutant, stages, times, killers)
                done[mutant.name()] = {"room": room, "mutant": mutant.name(), "kind": mutant.kind, "verdict": verdict, "test": test,
                                       "seconds": round(time.monotonic() - begin, 1)}
                with open(kept, "a", encoding="utf-8") as out:
                    out.write(json.dumps(done[mutant.name()]) + "\n")
            results.append(done[mutant.name()])
            print(f"{room} {number}/{len(mutants)} {results[-1]['verdict']:9} {results[-1]['test'] or '-'}: {mutant.name()}", flush=True)
    for result in results:
        if result["verdict"] == "survived":
            print(f"survived: {result['mutant']}")
    is_good = table(results)
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
