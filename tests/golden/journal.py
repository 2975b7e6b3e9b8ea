#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a run writes into systemd's journal: this test is the journal, a datagram socket at its place, and reads the native protocol.

  1. standard error is the journal: notes, a source's name, an error come as entries with their fields, and standard error stays empty;
  2. it is another file, though JOURNAL_STREAM is set; or nobody listens: the same lines on standard error;
  3. beyond the bound notices are left out, and counted.
Needs the right to mounts of its own (else 77)."""
import ctypes
import os
import pathlib
import queue
import signal
import socket
import subprocess
import sys
import threading
import time

import lcm_tools
from lcm_tools import WAYMARK, in_a_network

PLACE = pathlib.Path("/run/systemd/journal/socket")
BURST, PER_S, ASKED_S = 200, 2, 8


class Journal(threading.Thread):
    """Reads at once: the socket's queue has room for few."""

    def __init__(self):
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(PLACE))
        self.heard = queue.SimpleQueue()

    def run(self):
        while True:
            text = self.socket.recv(1 << 16).decode()
            assert text.endswith("\n"), text
            self.heard.put(dict(line.split("=", 1) for line in text[:-1].split("\n")))


def entries(journal):
    """Those that came, as {field: text}."""
    time.sleep(0.2)
    return [journal.heard.get() for _ in range(journal.heard.qsize())]


def start(words, to, is_named=True):
    """Exit code of a run whose standard error is the file `to`."""
    with open(to, "w+") as file:
        other = os.stat("/")
        place = os.fstat(file.fileno()) if is_named else other
        return subprocess.run(words, stdout=subprocess.DEVNULL, stderr=file, timeout=60, check=False,
                              env={**os.environ, "JOURNAL_STREAM": f"{place.st_dev}:{place.st_ino}"}).returncode


def check_fields(work, journal, command):
    assert start(command, work / "said") == 0
    assert (work / "said").read_text() == "", (work / "said").read_text()
    heard = entries(journal)
    assert heard and all(e["SYSLOG_IDENTIFIER"] == "waymark" and e["MESSAGE"].startswith(("note: ", "bad: ")) for e in heard), heard
    memory = next(e for e in heard if e.get("WAYMARK_ABOUT") == "memory")
    assert memory["PRIORITY"] == "5" and "taken before the start" in memory["MESSAGE"], memory
    found = [e for e in heard if "WAYMARK_FINDING" in e]
    assert found and all(e["PRIORITY"] == "4" and e["MESSAGE"].endswith(f"[{e['WAYMARK_FINDING']}]") for e in found), heard
    fixed = next(e for e in found if "WAYMARK_FIX" in e)
    assert f": {fixed['WAYMARK_ABOUT']}: " in fixed["MESSAGE"] and f"; fix: {fixed['WAYMARK_FIX']} [" in fixed["MESSAGE"], fixed
    print(len(heard), "entries; one of a finding:", fixed)


def check_error(work, journal):
    (work / "wrong.yaml").write_text("format: waymark-config/1\nestimator: nosuch\n")
    assert start([WAYMARK, "run", "--config", work / "wrong.yaml"], work / "said") == 2
    last = entries(journal)[-1]
    assert last["PRIORITY"] == "3" and last["MESSAGE"].startswith(f"waymark: {work}/wrong.yaml:2: "), last


def check_bound(work, journal):
    """A wrong configuration, read again and again."""
    config = work / "devices.yaml"
    lcm_tools.config(config, "odometry", "initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\ndevices: {lcm: [{stream: motion}]}\n")
    with open(work / "said", "w+") as file:
        place = os.fstat(file.fileno())
        run = subprocess.Popen([WAYMARK, "run", "--config", config], stdout=subprocess.DEVNULL, stderr=file,
                               env={**os.environ, "JOURNAL_STREAM": f"{place.st_dev}:{place.st_ino}"})
    begin, heard, asked = time.monotonic(), entries(journal), 0
    config.write_text("nonsense: 1\n")
    while time.monotonic() < begin + ASKED_S:
        run.send_signal(signal.SIGHUP)
        asked += 1
        time.sleep(0.022)  # the run looks every 20 ms
    heard += entries(journal)
    seconds = time.monotonic() - begin
    time.sleep(1.5)  # room for three more
    run.send_signal(signal.SIGHUP)
    last = entries(journal)
    run.send_signal(signal.SIGTERM)
    assert run.wait(timeout=20) == 0
    again = [e for e in heard + last if "The run continues unchanged" in e["MESSAGE"]]
    left_out = sum(int(e.get("WAYMARK_LEFT_OUT", 0)) for e in heard + last)
    print(f"{asked} times a wrong configuration: {len(again)} entries, {left_out} left out")
    assert BURST / 2 < len(heard) <= BURST + PER_S * seconds + 1, len(heard)
    assert left_out > 0 and last, last
    assert len(again) + left_out > 0.5 * asked, "lines are lost"


def main():
    lcm_tools.own_network("lcm", mounts=True)
    libc = ctypes.CDLL(None, use_errno=True)
    assert libc.mount(b"none", b"/", None, ctypes.c_ulong(1 << 18 | 1 << 14), None) == 0  # MS_PRIVATE | MS_REC
    subprocess.run(["mount", "-t", "tmpfs", "tmpfs", "/run"], check=True)
    PLACE.parent.mkdir(parents=True)
    journal = Journal()
    journal.start()
    with in_a_network.work_folder("journal") as work:
        lcm_tools.write_recording(work / "drive", 6)
        # Sightings end after 2 s, which is a finding.
        rows = (work / "drive/sightings.csv").read_text().splitlines()
        (work / "drive/sightings.csv").write_text("\n".join(r for r in rows if r[0] == "t" or int(r.split(",")[0]) < 2e9) + "\n")
        lcm_tools.config(work / "robot.yaml", "landmark_ekf")
        command = [WAYMARK, "run", "--config", work / "robot.yaml", "--recording", work / "drive", "--out", work / "out", "--force"]
        check_fields(work, journal, command)
        check_error(work, journal)
        check_bound(work, journal)
        entries(journal)  # of the end of that run
        assert start(command, work / "said", is_named=False) == 0
        assert not entries(journal) and "note: memory: " in (work / "said").read_text(), (work / "said").read_text()
        PLACE.unlink()  # as without systemd
        assert start(command, work / "said") == 0
        assert "note: memory: " in (work / "said").read_text()


if __name__ == "__main__":
    sys.exit(main())
