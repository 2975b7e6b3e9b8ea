# SPDX-License-Identifier: Apache-2.0
"""`waymark bench`: what a board does with drives that are the same everywhere, as a file and a row of a table."""
import argparse
import datetime
import hashlib
import json
import math
import os
import pathlib
import platform
import re
import socket
import struct
import subprocess
import sys
import tempfile
import time

from .bench_drives import DRIVES
from .plan import PlanError, desk_program, finite

FORMAT = "waymark-board/1"
REPLAYS = 3  # of which the least counts: other work on a board only adds time
LAST_M = 0.1  # an end of a drive that is farther from where it is was not localized
LIVE = "plan"  # the drive at real speed: the longest start and cycle
GROUP, PORT, POSE = "239.255.76.67", 7667, b"WAYMARK_POSE\0"  # LCM's default, and the channel of poses
FIRST_POSE_S = 30.0  # later than that there is none
EXAMPLES = """examples:
  waymark bench --board --out orin-nano.json
  waymark bench --board --minutes 0 --out quick.json
  waymark bench --table boards/*.json
On a board that does nothing else, set as on the robot (docs/boards.md). Exit code: 0 done, 1 a drive was not localized, 2 usage."""


def parser():
    """The command line."""
    out = argparse.ArgumentParser(prog="waymark bench", formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLES,
                                  description="Measures a board: waymark doctor, replays of drives that are the same on every board (tags in pictures, landmarks, "
                                              "a floor plan), a run at real speed, and whether it keeps its speed while it gets warm. Needs no network and changes nothing.")
    what = out.add_mutually_exclusive_group(required=True)
    what.add_argument("--board", action="store_true", help="measure this computer")
    what.add_argument("--table", metavar="FILE", nargs="+", help="a table in Markdown of such files, to paste into an issue")
    out.add_argument("--out", metavar="FILE", default="board.json", help="what was measured; board.json by default")
    out.add_argument("--minutes", metavar="M", type=finite, default=10.0, help="of work for the temperature; 10 by default, 0: none")
    out.add_argument("--name", metavar="TEXT", help="of the board; by default as it says itself")
    return out


# ── the computer ───────────────────────────────────────────────────────────────────────────────────────────────────────
def first_of(*paths):
    """The text of the first file that can be read, without the zero that a device tree ends with; "" without one."""
    for path in paths:
        try:
            return pathlib.Path(path).read_text().strip("\0\n ")
        except OSError:
            continue
    return ""


def computer(root="/"):
    """What a reader has to know of a board."""
    cpu = re.search(r"^(?:model name|Model)\s*:\s*(.+)$", first_of(f"{root}/proc/cpuinfo"), re.MULTILINE)
    memory = re.search(r"MemTotal:\s+(\d+) kB", first_of(f"{root}/proc/meminfo"))
    system = re.search(r'^PRETTY_NAME="(.*)"', first_of(f"{root}/etc/os-release"), re.MULTILINE)
    return {"board": first_of(f"{root}/proc/device-tree/model", f"{root}/sys/class/dmi/id/product_name") or platform.machine(),
            "cpu": cpu[1] if cpu else "", "cores": os.cpu_count(), "architecture": platform.machine(), "kernel": platform.release(),
            "realtime": first_of(f"{root}/sys/kernel/realtime") == "1", "memory_mb": int(memory[1]) // 1000 if memory else None,
            "system": system[1] if system else ""}


def warmth(root="/"):
    """The highest temperature in degrees C, and the lowest clock of a core in MHz; None where a board has none."""
    zones = [first_of(path) for path in pathlib.Path(f"{root}/sys/class/thermal").glob("thermal_zone*/temp")]
    clocks = [first_of(path) for path in pathlib.Path(f"{root}/sys/devices/system/cpu").glob("cpu[0-9]*/cpufreq/scaling_cur_freq")]
    degrees = [int(z) / 1000 for z in zones if re.fullmatch(r"-?\d+", z) and int(z) < 200_000]  # some say 256 degrees where there is no sensor
    return max(degrees, default=None), min((int(c) / 1000 for c in clocks if c.isdigit()), default=None)


