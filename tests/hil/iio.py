# SPDX-License-Identifier: Apache-2.0
"""A robot with two driven wheels and an IMU: its measured twist and the bearings of landmarks come over LCM, its turn rate from the IIO
buffer of the kernel's driver for HID gyroscopes, each at its own time; landmark_ekf."""
import drives
import messages
import motion
from published import WORKS, Published

WORLD = "yard-imu"
RECEIVED_LEAST = 0.98  # of the samples; the buffer is opened after the first


def rates(recording):
    """(t_ns, line for the player) of imu.csv."""
    for row in drives.rows(recording / "imu.csv"):
        yield int(row["t_ns"]), "g " + " ".join(str(round(1e6 * float(row[name]))) for name in ("wx_radps", "wy_radps", "wz_radps"))


def prepare(work, root, here, simulate):
    motion.stage(work, root, here, simulate, "iio", WORLD, "lcm: [{stream: motion}], iio: {device: gyro_3d}, sightings: lcm", rates)


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
