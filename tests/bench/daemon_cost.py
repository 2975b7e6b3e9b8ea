#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""daemon_cost.py PROGRAM...: what the daemon costs, of one or more builds, a row a figure: bytes without symbols, shared libraries
(directly and in all), resident memory, threads and open files after 20 s, system calls of the whole run and their kinds. The run: a drive
of 30 s among four landmarks in real time, poses at 50 Hz over LCM, in a network of its own with nothing but a loopback. Needs root and strace."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/golden"))
import lcm_tools  # noqa: E402

CONFIG = "format: waymark-config/1\nestimator: landmark_ekf\npublish: {rate_hz: 50, lcm_url: '%s'}\nrealtime: {lock_memory: false}\n"
SECONDS = 20


def output(*command):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True).stdout


def of_the_file(program, work):
    output("strip", "-o", work / "stripped", program)
    return {"bytes, stripped": (work / "stripped").stat().st_size,
            "libraries, directly": len(re.findall("NEEDED", output("readelf", "-d", program))),
            "libraries, in all": len(output("ldd", program).splitlines())}


def of_a_run(command):
    run = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    time.sleep(SECONDS)
    if run.poll() is not None:
        sys.exit(f"{command[0]} ended early: {run.stderr.read()}")
    process = pathlib.Path(f"/proc/{run.pid}")
    status = dict(re.findall(r"(\w+):\s+(\d+)", (process / "status").read_text()))
    figures = {"resident, kB": int(status["VmRSS"]), "threads": int(status["Threads"]), "open files": len(list((process / "fd").iterdir()))}
    run.communicate(timeout=60)
    return figures


def of_the_kernel(command, work):
    """System calls, counted by strace."""
    output("strace", "-f", "-c", "-U", "calls,name", "-o", work / "calls", *command)
    counts = {name: int(count) for count, name in re.findall(r"^\s*(\d+)\s+(\w+)$", (work / "calls").read_text(), re.M) if name != "total"}
    return {"system calls": sum(counts.values()), "kinds of system calls": len(counts)}, set(counts)


def measured(program):
    with tempfile.TemporaryDirectory(prefix="waymark-cost-") as name:
        work = pathlib.Path(name)
        lcm_tools.write_recording(work / "drive", 30)
        (work / "robot.yaml").write_text(CONFIG % lcm_tools.URL)
        command = [str(program), "run", "--config", str(work / "robot.yaml"), "--recording", str(work / "drive"), "--out"]
        calls, kinds = of_the_kernel([*command, str(work / "traced")], work)
        return {**of_the_file(program, work), **of_a_run([*command, str(work / "run")]), **calls}, kinds


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if os.environ.get("WM_OWN_NETWORK") != "1":
        sys.exit(subprocess.run(["unshare", "-n", sys.executable, *sys.argv], env={**os.environ, "WM_OWN_NETWORK": "1"}, check=False).returncode)
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    subprocess.run(lcm_tools.ROUTE, check=True)
    rows, kinds = zip(*(measured(pathlib.Path(program).resolve()) for program in sys.argv[1:]))
    for figure in rows[0]:
        print(f"{figure:24}" + "".join(f"{row[figure]:>14,}" for row in rows))
    for later in kinds[1:]:
        print("calls that the first does not make:", ", ".join(sorted(later - kinds[0])) or "none")


if __name__ == "__main__":
    main()
