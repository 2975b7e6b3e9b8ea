#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What is published while things break: `waymark run`, whole, with a simulated drive in the place of the kernel's CAN and V4L2
drivers (played_world.h), heard by LCM's own logger. Each drive has a network of its own; they drive side by side.

    faults.py BUILD [DRIVE ...]          needs the right to network and mount namespaces, and liblcm-bin; skipped (77) without"""
import fcntl
import json
import math
import os
import pathlib
import re
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(ROOT / "tests/hil"))
import drives  # noqa: E402
import edges  # noqa: E402
import messages  # noqa: E402
import player  # noqa: E402
from published import ABSENT, BUS_OFF, DOWN, FROZEN, IS_BUSY, MOTION_STALE, STALLED, WORKS, Published  # noqa: E402

BUILD = pathlib.Path(sys.argv[1]).resolve()
WAYMARK = BUILD / "tests/waymark-played"
SECONDS, WALLS_S, RATE_HZ = 64, 24, 10
CAMERA, CAN, SIGHTINGS = "edges:front", "can", "sightings"
LCM_GROUP = ("239.255.76.67", 7667)
ROUTE = ["ip", "route", "add", "224.0.0.0/4", "dev", "lo"]


def packet(channel, message, number=0):
    """LCM's datagram of one message."""
    return struct.pack(">II", 0x4c433032, number) + channel + b"\0" + message


# ── what is driven ──────────────────────────────────────────────────────────────────────────────────────────────────

def prepare(work, worlds):
    """Three worlds: a corridor that a camera sees, a crossing whose landmarks another program sees, and an office with two
    kinds of markers on its walls."""
    world = (ROOT / "config/worlds/corridor-easy.yaml").read_text().replace(
        "\npictures:", f"\ncameras: [{{name: front, size: [320, 180], rate_hz: {RATE_HZ}, colour: false}}]\n\npictures:")
    (work / "world.yaml").write_text(world)
    walls = (ROOT / "config/worlds/office-walls.yaml").read_text().replace(
        "\npictures:", f"\ncameras: [{{name: front, size: [640, 400], rate_hz: {RATE_HZ}, colour: false}}]\n\npictures:")
    (work / "walls.yaml").write_text(walls)
    for name, scenario, seconds in (("corridor", work / "world.yaml", SECONDS), ("crossing", ROOT / "config/worlds/crossing.yaml", SECONDS),
                                    ("walls", work / "walls.yaml", WALLS_S)):
        if name not in worlds:
            continue
        (work / name).mkdir()
        recording = work / name / "recording"
        subprocess.run([BUILD / "bin/waymark-simulate", scenario, "--out", recording, "--duration", str(seconds)], check=True)
        streams = subprocess.run([BUILD / "bin/waymark-play", recording, "--print-streams"], check=True, capture_output=True, text=True)
        (work / name / "first").write_text(str(json.loads(streams.stdout)["first_ns"]))


