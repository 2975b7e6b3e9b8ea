#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Mutated files for every command that reads some: no crash, no hang, no finding of a sanitizer, an exit code of 0, 1 or 2,
and a refusal that names the file.

    bad_input.py BIN [--mutants N] [--seed S] [--jobs J] [--rendered] [--only CASE[:NUMBER]] [--keep FOLDER] [--json FILE]

A mutant is chosen by its case, its number and the seed: the line of a fault has what makes it again. --rendered adds drives
with pictures, which take seconds to make. The work is of BIN's build: with one of the address sanitizer its findings count."""
import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time

from material import ROOT, make
from mutate import BINARY_ENDINGS, mutate

TIMEOUT_S = 120  # of a command that takes a second at most, on a machine that is busy and with a sanitizer
SANITIZER = re.compile(r"ERROR: \w*Sanitizer|runtime error:|SUMMARY: \w*Sanitizer")
ENVIRONMENT = {**os.environ, "ASAN_OPTIONS": "allocator_may_return_null=1:hard_rss_limit_mb=3000:detect_leaks=1:exitcode=99",
               "UBSAN_OPTIONS": "print_stacktrace=1:halt_on_error=1", "LCM_DEFAULT_URL": "memq://"}


class Case:
    """A command, by a function of its folder; the files of `place` that are mutated; how many shares of all mutants."""

    def __init__(self, place, files, command, shares=2, rendered=False):
        self.place, self.files, self.command, self.shares, self.rendered = place, files, command, shares, rendered


RECORDING = ["robot.yaml", "rec/recording.yaml", "rec/calibration.yaml", "rec/can-signals.yaml", "rec/vehicle.dbc", "rec/can.log"]
OUTPUT = ["run/trajectory.csv", "run/innovations.csv", "run/health.json", "run/events.wmlog", "run/published.csv", "run/timing.json"]


def replay(f):
    return ["waymark", "replay", f / "rec", "--config", f / "robot.yaml", "--out", f / "out"]


def check(f):
    return ["waymark", "check", f / "robot.yaml", f / "rec", "--quick"]


def play(f):
    return ["waymark-play", f / "rec", "--speed", "1000", "--until", "10", "--json", f / "played.json"]


def streams(*names):
    return [f"rec/{name}.csv" for name in names] + ["rec/recording.yaml", "robot.yaml"]


