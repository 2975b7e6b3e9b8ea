#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Edge localization over many rendered drives: each seed is another building, route, light and set of errors. Renders
what the cache lacks (at reduced cost), keeps what the detector saw and not the pictures, and then runs the filter over
all: as driven, set down elsewhere, started anywhere, set down where it looks the same.

    pictures.py SCENARIO --config FILE --cache FOLDER [--drives N] [--duration S] [--size WxH] [--rate HZ] [-- OPTION ...]

example: sim/montecarlo/pictures.py config/worlds/corridor-hard.yaml --config config/datasets/corridor.yaml --cache out/drives --drives 100
A drive of 120 s takes about 20 s of processor to render at 640x360 and 5 Hz, one ray a pixel, and 4.5 MB to keep. Drives
that are in the cache are reused: stop it and go on at will; another detector wants another cache. Options behind --
go to waymark-montecarlo (--trials kidnap, --diagram lost.svg, --csv looks.csv, --each ...)."""
import argparse
import pathlib
import shutil
import subprocess
import sys
import time

from landmarks import ROOT, call, cheaper


def make_drive(a, scenario, seed, folder):
    """A recording without pictures, with the event log of a replay: complete, or not there."""
    part, run = folder.with_suffix(".part"), folder.with_suffix(".run")
    for left in (part, run):
        shutil.rmtree(left, ignore_errors=True)
    call(a.bin / "waymark-simulate", scenario, "--seed", seed, "--duration", a.duration, "--out", part)
    call(a.bin / "waymark", "replay", part, "--config", a.config, "--out", run, "--seed", seed)
    shutil.move(run / "events.wmlog", part / "events.wmlog")
    for gone in (run, part / "video", part / "labels"):
        shutil.rmtree(gone, ignore_errors=True)
    part.rename(folder)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("scenario", type=pathlib.Path)
    p.add_argument("--config", type=pathlib.Path, required=True)
    p.add_argument("--cache", type=pathlib.Path, required=True, help="folder of the drives")
    p.add_argument("--drives", type=int, default=10)
    p.add_argument("--first-seed", type=int, default=1)
    p.add_argument("--duration", type=float, default=120)
    p.add_argument("--size", default="640x360")
    p.add_argument("--rate", type=float, default=5, help="pictures a second")
    p.add_argument("--bin", type=pathlib.Path, default=ROOT / "build" / "bin")
    own, rest = sys.argv[1:], []
    if "--" in own:
        own, rest = own[: own.index("--")], own[own.index("--") + 1 :]
    a = p.parse_args(own)
    scenario = cheaper(a, "front")
    seeds = range(a.first_seed, a.first_seed + a.drives)
    missing = [s for s in seeds if not (a.cache / str(s) / "events.wmlog").exists()]
    begun = time.monotonic()
    for done, seed in enumerate(missing):
        left = f", {(time.monotonic() - begun) / done * (len(missing) - done) / 60:.0f} min left" if done else ""
        print(f"rendering seed {seed}, {done + 1} of {len(missing)}{left}", file=sys.stderr, flush=True)
        make_drive(a, scenario, seed, a.cache / str(seed))
    command = [a.bin / "waymark-montecarlo", a.cache, "--config", a.config, *rest]
    sys.exit(subprocess.run([str(c) for c in command]).returncode)


if __name__ == "__main__":
    main()
