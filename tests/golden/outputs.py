#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Golden outputs: what each estimator and each detector makes of a small simulated drive, as text in tests/golden/outputs/.
A change of any bit of a trajectory, an innovation or a detection is a change of such a file, which a reviewer sees.

    outputs.py BIN check              compares; exit code 1 and a diff where anything changed
    outputs.py BIN accept "REASON"    writes the files anew; the reason belongs into the commit message

The simulator makes the same bytes from a scenario and its seed on every machine; nothing else is read."""
import csv
import difflib
import hashlib
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

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


def rows(file):
    with open(file, newline="", encoding="utf-8") as text:
        return list(csv.DictReader(text))


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


def make(binaries, folder):
    """Output of each drive, by its file's name."""
    out = {}
    for config, world, seconds in DRIVES:
        recording = folder / f"{world}-{seconds}"
        if not recording.exists():
            run(binaries / "waymark-simulate", ROOT / f"config/worlds/{world}.yaml", "--duration", seconds, "--out", recording)
        run(binaries / "waymark", "replay", recording, "--config", ROOT / f"config/datasets/{config}.yaml", "--out", folder / config)
        out[f"{config}.txt"] = output_of(folder / config, config, world, seconds)
        shutil.rmtree(folder / config)
    return out


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
    if len(sys.argv) < 3 or (sys.argv[2] == "accept") != (len(sys.argv) == 4) or sys.argv[2] not in ("check", "accept"):
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        made = make(pathlib.Path(sys.argv[1]), pathlib.Path(folder))
    return check(made) if sys.argv[2] == "check" else accept(made, sys.argv[3])


if __name__ == "__main__":
    sys.exit(main())
