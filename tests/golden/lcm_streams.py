#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A robot without CAN: another process publishes its twist and its gyro by the code of docs/motion-sources.md. Needs what
lcm_tools.py needs.

The robot drives sideways on a circle. Its wheels' turn rate is wrong by a fifth, its gyro is right; the gyro's process has a
clock of its own. Checked: the pose, health, the log's replay with the same bits, the recording's replay, and its live play.
Then another one with counts of its wheels, a compass and positions, for landmark_ekf; and a vehicle in space with an IMU, whose
velocity comes over LCM, and by a Doppler log over TCP.
"""
import json
import math
import re
import signal
import socket
import subprocess
import sys
import threading
import time

import lcm_tools
from judged import rows, run as program
from lcm_tools import in_a_network

V, VY, W = 0.4, 0.2, 0.3
SENDERS_CLOCK_NS = -10**15  # the gyro's computer started later
SECONDS = 4
TWIST = (
    "initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\ncalibration: calibration.yaml\n"
    "devices: {lcm: [{stream: motion}, {stream: imu, clock: sender, channel: GYRO}]}\n")


def publish():
    """Drives for SECONDS, by the publisher of the documentation."""
    text = (lcm_tools.ROOT / "docs/motion-sources.md").read_text()
    code = re.search(r"```python\n(.*?)```", text, re.S)[1]
    names = {}
    exec(code.replace("WAYMARK_IMU", "WAYMARK_GYRO"), names)
    here = time.clock_gettime_ns

    class senders_time:
        CLOCK_MONOTONIC = time.CLOCK_MONOTONIC
        clock_gettime_ns = staticmethod(lambda clock: here(clock) + 2 * abs(SENDERS_CLOCK_NS))

    begin = time.monotonic()
    k = 0
    while time.monotonic() < begin + SECONDS:
        names["time"] = senders_time
        names["publish_imu"]([0, 0, -W], [0, 0, -9.8])  # upside down
        names["time"] = time
        if k % 2 == 0:
            names["publish_motion"](V, VY, 0.8 * W)
        k += 1
        time.sleep(max(0, begin + k * 0.01 - time.monotonic()))


WHEELS = (
    "calibration: calibration.yaml\nlandmarks: landmarks.csv\ndevices: {lcm: [{stream: ticks}, {stream: heading}, {stream: gnss}], sightings: lcm}\n")


def publish_wheels():
    """Straight on, from (10, 5) to the north at 0.5 m/s, with wheels of 0.1 m and 1000 ticks a turn."""
    import lcm
    import waymark

    node = lcm.LCM(lcm_tools.URL)
    begin = time.monotonic()
    for k in range(SECONDS * 50):
        now_ns = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
        way_m = 0.5 * (now_ns * 1e-9 - begin)
        for kind, numbers in ((waymark.ticks_t, {"left": way_m / (0.2 * math.pi) * 1000, "right": way_m / (0.2 * math.pi) * 1000}),
                              (waymark.heading_t, {"heading_rad": math.pi / 2, "sigma_rad": 0.01}),
                              (waymark.gnss_t, {"position_m": [10, 5 + way_m, float("nan")], "sigma_xy_m": 0.1})):
            if kind is not waymark.ticks_t and k % 10:
                continue
            message = kind()
            message.t_ns = now_ns
            for name, value in numbers.items():
                setattr(message, name, value)
            node.publish("WAYMARK_" + kind.__name__[:-2].upper(), message.encode())
        if k % 10 == 0:  # a landmark straight ahead, by a sender that leaves elevations 0
            seen = waymark.observations_t()
            seen.t_ns, seen.count, seen.sensor = now_ns, 1, b"eye".ljust(32, b"\0")
            seen.landmark_id[0], seen.bearing_rad[0], seen.range_m[0] = 1, 0, math.nan
            node.publish("WAYMARK_SIGHTINGS", seen.encode())
        time.sleep(max(0, begin + (k + 1) * 0.02 - time.monotonic()))


def check_wheels(work):
    (work / "calibration.yaml").write_text("wheels: {radius_m: 0.1, ticks_per_turn: 1000, track_m: 0.5}\n"
                                           "sensors: {eye: {mounting: {xyz_m: [0, 0, 0], rpy_deg: [0, 0, 0]}, bearing_sigma_rad: 0.01}}\n")
    (work / "landmarks.csv").write_text("id,x_m,y_m,z_m,sigma_m\n1,10,105,0,0.01\n")
    lcm_tools.config(work / "wheels.yaml", "landmark_ekf", WHEELS)
    run = start(work, "wheels")
    subprocess.run([sys.executable, __file__, "publish_wheels"], env={"PYTHONPATH": str(work / "types")}, check=True)
    stop(run, 0.5)
    replay_both(work, "wheels")
    for what in ("wheels", "wheels-replayed"):
        row = rows(work / what / "trajectory.csv")[-1]
        off = [abs(float(row["x_m"]) - 10), abs(float(row["y_m"]) - 5 - 0.5 * SECONDS)]
        print(what, row["x_m"], row["y_m"], math.degrees(heading_of(row)))
        assert off[0] < 0.1 and off[1] < 0.1 and abs(heading_of(row) - math.pi / 2) < 0.02, row
    seen = json.loads((work / "wheels-replayed/health.json").read_text())["sources"]["sightings:eye"]
    # How many come before the pose is found depends on the computer's load.
    taken = seen["fused"] + seen["rejected"].get("searching", 0)
    assert taken >= SECONDS * 4 and seen["fused"] >= SECONDS * 2 and seen["malformed"] == 0, seen
    for name in ("ticks", "heading", "gnss", "sightings"):
        assert len(rows(work / f"wheels-rec/{name}.csv")) >= SECONDS * 4, name


ROLL = 0.05
SPACE = (
    "initial_pose: {x_m: 0, y_m: 0, z_m: -3, heading_rad: 0, sigma_heading_rad: 0.1}\ncalibration: calibration.yaml\n"
    "stereo_ekf: {states: {accelerometer_bias_sigma_mps2: 0.01}}\n"
    "devices: {lcm: [{stream: motion6}, {stream: imu}, {stream: depth}]}\n")


def publish_space():
    """A vehicle under water that turns and heels: a velocity log without gyros ten times a second, an IMU, a depth."""
    import lcm
    import waymark

    node = lcm.LCM(lcm_tools.URL)
    begin = time.monotonic()
    for k in range(SECONDS * 100):
        noise = 1e-5 if k % 2 else -1e-5
        rates = [noise, W * math.sin(ROLL) + noise, W * math.cos(ROLL) + noise]
        force = [0, 9.80665 * math.sin(ROLL), 9.80665 * math.cos(ROLL)]
        imu = waymark.imu_t()
        imu.t_ns = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
        imu.w_radps, imu.a_mps2, imu.temperature_c = rates, force, math.nan
        node.publish("WAYMARK_IMU", imu.encode())
        if k % 10 == 0:
            log, depth = waymark.motion6_t(), waymark.depth_t()
            log.t_ns = depth.t_ns = imu.t_ns
            depth.depth_m, depth.sigma_m = 3, 0.05
            node.publish("WAYMARK_MOTION6", log.encode())
            node.publish("WAYMARK_DEPTH", depth.encode())
        time.sleep(max(0, begin + (k + 1) * 0.01 - time.monotonic()))


def check_space(work):
    (work / "calibration.yaml").write_text("{}\n")
    lcm_tools.config(work / "space.yaml", "stereo_ekf", SPACE)
    run = start(work, "space")
    subprocess.run([sys.executable, __file__, "publish_space"], env={"PYTHONPATH": str(work / "types")}, check=True)
    stop(run, 0.5)
    replay_both(work, "space")
    for what in ("space", "space-replayed"):
        trajectory = rows(work / what / "trajectory.csv")
        row, seconds = trajectory[-1], (int(trajectory[-1]["t_ns"]) - int(trajectory[0]["t_ns"])) * 1e-9
        x, y, z, w = (float(row[name]) for name in ("qx", "qy", "qz", "qw"))
        roll, yaw = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        print(f"{what}: roll {roll:.4f} rad, {yaw:.3f} rad turned in {seconds:.2f} s, depth {-float(row['z_m']):.2f} m")
        assert abs(roll - ROLL) < 0.015 and abs(yaw - W * seconds) < 0.05 and abs(float(row["z_m"]) + 3) < 0.1, row
    assert len(rows(work / "space-rec/imu.csv")) > SECONDS * 80


SPEED = 0.4
ARM = (0.5, 0.1, -0.2)  # of the log in base_link; it looks to the left
LOG = (
    "initial_pose: {x_m: 0, y_m: 0, z_m: -3, heading_rad: 0, sigma_heading_rad: 0.1}\ncalibration: calibration.yaml\n"
    "devices: {dvl: {host: 127.0.0.1, port: %d}, lcm: [{stream: imu}, {stream: depth}]}\n")


def speak_as_log(server, ended):
    """The server of a log: ten reports a second, each twice, of the echo 0.1 s before, by a clock of its own. After 2 s it loses the
    bottom for 0.3 s, and then the connection, within a line."""
    w = (0, W * math.sin(ROLL), W * math.cos(ROLL))
    at_log = [SPEED + w[1] * ARM[2] - w[2] * ARM[1], w[2] * ARM[0] - w[0] * ARM[2], w[0] * ARM[1] - w[1] * ARM[0]]
    own = {"vx": at_log[1], "vy": at_log[0], "vz": -at_log[2]}  # turned by 90 degrees; y to the right, z down
    client, _ = server.accept()
    begin, k = time.monotonic(), 0
    while not ended.is_set():
        now_us = 1_000_000 * 86400 + int(1e6 * time.monotonic())
        is_lost = 20 <= k < 23
        report = {"time": 100.0, **(own if not is_lost else {"vx": 3.0, "vy": 0.0, "vz": 0.0}), "fom": 0.002 if not is_lost else 0.0002,
                  "covariance": [[4e-6, 0, 0], [0, 4e-6, 0], [0, 0, 4e-6]], "altitude": 1.5, "transducers": [], "velocity_valid": not is_lost,
                  "status": 0, "format": "json_v3.1", "type": "velocity", "time_of_validity": now_us - 100_000, "time_of_transmission": now_us}
        place = {"ts": 1.0, "x": 0, "y": 0, "z": 0, "std": 0.1, "roll": 0, "pitch": 0, "yaw": 0, "type": "position_local", "status": 0}
        try:
            client.sendall("".join(json.dumps(line) + "\r\n" for line in (report, report, place)).encode())
            if k == 25:
                client.sendall(json.dumps(report)[:100].encode())
                client.close()
                client, _ = server.accept()
        except OSError:  # the run has ended
            break
        k += 1
        time.sleep(max(0, begin + k * 0.1 - time.monotonic()))
    client.close()


def check_log(work):
    (work / "calibration.yaml").write_text(f"motion6: {{mounting: {{xyz_m: {list(ARM)}, rpy_deg: [0, 0, 90]}}}}\n")
    ended = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as server:
        lcm_tools.config(work / "log.yaml", "stereo_ekf", LOG % server.getsockname()[1])
        voice = threading.Thread(target=speak_as_log, args=(server, ended), daemon=True)
        voice.start()
        run = start(work, "log")
        subprocess.run([sys.executable, __file__, "publish_space"], env={"PYTHONPATH": str(work / "types")}, check=True)
        _, err = stop(run, 0.1)
        ended.set()
        voice.join(5)
    replay_both(work, "log")
    source = json.loads((work / "log/health.json").read_text())["sources"]["motion6"]
    print(source)
    assert source["malformed"] == 1 and source["ignored"] >= 2 * source["received"] and source["rejected"] == {}, source
    assert "no velocity log answers" in err and "without bottom lock" in err, err
    for what in ("log", "log-replayed"):
        trajectory = [(heading_of(row), float(row["x_m"]), float(row["y_m"])) for row in rows(work / what / "trajectory.csv")]
        turned = trajectory[-1][0]
        on_circle = [row for row in trajectory if 0.1 < row[0] < 0.9 * turned]  # before and behind, no IMU speaks
        (h, *begin), (end_h, *end) = on_circle[0], on_circle[-1]
        right = [begin[0] + SPEED / W * (math.sin(end_h) - math.sin(h)), begin[1] - SPEED / W * (math.cos(end_h) - math.cos(h))]
        print(f"{what}: {turned:.3f} rad turned, {math.dist(end, right):.3f} m beside the circle")
        assert turned > 0.5 * W * SECONDS and math.dist(end, right) < 0.08, (end, right)
    recorded = rows(work / "log-rec/motion6.csv")
    assert recorded[0]["wx_radps"] == "" and float(recorded[0]["sigma_v_mps"]) == 0.002, recorded[0]


def start(work, name):
    """A run on the devices, which also records them, until stop()."""
    run = subprocess.Popen([lcm_tools.WAYMARK, "run", "--config", work / f"{name}.yaml", "--out", work / name, "--record",
                            work / f"{name}-rec"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 5
    while not list((work / f"{name}-rec").glob("*.csv")) and time.monotonic() < until:  # the recorder is a process of its own
        time.sleep(0.05)
    time.sleep(0.7)
    return run


def stop(run, after_s):
    """Ends the run so long after the last message; what it said."""
    time.sleep(after_s)
    run.send_signal(signal.SIGINT)
    return lcm_tools.finish(run)


def replay_both(work, name):
    """The log gives the same bits; and the recording is replayed."""
    program("waymark", "replay", work / name / "events.wmlog", "--out", work / f"{name}-again")
    assert (work / f"{name}-again/trajectory.csv").read_bytes() == (work / name / "trajectory.csv").read_bytes()
    program("waymark", "replay", work / f"{name}-rec", "--config", work / f"{name}-rec/config.yaml", "--out", work / f"{name}-replayed")


def heading_of(row):
    return 2 * math.atan2(float(row["qz"]), float(row["qw"]))


def check_pose(trajectory, what):
    """On the arc that begins at the first row, by the gyro's rate."""
    first, last = trajectory[0], trajectory[-1]
    turned = W * (int(last["t_ns"]) - int(first["t_ns"])) * 1e-9
    h0 = heading_of(first)
    heading = h0 + turned
    s, c = math.sin(heading) - math.sin(h0), math.cos(heading) - math.cos(h0)
    expected = [(V * s + VY * c) / W, (-V * c + VY * s) / W]
    off = math.dist([float(last[k]) - float(first[k]) for k in ("x_m", "y_m")], expected)
    off_deg = math.degrees(abs(math.remainder(heading_of(last) - heading, 2 * math.pi)))
    print(f"{what}: {len(trajectory)} rows, {turned:.2f} rad turned, off by {off * 1e3:.1f} mm and {off_deg:.3f} deg")
    assert turned > 0.5 * W * SECONDS and off < 0.02 and off_deg < 0.2


