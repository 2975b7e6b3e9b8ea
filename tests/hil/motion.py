# SPDX-License-Identifier: Apache-2.0
"""A holonomic robot without CAN: its twist comes at 50 Hz over LCM from another program, as do the bearings of landmarks, each when it
arrived in the recording; landmark_ekf."""
import shutil

import drives
import landmarks
import messages

WORLD = "yard-holonomic"


def twists(work, recording):
    """(t_ns, message) of motion.csv."""
    waymark = messages.types(work)
    for row in drives.rows(recording / "motion.csv"):
        said = waymark.motion_t()
        said.t_ns = int(row["t_ns"])
        said.v_mps, said.vy_mps, said.w_radps = (float(row.get(name) or "nan") for name in ("v_mps", "vy_mps", "w_radps"))
        yield said.t_ns, said.encode()


def over_lcm(work, recording):
    """(when it is due, t_ns, message, channel) of twists, then of sightings."""
    for t_ns, message in twists(work, recording):
        yield t_ns, t_ns, message, "WAYMARK_MOTION"
    for arrival_ns, t_ns, message in landmarks.sightings(work, recording):
        yield arrival_ns, t_ns, message, "WAYMARK_SIGHTINGS"


def stage(work, root, here, simulate, name, world, devices, rows_of=lambda recording: ()):
    """The scenario of a robot whose twist and sightings come over LCM, with the player's other lines, (t_ns, line) of the recording."""
    recording, scenario = drives.make(work, name, simulate, root / f"config/worlds/{world}.yaml")
    items, blob, stamps = list(rows_of(recording)), bytearray(), []
    for due_ns, t_ns, message, channel in over_lcm(work, recording):
        items.append((due_ns, f"l {t_ns} {len(blob)} {len(message)} {channel}"))
        blob += message
        stamps.append(t_ns)
    drives.write(scenario, here, items, blob, (max(stamps) - min(stamps)) * 1e-9)
    for file in ("calibration.yaml", "landmarks.csv"):
        shutil.copy(recording / file, scenario)
    (scenario / "robot.yaml").write_text(
        (root / f"config/datasets/{world}.yaml").read_text() + f"\ninitial_pose: {drives.start_of(recording)}\n"
        "calibration: calibration.yaml\nlandmarks: landmarks.csv\n"
        f"publish: {{lcm_url: '{drives.URL}'}}\nrealtime: {{priority: 40}}\n"
        f"devices: {{{devices}}}\n")


def prepare(work, root, here, simulate):
    stage(work, root, here, simulate, "motion", WORLD, "lcm: [{stream: motion}], sightings: lcm")


def judge(work, waymark, root):
    seconds = float((work / "share/motion/duration").read_text())
    return drives.judge("motion", work, waymark, work / "motion-recording", root / f"config/datasets/{WORLD}.yaml", seconds)