# ── drives ─────────────────────────────────────────────────────────────────────────────────────────────────────────────
def call(words, codes=(0,)):
    """A program's run; its failure is an error with its last line."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    if done.returncode not in codes:
        raise PlanError(f"{' '.join(map(str, words))}: exit code {done.returncode}: {(done.stderr or done.stdout).strip().splitlines()[-1:]}")
    return done


def replay(waymark, drive, out):
    """timing.json of a replay, its sum and its last place."""
    call([*waymark, "replay", drive, "--config", drive / "robot.yaml", "--out", out, "--force"])
    rows = (out / "trajectory.csv").read_text()
    header, last = rows.split("\n", 1)[0].split(","), rows.strip().rsplit("\n", 1)[1].split(",")
    place = [float(last[header.index(name)]) for name in ("x_m", "y_m")]
    return json.loads((out / "timing.json").read_text()), hashlib.sha256(rows.encode()).hexdigest(), place


def measure_drive(waymark, drive, end, stages, out):
    """A drive's figures."""
    replays = [replay(waymark, drive, out) for _ in range(REPLAYS)]
    timing, digest, place = replays[0]
    assert all(r[1] == digest for r in replays), "the same replay has other bits"
    return {"stages": {stage: {k: min(t[stage][k] for t, _, _ in replays) for k in ("p50_us", "p99_us", "count")} for stage in stages},
            "memory_bytes": timing["memory_bytes"], "trajectory_sha256": digest, "end_off_m": round(math.dist(place, end), 4)}


def wait_for_pose(listener, begin):
    """Milliseconds from `begin` to the first pose on LCM (its datagrams: four bytes, a number, the channel); None without one."""
    while time.monotonic() - begin < FIRST_POSE_S:
        try:
            if listener.recv(65536)[8:].startswith(POSE):
                return (time.monotonic() - begin) * 1000
        except OSError:
            break
    return None


