# SPDX-License-Identifier: Apache-2.0
"""The parts of hil.py in which the package runs as a service under systemd, as it is shipped: silent for minutes, killed, and cut
off from power. A robot drives past markers on walls (an office, `slam`), played through a CAN controller and a V4L2 device."""
import math
import pathlib
import random
import re
import shutil
import statistics
import subprocess
import sys

import drives
import edges
from cuts import DISK_BYTES, FILES_BYTES
from published import ABSENT, MOTION_STALE, WORKS, Published

SIZE, RATE_HZ = (640, 400), 4
DETECTORS = ("apriltag:front", "mr:front")
# What is away, and the end, in seconds from the drive's begin; a lap takes 52 s, of three. Where both were away, only markers of the map show
# where the robot is: the first lap has seen those that are in view at the return, two or more (checked by the drawn markers' labels).
BUS_SILENT_S, CAMERA_GONE_S, BOTH_GONE_S = (22, 142), (15, 75), (60, 120)
END_S = {"bus": 157, "camera": 85, "both": 130}
HEALED_S, KILLS = 1.0, 20
# Killed during the second and the third lap. (In the first one the next markers are new, by which no pose is found.)
PAUSE_S = (2.0, 3.6)
POSE_S, RIGHT_S, RIGHT_M = 0.5, 5.0, 0.15
RANDOM = random.Random(11)


# ── what is driven ──────────────────────────────────────────────────────────────────────────────────────────────────

def drive(work, root, simulate):
    """The rendered drive, made once for a world."""
    world = (root / "config/worlds/office-walls.yaml").read_text().replace(
        "\npictures:", f"\ncameras: [{{name: front, size: {list(SIZE)}, rate_hz: {RATE_HZ}, colour: false}}]\n\npictures:")
    recording, made_of = work / "office-recording", work / "office.yaml"
    if not recording.exists() or not made_of.exists() or made_of.read_text() != world:
        shutil.rmtree(recording, ignore_errors=True)
        made_of.unlink(missing_ok=True)
        (work / "office-new.yaml").write_text(world)
        subprocess.run([simulate, work / "office-new.yaml", "--out", recording], check=True)
        (work / "office-new.yaml").rename(made_of)
    return recording


def first_ns(recording):
    return next(drives.can_items(recording))[0]


def scenario_of(name, work, root, here, simulate):
    """The folder for the guest with the robot's files, pictures and player; and the timeline's items."""
    recording, folder = drive(work, root, simulate), work / f"share/{name}"
    folder.mkdir(parents=True)
    can, (pictures, blob) = list(drives.can_items(recording)), edges.played(recording)
    (folder / "pictures").write_bytes(blob)
    drives.compile_player(here, folder)
    for file in ("vehicle.dbc", "can-signals.yaml", "calibration.yaml"):
        shutil.copy(recording / file, folder)
    (folder / "robot.yaml").write_text(
        # One processor: as in the other parts. The rest is as a robot has it.
        drives.with_realtime((root / "config/datasets/office-walls.yaml").read_text(), "priority: 40") +
        f"\ninitial_pose: {drives.start_of(recording)}\n"
        "calibration: calibration.yaml\ndbc: vehicle.dbc\ncan_signals: can-signals.yaml\n"
        "devices:\n  can: [{interface: can0}]\n"
        f"  cameras: [{{name: front, device: /dev/robot-camera, format: MJPG, rate_hz: {RATE_HZ}}}]\n"
        "start: {saved_pose: /var/lib/waymark/pose.yaml, saved_map: /var/lib/waymark/map.wmmap, save_map_every_s: 1}\n"
        "black_box: {folder: /var/lib/waymark/box, pictures_hz: 1}\n")
    return recording, folder, can, pictures


def write_timeline(path, items):
    path.write_text("".join(f"{t} {what}\n" for t, what in sorted(items)))


def without(items, first, *windows):
    return [item for item in items if not any(a <= (item[0] - first) * 1e-9 < b for a, b in windows)]


def ahead_ns(said):
    """How far the guest's monotonic clock is ahead of the recording's."""
    return int(re.search(r"ahead (-?\d+) ns", said.read_text()).group(1))