class Drive:
    """A folder with the world and its faults (a file beside this one), a configuration, and a logger of what is published."""

    def __init__(self, work, world, name, faults=None):
        self.world, self.folder = work / world, work / name
        self.folder.mkdir()
        recording = self.world / "recording"
        for file in ("vehicle.dbc", "can-signals.yaml", "calibration.yaml", "map", "landmarks.csv"):
            if (recording / file).exists():
                (self.folder / file).symlink_to(recording / file)
        (self.folder / "recording").symlink_to(recording)
        self.faults = []
        if faults:
            shutil.copy(HERE / faults, self.folder / "faults.yaml")
            said = subprocess.run([BUILD / "bin/waymark-play", "--faults", HERE / faults, "--print-faults"], check=True, capture_output=True, text=True)
            self.faults = json.loads(said.stdout)["faults"]
        camera_ = f"devices: {{can: [{{interface: can0}}], cameras: [{{name: front, device: /dev/video0, format: MJPG, rate_hz: {RATE_HZ}}}]}}\n"
        own, devices = {
            "corridor": ("corridor.yaml", camera_ + "map: map/map.yaml\n"),
            "crossing": ("crossing-points.yaml", "devices: {can: [{interface: can0}], sightings: lcm}\nlandmarks: landmarks.csv\n"),
            "walls": ("office-walls.yaml", camera_)}[world]
        self.config = (
            drives.with_realtime((ROOT / "config/datasets" / own).read_text(), "lock_memory: false") + f"\ninitial_pose: {drives.start_of(recording)}\n"
            "calibration: calibration.yaml\ndbc: vehicle.dbc\ncan_signals: can-signals.yaml\n" + devices +
            f"publish: {{lcm_url: '{drives.URL}'}}\ncommands: {{lcm: true}}\n"
            "start: {saved_pose: pose.yaml, save_every_s: 0.5}\n")
        (self.folder / "robot.yaml").write_text(self.config)
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
        subprocess.run(ROUTE, check=True)
        self.logger = subprocess.Popen(["lcm-logger", "-q", "-f", f"--lcm-url={drives.URL}", self.folder / "heard.lcm"])
        self.begin_ns = None
        self.first_ns = int((self.world / "first").read_text())
        self.environment = dict(os.environ, WM_PLAYED=str(self.folder))
        self.has_eyes, self.eyes = world == "crossing", None

    def send_sightings(self):
        """The program that sees landmarks: the player, over LCM, each message when it arrived in the recording."""
        with open(self.folder / "played.txt", "w") as said:
            self.eyes = subprocess.Popen([BUILD / "bin/waymark-play", self.folder / "recording", "--lcm", drives.URL, "--start-at", str(self.begin_ns),
                                          "--json", "played.json"], cwd=self.folder, stdout=said, stderr=said)

    def start(self, *words, stderr=None):
        with open(self.folder / "said.txt", "a") as said:
            return subprocess.Popen([WAYMARK, *words], cwd=self.folder, env=self.environment, stderr=stderr or said, stdout=said)

    def run(self, *words, stderr=None):
        """`waymark run`; with the first one, once it listens, the world begins."""
        run = self.start("run", "--config", "robot.yaml", *words, stderr=stderr)
        while self.begin_ns is None and run.poll() is None:
            time.sleep(0.05)
            if "can0 is up" in self.said():
                self.begin()
        return run

    def begin(self):
        self.begin_ns = time.monotonic_ns() + 10**9
        (self.folder / "begin.new").write_text(str(self.begin_ns))
        (self.folder / "begin.new").rename(self.folder / "begin")
        if self.has_eyes:
            self.send_sightings()

    def end(self, run, at_s):
        self.sleep_until(at_s)
        run.send_signal(signal.SIGTERM)
        run.wait(timeout=60)
        if self.eyes:
            self.eyes.send_signal(signal.SIGINT)
            self.eyes.wait(timeout=10)

    def fault(self, name):
        """(name, from_s, until_s) of a fault."""
        fault = next(f for f in self.faults if f["name"] == name)
        return name, fault["from_s"], fault["until_s"]

    def sleep_until(self, at_s):
        time.sleep(max(0.0, (self.begin_ns - time.monotonic_ns()) * 1e-9 + at_s))

    def now_s(self):
        return (time.monotonic_ns() - self.begin_ns) * 1e-9

    def said(self):
        return (self.folder / "said.txt").read_text()

    def hear(self):
        time.sleep(0.3)
        self.logger.send_signal(signal.SIGINT)
        self.logger.wait(timeout=10)
        truth = [(t - self.first_ns + self.begin_ns, *rest) for t, *rest in drives.table(self.world / "recording/truth.csv")]
        return Published(self.folder.name, self.folder, self.begin_ns, self.said, truth)


