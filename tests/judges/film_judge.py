# SPDX-License-Identifier: Apache-2.0
"""film_judge.py WAYMARK_SIMULATE: others read a rendered recording. ffmpeg and OpenCV decode its pictures, cantools its
CAN log by its DBC, evo its truth. What of ffmpeg, OpenCV and evo isn't there is named and left out."""
import csv
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import cantools

SCENARIO = Path("config/worlds/corridor-easy.yaml")
FAULTS = "faults:\n  frames_duplicated_percent: 20\n  frames_reordered_percent: 20"
CAMERA = "cameras:\n  - {name: front, size: [320, 180]}\n"


def simulate(program, folder):
    text = SCENARIO.read_text()
    text = re.sub(r"^faults:", FAULTS, text, flags=re.M).replace("samples: 2", "samples: 1") + CAMERA
    scenario = folder / "short.yaml"
    scenario.write_text(text)
    out = folder / "recording"
    subprocess.run([program, scenario, "--out", out, "--duration", "6"], check=True, stdout=subprocess.DEVNULL)
    return out


def check_stamps(rows):
    frames = [int(r["frame"]) for r in rows]
    assert frames == list(range(len(rows))), "frames are not numbered from 0"
    arrivals = [int(r["arrival_ns"]) for r in rows]
    assert all(a < b for a, b in zip(arrivals, arrivals[1:])), "rows are not in the order of arrival"
    stamps = [int(r["t_ns"]) for r in rows]
    again = sum(a == b for a, b in zip(stamps, stamps[1:]))
    backwards = sum(a > b for a, b in zip(stamps, stamps[1:]))
    assert again > 0 and backwards > 0, f"{again} duplicated and {backwards} reordered pictures"
    print(f"stamps: {len(rows)} pictures, {again} duplicated, {backwards} reordered")


def check_ffmpeg(video, count):
    if not shutil.which("ffprobe"):
        return print("left out: ffprobe is not there (Debian package ffmpeg)")
    done = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v:0", "-show_entries",
                           "stream=nb_read_frames,width,height", "-of", "csv=p=0", video], check=True, text=True,
                          capture_output=True)
    assert not done.stderr, done.stderr
    width, height, frames = (int(v) for v in done.stdout.strip().split(","))
    assert (width, height, frames) == (320, 180, count), f"ffprobe: {done.stdout}"
    print(f"ffprobe: {frames} pictures decoded")


def check_opencv(video, count):
    try:
        import cv2
    except ImportError:
        return print("left out: OpenCV is not there (Debian package python3-opencv)")
    capture, frames = cv2.VideoCapture(str(video)), 0
    while True:
        there, picture = capture.read()
        if not there:
            break
        assert picture.shape[:2] == (180, 320)
        frames += 1
    assert frames == count, f"OpenCV: {frames} of {count} pictures"
    print(f"OpenCV: {frames} pictures decoded")


def check_can(folder):
    database = cantools.database.load_file(folder / "vehicle.dbc")
    decoded = 0
    for line in (folder / "can.log").read_text().splitlines():
        number, data = re.fullmatch(r"\(\d+\.\d+\) \S+ ([0-9A-F]+)#([0-9A-F]*)(?: .*)?", line).groups()
        assert database.decode_message(int(number, 16), bytes.fromhex(data)), line
        decoded += 1
    assert decoded > 1000
    print(f"cantools: {decoded} CAN frames decoded")


def check_truth(folder):
    try:
        import numpy
        from evo.core.trajectory import PoseTrajectory3D
    except ImportError:
        return print("left out: evo is not there (PyPI package evo)")
    rows = list(csv.DictReader((folder / "truth.csv").open()))
    columns = lambda *names: numpy.array([[float(r[n]) for n in names] for r in rows])
    path = PoseTrajectory3D(columns("x_m", "y_m", "z_m"), columns("qw", "qx", "qy", "qz"), columns("t_ns")[:, 0] * 1e-9)
    fine, details = path.check()
    assert fine, details
    print(f"evo: {path.path_length:.1f} m of truth")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = simulate(sys.argv[1], Path(name))
        rows = list(csv.DictReader((folder / "video/front.csv").open()))
        check_stamps(rows)
        check_ffmpeg(folder / "video/front.avi", len(rows))
        check_opencv(folder / "video/front.avi", len(rows))
        check_can(folder)
        check_truth(folder)


main()