def heard(name, folder, log, recording):
    """What a subscriber heard, by seconds since the drive's begin."""
    if log != folder / "heard.lcm":
        shutil.copy(log, folder / "heard.lcm")
    said = folder / f"{name}.timeline.txt"
    ahead = ahead_ns(said if said.exists() else folder / "drive.timeline.txt")
    truth = [(t + ahead, *rest) for t, *rest in drives.table(recording / "truth.csv")]
    return Published(name, folder, first_ns(recording) + ahead, lambda: "", truth), ahead


# ── silent for minutes ──────────────────────────────────────────────────────────────────────────────────────────────

def prepare_service(work, root, here, simulate):
    recording, folder, can, pictures = scenario_of("service", work, root, here, simulate)
    first = first_ns(recording)
    at = lambda s: first + round(s * 1e9)
    drives_ = {"bus": ([BUS_SILENT_S], []), "camera": ([], [CAMERA_GONE_S]), "both": ([BOTH_GONE_S], [BOTH_GONE_S])}
    for name, (silent, gone) in drives_.items():
        end, switched = (END_S[name], 1e9), [item for a, b in gone for item in ((at(a), "x"), (at(b), "o"))]
        write_timeline(folder / f"{name}.timeline", switched + without(can, first, *silent, end) + without(pictures, first, *gone, end))
        (folder / f"{name}.camera").write_text("".join(f"camera_gone {at(a)}\ncamera_up {at(b - 0.1)}\n" for a, b in gone))


def in_view(recording, from_s, until_s):
    """Markers that are in a picture of that time."""
    times_s = [(int(row["t_ns"]) - first_ns(recording)) * 1e-9 for row in drives.rows(recording / "video/front.csv")]
    return {row["id"] for row in drives.rows(recording / "labels/markers.csv") if from_s <= times_s[int(row["frame"])] < until_s}


class Judge:
    """Checks of one drive, a table of its faults."""

    def __init__(self, name, out, recording):
        self.name, self.out = name, out
        self.heard, self.ahead_ns = heard(name, out, out / f"{name}.lcm", recording)
        self.check, self.first_ns = self.heard.check, first_ns(recording)
        self.states = []
        for line in (out / f"{name}.states").read_text().splitlines():
            t, *words = line.split("|")
            self.states.append((float(t) - (self.first_ns + self.ahead_ns) * 1e-9, dict(w.split("=", 1) for w in words if "=" in w)))
        self.rows = []

    def sigmas(self, poses):
        return [self.heard.error_m(t, p) / self.heard.sigma_m(p) for t, p in poses]

    def process(self):
        pids = {s["MainPID"] for _, s in self.states}
        self.check(len(pids) == 1 and all(s["NRestarts"] == "0" and s["ActiveState"] == "active" for _, s in self.states),
                   f"the same process all the time, active (READY): {sorted(pids)}, {len(self.states)} looks")

    def reason(self, what, from_s, until_s, sources):
        said = [s["StatusText"] for t, s in self.states if from_s + 10 < t < until_s - 1]
        self.check(said != [] and all(source in text for text in said for source in sources), f"{what}: READY's reason: {sorted(set(said))}")

    def fault(self, what, from_s, until_s, sources, grows):
        """Poses at their rate, no further from the truth than four sigma, from the fault on until the end of what follows it."""
        poses = self.heard.between(from_s, until_s)
        after = self.heard.between(until_s, until_s + 8)
        stamps = [t for t, _ in poses + after]
        gap_s = max(b - a for a, b in zip(stamps, stamps[1:]))
        rate_hz = len(poses) / (until_s - from_s)
        self.check(rate_hz > 49 and gap_s < 0.1, f"{what}: {rate_hz:.1f} poses a second, {gap_s * 1e3:.0f} ms apart at most")
        healing = [(t, p) for t, p in after if t < until_s + HEALED_S]
        worst, at_return = max(self.sigmas(poses + after[len(healing):])), max(self.sigmas(healing))
        self.check(worst < 4, f"{what}: errors are at most {worst:.1f} sigma, {max(self.heard.error_m(t, p) for t, p in poses):.2f} m; "
                   f"in the second after the return {at_return:.1f} sigma")
        before_m, most_m = self.heard.sigma_at(from_s), max(self.heard.sigma_m(p) for _, p in poses)
        if grows:
            self.heard.grows(what, from_s, until_s)
        self.reason(what, from_s, until_s, sources)
        well = [t - until_s for t, p in after if not p.status_flags & MOTION_STALE and self.heard.sigma_m(p) < max(3 * before_m, 0.15)]
        healed_s = next((t for t in well), math.inf)
        self.check(healed_s <= HEALED_S, f"{what}: healed {healed_s:.2f} s after the return (motion known, sigma below {max(3 * before_m, 0.15):.2f} m)")
        self.rows.append((what, f"{until_s - from_s:.0f} s", f"{rate_hz:.1f} Hz", f"{before_m:.3f} to {most_m:.2f} m", f"{worst:.1f}", f"{healed_s:.2f} s"))