def camera(work):
    """The camera breaks in five ways, one after the other."""
    drive = Drive(work, "corridor", "camera", "camera.yaml")
    run = drive.run()
    drive.end(run, 63)
    heard = drive.hear()
    heard.check(run.returncode == 0, f"exit code {run.returncode}")
    for name, state, delay_s in (("unplugged", ABSENT, 1.2), ("frozen", FROZEN, 2.3), ("stalled", STALLED, 2.4)):
        what, from_s, until_s = drive.fault(name)
        until_s = min(until_s, 36)  # from 36 s on the stalled camera is started again now and then
        usual_m = 3 * heard.sigma_at(from_s)
        heard.goes_on(what, from_s, until_s)
        heard.grows(what, from_s, until_s)
        heard.device(what, CAMERA, state, from_s + delay_s, until_s)
        heard.is_back(what, CAMERA, until_s, {"stalled": 40}.get(what, until_s + 2.5), usual_m)
    heard.counted("frozen", CAMERA, "frozen", 22, 27.2, 4 * RATE_HZ - 4, 4 * RATE_HZ + 2)
    heard.goes_on("20 % dropped", 45, 53)
    heard.device("20 % dropped", CAMERA, WORKS, 46, 53)
    heard.counted("20 % dropped", CAMERA, "lost", 44.9, 54.2, 0.08 * 8 * RATE_HZ, 0.35 * 8 * RATE_HZ)
    heard.goes_on("20 % dropped, over", 53, 56)
    heard.goes_on("30 % with error flags", 56, 61)
    heard.device("30 % with error flags", CAMERA, WORKS, 57, 61)
    heard.counted("30 % with error flags", CAMERA, "malformed", 55.9, 62.2, 0.12 * 5 * RATE_HZ, 0.48 * 5 * RATE_HZ)
    heard.is_said("front is gone")
    heard.is_said("front gives the same picture again and again")
    heard.is_said("front gives no pictures", 2)  # before the world began, too
    return heard.failures


def clock(work):
    """A camera whose clock is 29 s ahead all the time."""
    drive = Drive(work, "corridor", "clock", "clock.yaml")
    run = drive.run()
    drive.end(run, 13)
    heard = drive.hear()
    heard.goes_on("29 s ahead", 5, 12)
    heard.device("29 s ahead", CAMERA, WORKS, 3, 12)
    heard.counted("29 s ahead", CAMERA, "fused", 5.1, 11.2, 0.6 * 5 * RATE_HZ, 7 * RATE_HZ)
    heard.check(heard.error_m(*heard.between(11, 12)[-1]) < 0.2, "29 s ahead: the pose is where the robot is")
    return heard.failures


def can(work):
    """The bus breaks in four ways."""
    drive = Drive(work, "crossing", "can", "can.yaml")
    run = drive.run()
    drive.end(run, 38)
    heard = drive.hear()
    heard.check(run.returncode == 0, f"exit code {run.returncode}")
    for name, state in (("interface down", DOWN), ("adapter removed", ABSENT), ("bus-off", BUS_OFF)):
        what, from_s, until_s = drive.fault(name)
        usual_m = 3 * heard.sigma_at(from_s)
        poses = heard.goes_on(what, from_s, until_s)
        heard.check(all(p.status_flags & MOTION_STALE for t, p in poses if t > from_s + 1), f"{what}: poses say that motion is stale")
        heard.grows(what, from_s, until_s)
        heard.device(what, CAN, state, from_s + 1.2, until_s)
        heard.is_back(what, CAN, until_s, until_s + 2, usual_m)
    heard.goes_on("2 % of CAN frames lost", 21, 27)
    heard.goes_on("2 % of CAN frames lost, over", 27, 31)
    heard.device("2 % of CAN frames lost", CAN, WORKS, 22, 27)
    heard.is_said("can0 went down", or_else="can0 is down (")  # who notices first: who reads, or who looks after it
    heard.is_said("can0 is gone (No such device)")
    return heard.failures


