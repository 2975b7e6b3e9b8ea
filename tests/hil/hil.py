#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Hardware in the loop: the same daemon and configuration as on a robot, in a guest with Debian's PREEMPT_RT kernel and a
real (emulated) CAN controller, under qemu's instruction clock, fed from a recording at its own times.

usage: hil.py [--arch arm64|armhf] [--package DEB] WORK WAYMARK WAYMARK_SIMULATE [PART ...]

The guest's image is made once, for these tests and for `waymark hil` (WAYMARK_HIL_CACHE, ~/.cache/waymark/hil). WAYMARK is this computer's.
Parts: can, camera, libcamera, play, landmarks, motion, iio, gnss, edges, walls, service, board, power; all of them but power where none is named.
Without --arch the guest runs WAYMARK itself, under systemd the package; else the package in all parts.
The service and power parts run the package under systemd; without one they are left out. armhf is arm64's kernel with armhf's programs.

Judged on the host: the guest's own checks; the log of its run gives its poses bit by bit; its poses are those of a replay
of the same frames."""
import argparse
import math
import pathlib
import shutil
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(ROOT / "tools/hil"))
import board  # noqa: E402
import drives  # noqa: E402
import edges  # noqa: E402
import gnss  # noqa: E402
import iio  # noqa: E402
import landmarks  # noqa: E402
import motion  # noqa: E402
import player  # noqa: E402
import service  # noqa: E402
import vimc  # noqa: E402
import walls  # noqa: E402
from published import ABSENT, DOWN, MOTION_STALE, STALLED, WORKS, Published  # noqa: E402
from waymark_hil import guest  # noqa: E402
from waymark_hil.guest import BOARD, FAST, MACHINES, SLOW, SYSTEM  # noqa: E402

CAN = guest.buses(1)
POSITION_M, HEADING_DEG = 0.02, 0.2
PLAYER_M, PLAYER_DEG, PLAYER_MS = 0.1, 0.5, 100


def boot(work, machine, script, *devices, clock=SLOW, init="", watch=None):
    """Runs guest/SCRIPT by this clock; everything that it prints is shown and kept."""
    log = work / f"{script}.log"
    is_good = guest.boot(guest.command_of(work / "image", machine, work / "share", script, devices, clock, init), log, watch=watch)
    print(log.read_text(errors="replace"))
    return is_good


def worst_difference(a, b):
    """Row by row: each belongs to the same CAN frame. The player's jitter moves stamps, not frames."""
    worst_m = max(math.hypot(p[1] - q[1], p[2] - q[2]) for p, q in zip(a, b))
    worst_deg = max(abs(math.degrees(math.remainder(p[3] - q[3], 2 * math.pi))) for p, q in zip(a, b))
    worst_ms = max(abs((p[0] - a[0][0]) - (q[0] - b[0][0])) for p, q in zip(a, b)) / 1e6
    return worst_m, worst_deg, worst_ms


def scenario_can(work, simulate):
    recording, scenario = work / "recording", work / "share/scenario"
    shutil.rmtree(recording, ignore_errors=True)
    subprocess.run([simulate, ROOT / "config/worlds/crossing.yaml", "--out", recording], check=True)
    scenario.mkdir(parents=True)
    for name in ("can.log", "vehicle.dbc", "can-signals.yaml", "calibration.yaml", "landmarks.csv"):
        shutil.copy(recording / name, scenario)
    start = next(line for line in (recording / "recording.yaml").read_text().splitlines() if "initial_pose:" in line)
    # The configuration of the same drive at the desk, on CAN alone, and the robot's own files and devices.
    config = (ROOT / "config/datasets/crossing-points.yaml").read_text().replace("lateness_max_ms: 300}", "use: false}")
    (work / "can.yaml").write_text(config)
    (scenario / "robot.yaml").write_text(
        config + f"\n{start.strip()}\n"
        "calibration: calibration.yaml\nlandmarks: landmarks.csv\ndbc: vehicle.dbc\ncan_signals: can-signals.yaml\n"
        "devices: {can: [{interface: can0}]}\nstart: {saved_pose: /run/pose.yaml}\nblack_box: {folder: /run/box}\n")
    lines = (recording / "can.log").read_text().splitlines()
    seconds = float(lines[-1][1:].split(")")[0]) - float(lines[0][1:].split(")")[0])
    (scenario / "duration").write_text(f"{seconds + 5:.0f}\n")


