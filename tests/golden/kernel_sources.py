#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A robot without CAN: its speed over LCM, its gyro by Linux IIO, positions and course by gpsd. Needs what lcm_tools.py needs, and
gpsd (Debian: gpsd); without them, or without the right to name spaces, it is skipped (exit code 77).

In a network and a file tree of its own: a folder stands for sysfs, a FIFO for the IMU's device, and a pseudo-terminal for the receiver
of a real gpsd. The receiver gets corrections on the way (a fix without them, then RTK). Checked: the pose, the notes, health, doctor, the
log's replay with the same bits, the recording's replay; both devices are unplugged.
"""
import json
import math
import os
import pathlib
import pty
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
import tty

import lcm_tools
from lcm_streams import heading_of, replay_both, rows, start
from lcm_tools import in_a_network

SECONDS = 6
SPEED = 0.5
ORIGIN = (48.0, 11.0, 500.0)
METRES_PER_DEGREE = 111199.2  # of latitude at 48 degrees
PORT = 2999
GPSD_PATH = os.environ["PATH"] + ":/usr/sbin"
SYS = pathlib.Path("/sys/bus/iio/devices")
CONFIG = (
    "calibration: calibration.yaml\n"
    "devices:\n  lcm: [{stream: motion}]\n  iio: {device: bmi160, rate_hz: 100}\n"
    f"  gpsd: [{{port: {PORT}}}, {{port: {PORT}, take: course, course_min_mps: 0.3}}]\n")


def nmea(text):
    check = 0
    for letter in text:
        check ^= ord(letter)
    return f"${text}*{check:02X}\r\n"


def degrees(value, width):
    return f"{int(value):0{width}d}{(value - int(value)) * 60:011.8f}"


def feed_receiver():
    """A gpsd, and its receiver: northwards from the origin at 5 Hz; with corrections after two seconds."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.fchmod(slave, 0o666)  # gpsd drops root's rights
    gpsd = subprocess.Popen([shutil.which("gpsd", path=GPSD_PATH), "-N", "-n", "-b", "-s", "115200", "-S", str(PORT), os.ttyname(slave)])
    begin = time.monotonic()
    for i in range(SECONDS * 5):
        at = i * 0.2
        latitude = degrees(ORIGIN[0] + SPEED * at / METRES_PER_DEGREE, 2)
        hms, is_rtk = f"1200{at:05.2f}", at >= 2
        sigma = 0.02 if is_rtk else 0.8
        for text in (f"GPRMC,{hms},A,{latitude},N,{degrees(ORIGIN[1], 3)},E,{SPEED / 0.514444:.3f},0.0,231126,,,A",
                     f"GPGGA,{hms},{latitude},N,{degrees(ORIGIN[1], 3)},E,{4 if is_rtk else 1},12,0.7,453.0,M,47.0,M,,",
                     f"GPGST,{hms},1,,,,{sigma},{sigma},{2 * sigma}"):
            os.write(master, nmea(text).encode())
        time.sleep(max(0, begin + at + 0.2 - time.monotonic()))
    gpsd.terminate()
    gpsd.wait(timeout=10)
    os.close(master)
    os.close(slave)


def make_imu():
    """As bmi160 has it in sysfs, upside down by its device tree."""
    device = SYS / "iio:device0"
    for folder in ("scan_elements", "buffer", "trigger"):
        (device / folder).mkdir(parents=True)
    (SYS / "trigger0").mkdir()
    (SYS / "trigger0/name").write_text("bmi160-dev0\n")
    elements = [f"{kind}_{axis}" for kind in ("accel", "anglvel") for axis in "xyz"] + ["timestamp"]
    for index, name in enumerate(elements):
        for what, text in (("en", "0"), ("index", index), ("type", "le:s64/64>>0" if name == "timestamp" else "le:s16/16>>0")):
            (device / f"scan_elements/in_{name}_{what}").write_text(f"{text}\n")
    for name, text in {"name": "bmi160", "in_anglvel_scale": "0.001", "in_accel_scale": "0.01", "trigger/current_trigger": "",
                       "in_mount_matrix": "1, 0, 0; 0, -1, 0; 0, 0, -1", "in_anglvel_sampling_frequency": "50",
                       "current_timestamp_clock": "realtime", "buffer/enable": "0", "buffer/length": "2"}.items():
        (device / name).write_text(f"{text}\n")
    os.mkfifo("/dev/iio:device0")


def feed_imu(stop):
    fifo = os.open("/dev/iio:device0", os.O_RDWR)  # no reader yet, or none any more: no broken pipe
    k = 0
    begin = time.monotonic()
    while not stop.is_set():
        os.write(fifo, struct.pack("<6h4xq", 0, 0, -981, 0, 0, 0, time.clock_gettime_ns(time.CLOCK_MONOTONIC)))
        k += 1
        time.sleep(max(0, begin + k * 0.01 - time.monotonic()))
    os.close(fifo)


def feed_motion(stop):
    import lcm
    import waymark as messages

    node = lcm.LCM(lcm_tools.URL)
    while not stop.is_set():
        message = messages.motion_t()
        message.t_ns = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
        message.v_mps, message.vy_mps, message.w_radps = SPEED, float("nan"), 0.0
        node.publish("WAYMARK_MOTION", message.encode())
        time.sleep(0.02)


