#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""memory.py [SECONDS]: resident memory of the daemon with all of it locked, after so many seconds (default 3) of a run: the
landmark EKF within 64 MB, edge localization on the corridor's map (4676x1372, WM_DATA_DIR/corridor-a) within 128 MB; and the
program's own code, without symbols, within 3 MB. What isn't there is said and left out. Skipped (77) where memory may not be
locked."""
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(os.environ.get("WM_SOURCE_DIR", ".")).resolve()
WAYMARK = pathlib.Path(os.environ.get("WM_BIN_DIR", ROOT / "build/bin")) / "waymark"
DATA = pathlib.Path(os.environ.get("WM_DATA_DIR", "nowhere"))
SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 3
MB = 1000 * 1000


def status(pid):
    text = pathlib.Path(f"/proc/{pid}/status").read_text()
    return {name: int(kib) * 1024 for name, kib in re.findall(r"(Vm\w+):\s+(\d+) kB", text)}


def measure(name, config, recording, work, limit):
    run = subprocess.Popen([WAYMARK, "run", "--config", config, "--recording", recording, "--out", work / name,
                            "--duration", "600"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                           preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_STACK, (2 << 20, 2 << 20)))  # LimitSTACK=2M
    try:
        # Locked once everything is loaded, at the start of the threads.
        begin = time.monotonic()
        is_ = status(run.pid)
        while run.poll() is None and is_["VmLck"] < 0.9 * is_["VmRSS"] and time.monotonic() - begin < 100:
            time.sleep(0.1)
            is_ = status(run.pid)
        time.sleep(SECONDS)
        assert run.poll() is None, f"{name}: it ended early: {run.stderr.read()}"
        is_ = status(run.pid)
    finally:
        run.terminate()
        run.communicate(timeout=60)
    print(f"{name}: resident {is_['VmHWM'] / MB:.1f} MB at most, locked {is_['VmLck'] / MB:.1f} MB (limit {limit / MB:.0f} MB)")
    assert is_["VmLck"] >= 0.9 * is_["VmRSS"], "memory is not locked"
    assert is_["VmHWM"] <= limit, f"{name}: too much"


def landmarks(work):
    """A robot that drives straight past three landmarks."""
    rec = work / "rec"
    rec.mkdir()
    (rec / "recording.yaml").write_text("format: waymark-recording/1\nname: past\nduration_s: 600\nstreams: [motion.csv, sightings.csv]\n"
                                        "vehicle: {initial_pose: {t_ns: 0, x_m: 0, y_m: 0, heading_rad: 0}}\n")
    (rec / "calibration.yaml").write_text("sensors: {eye: {mounting: {xyz_m: [0, 0, 0], rpy_deg: [0, 0, 0]}, bearing_sigma_rad: 0.01, range_sigma_m: 0.05}}\n")
    (rec / "landmarks.csv").write_text("id,x_m,y_m,z_m,sigma_m\n1,5,1,0,0.01\n2,5,-3,0,0.01\n3,9,2,0,0.01\n")
    (rec / "motion.csv").write_text("t_ns,v_mps,w_radps\n" + "".join(f"{i * 20_000_000},0,0\n" for i in range(30000)))
    (rec / "sightings.csv").write_text("t_ns,sensor,id,bearing_rad,range_m\n" + "".join(
        f"{i * 100_000_000},eye,1,0.1974,5.0990\n" for i in range(6000)))
    (work / "landmarks.yaml").write_text("format: waymark-config/1\nestimator: landmark_ekf\npublish: {lcm: false}\n"
                                         "sightings: {states: {sensor_yaw_sigma_rad: 0.05}}\n")
    return work / "landmarks.yaml", rec


def main():
    if os.geteuid() != 0 and resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] < 128 * MB:
        print("skipped: no right to lock memory")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        stripped = work / "waymark"
        subprocess.run(["strip", "-o", stripped, WAYMARK], check=True)
        print(f"the program without symbols: {stripped.stat().st_size / MB:.2f} MB")
        assert stripped.stat().st_size <= 3 * MB
        measure("landmark_ekf", *landmarks(work), work, 64 * MB)
        if (DATA / "corridor-a").exists():
            measure("edge_mcl", ROOT / "config/datasets/corridor.yaml", DATA / "corridor-a", work, 128 * MB)
        else:
            print("edge_mcl: no corridor-a in WM_DATA_DIR: not measured")
    return 0


if __name__ == "__main__":
    sys.exit(main())
