#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Real pictures: landmarks of a hall learnt from one picture of one robot's fisheye are found in one of another robot, sixteen months
later, without a pose. The cameras' calibration isn't known: it and the wall's place were fitted to straight lines of the first picture.

usage: landmarks_real.py [SEEN.png], where the picture is drawn to."""
import math
import os
import pathlib
import sys
import tempfile

from judged import run

PICTURES = pathlib.Path(os.environ.get("WM_DATA_DIR", "")) / "pictures/robocup-msl-fisheye"
LEARNT, SEEN = "000014.jpg", "000027.jpg"
CALIBRATION = """cameras:
  front:
    model: equidistant
    size: [608, 800]
    intrinsics: [244.93, 244.93, 306.86, 395.80]
    distortion: [0.07500, 0.09017, 0, 0]
    mounting: {xyz_m: [0, 0, 0.2814], rpy_deg: [-0.659, 1.862, 0]}
"""
# Corners in the picture, place and size in units of which the wall is 6 away, direction; and where it is in the other
# picture, by eye.
LANDMARKS = {
    1: ("165.4,336.2,205.2,331.3,205.4,363.1,164.9,364.2", "7.637,4.092,1.550", "1.878,1.002", -107.99, (153, 354)),
    2: ("216.9,305.4,273.5,299.1,269.4,378.9,210.9,379.4", "6.938,1.940,1.648", "1.995,2.269", -107.99, (231, 346)),
    3: ("341.1,305.5,395.5,301.5,396,383.9,341.6,384.4", "5.828,-1.478,1.390", "1.329,1.998", -107.99, (383, 357)),
    4: ("483.1,317,504.3,316.4,504.9,376.3,484.5,375.7", "4.911,-4.302,1.315", "0.494,1.379", -107.99, (499, 356)),
    5: ("404.5,382.3,469,382.3,469.8,395.9,405,395.3", "5.328,-3.020,0.302", "1.508,0.310", -107.99, (442, 401)),
    6: ("277,380.8,331.5,383.1,331.5,392.6,277,391.7", "6.340,0.097,0.302", "1.494,0.265", -107.99, None),
    7: ("94.7,319.8,115.6,321.7,113.7,384.3,93.9,383.5", "7.062,6.851,1.446", "0.730,2.144", -17.99, (52.5, 355.5)),
}


def main():
    if not (PICTURES / SEEN).exists():
        print(f"skipped: {PICTURES / SEEN} is not there (WM_DATA_DIR)")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="waymark-real-") as name:
        folder = pathlib.Path(name)
        calibration = folder / "calibration.yaml"
        calibration.write_text(CALIBRATION)
        for number, (corners, at, size, yaw, _) in LANDMARKS.items():
            run("waymark-map", "add-landmark", folder / "map", "--id", number, "--picture", PICTURES / LEARNT, "--calibration", calibration,
                "--camera", "front", "--corners", corners, "--at", at, "--size", size, "--yaw", yaw)
        drawn = sys.argv[1] if len(sys.argv) > 1 else folder / "seen.png"
        said = run("waymark-map", "look", folder / "map", "--picture", PICTURES / SEEN, "--calibration", calibration, "--camera", "front",
                   "--mounting-deg", 1.5, "--draw", drawn, expect=(0, 1))
    print(said)
    right = wrong = 0
    for line in said.splitlines():
        words = line.split()
        if len(words) == 7 and words[1] == "found":
            there = LANDMARKS[int(words[0])][4]
            close = there is not None and math.dist((float(words[4]), float(words[5])), there) < 8
            right, wrong = right + close, wrong + (not close)
    print(f"{right} found where they are, {wrong} elsewhere")
    sys.exit(0 if right >= 5 and wrong == 0 else 1)


main()
