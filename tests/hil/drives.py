# SPDX-License-Identifier: Apache-2.0
"""A recording through the guest's drivers into `waymark run`: its timeline for guest/play, and the judgement of what the run
said over LCM, against a replay of the recording with the data that the guest saw, and against the truth."""
import csv
import pathlib
import re
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools/hil"))
import messages  # noqa: E402
from waymark_hil.poses import BEGIN_NS, HEADING_DEG, POSITION_M, apart_of, at, differences, rms, table  # noqa: E402

TRUTH_RATIO = 1.5
COMPILER = "cc"  # of what runs in the guest
URL = "udpm://239.255.76.67:7667?ttl=0"


def rows(path):
    """A table's rows, texts by column."""
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


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


def compile_helper(program, *sources):
    subprocess.run([COMPILER, "-O2", "-static", *sources, "-o", program], check=True)


def compile_player(here, folder):
    compile_helper(folder / "play", here / "play.c", here / "play_devices.c")


def write(scenario, here, items, blob, seconds):
    """What guest/drive.sh plays."""
    (scenario / "timeline").write_text("".join(f"{t} {what}\n" for t, what in sorted(items)))
    (scenario / "pictures").write_bytes(blob)
    (scenario / "duration").write_text(f"{seconds:.0f}\n")
    compile_player(here, scenario)


def judge(name, work, waymark, recording, config, seconds, *logged_options, is_recorded=False, settled_s=0):
    """Poses are compared with a replay of the recording with the data that the guest saw; where the guest's own recording is there
    (is_recorded), with the replay of that one, from settled_s on."""
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
    if is_recorded:
        replay(out / "rec", "--config", out / "rec/config.yaml", "--out", work / f"{name}-recorded")
        apart = list(apart_of(poses, table(work / f"{name}-recorded/published.csv"), 0))
    else:
        apart = list(apart_of(poses, table(work / f"{name}-same/published.csv"), offset_ns))
    truth = table(recording / "truth.csv")
    live = [m for _, m, _ in differences(poses, truth, offset_ns)]
    desk = [m for _, m, _ in differences(table(work / f"{name}-desk/published.csv"), truth, 0)]
    apart = [row for row in apart if row[0] >= begun_ns + settled_s * 10**9]
    if len(apart) < 30 * (seconds - settled_s):
        return failures + [f"{name}: only {len(apart)} of {len(poses)} poses over LCM can be compared"]
    worst_m, worst_deg = max(m for _, m, _ in apart), max(d for *_, d in apart)
    of_what = "of the guest's recording" if is_recorded else "with the guest's data"
    print(f"{name}: {len(poses)} poses over LCM; {len(apart)} of them at most {worst_m:.4f} m and {worst_deg:.3f} degrees from the replay "
          f"{of_what}; from the truth {rms(live):.4f} m RMS, at the desk {rms(desk):.4f} m")
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