def judge_service(work, waymark):
    out, recording = work / "share/out/service", work / "office-recording"
    sizes = dict(line.split() for line in (out / "heard-bytes").read_text().splitlines())
    bus = Judge("bus", out, recording)
    bus.check(int(sizes["without"]) == 0, f"in no network, without the unit's route: {sizes['without']} bytes are heard")
    for when, what in (("alone", "in no network"), ("early", "in a network, there before the service"), ("late", "in a network, there after it")):
        bus.check(int(sizes[when]) > 20_000, f"a subscriber {what} hears {sizes[when]} bytes by the shipped unit")
    bus.process()
    bus.fault("CAN silent", *BUS_SILENT_S, ["can"], False)
    bus.heard.device("CAN silent, over", "can", WORKS, BUS_SILENT_S[1] + 1, END_S["bus"] - 1)
    camera, both = Judge("camera", out, recording), Judge("both", out, recording)
    known = in_view(recording, 0, BOTH_GONE_S[0]) & in_view(recording, BOTH_GONE_S[1], BOTH_GONE_S[1] + 0.5)
    both.check(len(known) >= 2, f"CAN and camera gone: {len(known)} markers of before are in view at the return")
    for judge, what, window, sources in ((camera, "camera gone", CAMERA_GONE_S, DETECTORS), (both, "CAN and camera gone", BOTH_GONE_S, ("can", *DETECTORS))):
        judge.process()
        judge.fault(what, *window, sources, True)
        for detector in DETECTORS:
            judge.heard.device(what, detector, ABSENT, window[0] + 7, window[1])
            judge.heard.device(what + ", over", detector, WORKS, window[1] + 2, window[1] + 6)
    print(f"{'fault':<22}{'for':>8}{'poses':>10}{'sigma':>18}{'error/sigma':>13}{'healed after':>14}")
    for row in bus.rows + camera.rows + both.rows:
        print(f"{row[0]:<22}{row[1]:>8}{row[2]:>10}{row[3]:>18}{row[4]:>13}{row[5]:>14}")
    return bus.heard.failures + camera.heard.failures + both.heard.failures


# ── killed, and cut off from power ──────────────────────────────────────────────────────────────────────────────────

def prepare_kills(work, root, here, simulate):
    recording, folder, can, pictures = scenario_of("kills", work, root, here, simulate)
    write_timeline(folder / "drive.timeline", can + pictures)
    (folder / "pauses").write_text("".join(f"{RANDOM.uniform(*PAUSE_S):.3f}\n" for _ in range(KILLS)))
    drives.compile_helper(folder / "disk_clock", here / "disk_clock.c")
    disk = work / "kills.disk"
    disk.unlink(missing_ok=True)
    subprocess.run(["mke2fs", "-q", "-F", "-t", "ext4", disk, f"{FILES_BYTES >> 10}k"], check=True)
    with open(disk, "r+b") as f:
        f.truncate(DISK_BYTES)
    shutil.copy(disk, work / "kills.before")
    (work / "kills.writes").write_bytes(b"")
    return [word for option in (f"driver=file,filename={disk},node-name=kills-file", f"driver=file,filename={work}/kills.writes,node-name=kills-writes",
                                "driver=raw,file=kills-file,node-name=kills-disk",
                                "driver=blklogwrites,file=kills-disk,log=kills-writes,node-name=kills")
            for word in ("-blockdev", option)] + ["-device", "virtio-blk-pci,drive=kills,addr=0x18"]


