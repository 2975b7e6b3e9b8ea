#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The estimator's thread makes no system call but its sleep: strace watches a run. The thread is the one that asks for
its page faults (getrusage) before and after its loop; between the two there must be sleeps alone. Skipped (77) where
strace is missing or may not watch."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from judged import BIN, drive_straight


def main():
    if not shutil.which("strace"):
        print("skipped: there is no strace")
        return 77
    if "WM_FEWER" in os.environ:
        print("skipped: what strace sees of an emulator are its own calls")
        return 77
    work = pathlib.Path(tempfile.mkdtemp(prefix="waymark-strace-"))
    try:
        recording = drive_straight(work / "rec", 2, 50)
        (work / "config.yaml").write_text(
            "format: waymark-config/1\nestimator: odometry\npublish: {lcm: false}\nrealtime: {lock_memory: false}\n")
        trace = work / "trace"
        done = subprocess.run(["strace", "-f", "-o", trace, BIN / "waymark", "run", "--config", work / "config.yaml",
                               "--recording", recording, "--out", work / "out"], capture_output=True, text=True)
        if not trace.exists() or "getrusage" not in trace.read_text():
            print(f"skipped: strace may not watch here\n{done.stderr}")
            return 77
        calls = {}
        for line in trace.read_text().splitlines():
            match = re.match(r"(\d+) +(\w+)\(", line)
            if match:
                calls.setdefault(match.group(1), []).append(match.group(2))
        estimator = [names for names in calls.values() if names.count("getrusage") >= 2]
        assert len(estimator) == 1, f"{len(estimator)} threads ask for their page faults"
        names = estimator[0]
        first, last = names.index("getrusage"), len(names) - 1 - names[::-1].index("getrusage")
        loop = names[first + 1:last]
        others = sorted(set(loop) - {"clock_nanosleep", "restart_syscall"})
        print(f"{loop.count('clock_nanosleep')} sleeps in the loop, other calls: {others}")
        assert loop.count("clock_nanosleep") > 100 and not others
        return 0
    finally:
        shutil.rmtree(work)


if __name__ == "__main__":
    sys.exit(main())