CASES = {
    "replay-sightings": Case("crossing", [*RECORDING, "rec/landmarks.csv", "rec/sightings.csv"], replay, 4),
    "replay-markers": Case("markers", ["rec/markers.csv", "rec/calibration.yaml", "robot.yaml"], replay),
    "replay-stereo": Case("seabed", ["rec/stereo.csv", "rec/motion6.csv", "rec/calibration.yaml", "rec/landmarks.csv", "robot.yaml"], replay),
    "replay-points": Case("corridor", ["rec/points.csv", "rec/map/map.yaml", "rec/map/edges.png", "rec/map/drivable.png", "robot.yaml"],
                          replay),
    "replay-streams": Case("streams", streams("motion", "imu", "gnss", "heading"), replay),
    "replay-wheels": Case("wheels", streams("ticks", "imu"), replay, 1),
    "replay-sides": Case("sides", streams("speeds", "imu", "gnss"), replay, 1),
    "replay-steered": Case("steered", streams("steering", "imu", "heading", "depth"), replay, 1),
    "replay-log": Case("crossing", ["run/events.wmlog"],
                       lambda f: ["waymark", "replay", f / "run/events.wmlog", "--out", f / "out"]),
    "replay-pictures": Case("signs", ["rec/video/left.avi", "rec/video/left.csv", "rec/landmarks/appearance.csv", "rec/landmarks/1.png"],
                            replay, 1, True),
    "replay-floor": Case("floor", ["rec/video/front.avi", "rec/video/front.csv", "rec/calibration.yaml"], replay, 1, True),
    "play": Case("crossing", ["rec/recording.yaml", "rec/can.log", "rec/sightings.csv"], play),
    "play-streams": Case("streams", [f"rec/{name}.csv" for name in ("motion", "imu", "gnss", "heading")], play, 1),
    "play-faults": Case("robot", ["faults.yaml"], lambda f: ["waymark-play", "--faults", f / "faults.yaml", "--print-faults"], 1),
    "run-resumed": Case("robot", ["pose.yaml", "robot.yaml"],
                        lambda f: ["waymark", "run", "--config", f / "robot.yaml", "--recording", f / "rec", "--out", f / "out",
                                   "--resume", "--speed", "20", "--duration", "1"], 1),
    "check": Case("crossing", [*RECORDING, "rec/landmarks.csv", "rec/sightings.csv"], check, 3),
    "check-configuration": Case("streams", ["robot.yaml"], lambda f: ["waymark", "check", f / "robot.yaml", f / "rec", "--json"], 1),
    "check-shipped": Case("corridor", ["robot.yaml"], check, 1),
    "eval": Case("crossing", [*OUTPUT, "rec/truth.csv", "rec/recording.yaml"],
                 lambda f: ["waymark-eval", f / "run", f / "rec", "--json"]),
    "eval-published": Case("crossing", ["run/published.csv", "rec/truth.csv"],
                           lambda f: ["waymark-eval", f / "run", f / "rec", "--published"], 1),
    "eval-gnss": Case("streams", ["out/trajectory.csv", "rec/gnss.csv"],
                      lambda f: ["waymark-eval", f / "out", f / "rec", "--against", "gnss", "--take-out-delay"], 1),
    "eval-edges": Case("floor", ["rec/labels/edges.csv", "run/events.wmlog", "rec/calibration.yaml"],
                       lambda f: ["waymark-eval", f / "run", f / "rec", "--detector", "edges"], 1, True),
    "report": Case("crossing", [*OUTPUT, "rec/truth.csv", "rec/landmarks.csv"],
                   lambda f: ["waymark-report", f / "run", f / "rec", "--out", f / "page.html"]),
    "report-map": Case("corridor", ["rec/map/map.yaml", "rec/map/edges.png", "run/hypotheses.csv", "run/trajectory.csv"],
                       lambda f: ["waymark-report", f / "run", f / "rec", "--out", f / "page.html"], 1),
    "diff": Case("crossing", OUTPUT, lambda f: ["waymark-diff", f / "run", f / "other"]),
    "reference": Case("corridor", ["run/events.wmlog", "run/trajectory.csv", "rec/map/map.yaml", "rec/calibration.yaml"],
                      lambda f: ["waymark-reference", f / "run", f / "rec", "--particles", "50", "--passes", "1"], 1),
    "suggest": Case("crossing", ["robot.yaml", "rec/sightings.csv", "rec/can.log"],
                    lambda f: ["waymark-suggest", f / "robot.yaml", f / "rec", "--against", f / "robot.yaml"], 1),
    "suggest-run": Case("crossing", ["run/events.wmlog"],
                        lambda f: ["waymark-suggest", f / "run", "--only", "sightings.noise", "--minutes", "0.1"], 1),
    "init": Case("robot", ["rec/vehicle.dbc", "rec/can.log"],
                 lambda f: ["waymark-init", f / "new", "--dbc", f / "rec/vehicle.dbc", "--can-log", f / "rec/can.log",
                            "--wheel-radius", "0.05", "--ticks", "1024", "--track", "0.3", "--sees", "nothing", "--yes"]),
    "init-urdf": Case("place", ["robot.urdf"],
                      lambda f: ["waymark-init", f / "new", "--motion", "ticks", "--ticks", "1024", "--wheel-radius", "0.05", "--track", "0.3", "--imu",
                                 "--urdf", f / "robot.urdf", "--sees", "nothing", "--yes"], 1),
    "init-layout": Case("place", ["camchain-imucam.yaml", "tags.json"],
                        lambda f: ["waymark-init", f / "new", "--motion", "twist", "--imu", "--calibration", f / "camchain-imucam.yaml",
                                   "--mounting", "cam0=0.2,0,0.5,0,0,0", "--sees", "tags", "--tag-size", "0.16", "--tag-layout",
                                   f / "tags.json", "--yes"]),
    "map-make": Case("place", ["plan.png"],
                     lambda f: ["waymark-map", "make", f / "plan.png", "--resolution", "0.05", "--out", f / "made"]),
    "map-make-ros": Case("place", ["ros.yaml", "plan.pgm"], lambda f: ["waymark-map", "make", f / "ros.yaml", "--out", f / "made"]),
    "map-check": Case("place", ["map/map.yaml", "map/edges.png", "map/drivable.png"],
                      lambda f: ["waymark-map", "check", f / "map/map.yaml", "--draw", f / "drawn.png"]),
    "map-survey": Case("crossing", ["run/innovations.csv", "run/trajectory.csv", "run/events.wmlog", "rec/truth.csv"],
                       lambda f: ["waymark-map", "survey", f / "run", "--poses", f / "rec", "--out", f / "made"], 1),
    "map-add-landmark": Case("place", ["photos/board.png", "front.yaml"],
                             lambda f: ["waymark-map", "add-landmark", f / "made", "--id", "7", "--picture", f / "photos/board.png",
                                        "--at", "1,2,3", "--size", "1,1", "--yaw", "0"], 1),
    "calibrate-kalibr": Case("place", ["camchain-imucam.yaml"],
                             lambda f: ["waymark-calibrate", "import", f / "camchain-imucam.yaml"], 1),
    "calibrate-ros": Case("place", ["front.yaml"], lambda f: ["waymark-calibrate", "import", f / "front.yaml"], 1),
    "calibrate-opencv": Case("place", ["opencv.yaml"],
                             lambda f: ["waymark-calibrate", "import", f / "opencv.yaml", "--lens", "plain"], 1),
    "calibrate-ocam": Case("place", ["calib_results.txt"], lambda f: ["waymark-calibrate", "import", f / "calib_results.txt"], 1),
    "calibrate-camera": Case("place", ["photos/board.png"],
                             lambda f: ["waymark-calibrate", "camera", f / "photos", "--chessboard", "9x6"], 1),
    "detect": Case("place", ["photos/board.png"],
                   lambda f: ["waymark-detect", f / "photos", "--detector", "apriltag", "--out", f / "seen"]),
    "detect-recording": Case("floor", ["rec/video/front.avi", "rec/video/front.csv", "robot.yaml", "rec/calibration.yaml"],
                             lambda f: ["waymark-detect", f / "rec", "--config", f / "robot.yaml", "--out", f / "seen"], 1, True),
    "import": Case("floor", ["rec/video/front.avi", "rec/video/front.csv"],
                   lambda f: ["waymark-import", f / "rec/video/front.avi", "--out", f / "imported"], 1, True),
    "simulate": Case("place", ["world.yaml"],
                     lambda f: ["waymark-simulate", f / "world.yaml", "--duration", "1", "--no-video", "--out", f / "made"]),
}