def scenario_camera(work, simulate):
    subprocess.run(["mke2fs", "-q", "-F", "-t", "ext4", work / "power.ext4", "200M"], check=True)
    scenario = work / "share/camera"
    scenario.mkdir(parents=True)
    (scenario / "calibration.yaml").write_text(
        "cameras:\n  front:\n    model: equidistant\n    size: [320, 180]\n"
        "    intrinsics: [130, 130, 159.5, 89.5]\n    distortion: [0, 0, 0, 0]\n"
        "    mounting: {xyz_m: [1, 0, 0.4], rpy_deg: [0, 22, 0]}\n")
    (scenario / "robot.yaml").write_text(
        "format: waymark-config/1\nestimator: odometry\ncalibration: calibration.yaml\n"
        "devices: {cameras: [{name: front, device: /dev/video0, format: GREY, rate_hz: 15}]}\n")
    drives.compile_helper(scenario / "feed", HERE / "feed.c")
    # Motion over a virtual bus, and a detector that looks at every picture.
    recording = work / "camera-recording"
    shutil.rmtree(recording, ignore_errors=True)
    subprocess.run([simulate, ROOT / "config/worlds/crossing.yaml", "--out", recording], check=True)
    for name in ("can.log", "vehicle.dbc", "can-signals.yaml"):
        shutil.copy(recording / name, scenario)
    (scenario / "wheels.yaml").write_text((recording / "calibration.yaml").read_text() + (scenario / "calibration.yaml").read_text())
    (scenario / "published.yaml").write_text(
        "format: waymark-config/1\nestimator: slam\nvision: {apriltag: {family: tag36h11, size_m: 0.2}}\ncalibration: wheels.yaml\n"
        "dbc: vehicle.dbc\ncan_signals: can-signals.yaml\ninitial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\n"
        "devices:\n  can: [{interface: vcan0}]\n  cameras: [{name: front, device: /dev/video0, format: GREY, rate_hz: 15}]\n")


def marks(path):
    """Seconds on the guest's monotonic clock."""
    return {name: float(t) for name, t in (line.split() for line in path.read_text().splitlines())}


def judge_published(out):
    """What health and poses said while the camera broke."""
    at, folder, camera = marks(out / "camera-marks"), out / "camera-published", "apriltag:front"
    heard = Published("camera", folder, 0, (folder / "published.txt").read_text)
    heard.goes_on("20 % of buffers dropped", at["dropped"], at["damaged"])
    heard.counted("20 % of buffers dropped", camera, "lost", at["dropped"], at["damaged"] + 1.1, 3, 40)
    heard.counted("buffers with error flags", camera, "malformed", at["damaged"], at["unplugged"] + 1.1, 5, 5)
    heard.device("dropped and damaged buffers", camera, WORKS, at["dropped"] + 1, at["unplugged"])
    heard.goes_on("unplugged", at["unplugged"], at["plugged"])
    heard.device("unplugged", camera, ABSENT, at["unplugged"] + 1.5, at["plugged"])
    heard.device("plugged in again", camera, WORKS, at["plugged"] + 2.5, at["stalled"])
    heard.goes_on("no buffers", at["stalled"], at["works"])
    heard.device("no buffers", camera, STALLED, at["stalled"] + 2.3, at["works"])
    heard.device("buffers again", camera, WORKS, at["works"] + 2, at["works"] + 5)
    return heard.failures


def judge_bus(out):
    """The same while the bus broke."""
    at, folder = marks(out / "marks"), out / "faults"
    heard = Published("can", folder, 0, (folder / "faults.txt").read_text)
    for what, from_s, until_s, state in (("interface down", at["down"], at["up"], DOWN), ("adapter removed", at["removed"], at["back"], ABSENT)):
        poses = heard.goes_on(what, from_s, until_s)
        heard.grows(what, from_s, until_s)
        # A removed adapter is there again, down and up, before the mark.
        heard.check(all(p.status_flags & MOTION_STALE for t, p in poses if from_s + 1 < t < from_s + 2.9), f"{what}: poses say that motion is stale")
        heard.device(what, "can", state, from_s + 1.3, min(until_s, from_s + 3))
        heard.device(what + ", over", "can", WORKS, until_s + 2, until_s + 4)
    return heard.failures


