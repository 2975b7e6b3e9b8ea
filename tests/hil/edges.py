# SPDX-License-Identifier: Apache-2.0
"""A rendered corridor through the guest's CAN controller and V4L2 device into `waymark run`, and the judgement of what it
said over LCM: against a replay of the recording with the pictures that the guest saw, and against the truth."""
import bisect
import csv
import math
import pathlib
import re
import shutil
import struct
import subprocess

SIZE, RATE_HZ, SECONDS = (640, 360), 5, 14
POSITION_M, HEADING_DEG, TRUTH_RATIO = 0.02, 0.2, 1.5
URL = "udpm://239.255.76.67:7667?ttl=0"


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


def prepare(work, root, here, simulate):
    """The drive, its timeline for the player, and the robot's configuration."""
    recording, scenario = work / "edges-recording", work / "share/edges"
    shutil.rmtree(recording, ignore_errors=True)
    scenario.mkdir(parents=True)
    world = (root / "config/worlds/corridor-easy.yaml").read_text()
    world = world.replace("\npictures:", f"\ncameras: [{{name: front, size: {list(SIZE)}, rate_hz: {RATE_HZ}, colour: false}}]\n\npictures:")
    (work / "world.yaml").write_text(world)
    subprocess.run([simulate, work / "world.yaml", "--out", recording, "--duration", str(SECONDS)], check=True)

    items, blob = [], bytearray()
    for line in (recording / "can.log").read_text().splitlines():
        time, _, frame = line.split()[:3]
        whole, fraction = time.strip("()").split(".")
        ident, data = frame.split("#")
        items.append((int(whole) * 10**9 + int(fraction.ljust(9, "0")), f"c {ident} {data}"))
    with open(recording / "video/front.csv", newline="") as f:
        for row, picture in zip(csv.DictReader(f), pictures(recording / "video/front.avi")):
            items.append((int(row["t_ns"]), f"p {len(blob)} {len(picture)}"))
            blob += picture
    (scenario / "timeline").write_text("".join(f"{t} {what}\n" for t, what in sorted(items)))
    (scenario / "pictures").write_bytes(blob)
    (scenario / "duration").write_text(f"{SECONDS}\n")
    for name in ("vehicle.dbc", "can-signals.yaml", "calibration.yaml"):
        shutil.copy(recording / name, scenario)
    shutil.copytree(recording / "map", scenario / "map")
    about = (recording / "recording.yaml").read_text()
    start = re.search(r"initial_pose: *(\{[^}]*\})", about)
    start = start.group(1) if start else "{" + ", ".join(re.findall(r"((?:x_m|y_m|heading_rad): *[-0-9.e]+)", about)) + "}"
    (scenario / "robot.yaml").write_text(
        (root / "config/corridor.yaml").read_text() + f"\ninitial_pose: {start}\n"
        "calibration: calibration.yaml\ndbc: vehicle.dbc\ncan_signals: can-signals.yaml\nmap: map/map.yaml\n"
        f"publish: {{lcm_url: '{URL}'}}\n"
        # One processor: above the interrupts' threads (50), an estimator that takes 20 ms would cost CAN frames.
        "realtime: {priority: 40}\n"
        "devices:\n  can: [{interface: can0}]\n"
        f"  cameras: [{{name: front, device: /dev/video10, format: MJPG, rate_hz: {RATE_HZ}}}]\n")
    subprocess.run(["cc", "-O2", "-static", here / "play.c", "-o", scenario / "play"], check=True)
    return recording


def heard(path):
    """Poses of an LCM log: (t_ns, x, y, heading). Source: LCM's log format; msgs/lcm/pose_t.lcm."""
    data, at, poses = path.read_bytes(), 0, []
    while at + 28 <= len(data):
        sync, _, _, name, length = struct.unpack_from(">IqqII", data, at)
        if sync != 0xEDA1DA01 or at + 28 + name + length > len(data):
            break
        at += 28
        if data[at:at + name] == b"WAYMARK_POSE":
            fields = struct.unpack_from(">q5q4b3d4d", data, at + name)
            position, q = fields[10:13], fields[13:17]
            poses.append((fields[1], position[0], position[1], 2 * math.atan2(q[2], q[3])))
        at += name + length
    return poses


def table(path):
    with open(path, newline="") as f:
        return [(int(r["t_ns"]), float(r["x_m"]), float(r["y_m"]), 2 * math.atan2(float(r["qz"]), float(r["qw"])))
                for r in csv.DictReader(f)]


def at(rows, times, t_ns):
    """Between the two rows around t_ns; None outside."""
    i = bisect.bisect_right(times, t_ns)
    if i == 0 or i == len(rows):
        return None
    a, b = rows[i - 1], rows[i]
    part = (t_ns - a[0]) / (b[0] - a[0])
    return (a[1] + part * (b[1] - a[1]), a[2] + part * (b[2] - a[2]), a[3] + part * math.remainder(b[3] - a[3], 2 * math.pi))


def differences(poses, rows, offset_ns):
    times = [r[0] for r in rows]
    for p in poses:
        q = at(rows, times, p[0] - offset_ns)
        if q:
            yield math.hypot(p[1] - q[0], p[2] - q[1]), abs(math.degrees(math.remainder(p[3] - q[2], 2 * math.pi)))


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def judge(work, waymark, root, recording):
    out, failures = work / "share/out", []

    def replay(*words):
        return subprocess.run([waymark, "replay", *words], check=True, capture_output=True, text=True).stdout

    config = root / "config/corridor.yaml"
    # The map was in the guest's memory; here it is the recording's.
    replay(out / "drive/events.wmlog", "--map", recording / "map/map.yaml", "--out", work / "edges-again")
    if (out / "drive/trajectory.csv").read_bytes() != (work / "edges-again/trajectory.csv").read_bytes():
        failures.append("the guest's log doesn't give its poses bit by bit (edges)")
    said = replay(recording, "--config", config, "--frames-of", out / "drive/events.wmlog", "--out", work / "edges-same")
    offset_ns = int(re.search(r"clock is (-?\d+) ns ahead", said).group(1))
    replay(recording, "--config", config, "--out", work / "edges-desk")

    poses = heard(out / "heard.lcm")
    apart = list(differences(poses, table(work / "edges-same/published.csv"), offset_ns))
    truth = table(recording / "truth.csv")
    live = [m for m, _ in differences(poses, truth, offset_ns)]
    desk = [m for m, _ in differences(table(work / "edges-desk/published.csv"), truth, 0)]
    if len(apart) < 30 * SECONDS:
        return failures + [f"edges: only {len(apart)} of {len(poses)} poses over LCM can be compared"]
    worst_m, worst_deg = max(m for m, _ in apart), max(d for _, d in apart)
    print(f"edges: {len(poses)} poses over LCM; {len(apart)} of them at most {worst_m:.4f} m and {worst_deg:.3f} degrees from the "
          f"replay with the guest's pictures; from the truth {rms(live):.4f} m RMS, at the desk {rms(desk):.4f} m")
    if worst_m > POSITION_M or worst_deg > HEADING_DEG:
        failures.append("the guest's poses over LCM are not those of the replay with its pictures")
    if rms(live) > TRUTH_RATIO * rms(desk):
        failures.append("the guest's poses are worse than the desk's")
    return failures