def process(work):
    """Killed and started again; a disk that is full; another configuration with an error; a network without a route."""
    drive = Drive(work, "crossing", "process")
    small = drive.folder / "small"
    small.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", small], check=True)
    run = drive.run()
    drive.sleep_until(10)
    run.kill()
    run.wait()
    again_s, came_up = drive.now_s(), drive.said().count("can0 is up")
    run = drive.run("--out", "small/run")
    while drive.said().count("can0 is up") == came_up and run.poll() is None:
        time.sleep(0.01)
    up_s = drive.now_s()
    drive.sleep_until(20)
    assert "speed_rel:" in drive.config, "another key has to be misspelt"
    (drive.folder / "robot.yaml").write_text(drive.config.replace("speed_rel:", "speed_rell:"))
    run.send_signal(signal.SIGHUP)
    drive.sleep_until(26)
    subprocess.run(["ip", "route", "del", "224.0.0.0/4"], check=True)
    drive.sleep_until(30)
    subprocess.run(ROUTE, check=True)
    drive.sleep_until(35.5)
    (drive.folder / "robot.yaml").write_text(drive.config)
    run.send_signal(signal.SIGHUP)
    drive.end(run, 38)
    heard = drive.hear()
    heard.check(run.returncode == 1, f"exit code {run.returncode}: the disk was full")

    tracking = [(t, p) for t, p in heard.poses if t > again_s and p.state == 1]
    first_s, first = tracking[0] if tracking else (math.inf, None)
    # A desk that is busy loads programs slowly; a robot's isn't.
    begun_s = up_s if IS_BUSY else again_s
    heard.check(first_s < begun_s + 2, f"killed: tracking again {first_s - begun_s:.2f} s after the start, which took {up_s - again_s:.2f} s")
    heard.check(first is not None and heard.error_m(first_s, first) < 4 * heard.sigma_m(first),
                f"killed: where it was, {heard.error_m(first_s, first):.2f} m off with a sigma of {heard.sigma_m(first):.2f} m")
    heard.goes_on("killed, over", first_s, 20)
    heard.is_said("start: saved pose of")
    heard.is_said("can't be written on: No space left on device. Localization continues")
    heard.goes_on("configuration with an error", 20, 25)
    heard.is_said("did you mean")
    heard.is_said("The run continues unchanged")
    # Nobody hears it without a route; the run itself goes on.
    silent = heard.between(26.5, 29.5)
    heard.check(len(silent) < 10, f"no route: {len(silent)} poses are heard")
    heard.goes_on("no route, over; disk full all the time", 33, 35.5)
    heard.goes_on("a configuration that is right; disk full all the time", 36.5, 38)
    heard.is_said("not written, the disk is full")
    heard.check(heard.health_at(35).published > heard.health_at(25.9).published + 7 * 50 * 0.8, "no route: the run went on")
    heard.is_said("connected again")
    subprocess.run(["umount", small], check=True)
    return heard.failures


class Reader(threading.Thread):
    """Of a run's standard error by a small pipe, which it can leave full."""

    def __init__(self, to):
        super().__init__(daemon=True)
        self.end, self.write_end = os.pipe()
        fcntl.fcntl(self.write_end, fcntl.F_SETPIPE_SZ, 4096)
        self.to, self.reads = to, threading.Event()
        self.reads.set()
        self.start()

    def run(self):
        while True:
            self.reads.wait()
            if select.select([self.end], [], [], 0.1)[0] and self.reads.is_set():
                with open(self.to, "ab") as out:
                    out.write(os.read(self.end, 4096))

    def leave_full(self):
        self.reads.clear()
        time.sleep(0.2)
        os.set_blocking(self.write_end, False)
        try:
            while True:
                os.write(self.write_end, b"x" * 63 + b"\n")
        except BlockingIOError:
            os.set_blocking(self.write_end, True)


def terminal(work):
    """Nobody reads standard error any more (a terminal that was stopped, a log's program that hangs) while the bus goes down and up."""
    drive = Drive(work, "crossing", "terminal", "terminal.yaml")
    reader = Reader(drive.folder / "said.txt")
    run = drive.run(stderr=reader.write_end)
    drive.sleep_until(6)
    reader.leave_full()
    drive.sleep_until(16)
    reader.reads.set()
    drive.end(run, 18)
    heard = drive.hear()
    heard.check(run.returncode == 0, f"exit code {run.returncode}")
    usual_m = 3 * heard.sigma_at(8)
    heard.goes_on("standard error blocked, interface down", 8, 11)
    heard.device("standard error blocked, interface down", CAN, DOWN, 9.2, 11)
    heard.is_back("standard error blocked, interface down", CAN, 11, 13, usual_m)
    heard.is_said("can0 went down", or_else="can0 is down (")
    return heard.failures


