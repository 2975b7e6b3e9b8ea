# SPDX-License-Identifier: Apache-2.0
"""A simulated crossing through the guest's CAN controller into landmark_ekf; its sightings come from another program, over LCM,
each when it arrived in the recording."""
import math
import shutil

import drives
import messages


def sightings(work, recording):
    """(arrival_ns, t_ns, message) of each sensor's picture."""
    waymark = messages.types(work)
    together = {}
    for row in drives.rows(recording / "sightings.csv"):
        together.setdefault((int(row["t_ns"]), row["sensor"]), []).append(row)
    number = lambda text: float(text) if text else math.nan
    for (t_ns, sensor), rows in together.items():
        said = waymark.observations_t()
        said.t_ns, said.count = t_ns, len(rows)
        said.sensor = sensor.encode().ljust(32, b"\0")
        for i, row in enumerate(rows):
            said.landmark_id[i] = int(row["id"]) if row["id"] else -1
            said.bearing_rad[i], said.range_m[i] = number(row["bearing_rad"]), number(row.get("range_m"))
        yield max(int(row["arrival_ns"]) for row in rows), t_ns, said.encode()


def prepare(work, root, here, simulate):
    recording, scenario = drives.make(work, "landmarks", simulate, root / "config/worlds/crossing.yaml")
    items, blob = list(drives.can_items(recording)), bytearray()
    seconds = (items[-1][0] - items[0][0]) * 1e-9
    for arrival_ns, t_ns, message in sightings(work, recording):
        items.append((arrival_ns, f"l {t_ns} {len(blob)} {len(message)}"))
        blob += message
    drives.write(scenario, here, items, blob, seconds)
    for name in ("vehicle.dbc", "can-signals.yaml", "calibration.yaml", "landmarks.csv"):
        shutil.copy(recording / name, scenario)
    (scenario / "robot.yaml").write_text(
        (root / "config/datasets/crossing-points.yaml").read_text() + f"\ninitial_pose: {drives.start_of(recording)}\n"
        "calibration: calibration.yaml\ndbc: vehicle.dbc\ncan_signals: can-signals.yaml\nlandmarks: landmarks.csv\n"
        f"publish: {{lcm_url: '{drives.URL}'}}\nrealtime: {{priority: 40}}\n"
        "devices: {can: [{interface: can0}], sightings: lcm}\n")


def judge(work, waymark, root):
    seconds = float((work / "share/landmarks/duration").read_text())
    return drives.judge("landmarks", work, waymark, work / "landmarks-recording", root / "config/datasets/crossing-points.yaml", seconds)