def names_of(file):
    """Words by which a message may name a file: its name, or the folder or run that it is part of."""
    path = pathlib.PurePath(file)
    # A signal that the DBC lacks is missed where it is bound; a log has a copy of its configuration; a run's tables are the run's.
    of = {"vehicle.dbc": {"can-signals.yaml"}, "events.wmlog": {"the event log's copy"}}.get(path.name, set())
    return {path.name, path.stem} | of | ({path.parent.name} if path.parent.name in ("run", "photos", "map") else set())


def judge(file, code, text, good_code):
    """What is wrong with how a command ended; "" where nothing is. `good_code` is its exit code with good files."""
    found = SANITIZER.search(text)
    if found or code == 99:
        return "sanitizer"
    if code is None:
        return "hang"
    if code < 0:
        return f"signal {-code}"
    if code not in (0, 1, 2):
        return f"exit code {code}"
    if code and not text.strip():
        return "silent"
    if code not in (0, good_code) and not any(name in text for name in names_of(file)):
        return "nameless"
    return ""


def has_line(file, text):
    return any(re.search(re.escape(name) + r"[^\n]{0,3}?:\d+", text) or re.search(re.escape(name) + r"[^\n]*line \d+", text)
               for name in names_of(file))


def call(options, case, place):
    """The command in the folder `place`: exit code (None: it did not end), what it printed, seconds."""
    program, *words = case.command(place)
    begun = time.monotonic()
    try:
        done = subprocess.run([options.binaries / program, *map(str, words)], capture_output=True, check=False, env=ENVIRONMENT,
                              timeout=TIMEOUT_S, cwd=place, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        return None, "", time.monotonic() - begun
    text = (done.stdout + done.stderr).decode(errors="replace").replace(str(place), ".")
    return done.returncode, text, time.monotonic() - begun


def copy_of(base, name, place):
    shutil.copytree(base / CASES[name].place, place)
    if name == "diff":
        shutil.copytree(place / "run", place / "other")


def good_codes(options, base, names):
    """Exit code of each case with good files; cases that this build cannot do are not in it."""
    out = {}
    for name in names:
        with tempfile.TemporaryDirectory(dir=options.work) as temporary:
            place = pathlib.Path(temporary) / "f"
            copy_of(base, name, place)
            code, text, _ = call(options, CASES[name], place)
            if "this build" in text:
                print(f"{name}: left out: {text.strip()}")
                continue
            lacking = [file for file in CASES[name].files if not (place / file).exists()]
            if code not in (0, 1) or lacking:
                sys.exit(f"{name}: exit code {code} with good files, without {lacking}:\n{text}")
            out[name] = code
    return out


def try_one(options, base, name, number, good_code):
    """Makes mutant `number` of a case and gives it to the command: what came of it."""
    case = CASES[name]
    rng = random.Random(f"{options.seed}:{name}:{number}")
    file = case.files[number % len(case.files)]
    with tempfile.TemporaryDirectory(prefix="waymark-mutant-", dir=options.work) as temporary:
        place = pathlib.Path(temporary) / "f"
        copy_of(base, name, place)
        (place / file).write_bytes(mutate(file, (place / file).read_bytes(), rng))
        code, text, took_s = call(options, case, place)
        fault = judge(file, code, text, good_code)
        if options.keep and (fault or options.only):
            shutil.copytree(place, options.keep / f"{name}-{number}", dirs_exist_ok=True)
            (options.keep / f"{name}-{number}/said.txt").write_text(text)
        lined = None if code in (0, good_code, None) or file.endswith(BINARY_ENDINGS) else has_line(file, text)
        return {"case": name, "number": number, "file": file, "fault": fault, "code": code, "text": text, "s": took_s, "lined": lined}


def chosen(options, names):
    """(case, number) of all mutants, each case with its shares."""
    if options.only:
        name, _, number = options.only.partition(":")
        return [(name, int(number))] if number else [(name, k) for k in range(options.mutants)]
    shares = sum(CASES[name].shares for name in names)
    return [(name, k) for name in names for k in range(max(2, round(options.mutants * CASES[name].shares / shares)))]


def print_table(results):
    rows = collections.defaultdict(collections.Counter)
    for result in results:
        row = rows[result["case"]]
        row[result["code"] if result["code"] in (0, 1, 2) else "other"] += 1
        row["fault"] += bool(result["fault"])
        row["lined"] += result["lined"] is True
        row["unlined"] += result["lined"] is False
        row["s"] = max(row["s"], result["s"])
    print(f"{'case':20} mutants  exit 0  exit 1  exit 2  other  faults  refusals of text with a line  longest s")
    for name, row in rows.items():
        print(f"{name:20} {sum(row[k] for k in (0, 1, 2, 'other')):7} {row[0]:7} {row[1]:7} {row[2]:7} {row['other']:6} {row['fault']:7} "
              f"{row['lined']:10} of {row['lined'] + row['unlined']:<16} {row['s']:8.1f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binaries", type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--mutants", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--rendered", action="store_true")
    parser.add_argument("--only")
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--material", type=pathlib.Path, help="good files of a run before; made there where missing")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="waymark-bad-input-") as temporary:
        options.work = temporary
        base = options.material or pathlib.Path(temporary) / "base"
        if not base.exists():
            made = base.with_name(base.name + ".new")
            make(options.binaries, made, options.rendered)
            subprocess.run([options.binaries / "waymark", "replay", made / "streams/rec", "--config", made / "streams/robot.yaml",
                            "--out", made / "streams/out"], check=True, capture_output=True)
            made.rename(base)
        codes = good_codes(options, base, [options.only.partition(":")[0]] if options.only else
                           [name for name, case in CASES.items() if options.rendered or not case.rendered])
        results = []
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            for result in pool.map(lambda mutant: try_one(options, base, *mutant, codes[mutant[0]]), chosen(options, list(codes))):
                results.append(result)
                if result["fault"]:
                    print(f"{result['fault']}: {result['case']}:{result['number']} --seed {options.seed}, {result['file']}, exit code "
                          f"{result['code']}\n    " + "\n    ".join(result["text"].strip().splitlines()[:12]), flush=True)
    print_table(results)
    faults = [result for result in results if result["fault"]]
    print(f"{len(results)} mutants, {len(faults)} faults, seed {options.seed}")
    if options.json:
        options.json.write_text(json.dumps(results))
    return 1 if faults or not results else 0


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    sys.exit(main())
