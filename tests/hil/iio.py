# SPDX-License-Identifier: Apache-2.0
"""A robot with two driven wheels and an IMU: its measured twist and the bearings of landmarks come over LCM, its turn rate from the IIO
buffer of the kernel's driver for HID gyroscopes, each at its own time; landmark_ekf."""
import csv
import shutil

import drives
import landmarks
import messages
import motion
from published import WORKS, Published

WORLD = "yard-imu"
RECEIVED_LEAST = 0.98  # of the samples; the buffer is opened after the first


def rates(recording):
    """(t_ns, line for the player) of imu.csv."""
    with open(recording / "imu.csv", newline="") as f:
        for row in csv.DictReader(f):
            yield int(row["t_ns"]), "g " + " ".join(str(round(1e6 * float(row[name]))) for name in ("wx_radps", "wy_radps", "wz_radps"))


def prepare(work, root, here, simulate):
    recording, scenario = drives.make(work, "iio", simulate, root / f"config/worlds/{WORLD}.yaml")
    items, blob = list(rates(recording)), bytearray()
    seconds = (items[-1][0] - items[0][0]) * 1e-9
    for due_ns, t_ns, message, channel in motion.over_lcm(work, recording):
        items.append((due_ns, f"l {t_ns} {len(blob)} {len(message)} {channel}"))
        blob += message
    drives.write(scenario, here, items, blob, seconds)
    for name in ("calibration.yaml", "landmarks.csv"):
        shutil.copy(recording / name, scenario)
    (scenario / "robot.yaml").write_text(
        (root / f"config/datasets/{WORLD}.yaml").read_text() + f"\ninitial_pose: {drives.start_of(recording)}\n"
        "calibration: calibration.yaml\nlandmarks: landmarks.csv\n"
        f"publish: {{lcm_url: '{drives.URL}'}}\nrealtime: {{priority: 40}}\n"
        "devices: {lcm: [{stream: motion}], iio: {device: gyro_3d}, sightings: lcm}\n")


def judge(work, waymark, root):
    seconds = float((work / "share/iio/duration").read_text())
    failures = drives.judge("iio", work, waymark, work / "iio-recording", root / f"config/datasets/{WORLD}.yaml", seconds)
    heard = Published("iio", work / "share/out/iio", 0, str)
    samples = sum(1 for _ in rates(work / "iio-recording"))
    end_s = heard.healths[-1][0]
    received = messages.source(heard.health_at(end_s), "imu").received
    heard.check(received >= RECEIVED_LEAST * samples, f"{received} of {samples} samples by IIO")
    heard.device("the drive", "imu", WORKS, end_s - seconds, end_s - 10)
    return failures + heard.failures
