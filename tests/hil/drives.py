# SPDX-License-Identifier: Apache-2.0
"""A recording through the guest's drivers into `waymark run`: its timeline for guest/play, and the judgement of what the run
said over LCM, against a replay of the recording with the data that the guest saw, and against the truth."""
import bisect
import csv
import math
import re
import shutil
import subprocess

import messages

POSITION_M, HEADING_DEG, TRUTH_RATIO = 0.02, 0.2, 1.5
BEGIN_NS = 400_000_000  # after the first pose: the first picture comes up to a period of 200 ms later, and is fused when its detection and lateness have passed
COMPILER = "cc"  # of what runs in the guest
URL = "udpm://239.255.76.67:7667?ttl=0"


def can_items(recording):
    """(t_ns, line for the player) of can.log."""
    for line in (recording / "can.log").read_text().splitlines():
        time, _, frame = line.split()[:3]
        whole, fraction = time.strip("()").split(".")
        ident, data = frame.split("#")
        yield int(whole) * 10**9 + int(fraction.ljust(9, "0")), f"c {ident} {data}"


def start_of(recording):
    about = (recording / "recording.yaml").read_text()
    start = re.search(r"initial_pose: *(\{[^}]*\})", about)
    return start.group(1) if start else "{" + ", ".join(re.findall(r"((?:x_m|y_m|heading_rad): *[-0-9.e]+)", about)) + "}"


def with_realtime(config, keys):
    """The configuration with these keys of `realtime`, which may stand in it, on a line, or not."""
    if "\nrealtime: {" in config:
        return config.replace("\nrealtime: {", f"\nrealtime: {{{keys}, ", 1)
    return config + f"\nrealtime: {{{keys}}}\n"


def compile_helper(source, program):
    subprocess.run([COMPILER, "-O2", "-static", source, "-o", program], check=True)


def write(scenario, here, items, blob, seconds):
    """What guest/drive.sh plays."""
    (scenario / "timeline").write_text("".join(f"{t} {what}\n" for t, what in sorted(items)))
    (scenario / "pictures").write_bytes(blob)
    (scenario / "duration").write_text(f"{seconds:.0f}\n")
    compile_helper(here / "play.c", scenario / "play")


def table(path):
    with open(path, newline="") as f:
        return [(int(r["t_ns"]), float(r["x_m"]), float(r["y_m"]), 2 * math.atan2(float(r["qz"]), float(r["qw"])))
                for r in csv.DictReader(f)]


def between(a, b, t_ns):
    """On the line through two rows."""
    part = (t_ns - a[0]) / (b[0] - a[0])
    return a[1] + part * (b[1] - a[1]), a[2] + part * (b[2] - a[2]), a[3] + part * math.remainder(b[3] - a[3], 2 * math.pi)


def at(rows, times, t_ns):
    """Between the two rows around t_ns; None outside."""
    i = bisect.bisect_right(times, t_ns)
    return None if i == 0 or i == len(rows) else between(rows[i - 1], rows[i], t_ns)


def around(rows, times, t_ns):
    """Between the rows around t_ns, and on from pairs of rows up to two before and after: a correction that takes the processor a while
    falls between two messages of the one run, and one or two later or earlier in the other."""
    i = bisect.bisect_right(times, t_ns)
    if i < 3 or i + 2 >= len(rows):
        return []
    return [between(rows[k - 1], rows[k], t_ns) for k in (i, i - 1, i + 1, i - 2, i + 2)]


def away(pose, other):
    return math.hypot(pose[1] - other[0], pose[2] - other[1]), abs(math.degrees(math.remainder(pose[3] - other[2], 2 * math.pi)))


def differences(poses, rows, offset_ns):
    times = [r[0] for r in rows]
    for p in poses:
        q = at(rows, times, p[0] - offset_ns)
        if q:
            yield away(p, q)


def apart_of(poses, rows, offset_ns):
    """As differences, from the nearest of what is around."""
    times = [r[0] for r in rows]
    for p in poses:
        near = around(rows, times, p[0] - offset_ns)
        if near:
            yield min((away(p, q) for q in near), key=lambda d: d[0] / POSITION_M + d[1] / HEADING_DEG)


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def judge(name, work, waymark, recording, config, seconds, *logged_options):
    out, failures = work / f"share/out/{name}", []

    def replay(*words):
        return subprocess.run([waymark, "replay", *words], check=True, capture_output=True, text=True).stdout

    replay(out / "drive/events.wmlog", *logged_options, "--out", work / f"{name}-again")
    if (out / "drive/trajectory.csv").read_bytes() != (work / f"{name}-again/trajectory.csv").read_bytes():
        failures.append(f"{name}: the guest's log doesn't give its poses bit by bit")
    said = replay(recording, "--config", config, "--frames-of", out / "drive/events.wmlog", "--out", work / f"{name}-same")
    offset_ns = int(re.search(r"clock is (-?\d+) ns ahead", said).group(1))
    replay(recording, "--config", config, "--out", work / f"{name}-desk")

    poses = messages.rows(messages.heard(work, out / "heard.lcm")[0])
    begun_ns = table(work / f"{name}-same/published.csv")[0][0] + offset_ns + BEGIN_NS
    poses = [p for p in poses if p[0] > begun_ns]
    apart = list(apart_of(poses, table(work / f"{name}-same/published.csv"), offset_ns))
    truth = table(recording / "truth.csv")
    live = [m for m, _ in differences(poses, truth, offset_ns)]
    desk = [m for m, _ in differences(table(work / f"{name}-desk/published.csv"), truth, 0)]
    if len(apart) < 30 * seconds:
        return failures + [f"{name}: only {len(apart)} of {len(poses)} poses over LCM can be compared"]
    worst_m, worst_deg = max(m for m, _ in apart), max(d for _, d in apart)
    print(f"{name}: {len(poses)} poses over LCM; {len(apart)} of them at most {worst_m:.4f} m and {worst_deg:.3f} degrees from the "
          f"replay with the guest's data; from the truth {rms(live):.4f} m RMS, at the desk {rms(desk):.4f} m")
    if worst_m > POSITION_M or worst_deg > HEADING_DEG:
        failures.append(f"{name}: the guest's poses over LCM are not those of the replay with its data")
    if rms(live) > TRUTH_RATIO * rms(desk):
        failures.append(f"{name}: the guest's poses are worse than the desk's")
    return failures


def make(work, name, simulate, *words):
    """A simulated drive in WORK/NAME-recording, and the folder of its scenario in the guest."""
    recording, scenario = work / f"{name}-recording", work / f"share/{name}"
    shutil.rmtree(recording, ignore_errors=True)
    scenario.mkdir(parents=True)
    subprocess.run([simulate, *words, "--out", recording], check=True)
    return recording, scenario