def first_right_s(heard_, began_s, until_s, most_m):
    """(first pose, from when on all are right) after began_s."""
    poses = heard_.between(began_s, until_s)
    wrong = [t for t, p in poses if heard_.error_m(t, p) > most_m]
    return poses[0][0] - began_s if poses else math.inf, max(wrong, default=began_s) - began_s


def report(what, times, failures):
    first, right = [t[0] for t in times], [t[1] for t in times]
    print(f"{what}: {len(times)} times: first pose {sorted(first)[len(first) // 2]:.3f} s after the program's start (median), {max(first):.3f} s at most; "
          f"right for good (within {RIGHT_M} m) after {max(right):.2f} s at most")
    if max(first) > POSE_S:
        failures.append(f"{what}: a pose only after {max(first):.3f} s")
    if max(right) > RIGHT_S:
        failures.append(f"{what}: right only after {max(right):.2f} s")


def where_time_goes(journal, killed_s, started_s, nothing_s, first_s):
    """Prints the medians of a start's steps, by the run's lines in the journal, whose clock is compared at the first kill."""
    at = [(float(t), int(pid), what) for t, pid, what in
          re.findall(r"\[ *([\d.]+)\] \S+ waymark\[(\d+)\]: note: (start: saved pose|memory: |can: can0 is up)", journal)]
    clock_s = float(re.search(r"\[ *([\d.]+)\] .*Sent signal SIGKILL to main process", journal).group(1)) - killed_s
    steps = []
    for pid, start_s in zip(list(dict.fromkeys(pid for _, pid, _ in at))[-len(started_s):], started_s):
        line = {what: t - clock_s - start_s - nothing_s for t, of, what in at if of == pid}
        steps.append([line.get(what, math.nan) for what in ("start: saved pose", "memory: ", "can: can0 is up")])
    middle = [statistics.median(column) for column in zip(*steps)]
    print(f"a start, medians: the saved pose is read after {middle[0]:.3f} s (loader, configuration), memory taken and detectors ready after {middle[1]:.3f} s, "
          f"memory locked and the bus open after {middle[2]:.3f} s, the first pose after {statistics.median(first_s):.3f} s")


def judge_kills(work, waymark):
    out, recording, failures = work / "share/out/kills", work / "office-recording", []
    told, ahead = heard("kills", out, out / "heard.lcm", recording)
    begin_s = (first_ns(recording) + ahead) * 1e-9
    killed = [float(line.split()[1]) - begin_s for line in (out / "marks").read_text().splitlines()]
    said = (out / "journal").read_text()
    mapped = said.count("continues with the map")
    if mapped < KILLS:
        failures.append(f"killed: {mapped} of {KILLS} starts had the map")
    times = []
    started = [int(line) * 1e-6 - begin_s for line in (out / "started-us").read_text().split()]
    for start_s, until_s in zip(started, killed[1:] + [killed[-1] + 6]):
        times.append(first_right_s(told, start_s, until_s, RIGHT_M))
    stamps = [int(us) for us in (out / "nothing-us").read_text().split()]
    nothing_s = statistics.median(abs(end - begin) for begin, end in zip(stamps[::2], stamps[1::2])) * 1e-6
    print(f"the same unit with /bin/true is over {nothing_s:.3f} s after its start (median): systemd's part, in this emulated computer")
    report("killed (SIGKILL), without that", [(first - nothing_s, right) for first, right in times], failures)
    where_time_goes(said, killed[0] + begin_s, [start + begin_s for start in started], nothing_s, [first - nothing_s for first, _ in times])
    if subprocess.run([sys.executable, pathlib.Path(__file__).parent / "cuts.py", work, waymark]).returncode:
        failures.append("the disks that cuts of the power left (above)")
    return failures