def recorder(work):
    """A recording that is ended by SIGTERM in its middle, and one that is killed: both replay."""
    drive = Drive(work, "corridor", "recorder")
    failures = []
    for name, number in (("term", signal.SIGTERM), ("kill", signal.SIGKILL)):
        record = drive.start("record", "--config", "robot.yaml", "--out", name, "--free-mb", "0")
        if drive.begin_ns is None:
            drive.begin()
        time.sleep(10)
        record.send_signal(number)
        code = record.wait(timeout=20)
        replay = subprocess.run([BUILD / "bin/waymark", "replay", drive.folder / name, "--config", drive.folder / name / "config.yaml", "--out",
                                 drive.folder / f"{name}-run"], capture_output=True, text=True)
        health = json.loads((drive.folder / f"{name}-run/health.json").read_text()) if replay.returncode == 0 else {"sources": {}}
        fused = {s: v["received"] for s, v in health["sources"].items()}
        good = code == (0 if name == "term" else -9) and fused.get(CAMERA, 0) > 3 * RATE_HZ and fused.get(CAN, 0) > 500
        print(f"  {'good' if good else 'BAD '}  recorder: {name}: exit code {code}; its replay has {fused} {replay.stderr[-300:] if not good else ''}")
        if not good:
            failures.append(name)
    drive.logger.kill()
    drive.logger.wait()
    return failures


def say_it_is_elsewhere(drive, at_s):
    """SET_POSE: 3 m ahead of where it is, turned by a quarter, and sure of it."""
    truth = [(t - drive.first_ns, *rest) for t, *rest in drives.table(drive.world / "recording/truth.csv")]
    x_m, y_m, heading_rad, _ = drives.at(truth, [row[0] for row in truth], at_s * 1e9)
    said = messages.types(drive.folder).set_pose_t()
    turned = heading_rad + math.pi / 2
    said.position_m = [x_m + 3 * math.cos(heading_rad), y_m + 3 * math.sin(heading_rad), 0]
    said.orientation_xyzw = [0, 0, math.sin(turned / 2), math.cos(turned / 2)]
    said.sigma_xy_m, said.sigma_heading_rad = 0.05, 0.02
    socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(packet(b"WAYMARK_SET_POSE", said.encode()), LCM_GROUP)


def box(work):
    """The black box of a run that is killed, and of one that loses its way: the last seconds with CAN and pictures, which replay."""
    keep_s, pictures_hz, killed_s, elsewhere_s = 8, 2, 20, 34
    drive = Drive(work, "corridor", "box")
    (drive.folder / "robot.yaml").write_text(drive.config + f"black_box: {{folder: box, keep_s: {keep_s}, pictures_hz: {pictures_hz}}}\n")
    run = drive.run()
    drive.sleep_until(killed_s)
    run.kill()
    run.wait()
    run = drive.run()
    drive.sleep_until(elsewhere_s)
    say_it_is_elsewhere(drive, elsewhere_s)
    drive.end(run, 52)
    heard = drive.hear()
    lost_s = next((t for t, p in heard.poses if t > elsewhere_s and p.state == 3), math.inf)
    heard.check(lost_s < 45, f"lost {lost_s - elsewhere_s:.1f} s after it was told a wrong place")
    for what, until_s in (("died-0001", killed_s), ("lost-0002", lost_s + keep_s / 4)):
        times, received = [], {CAN: 0, CAMERA: 0}
        for part in ("before", "now"):
            log, out = drive.folder / f"box/{what}-{part}.wmlog", drive.folder / f"{what}-{part}"
            replay = subprocess.run([BUILD / "bin/waymark", "replay", log, "--map", drive.world / "recording/map/map.yaml", "--out", out], capture_output=True, text=True)
            if replay.returncode != 0:
                heard.check(False, f"{what}-{part} doesn't replay: {replay.stderr[-300:]}")
                continue
            times += [(row[0] - drive.begin_ns) * 1e-9 for row in drives.table(out / "trajectory.csv")]
            for name in received:
                received[name] += json.loads((out / "health.json").read_text())["sources"][name]["received"]
        span_s = times[-1] - times[0] if times else 0
        heard.check(keep_s - 1 < span_s < 2 * keep_s + 1 and until_s - 1.5 < times[-1] < until_s + 1,
                    f"{what}: poses of {span_s:.1f} s, to {until_s - times[-1]:.1f} s before it")
        heard.check(received[CAN] > 200 * span_s and received[CAMERA] > 0.7 * RATE_HZ * span_s, f"{what}: has {received}")
        stamps, whole = [], 0
        for part in "ab":
            video = drive.folder / f"box/{what}-front-{part}.avi"
            if not video.exists():
                continue
            stamps += [(int(row["t_ns"]) - drive.begin_ns) * 1e-9 for row in drives.rows(video.with_suffix(".csv"))]
            whole += sum(p[:2] == b"\xff\xd8" and p[-2:] == b"\xff\xd9" for p in edges.pictures(video))
        heard.check(whole == len(stamps) > 0.8 * pictures_hz * keep_s and until_s - 1.5 < max(stamps) < until_s + 1,
                    f"{what}: {whole} whole pictures, {len(stamps)} stamps, to {until_s - max(stamps, default=math.nan):.1f} s before it")
    return heard.failures


