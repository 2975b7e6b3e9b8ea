#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A disk that blocks for 3 s delays no pose on LCM and does not stop the watchdog; nothing is lost. The robot's motion falls
silent for the last part of the drive, which does not stop the watchdog either. Needs what lcm_tools.py needs (else 77).

    slow_disk.py LIBRARY        (tests/golden/slow_disk.c, to be preloaded)"""
import os
import socket
import subprocess
import sys
import threading
import time

import lcm_tools
import restarts
from lcm_tools import in_a_network

BLOCK_S, DRIVE_S, SILENT_S, WATCHDOG_S = 3, 6, 5, 1


class Manager(threading.Thread):
    """The service manager's end of the notification socket."""

    def __init__(self, path):
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(path))
        self.heard = []

    def run(self):
        while True:
            text = self.socket.recv(4096).decode()
            self.heard.append((time.monotonic(), text))


def largest_gap(times):
    return max(b - a for a, b in zip(times, times[1:]))


def main():
    lcm_tools.own_network()
    library = sys.argv[1]
    with in_a_network.work_folder("slow-disk") as work:
        waymark = lcm_tools.python_types(work)
        recording = work / "recording"
        lcm_tools.write_recording(recording, DRIVE_S)
        with open(recording / "sightings.csv", "a") as f:  # sightings go on without motion
            for i in range(DRIVE_S * 10, (DRIVE_S + SILENT_S) * 10):
                f.write(f"{i * 100_000_000},eye,0,0,5\n")
        lcm_tools.config(work / "config.yaml", "landmark_ekf")
        manager, subscriber = Manager(work / "notify"), restarts.Subscriber(waymark)
        manager.start()
        subscriber.start()
        environment = dict(os.environ, LD_PRELOAD=library, WM_BLOCK_FOLDER=str(work / "out"), WM_BLOCK_AFTER_S="2",
                           WM_BLOCK_S=str(BLOCK_S), NOTIFY_SOCKET=str(work / "notify"),
                           WATCHDOG_USEC=str(int(WATCHDOG_S * 2e6)))
        done = subprocess.run([lcm_tools.WAYMARK, "run", "--config", work / "config.yaml", "--recording", recording,
                               "--out", work / "out"], capture_output=True, text=True, env=environment)
        end = time.monotonic()
        assert done.returncode == 0, done.stdout + done.stderr
        assert "slow disk: blocked" in done.stderr, done.stderr
        time.sleep(0.3)
        rows = lcm_tools.published(work / "out")
        heard = [pose.t_ns for _, pose in subscriber.poses]
        gap = largest_gap([at for at, _ in subscriber.poses])
        fed = [at for at, text in manager.heard if "WATCHDOG=1" in text]
        print(f"{len(heard)} poses heard, {len(rows)} written, largest gap {gap:.3f} s; watchdog fed {len(fed)} times, "
              f"largest gap {largest_gap(fed):.2f} s")
        assert heard == sorted(rows) and len(heard) > 150, "a pose is missing"
        assert gap < BLOCK_S / 2, "the disk held poses up"
        assert largest_gap(fed + [end]) < BLOCK_S and len(fed) > 6, "a slow disk or silent motion stops the watchdog"
        states = [text for _, text in manager.heard if text.startswith("STATUS=")]
        print(" | ".join(states))
        assert any("silent: motion" in text for text in states), states
        assert "outputs: " not in done.stderr + done.stdout


if __name__ == "__main__":
    sys.exit(main())