def live(waymark, drive, out):
    """A run at real speed: the estimator's wake-up and cycle, deadlines, resident memory, and from its start to its first pose on LCM."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((GROUP, PORT))
        listener.settimeout(FIRST_POSE_S)
        listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, struct.pack("4s4s", socket.inet_aton(GROUP), bytes(4)))
        begin = time.monotonic()
        run = subprocess.Popen([*waymark, "run", "--config", drive / "robot.yaml", "--recording", drive, "--out", out], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        first_pose_ms = wait_for_pose(listener, begin)
    resident_kb = 0
    while run.poll() is None:
        peak = re.search(r"VmHWM:\s+(\d+)", first_of(f"/proc/{run.pid}/status"))
        resident_kb = max(resident_kb, int(peak[1]) if peak else 0)
        time.sleep(0.2)
    if run.returncode:
        raise PlanError(f"waymark run: exit code {run.returncode}; `waymark doctor` names what is missing")
    timing = json.loads((out / "timing.json").read_text())
    return {"wake_p99_us": timing["wake"]["p99_us"], "wake_max_us": timing["wake"]["max_us"], "cycle_p99_us": timing["loop"]["p99_us"],
            "deadlines_missed": timing["deadlines_missed"], "deadlines_total": timing["deadlines_total"], "resident_kb": resident_kb,
            "first_pose_ms": first_pose_ms}


def astray(result):
    """Drives that were not localized."""
    return [name for name, drive in result["drives"].items() if drive["end_off_m"] > LAST_M]


def heat(waymark, drive, out, minutes):
    """Pictures a second in the first and in the last tenth of the time, and how warm the board became."""
    rates, degrees, clocks, begin = [], [], [], time.monotonic()
    while time.monotonic() - begin < 60 * minutes:
        timing, _, _ = replay(waymark, drive, out)
        rates.append((time.monotonic() - begin, 1e6 / timing["detect"]["p50_us"]))
        warm, clock = warmth()
        degrees += [warm] if warm is not None else []
        clocks += [clock] if clock is not None else []
    tenth = max(1, len(rates) // 10)
    middle = lambda some: sorted(rate for _, rate in some)[len(some) // 2]  # noqa: E731
    return {"minutes": minutes, "replays": len(rates), "first_hz": middle(rates[:tenth]), "last_hz": middle(rates[-tenth:]), "begin_c": degrees[0] if degrees else None,
            "highest_c": max(degrees, default=None), "lowest_mhz": min(clocks, default=None)}


def measure(waymark, minutes, name, say):
    """The whole file."""
    result = {"format": FORMAT, "waymark": call([*waymark, "--version"]).stdout.strip(), "date": f"{datetime.datetime.now(datetime.timezone.utc):%Y-%m-%d}",
              "computer": computer(), "load": os.getloadavg()[0]}
    result["computer"]["board"] = name or result["computer"]["board"]
    say("waymark doctor")
    result["doctor"] = json.loads(call([*waymark, "doctor", "--json"], codes=(0, 1)).stdout)
    with tempfile.TemporaryDirectory(prefix="waymark-bench-") as temporary:
        work, result["drives"] = pathlib.Path(temporary), {}
        for drive, (what, make, stages) in DRIVES.items():
            say(what)
            (work / drive).mkdir()
            result["drives"][drive] = measure_drive(waymark, work / drive, make(work / drive), stages, work / "run")
        say("a run at real speed")
        result["live"] = live(waymark, work / LIVE, work / "live")
        if minutes > 0:
            say(f"{minutes:g} minutes of tags")
            result["heat"] = heat(waymark, work / "tags-720p", work / "run", minutes)
    return result


# ── a table ────────────────────────────────────────────────────────────────────────────────────────────────────────────
def number(value, digits):
    """A figure, or that there is none."""
    return "-" if value is None else f"{value:.{digits}f}"


def row(result):
    """{column: text} of a file."""
    computer_, live_, heat_ = result["computer"], result["live"], result.get("heat", {})

    def stage(drive, name, figure="p50_us", scale=1.0):
        return result["drives"][drive]["stages"][name][figure] * scale

    sums = "".join(result["drives"][drive]["trajectory_sha256"] for drive in sorted(result["drives"]))
    return {"board": computer_["board"], "system, kernel": f"{computer_['system']}, {computer_['kernel']}{', PREEMPT_RT' if computer_['realtime'] else ''}",
            "12 tags 640x480, ms": number(stage("tags-vga", "detect", scale=1e-3), 2), "1280x720, ms (a second)":
            f"{number(stage('tags-720p', 'detect', scale=1e-3), 2)} ({number(1e6 / stage('tags-720p', 'detect'), 0)})",
            "a bearing: landmark_ekf, slam, µs": f"{number(stage('landmarks', 'correct'), 1)}, {number(stage('slam', 'correct'), 1)}",
            "a scan on a plan, µs": number(stage("plan", "correct"), 0), "wake-up p99 (most), ms": f"{number(live_['wake_p99_us'] * 1e-3, 2)} ({number(live_['wake_max_us'] * 1e-3, 2)})",
            "deadlines missed": f"{live_['deadlines_missed']} of {live_['deadlines_total']}", "first pose, ms": number(live_["first_pose_ms"], 0),
            "memory, MB": number(live_["resident_kb"] / 1000, 1), "warm: pictures a second, °C":
            f"{number(heat_['first_hz'], 0)} to {number(heat_['last_hz'], 0)}, {number(heat_['highest_c'], 0)}" if heat_ else "-",
            "poses": hashlib.sha256(sums.encode()).hexdigest()[:8]}


def table(results):
    """Markdown. Boards with the same poses to the last bit have the same letters in the last column."""
    rows = [row(result) for result in results]
    lines = ["| " + " | ".join(rows[0]) + " |", "|" + " --- |" * len(rows[0])]
    return "\n".join(lines + ["| " + " | ".join(r.values()) + " |" for r in rows])


def load(path):
    """A file that this program wrote."""
    try:
        result = json.loads(pathlib.Path(path).read_text())
    except (OSError, ValueError) as why:
        raise PlanError(f"{path}: {why}; waymark bench --board writes such a file") from None
    if not isinstance(result, dict) or result.get("format") != FORMAT:
        raise PlanError(f"{path}: its format is not {FORMAT}; waymark bench --board writes such a file")
    return result


def main(argv=None, beside=None):
    """The program."""
    asked = parser().parse_args(argv)
    try:
        if asked.table:
            print(table([load(path) for path in asked.table]))
            return 0
        waymark = desk_program("waymark", beside or pathlib.Path(sys.argv[0]).resolve().parent)
        result = measure(waymark, asked.minutes, asked.name, lambda what: print(f"... {what}", file=sys.stderr))
        pathlib.Path(asked.out).write_text(json.dumps(result, indent=1) + "\n")
    except (PlanError, OSError) as why:
        print(f"waymark bench: {why}", file=sys.stderr)
        return 2
    print(table([result]))
    print(f"\n{asked.out} has all of it")
    for name in astray(result):
        print(f"bad: {DRIVES[name][0]}: the last pose is {result['drives'][name]['end_off_m']} m off: a wrong build?", file=sys.stderr)
    return int(bool(astray(result)))
