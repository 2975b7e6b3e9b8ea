#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark play` over LCM, received by LCM's own logger: all messages of a recording, in their order, with their stamps on the monotonic
clock; with faults; ended by Ctrl-C. And what it refuses. Needs lcm-logger and the right to a network namespace for the first."""
import csv
import json
import os
import pathlib
import signal
import struct
import subprocess
import sys
import time

ROOT = pathlib.Path(os.environ.get("WM_SOURCE_DIR", ".")).resolve()
PLAY = pathlib.Path(os.environ.get("WM_BIN_DIR", ROOT / "build/bin")) / "waymark-play"
sys.path[:0] = [str(ROOT / "tests/golden"), str(ROOT / "tests/hil")]
import lcm_tools  # noqa: E402
import messages  # noqa: E402
from lcm_tools import in_a_network  # noqa: E402

SECONDS = 4


def play(*words, **keys):
    return subprocess.run([PLAY, *map(str, words)], capture_output=True, text=True, timeout=60, **keys)


def stamps(path, channel):
    return [struct.unpack_from(">q", message, 8)[0] for _, name, message in messages.logged(path) if name == channel]


class Heard:
    """What lcm-logger receives while the player plays."""

    def __init__(self, work, name):
        self.log = work / f"{name}.lcm"
        self.logger = subprocess.Popen(["lcm-logger", "-q", "-f", f"--lcm-url={lcm_tools.URL}", self.log])
        lcm_tools.wait_for_listener()
        time.sleep(0.5)  # its own test of the network

    def end(self):
        time.sleep(0.5)
        self.logger.send_signal(signal.SIGINT)
        self.logger.wait(timeout=10)
        return self.log


def rows(recording, name):
    with open(recording / name, newline="") as f:
        return [int(row["t_ns"]) for row in csv.DictReader(f)]


def check_all(work, recording):
    """Each row is received once, in its order, its stamp moved by one offset."""
    heard = Heard(work, "all")
    done = play(recording, "--lcm", lcm_tools.URL, "--json", work / "played.json")
    log = heard.end()
    assert done.returncode == 0, done.stderr
    result = json.loads((work / "played.json").read_text())
    assert result["state"] == "done" and result["not_placed"] == [], result
    sent = {s["name"]: s["sent"] for s in result["streams"]}
    for name, channel, wanted in (("motion", "WAYMARK_MOTION", rows(recording, "motion.csv")),
                                  ("sightings:eye", "WAYMARK_SIGHTINGS", sorted(set(rows(recording, "sightings.csv"))))):
        got = stamps(log, channel)
        assert got == [t + result["offset_ns"] for t in wanted], f"{channel}: {len(got)} messages of {len(wanted)}"
        assert sent[name] == len(wanted), sent
    arrived = [utc_us * 1000 for utc_us, name, _ in messages.logged(log) if name == "WAYMARK_MOTION"]
    spans = [(arrived[-1] - arrived[0]) * 1e-9, (rows(recording, "motion.csv")[-1] - rows(recording, "motion.csv")[0]) * 1e-9]
    assert abs(spans[0] - spans[1]) < 0.5, spans
    print(f"all: {len(arrived)} motion_t and {sent['sightings:eye']} observations_t are heard; {result['streams']}")


def check_faults(work, recording):
    """A silent stream, a share that is dropped, a clock that is ahead: counted by the listener."""
    (work / "faults.yaml").write_text(
        "format: waymark-faults/1\nfaults:\n"
        "- {name: silent, fault: stream_silent, stream: motion, from_s: 0.5, until_s: 1}\n"
        "- {name: ahead, fault: stream_clock_ahead, stream: motion, ahead_s: 100, from_s: 1, until_s: 2}\n"
        "- {name: dropped, fault: stream_dropped, stream: sightings, share: 0.5, from_s: 0, until_s: 4}\n"
        "- {name: cut, fault: power_cut, from_s: 2}\n")
    heard = Heard(work, "faults")
    done = play(recording, "--lcm", lcm_tools.URL, "--json", work / "played.json", "--faults", work / "faults.yaml", "--speed", 2, "--from", 0.25)
    log = heard.end()
    assert done.returncode == 0, done.stderr
    assert "'cut' (power_cut at 2 s) is left to the runner" in done.stderr, done.stderr
    result = json.loads((work / "played.json").read_text())
    faults = {f["name"]: (f["by"], f["done"]) for f in result["faults"]}
    assert faults == {"silent": ("player", True), "ahead": ("player", True), "dropped": ("player", True), "cut": ("runner", False)}, faults
    first = result["first_ns"]
    since = lambda t: (t - result["begin_ns"]) * 2e-9 + 0.25
    at = [since(t) for t in stamps(log, "WAYMARK_MOTION")]
    wanted = [(t - first) * 1e-9 + (100 if 1 <= (t - first) * 1e-9 < 2 else 0) for t in rows(recording, "motion.csv")
              if not 0.5 <= (t - first) * 1e-9 < 1 and (t - first) * 1e-9 >= 0.25]
    assert len(at) == len(wanted) and all(abs(a - b) < 1e-6 for a, b in zip(at, wanted)), (len(at), len(wanted))
    seen = len(stamps(log, "WAYMARK_SIGHTINGS"))
    assert 10 < seen < 30, seen
    print(f"faults: {len(at)} motion_t, {seen} observations_t")


def check_end(work, recording):
    """Ctrl-C: the summary, and exit code 0."""
    player = subprocess.Popen([PLAY, recording, "--lcm", lcm_tools.URL, "--loop", "100"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(2.5)
    player.send_signal(signal.SIGINT)
    out, err = player.communicate(timeout=5)
    assert player.returncode == 0 and "interrupted after" in out and "motion" in out, (player.returncode, out, err)
    print("Ctrl-C: the summary is there")


def check_mistakes(work, recording):
    """Each is refused with its remedy, before anything is played."""
    (work / "bad.yaml").write_text("format: waymark-faults/1\nfaults: [{name: a, fault: bus_of, from_s: 1}]\n")
    (work / "elsewhere.yaml").write_text("format: waymark-faults/1\nfaults: [{name: a, fault: stream_silent, stream: imu, from_s: 1}]\n")
    for words, code, text in (
            ([], 2, "play needs a RECORDING"),
            (["/nowhere"], 1, "there is no recording.yaml in it"),
            ([recording, "--can", "can0=vcan0"], 2, "the recording has no frames of the interface 'can0'"),
            ([recording, "--camera", "front"], 2, "'front' is not NAME=DEVICE[,FORMAT]"),
            ([recording, "--lcm", "off"], 2, "no stream of the recording has a place"),
            ([recording, "--from", "5", "--until", "3"], 2, "--until: 3 is not after --from (5)"),
            ([recording, "--start-at", "1"], 2, "s ago (CLOCK_MONOTONIC is at"),
            ([recording, "--fault", "x"], 2, "did you mean '--faults'?"),
            ([recording, "--faults", work / "none.yaml"], 2, "none.yaml"),
            ([recording, "--faults", work / "bad.yaml"], 2, "'bus_of' is unknown; did you mean 'bus_off'?"),
            ([recording, "--faults", work / "elsewhere.yaml"], 2, "has no stream 'imu'; it has motion, sightings"),
            ([recording, "--faults", work / "elsewhere.yaml", "--print-faults"], 2, "has no stream 'imu'; it has motion, sightings"),
            (["--print-faults"], 2, "--print-faults needs --faults FILE")):
        done = play(*words)
        assert done.returncode == code and text in done.stderr, (words, done.returncode, done.stderr)
        assert "sent to" not in done.stdout, words
    print("13 mistakes are refused")


def check_reference():
    kinds = play("--print-kinds").stdout
    assert kinds in (ROOT / "docs/faults.md").read_text(), "docs/faults.md has not the table of `waymark play --print-kinds`"
    for path in sorted((ROOT / "config/faults").glob("*.yaml")):
        done = play("--faults", path, "--print-faults")
        assert done.returncode == 0, done.stderr
        print(f"{path.name}: {len(json.loads(done.stdout)['faults'])} faults")


def main():
    if in_a_network.INSIDE not in os.environ:
        check_reference()
    in_a_network.begin(programs=("lcm-logger",))
    with in_a_network.work_folder("play") as work:
        recording = work / "recording"
        lcm_tools.write_recording(recording, SECONDS)
        check_all(work, recording)
        check_faults(work, recording)
        check_end(work, recording)
        check_mistakes(work, recording)


if __name__ == "__main__":
    sys.exit(main())