def check_twist(work):
    lcm_tools.config(work / "twist.yaml", "odometry", TWIST)
    (work / "calibration.yaml").write_text("imu: {mounting: {rpy_deg: [180, 0, 30]}}\n")
    run = start(work, "twist")
    subprocess.run([sys.executable, __file__, "publish"], env={"PYTHONPATH": str(work / "types")}, check=True)
    out, err = stop(run, 3)  # silent for longer than 2 s
    assert "no usable motion_t on WAYMARK_MOTION yet" in err, err
    assert "imu_t comes on WAYMARK_GYRO" in err and "no usable imu_t on WAYMARK_GYRO any more" in err, err
    check_pose(rows(work / "twist/trajectory.csv"), "run")
    sources = json.loads((work / "twist/health.json").read_text())["sources"]
    assert sources["motion"]["fused"] == sources["motion"]["received"] >= SECONDS * 40, sources
    assert sources["imu"]["stamp_uncertainty_ms"] > 2 and sources["imu"]["device"] == "stalled", sources
    replay_both(work, "twist")
    check_pose(rows(work / "twist-replayed/trajectory.csv"), "recording")
    recording = work / "twist-rec"
    program("waymark", "run", "--recording", recording, "--config", recording / "config.yaml", "--out", work / "played", "--speed", "4")
    check_pose(rows(work / "played/trajectory.csv"), "played")
    assert "\ngood" in program("waymark", "check", recording / "config.yaml", recording, "--quick")


def main():
    if len(sys.argv) > 1:
        return {"publish": publish, "publish_wheels": publish_wheels, "publish_space": publish_space}[sys.argv[1]]()
    lcm_tools.own_network()
    with in_a_network.work_folder("streams") as work:
        lcm_tools.python_types(work)
        check_twist(work)
        check_wheels(work)
        check_space(work)
        check_log(work)


if __name__ == "__main__":
    sys.exit(main())
