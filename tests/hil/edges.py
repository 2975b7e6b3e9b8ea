# SPDX-License-Identifier: Apache-2.0
"""A rendered corridor through the guest's CAN controller and V4L2 device into edge_mcl."""
import shutil
import struct

import drives

SIZE, RATE_HZ, SECONDS = (640, 360), 5, 14


def pictures(avi):
    """The MJPEG pictures of an AVI, in their order."""
    data, at = avi.read_bytes(), 12
    while at + 8 <= len(data):
        kind, length = data[at:at + 4], struct.unpack_from("<I", data, at + 4)[0]
        if kind == b"LIST":
            at += 12
            continue
        if kind == b"00dc":
            yield data[at + 8:at + 8 + length]
        at += 8 + length + (length & 1)


def played(recording):
    """The player's lines of the pictures, (t_ns, line), and the pictures' bytes one behind the other."""
    items, blob = [], bytearray()
    for row, picture in zip(drives.rows(recording / "video/front.csv"), pictures(recording / "video/front.avi")):
        items.append((int(row["t_ns"]), f"p {len(blob)} {len(picture)}"))
        blob += picture
    return items, blob


def prepare(work, root, here, simulate):
    """The drive, its timeline for the player, and the robot's configuration."""
    world = (root / "config/worlds/corridor-easy.yaml").read_text()
    world = world.replace("\npictures:", f"\ncameras: [{{name: front, size: {list(SIZE)}, rate_hz: {RATE_HZ}, colour: false}}]\n\npictures:")
    (work / "world.yaml").write_text(world)
    recording, scenario = drives.make(work, "edges", simulate, work / "world.yaml", "--duration", str(SECONDS))

    items, blob = played(recording)
    drives.write(scenario, here, [*drives.can_items(recording), *items], blob, SECONDS)
    for name in ("vehicle.dbc", "can-signals.yaml", "calibration.yaml"):
        shutil.copy(recording / name, scenario)
    shutil.copytree(recording / "map", scenario / "map")
    (scenario / "robot.yaml").write_text(
        # One processor: above the interrupts' threads (50), an estimator that takes 20 ms would cost CAN frames.
        drives.with_realtime((root / "config/datasets/corridor.yaml").read_text(), "priority: 40") + f"\ninitial_pose: {drives.start_of(recording)}\n"
        "calibration: calibration.yaml\ndbc: vehicle.dbc\ncan_signals: can-signals.yaml\nmap: map/map.yaml\n"
        f"publish: {{lcm_url: '{drives.URL}'}}\n"
        "devices:\n  can: [{interface: can0}]\n"
        f"  cameras: [{{name: front, device: /dev/video10, format: MJPG, rate_hz: {RATE_HZ}}}]\n")


def judge(work, waymark, root):
    recording = work / "edges-recording"
    # The map was in the guest's memory; here it is the recording's.
    return drives.judge("edges", work, waymark, recording, root / "config/datasets/corridor.yaml", SECONDS, "--map", recording / "map/map.yaml")