def readers(work):
    """One camera, four readers: two detectors (config/datasets/office-walls.yaml), the black box and a recording, whose replay gives the
    poses of the run. Two CAN interfaces: the wheels on one, the gyro on the other."""
    drive, until_s = Drive(work, "walls", "readers"), WALLS_S - 3
    signals = re.split(r"(?m)^(?=- )", (drive.folder / "can-signals.yaml").read_text())
    for name, on_it in (("gyro", True), ("wheels", False)):
        (drive.folder / f"{name}.yaml").write_text("".join(one for one in signals if one.startswith("- ") and ("yaw_rate" in one) == on_it))
    (drive.folder / "robot.yaml").write_text(drive.config.replace(
        "can: [{interface: can0}]", "can: [{interface: can0, can_signals: wheels.yaml}, {interface: can1, can_signals: gyro.yaml}]") +
        "black_box: {folder: box, keep_s: 8, pictures_hz: 2}\n")
    run = drive.run("--record", "recorded", "--out", "run")
    drive.end(run, until_s)
    heard = drive.hear()
    heard.check(run.returncode == 0, f"exit code {run.returncode}")
    heard.goes_on("two detectors", 2, until_s - 1)
    health = heard.health_at(until_s - 1)
    for bus in ("can:can0", "can:can1"):
        source = messages.source(health, bus)
        heard.check(source is not None and source.fused > 40 * (until_s - 1), f"{bus}: {source and source.fused} frames are fused")
    for detector in ("apriltag:front", "mr:front"):
        source = messages.source(health, detector)
        heard.device(detector, detector, WORKS, 3, until_s - 1)
        heard.check(source is not None and source.fused > 20, f"{detector}: {source and source.fused} of its observations are fused")
    replay = subprocess.run([BUILD / "bin/waymark", "replay", drive.folder / "recorded", "--config", drive.folder / "recorded/config.yaml",
                             "--frames-of", drive.folder / "run/events.wmlog", "--out", drive.folder / "again"], capture_output=True, text=True)
    heard.check(replay.returncode == 0, f"the recording replays{'' if replay.returncode == 0 else ': ' + replay.stderr[-300:]}")
    said = {line.split()[1] for line in (drive.folder / "recorded/can.log").read_text().splitlines()}
    heard.check(said == {"can0", "can1"}, f"the recording has frames of {sorted(said)}")
    if replay.returncode == 0:
        poses = [p for p in messages.rows([p for _, p in heard.poses]) if p[0] > drive.begin_ns + 2e9]
        apart = list(drives.apart_of(poses, drives.table(drive.folder / "again/published.csv"), 0))
        worst_m, worst_deg = max((m for _, m, _ in apart), default=math.inf), max((d for *_, d in apart), default=math.inf)
        heard.check(len(apart) > 40 * (until_s - 4) and worst_m < 0.02 and worst_deg < 0.2,
                    f"{len(apart)} poses at most {worst_m:.4f} m and {worst_deg:.3f} degrees from the replay of its recording")
    stamps = sum(len((drive.folder / f"box/pictures-front-{part}.csv").read_text().splitlines()) - 1 for part in "ab"
                 if (drive.folder / f"box/pictures-front-{part}.csv").exists())
    heard.check(stamps > 16, f"the black box has {stamps} pictures")
    recorded = len((drive.folder / "recorded/video/front.csv").read_text().splitlines()) - 1
    heard.check(recorded > 0.9 * RATE_HZ * until_s, f"the recording has {recorded} pictures of {until_s} s at {RATE_HZ} Hz")
    return heard.failures