def check_doctor(work):
    findings = json.loads(subprocess.run([lcm_tools.WAYMARK, "doctor", work / "robot.yaml", "--json", "--seconds", "0.1"],
                                     capture_output=True, text=True).stdout)["findings"]
    found = {f["about"]: f for f in findings}
    assert found["imu"]["severity"] == "note" and "not set up yet" in found["imu"]["text"], found["imu"]
    assert found["gnss"]["severity"] == "bad" and "no gpsd answers" in found["gnss"]["text"], found["gnss"]


def check_drive(work):
    run = start(work, "robot")
    stop = threading.Event()
    feeds = [threading.Thread(target=feed, args=[stop]) for feed in (feed_imu, feed_motion)]
    for feed in feeds:
        feed.start()
    feed_receiver()
    shutil.rmtree(SYS / "iio:device0")
    stop.set()
    for feed in feeds:
        feed.join()
    time.sleep(1)
    run.send_signal(signal.SIGTERM)
    out, err = lcm_tools.finish(run)
    for note in ("gnss: gpsd at localhost:2999: fix", "gnss: gpsd at localhost:2999: RTK fixed", "gnss: no gpsd answers at localhost:2999",
                 "imu: iio:device0 (bmi160) is open", "imu: iio:device0: its buffer has ended", "heading: gpsd at localhost:2999"):
        assert note in err, f"{note}\n{err}"
    sources = json.loads((work / "robot/health.json").read_text())["sources"]
    print({name: (s["received"], s["fused"], s["device"]) for name, s in sources.items()})
    assert sources["gnss"]["fused"] >= SECONDS * 3 and sources["heading"]["fused"] >= SECONDS * 3, sources
    assert sources["imu"]["received"] >= SECONDS * 70 and sources["imu"]["device"] == "absent", sources


def check_pose(work, what):
    """At the last position, the robot is where the receiver is, and drives north."""
    last_ns = int(rows(work / "robot-rec/gnss.csv")[-1]["t_ns"])
    trajectory = rows(work / what / "trajectory.csv")
    begin_ns = int(trajectory[0]["t_ns"])
    # The log's stamps count from the run's start, the recording's are those of the monotonic clock.
    at = min(trajectory, key=lambda row: abs(int(row["t_ns"]) - last_ns)) if begin_ns > 10**15 or what != "robot" else trajectory[-1]
    north = float(rows(work / "robot-rec/gnss.csv")[-1]["y_m"])
    print(what, at["x_m"], at["y_m"], north, math.degrees(heading_of(at)))
    assert abs(float(at["x_m"])) < 0.1 and abs(heading_of(at) - math.pi / 2) < 0.05, at
    assert what == "robot" or abs(float(at["y_m"]) - north) < 0.1, (at, north)


def check_record(work):
    positions, samples = rows(work / "robot-rec/gnss.csv"), rows(work / "robot-rec/imu.csv")
    assert len(positions) >= SECONDS * 4 and len(samples) >= SECONDS * 70, (len(positions), len(samples))
    assert abs(float(positions[-1]["y_m"]) - SPEED * (SECONDS - 0.2)) < 0.05, positions[-1]
    assert abs(float(positions[-1]["sigma_xy_m"]) - 0.02) < 1e-6 and float(positions[2]["sigma_xy_m"]) > 0.5
    assert abs(float(samples[50]["az_mps2"]) - 9.81) < 1e-9, samples[50]
    replay_both(work, "robot")


def own_devices(work):
    """An empty sysfs, and a /dev with what programs need."""
    dev = work / "dev"
    dev.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "none", "/sys"], check=True)
    subprocess.run(["mount", "-t", "tmpfs", "none", dev], check=True)
    for name in ("null", "zero", "full", "random", "urandom", "tty"):
        (dev / name).touch()
        subprocess.run(["mount", "--bind", f"/dev/{name}", dev / name], check=True)
    for name in ("pts", "shm"):
        (dev / name).mkdir()
        subprocess.run(["mount", "--rbind", f"/dev/{name}", dev / name], check=True)
    (dev / "ptmx").symlink_to("pts/ptmx")
    subprocess.run(["mount", "--move", dev, "/dev"], check=True)
    SYS.mkdir(parents=True)


def main():
    if not shutil.which("gpsd", path=GPSD_PATH):
        in_a_network.skip("gpsd is missing (Debian: gpsd)")
    lcm_tools.own_network(mounts=True)
    with in_a_network.work_folder("kernel") as work:
        own_devices(work)
        lcm_tools.python_types(work)
        lcm_tools.config(work / "robot.yaml", "landmark_ekf", CONFIG)
        (work / "calibration.yaml").write_text("gnss: {origin: [%g, %g, %g]}\nimu: {mounting: {rpy_deg: [0, 0, 30]}}\n" % ORIGIN)
        make_imu()
        check_doctor(work)
        check_drive(work)
        check_record(work)
        for what in ("robot", "robot-replayed"):
            check_pose(work, what)


if __name__ == "__main__":
    sys.exit(main())
