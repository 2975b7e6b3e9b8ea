#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A small version of the trials over many drives (docs/consistency.md, edges on the floor): four rendered drives, as driven and
set down elsewhere; and that the cache is used, not rendered again.

    edge_drives.py SOURCE BUILD"""
import pathlib
import re
import subprocess
import sys
import tempfile

SOURCE, BUILD = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
DRIVES = 4


def run(cache, *options):
    done = subprocess.run([sys.executable, SOURCE / "sim/montecarlo/pictures.py", SOURCE / "config/worlds/corridor-easy.yaml",
                           "--config", SOURCE / "config/datasets/corridor.yaml", "--cache", cache, "--drives", str(DRIVES),
                           "--duration", "80", "--bin", BUILD / "bin", "--", *options],
                          capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"pictures.py: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout, done.stderr


def number(text, what):
    found = re.search(what + r" (\d+)", text)
    if not found:
        sys.exit(f"no '{what}' in\n{text}")
    return int(found[1])


def main():
    with tempfile.TemporaryDirectory() as cache:
        cache = pathlib.Path(cache)
        diagram = cache / "lost.svg"
        out, err = run(cache, "--trials", "normal,kidnap", "--diagram", str(diagram))
        print(out)
        wrong = []
        if err.count("rendering seed") != DRIVES or list(cache.glob("*/video")):
            wrong.append("it should have rendered each drive once and kept no pictures")
        if number(out, "lost") > 0 or number(out, "with a false alarm") > 0:
            wrong.append("lost, or a false alarm")
        trials = number(out, "kidnap:")
        if trials < DRIVES - 1 or number(out, "detected within 5 s") < trials - 1:
            wrong.append("carried away and not detected")
        if number(out, "right within 20 m") < trials - 1:
            wrong.append("carried away and not found again")
        if number(out, "off by > 1 m for > 10 s") > 0:
            wrong.append("tracks a wrong place")
        if "<svg" not in diagram.read_text():
            wrong.append("no diagram")
        again, err = run(cache, "--trials", "normal")
        if "rendering" in err:
            wrong.append("rendered again what was there")
        sys.exit("\n".join(wrong) or 0)


if __name__ == "__main__":
    main()