def judge_power(work, waymark):
    """The recording on the disk of a computer whose power failed: it replays, to within the last seconds."""
    disk, folder = work / "power.ext4", work / "power"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    subprocess.run(["e2fsck", "-f", "-y", disk], stdout=subprocess.DEVNULL)
    subprocess.run(["debugfs", "-R", f"rdump /rec {folder}", disk], check=True, capture_output=True)
    replay = subprocess.run([waymark, "replay", folder / "rec", "--config", folder / "rec/config.yaml", "--out", folder / "run"], capture_output=True, text=True)
    if replay.returncode:
        return [f"power cut: the recording doesn't replay: {replay.stderr[-300:]}"]
    cut_s = marks(work / "share/out/camera-marks")["power"]
    pictures_s = [int(row["t_ns"]) * 1e-9 for row in drives.rows(folder / "rec/video/front.csv")]
    whole = sum(len(p) == 320 * 180 for p in edges.pictures(folder / "rec/video/front.avi"))
    frames_s = [float(line[1:].split(")")[0]) for line in (folder / "rec/can.log").read_text().splitlines() if line.endswith(tuple("0123456789ABCDEF"))]
    if not pictures_s or not frames_s:
        return [f"power cut: {len(pictures_s)} pictures and {len(frames_s)} CAN frames are left"]
    print(f"power cut: {whole} whole pictures of {len(pictures_s)}, the last {cut_s - pictures_s[-1]:.1f} s before it; {len(frames_s)} CAN frames, "
          f"the last {cut_s - frames_s[-1]:.1f} s before it; it replays")
    good = len(pictures_s) - 2 <= whole and whole > 60 and max(cut_s - pictures_s[-1], cut_s - frames_s[-1]) < 2.5
    return [] if good else ["power cut: too much of the recording is gone"]


def judge_camera(work, waymark):
    """Stamps of the recording: each later than the one before, no more than their arrival, most a period apart. What is
    left of a recording when the disk was full is read."""
    whole = sum(len(p) == 320 * 180 for p in edges.pictures(work / "share/out/camera-full/video/front.avi"))
    print(f"camera: {whole} whole pictures in the recording that filled the disk")
    rows = [(int(r["t_ns"]), int(r["arrival_ns"])) for r in drives.rows(work / "share/out/camera-faults/video/front.csv")]
    failures = [] if whole >= 5 else ["a recording that filled the disk has lost its pictures"]
    if any(b[0] <= a[0] for a, b in zip(rows, rows[1:])):
        failures.append("stamps of pictures go back")
    late = [a - t for t, a in rows]
    print(f"camera: {len(rows)} pictures, {min(late) / 1e6:.1f} to {max(late) / 1e6:.1f} ms old when they arrive")
    if min(late) < 0 or max(late) > 1e9:
        failures.append("stamps of pictures can't be")
    return failures + judge_published(work / "share/out") + judge_power(work, waymark)


def judge_can(work, waymark):
    out, recording, failures = work / "share/out", work / "recording", []
    subprocess.run([waymark, "replay", out / "drive/events.wmlog", "--out", work / "again"], check=True,
                   stdout=subprocess.DEVNULL)
    if (out / "drive/trajectory.csv").read_bytes() != (work / "again/trajectory.csv").read_bytes():
        failures.append("the guest's log doesn't give its poses bit by bit")
    subprocess.run([waymark, "replay", recording, "--config", work / "can.yaml", "--out", work / "desk"],
                   check=True, stdout=subprocess.DEVNULL)
    heard = work / "heard"
    shutil.rmtree(heard, ignore_errors=True)
    shutil.copytree(recording, heard)
    shutil.copy(out / "heard.log", heard / "can.log")
    subprocess.run([waymark, "replay", heard, "--config", work / "can.yaml", "--out", work / "witness"],
                   check=True, stdout=subprocess.DEVNULL)
    guest = drives.table(out / "drive/trajectory.csv")
    for name, limit_m, limit_deg, what in (
            ("witness", POSITION_M, HEADING_DEG, "what candump heard beside it"),
            ("desk", PLAYER_M, PLAYER_DEG, "the recording itself, whose times the player can't keep")):
        other = drives.table(work / name / "trajectory.csv")
        worst_m, worst_deg, worst_ms = worst_difference(guest, other)
        print(f"can: {len(guest)} poses in the guest, {len(other)} by {what}: at most {worst_m:.5f} m and "
              f"{worst_deg:.5f} degrees apart, stamps {worst_ms:.3f} ms")
        if name == "desk" and worst_ms > PLAYER_MS:
            print(f"can: the player was late by more than {PLAYER_MS} ms, as this computer does much else; that is not judged")
            continue
        if len(guest) != len(other) or worst_m > limit_m or worst_deg > limit_deg:
            failures.append(f"the guest's poses are not those by {what}")
    return failures + judge_bus(out)


