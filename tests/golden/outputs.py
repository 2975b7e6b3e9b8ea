#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Golden outputs: what each estimator and each detector makes of a small simulated drive, as text in tests/golden/outputs/.
A change of any bit of a trajectory, an innovation or a detection is a change of such a file, which a reviewer sees.

    outputs.py BIN check              compares; exit code 1 and a diff where anything changed
    outputs.py BIN accept "REASON"    writes the files anew; the reason belongs into the commit message
    outputs.py BIN near CHECKOUT      the same but for rounding? Compares with the programs in CHECKOUT/build/bin, by the
                                      configurations of CHECKOUT, on the same drives: verdicts, states and counts equal,
                                      poses within 1e-9 m and rad, sigmas within 1e-9 of themselves (tests/golden/near.py)

The simulator makes the same bytes from a scenario and its seed on every machine; nothing else is read."""
import difflib
import hashlib
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

import near
from judged import rows

ROOT = pathlib.Path(__file__).resolve().parents[2]
OUTPUTS = ROOT / "tests/golden/outputs"
# Configuration, world, seconds. Estimators by features; below, detectors by rendered pictures, few of which take seconds.
DRIVES = [
    ("crossing-odometry", "crossing", 20),   # odometry
    ("crossing-points", "crossing", 20),     # landmark_ekf
    ("loops-lines", "loops-lines", 30),      # slam by bearings
    ("loops-markers", "loops-markers", 30),  # slam by coded markers
    ("loops-landmarks", "loops-landmarks", 30),
    ("seabed-points", "seabed-points", 20),  # stereo_ekf
    ("corridor", "corridor-low", 3),            # edge_mcl; edges
    ("corridor-particles", "corridor-low", 3),  # pf_edges; edges
    ("crossing", "crossing-easy", 0.6),         # landmark_ekf; landmarks
    ("crossing-cascade", "crossing-easy", 0.6),  # cascade
    ("hall", "hall-easy", 1),                    # slam; lines
    ("office-walls", "office-walls", 1.2),       # slam; apriltag, mr
    ("seabed", "seabed-easy", 0.8),              # stereo_ekf; stereo
]
POSES = 12  # shown of each trajectory, evenly spaced; the digest is of all


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(word) for word in command)}\n{done.stderr[-2000:]}")


def digest(data):
    return hashlib.sha256(data).hexdigest()[:16]


def trajectory_text(file):
    lines = file.read_text(encoding="utf-8").splitlines()
    poses = lines[1:]
    if file.name == "published.csv":  # carried on from those of trajectory.csv
        return [f"{file.name}: {len(poses)} rows, digest {digest(file.read_bytes())}"]
    shown = sorted({round(i * (len(poses) - 1) / (POSES - 1)) for i in range(POSES)}) if poses else []
    return [f"{file.name}: {len(poses)} rows, digest {digest(file.read_bytes())}", f"  {lines[0]}",
            *(f"  {poses[i]}" for i in shown)]


def innovations_text(file):
    """Digest of all, and of each source, sensor and residual: how many of each verdict, sum of NIS."""
    kinds = {}
    for row in rows(file):
        kind = kinds.setdefault((row["source"], row["sensor"], row["residual"]), {"nis": 0.0})
        kind[row["verdict"]] = kind.get(row["verdict"], 0) + 1
        kind["nis"] += float(row["nis"]) if row["nis"] not in ("", "nan") else 0.0
    out = [f"{file.name}: digest {digest(file.read_bytes())}"]
    for key in sorted(kinds):
        counts = ", ".join(f"{name} {kinds[key][name]}" for name in sorted(kinds[key]) if name != "nis")
        out.append(f"  {' '.join(key)}: {counts}, sum of NIS {kinds[key]['nis']:.9g}")
    return out


def counters(value, path=""):
    """Counts of health.json by their keys; calibration has values, and stamps are not counts."""
    if isinstance(value, dict):
        return [line for key in sorted(value) if key != "calibration" and not key.endswith("_ns")
                for line in counters(value[key], f"{path}.{key}" if path else key)]
    return [f"  {path}: {value}"] if isinstance(value, int) and not isinstance(value, bool) and value != 0 else []


def output_of(folder, config, world, seconds):
    out = [f"config/datasets/{config}.yaml on config/worlds/{world}.yaml, {seconds} s"]
    for name in ("trajectory.csv", "published.csv", "map-estimate.csv"):
        if (folder / name).exists():
            out += trajectory_text(folder / name)
    if (folder / "innovations.csv").exists():
        out += innovations_text(folder / "innovations.csv")
    out += ["health.json, what was counted:", *counters(json.loads((folder / "health.json").read_text(encoding="utf-8")))]
    return "\n".join(out) + "\n"


def simulate(binaries, folder, world, seconds):
    """The recording of a drive; several drives may share one."""
    recording = folder / f"{world}-{seconds}"
    if not recording.exists():
        run(binaries / "waymark-simulate", ROOT / f"config/worlds/{world}.yaml", "--duration", seconds, "--out", recording)
    return recording


def replay(binaries, root, recording, config, out):
    run(binaries / "waymark", "replay", recording, "--config", root / f"config/datasets/{config}.yaml", "--out", out)


def make(binaries, folder):
    """Output of each drive, by its file's name."""
    out = {}
    for config, world, seconds in DRIVES:
        replay(binaries, ROOT, simulate(binaries, folder, world, seconds), config, folder / config)
        out[f"{config}.txt"] = output_of(folder / config, config, world, seconds)
        shutil.rmtree(folder / config)
    return out