def load(work):
    """2000 CAN frames a second on two buses and two cameras at 30 Hz: the drivers give all of it, as it was."""
    folder, devices = work / "load", {"vcan0": "can:can0", "vcan1": "can:can1", "/dev/video10": "camera:left", "/dev/video11": "camera:right"}
    player.write_recording(folder / "recording")
    (folder / "devices").write_text("".join(f"{device} {stream}\n" for device, stream in devices.items()))
    (folder / "begin").write_text(str(time.monotonic_ns() + 2 * 10**9))
    read = subprocess.run([BUILD / "tests/played_rates", str(player.SECONDS + 6), *devices], env=dict(os.environ, WM_PLAYED=str(folder)),
                          capture_output=True, text=True)
    (folder / "heard.log").write_text(read.stdout)
    print(read.stderr)
    failures = [] if read.returncode == 0 else [f"exit code {read.returncode}"]
    for name, to in (("can0", "vcan0"), ("can1", "vcan1")):
        sent = [frame for _, interface, frame in sorted(player.frames()) if interface == name]
        heard = [frame for _, frame in player.read_can(folder / "heard.log", to)]
        if sent != heard:
            failures.append(f"{to}: {len(heard)} frames of {len(sent)}, or others")
    for device in ("/dev/video10", "/dev/video11"):
        if f"{device} {player.PICTURES_HZ * player.SECONDS} came 0 missing" not in read.stderr:
            failures.append(f"{device}: not all pictures came")
    print("\n".join(f"  BAD   load: {failure}" for failure in failures) or "  good  load: all frames and pictures came, as they were")
    return failures


DRIVES = {"camera": (camera, "corridor"), "clock": (clock, "corridor"), "can": (can, "crossing"), "process": (process, "crossing"),
          "terminal": (terminal, "crossing"),
          "recorder": (recorder, "corridor"), "box": (box, "corridor"), "readers": (readers, "walls"), "load": (load, None)}


def main():
    if sys.argv[2:3] == ["inside"]:
        failures = DRIVES[sys.argv[3]][0](pathlib.Path(sys.argv[4]))
        return 1 if failures else 0
    if not shutil.which("lcm-logger") or subprocess.run(["unshare", "-n", "-m", "true"], capture_output=True).returncode:
        print("no lcm-logger, or no right to namespaces: skipped")
        return 77
    chosen = sys.argv[2:] or list(DRIVES)
    with tempfile.TemporaryDirectory(prefix="waymark-faults-") as folder:
        work = pathlib.Path(folder)
        prepare(work, {DRIVES[name][1] for name in chosen})
        running = {name: subprocess.Popen(["unshare", "-n", "-m", sys.executable, __file__, BUILD, "inside", name, work]) for name in chosen}
        bad = [name for name, process_ in running.items() if process_.wait() != 0]
        if bad and os.environ.get("WM_KEEP"):
            shutil.copytree(work, os.environ["WM_KEEP"], symlinks=True, dirs_exist_ok=True)
    print("failed: " + ", ".join(bad) if bad else "all good")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