# Of each part: scripts in the guest, what it is prepared and judged by, devices, clock, how the guest is begun.
DISK = ["-drive", "file={work}/power.ext4,if=virtio,format=raw"]
OF_ROOT = lambda prepare: lambda work, simulate: prepare(work, ROOT, HERE, simulate)
AT_ROOT = lambda judge: lambda work, waymark: judge(work, waymark, ROOT)
PARTS = {
    "can": [("can", scenario_can, judge_can, CAN, SLOW, "")],
    "camera": [("camera", scenario_camera, judge_camera, DISK, SLOW, "")],
    "libcamera": [("libcamera", lambda work, _: vimc.prepare(work), lambda work, _: vimc.judge(work), [], SLOW, "")],
    "play": [("play", OF_ROOT(player.prepare), AT_ROOT(player.judge), [], FAST, "")],
    "landmarks": [("landmarks", OF_ROOT(landmarks.prepare), AT_ROOT(landmarks.judge), CAN, FAST, "")],
    "motion": [("motion", OF_ROOT(motion.prepare), AT_ROOT(motion.judge), CAN, FAST, "")],
    "iio": [("iio", OF_ROOT(iio.prepare), AT_ROOT(iio.judge), CAN, FAST, "")],
    "gnss": [("gnss", OF_ROOT(gnss.prepare), AT_ROOT(gnss.judge), CAN, FAST, "")],
    "edges": [("edges", OF_ROOT(edges.prepare), AT_ROOT(edges.judge), CAN, FAST, "")],
    "walls": [("walls", OF_ROOT(walls.prepare), AT_ROOT(walls.judge), CAN, FAST, "")],
    "service": [("service", OF_ROOT(service.prepare_service), service.judge_service, CAN, FAST, "systemd")],
    "board": [("board", OF_ROOT(board.prepare), AT_ROOT(board.judge), [], BOARD, "")],
    "power": [("kills", OF_ROOT(service.prepare_kills), service.judge_kills, CAN, SYSTEM, "systemd")],
}
UNDER_SYSTEMD = ("service", "power")


def run_part(work, machine, waymark, simulate, steps):
    """Its failures; a step that fails in the guest is the last."""
    failures = []
    for name, prepare, judge, devices, clock, init in steps:
        more = prepare(work, simulate) or []
        begun_s = time.monotonic()
        devices = [word.format(work=work) for word in devices] + more
        watch = board.watch(work, waymark) if name == "board" else None
        if not boot(work, machine, f"{name}.sh", *devices, clock=clock, init=init, watch=watch):
            return failures + [f"the guest's own checks failed ({name}.sh)"]
        print(f"{name}: {time.monotonic() - begun_s:.0f} s in the guest")
        failures += judge(work, waymark)
    return failures


def link_image(arch, work):
    """The image of all tests and of `waymark hil`, made where it is not there; WORK/image leads to it."""
    folder, link = guest.folder_of(arch), work / "image"
    folder.mkdir(parents=True, exist_ok=True)
    work.mkdir(parents=True, exist_ok=True)
    if link.is_dir() and not link.is_symlink():
        shutil.rmtree(link)  # one of its own
    link.unlink(missing_ok=True)
    link.symlink_to(guest.prepare(arch, folder))


def arguments():
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--arch", choices=MACHINES, default="amd64")
    parser.add_argument("--package", type=pathlib.Path)
    parser.add_argument("paths", nargs=3, type=pathlib.Path)
    parser.add_argument("parts", nargs="*")
    return parser.parse_args()


def main():
    args = arguments()
    work, waymark, simulate = (path.resolve() for path in args.paths)
    machine, camera = MACHINES[args.arch], waymark.parent.parent / "lib/waymark/waymark-camera"
    if args.arch != "amd64":
        work = work / args.arch
    for program in (machine["qemu"][0], "mmdebstrap", machine["cc"]):
        if shutil.which(program) is None:
            print(f"{program} is not there: skipped")
            return 77
    link_image(args.arch, work)
    shutil.rmtree(work / "share", ignore_errors=True)
    (work / "share/out").mkdir(parents=True)
    shutil.copytree(HERE / "guest", work / "share/guest")
    shutil.copytree(guest.SCRIPTS, work / "share/guest", dirs_exist_ok=True)
    if args.package:
        shutil.copy(args.package, work / "share/waymark.deb")
    if args.arch == "amd64":
        shutil.copy(waymark, work / "share/waymark")
        if camera.exists():
            shutil.copy(camera, work / "share/waymark-camera")
        shutil.copy(waymark.parent / "waymark-play", work / "share/waymark-play")
    drives.COMPILER = machine["cc"]
    failures = []
    for name in args.parts or [part for part in PARTS if part != "power"]:
        if name == "libcamera" and (args.arch != "amd64" or not camera.exists()):
            print("libcamera: waymark is built without it: skipped")
            continue
        if name in UNDER_SYSTEMD and (args.arch != "amd64" or not args.package):
            print(f"{name}: without a package of this computer's kind: skipped")
            continue
        failures += run_part(work, machine, waymark, simulate, PARTS[name])
    for failure in failures:
        print("FAIL:", failure)
    print("hil:", "failed" if failures else "good")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