def check_near(binaries, reference, folder):
    """One line for each drive: the largest differences from what the reference's programs make of it."""
    is_near = True
    for config, world, seconds in DRIVES:
        recording = simulate(binaries, folder, world, seconds)
        replay(binaries, ROOT, recording, config, folder / "now")
        replay(reference / "build/bin", reference, recording, config, folder / "was")
        of = near.compare(folder / "was", folder / "now")
        differences = ", ".join(f"{near.NAMES[kind]}: {worst:.1e}" for kind, worst in of.worst.items())
        print(f"{config}: {'near' if not of.faults else 'DIFFERS'}; {of.verdicts} verdicts; {differences}")
        for fault in of.faults:
            print(f"  {fault}")
        is_near = is_near and not of.faults
        for name in ("now", "was"):
            shutil.rmtree(folder / name)
    return 0 if is_near else 1


def check(made):
    kept = {file.name: file.read_text(encoding="utf-8") for file in OUTPUTS.glob("*.txt")}
    diff = []
    for name in sorted(kept.keys() | made.keys()):
        diff += difflib.unified_diff(kept.get(name, "").splitlines(), made.get(name, "").splitlines(),
                                     f"tests/golden/outputs/{name}", "now", n=1, lineterm="")
    if diff:
        print("\n".join(diff))
        print('Is the change meant? Then: ./dev golden --accept "reason", and the reason into the commit message.')
    return 1 if diff else 0


def accept(made, reason):
    OUTPUTS.mkdir(exist_ok=True)
    for file in OUTPUTS.glob("*.txt"):
        file.unlink()
    for name, text in made.items():
        (OUTPUTS / name).write_text(text, encoding="utf-8")
    print(f"tests/golden/outputs has the outputs of now; for the commit message:\n\nGolden outputs: {reason}")
    return 0


def main():
    words = {"check": 3, "accept": 4, "near": 4}  # of a command line
    if len(sys.argv) < 3 or words.get(sys.argv[2]) != len(sys.argv):
        is_asked = sys.argv[1:] in (["--help"], ["-h"])
        print(__doc__, file=sys.stdout if is_asked else sys.stderr)
        return 0 if is_asked else 2
    binaries = pathlib.Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        if sys.argv[2] == "near":
            return check_near(binaries, pathlib.Path(sys.argv[3]).resolve(), pathlib.Path(folder))
        made = make(binaries, pathlib.Path(folder))
    return check(made) if sys.argv[2] == "check" else accept(made, sys.argv[3])


if __name__ == "__main__":
    sys.exit(main())
