#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""waymark-ros2 before participants of Fast DDS (Debian's) and of Cyclone DDS (its Python binding), as ROS 2 names topics and types.

    test_ros2.py BIN_DIR FASTDDS_PROBE [--seconds 12] [--age-ms 5]

In a network of its own: a run with the bridge; each listener receives all topics, and each message is compared field by field
with LCM's. No pose is lost, odom does not jump, /tf agrees with the pose, /initialpose reaches the filter; /odom, /imu/data,
/fix and /vo reach a run on devices. Wrong starts have clear errors. Ages are printed; --age-ms makes them a condition, for a quiet
computer."""

import argparse
import json
import math
import os
import pathlib
import pickle
import signal
import struct
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "golden"), str(HERE.parent / "common")]
import in_a_network  # noqa: E402

DOMAIN = "42"
OUT = {"/tf": ("tf2_msgs/msg/TFMessage", "stream"), "/waymark/pose": ("geometry_msgs/msg/PoseWithCovarianceStamped", "latched"),
       "/waymark/odom": ("nav_msgs/msg/Odometry", "stream"), "/diagnostics": ("diagnostic_msgs/msg/DiagnosticArray", "stream")}
IN = {"/initialpose": "geometry_msgs/msg/PoseWithCovarianceStamped", "/odom": "nav_msgs/msg/Odometry", "/imu/data": "sensor_msgs/msg/Imu",
      "/fix": "sensor_msgs/msg/NavSatFix", "/vo": "nav_msgs/msg/Odometry"}
TOLERANCE = 1e-12  # of a number that went through other formulas than the judge's


def dds_name(kind):
    package, _, name = kind.split("/")
    return f"{package}::msg::dds_::{name}_"


def listeners(work, probe, url):
    """Starts both; their processes, ready."""
    fast, cyclone = [], []
    for topic, (kind, quality) in OUT.items():
        fast += [topic, dds_name(kind), quality]
        cyclone += [topic, kind, quality]
    started = [subprocess.Popen([probe, "listen", DOMAIN, work / "fast", url, "WAYMARK_POSE", *fast], stdin=subprocess.PIPE,
                                stdout=subprocess.PIPE, text=True),
               subprocess.Popen([sys.executable, HERE / "cyclone_probe.py", "listen", DOMAIN, work / "cyclone", *cyclone],
                                stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)]
    for process in started:
        assert process.stdout.readline() == "ready\n"
    return started


def fast_messages(path):
    """[(arrival, topic, message as dict)] of Fast DDS by rosbags, and [(arrival, bytes)] of LCM."""
    data, at, out, poses, topics = path.read_bytes(), 0, [], [], list(OUT)
    while at < len(data):
        arrival_ns, index, length = struct.unpack_from("=qII", data, at)
        at += 16 + length
        raw = data[at - length:at]
        if index == 0:
            poses.append((arrival_ns, raw))
            continue
        topic = topics[index - 1]
        out.append((arrival_ns, topic, cyclone_probe.plain(cyclone_probe.STORE.deserialize_cdr(raw, OUT[topic][0]))))
    return out, poses


def cyclone_messages(path):
    out = []
    with path.open("rb") as file:
        while True:
            try:
                out.append(pickle.load(file))
            except EOFError:
                return out


def stamp_ns(message):
    return message["header"]["stamp"]["sec"] * 10**9 + message["header"]["stamp"]["nanosec"]


def close(a, b):
    return all(abs(x - y) <= TOLERANCE * max(1, abs(y)) for x, y in zip(a, b, strict=True))


def compose(transform, inner):
    """x, y and heading of `inner` through a planar transform."""
    p, q = transform["transform"]["translation"], transform["transform"]["rotation"]
    heading = 2 * math.atan2(q["z"], q["w"])
    c, s = math.cos(heading), math.sin(heading)
    return p["x"] + c * inner[0] - s * inner[1], p["y"] + s * inner[0] + c * inner[1], heading + inner[2]


def judge(name, heard, poses):
    """Each message of a listener against the LCM messages {stamp: (arrival, pose_t)}."""
    ages_ms, counts, last_odom, searching, unheard = [], dict.fromkeys(OUT, 0), None, 0, set()
    stamps = {topic: [] for topic in OUT}
    for arrival_ns, topic, message in heard:
        counts[topic] += 1
        if topic == "/diagnostics":
            names = [status["name"] for status in message["status"]]
            assert "waymark: pose" in names and message["status"][0]["level"] in (0, 1, 2, 3), message
            continue
        t_ns = stamp_ns(message["transforms"][0] if topic == "/tf" else message)
        if t_ns not in poses:  # the judge's own listener of LCM lost it, on a loaded computer
            unheard.add(t_ns)
            continue
        lcm_ns, pose = poses[t_ns]
        stamps[topic].append(t_ns)
        ages_ms.append((arrival_ns - lcm_ns) / 1e6)
        odom = (*pose.odom_position_m, pose.odom_heading_rad)
        if topic == "/waymark/pose":
            assert message["header"]["frame_id"] == "map"
            place, turn = message["pose"]["pose"]["position"], message["pose"]["pose"]["orientation"]
            assert close([place[k] for k in "xyz"], pose.position_m) and close([turn[k] for k in "xyzw"], pose.orientation_xyzw)
            assert close(message["pose"]["covariance"], [value for row in pose.covariance for value in row])  # planar: the same axes
        elif topic == "/waymark/odom":
            assert (message["header"]["frame_id"], message["child_frame_id"]) == ("odom", "base_link")
            place, turn = message["pose"]["pose"]["position"], message["pose"]["pose"]["orientation"]
            assert close([place["x"], place["y"], place["z"]], [*odom[:2], 0])
            assert abs(math.remainder(2 * math.atan2(turn["z"], turn["w"]) - odom[2], 2 * math.pi)) < 1e-9
            twist = message["twist"]["twist"]
            assert close([twist["linear"][k] for k in "xyz"] + [twist["angular"][k] for k in "xyz"],
                         [*pose.velocity_mps, *pose.rate_radps])
            if last_odom:
                step = math.dist(last_odom[1][:2], odom[:2])
                assert step < 0.1 + 2 * (t_ns - last_odom[0]) * 1e-9, f"{name}: odom jumps by {step} m"
            last_odom = t_ns, odom
        else:
            frames = [(t["header"]["frame_id"], t["child_frame_id"]) for t in message["transforms"]]
            if pose.state == 0:
                assert frames == [("odom", "base_link")]
                searching += 1
                continue
            assert frames == [("map", "odom"), ("odom", "base_link")], frames
            base = compose(message["transforms"][0], compose(message["transforms"][1], (0, 0, 0)))
            turn = pose.orientation_xyzw
            off = math.dist(base[:2], pose.position_m[:2])
            assert off < 1e-9 and abs(math.remainder(base[2] - 2 * math.atan2(turn[2], turn[3]), 2 * math.pi)) < 1e-9
    for topic in ("/tf", "/waymark/pose", "/waymark/odom"):
        has_pose = [t for t in poses if topic != "/waymark/pose" or poses[t][1].state != 0]
        first, last = stamps[topic][0], stamps[topic][-1]
        missing = {t for t in has_pose if first <= t <= last} - set(stamps[topic])
        assert not missing and len(set(stamps[topic])) == len(stamps[topic]), f"{name}: {topic}: {len(missing)} of {len(has_pose)} lost"
        assert len(stamps[topic]) >= 0.8 * len(has_pose), f"{name}: {topic}: {len(stamps[topic])} of {len(has_pose)}"
    assert len(unheard) <= 1e-3 * len(poses), f"{name}: {len(unheard)} stamps that LCM has not, as {min(unheard)}"
    ages_ms.sort()
    p99 = ages_ms[int(0.99 * len(ages_ms))]
    print(f"{name}: {counts}, none lost, {len(unheard)} unheard over LCM; age over LCM p50 {ages_ms[len(ages_ms) // 2]:.2f} ms, "
          f"p99 {p99:.2f} ms, max {ages_ms[-1]:.2f} ms", flush=True)
    return p99


def check_poses(work, given):
    """The run's poses before both listeners; /initialpose by Fast DDS while it drives."""
    waymark = lcm_tools.python_types(work)
    started = listeners(work, given.probe, lcm_tools.URL)
    bridge = subprocess.Popen([given.bin / "waymark-ros2", "--domain", DOMAIN, "--url", lcm_tools.URL], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True)
    assert "-> domain 42: /tf" in bridge.stdout.readline()
    run = lcm_tools.run(work / "recording", work / "config.yaml", work / "out")
    time.sleep(given.seconds * 0.6)
    kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
    told = cyclone_probe.zeros(kind)
    told["header"]["frame_id"] = "map"
    told["pose"]["pose"]["position"] = {"x": 100.0, "y": -50.0, "z": 0.0}
    told["pose"]["pose"]["orientation"]["w"] = 1.0
    told["pose"]["covariance"][0] = told["pose"]["covariance"][7] = 0.25
    told["pose"]["covariance"][35] = 0.07
    send_fast(given.probe, "/initialpose", kind, told)
    if given.stall:
        bridge.send_signal(signal.SIGSTOP)
        time.sleep(1)
        bridge.send_signal(signal.SIGCONT)
    lcm_tools.finish(run, given.seconds + 60)
    check_second(given)  # the bridge goes on
    time.sleep(1)
    bridge.send_signal(signal.SIGTERM)
    out, err = bridge.communicate(timeout=10)
    assert bridge.returncode == 0 and " 1 taken, 0 refused" in out, f"{bridge.returncode} {out}{err}"
    print(out.strip().splitlines()[-1])
    for process in started:
        process.stdin.close()
        assert process.wait(timeout=20) == 0
    fast, lcm_messages = fast_messages(work / "fast")
    poses = {}
    for arrival_ns, raw in lcm_messages:
        pose = waymark.pose_t.decode(raw)
        poses[pose.t_ns + pose.utc_offset_ns] = arrival_ns, pose
    ages = [judge("Fast DDS", fast, poses), judge("Cyclone DDS", cyclone_messages(work / "cyclone"), poses)]
    last = list(poses.values())[-1][1]
    assert math.dist(last.position_m[:2], (100, -50)) < 10, last.position_m
    print(f"/initialpose at 100, -50: the run ends at {last.position_m[0]:.2f}, {last.position_m[1]:.2f}")
    if given.age_ms:
        assert max(ages) <= given.age_ms, ages


def cdr(name, values):
    """A message's bytes from dicts, by rosbags."""
    store = cyclone_probe.STORE

    def of(kind, value):
        fields = {}
        for field, (node, what) in store.get_msgdef(kind).fields:
            given = value[field]
            if node.name == "NAME":
                given = of(what, given)
            elif node.name in ("ARRAY", "SEQUENCE") and what[0][0].name == "BASE" and what[0][1][0] != "string":
                given = np.array(given, dtype=what[0][1][0])
            fields[field] = given
        return store.types[kind](**fields)
    return bytes(store.serialize_cdr(of(name, values), name))


def send_fast(probe, topic, kind, message):
    raw = cdr(kind, message)
    done = subprocess.run([probe, "send", DOMAIN, topic, dds_name(kind), "50"], input=struct.pack("=I", len(raw)) + raw,
                          capture_output=True, timeout=60)
    assert done.returncode == 0, done.stderr


def check_types():
    """Type names and hashes as nodes of ROS 2 look for them, of all that the bridge sends and takes."""
    done = subprocess.run([sys.executable, HERE / "cyclone_probe.py", "endpoints", DOMAIN], capture_output=True, text=True, timeout=30)
    found, store = json.loads(done.stdout), get_typestore(Stores.ROS2_JAZZY)
    for topic, kind in {**{topic: kind for topic, (kind, _) in OUT.items()}, **IN}.items():
        expected = [dds_name(kind), f"typehash={store.hash_rihs01(kind)};"]
        assert found.get("rt" + topic) == expected, f"{topic}: {found.get('rt' + topic)}, not {expected}"
    print("type names and hashes of", len(OUT) + len(IN), "topics are those of ROS 2")


def check_second(given):
    """Another bridge on the same channels and topics, wrong addresses and domains: an error that names the reason."""
    def fails(code, text, *options, **environment):
        done = subprocess.run([given.bin / "waymark-ros2", "--duration", "1", *options], capture_output=True, text=True,
                              timeout=20, env={**os.environ, "LCM_DEFAULT_URL": lcm_tools.URL, "ROS_DOMAIN_ID": DOMAIN, **environment})
        assert done.returncode == code and text in done.stderr, f"{options} {environment}: {done.returncode}\n{done.stdout}{done.stderr}"
        print("refused:", [line for line in done.stderr.splitlines() if text in line][0])

    fails(1, "sends /waymark/pose in this domain already")
    fails(1, "takes the same channels", "--namespace", "robot2")
    fails(1, "no connection", "--url", "udpm://1.2.3.4:7667", "--domain", "1")
    fails(2, "not in range", "--domain", "233")
    fails(2, "ROS_DOMAIN_ID: 'x'", ROS_DOMAIN_ID="x")
    fails(2, "is not a topic", "--odom", "odom")
    fails(2, "--tf robot needs", "--tf", "robot")
    fails(2, "give one of them", "--localizer", "/amcl_pose", "--visual-odom", "/vo")
    in_use = "<CycloneDDS><Domain><Discovery><ParticipantIndex>7</ParticipantIndex></Discovery></Domain></CycloneDDS>"
    holder = subprocess.Popen([given.bin / "waymark-ros2", "--domain", "9", "--prefix", "OTHER_"], stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL, text=True,
                              env={**os.environ, "LCM_DEFAULT_URL": lcm_tools.URL, "CYCLONEDDS_URI": in_use})
    assert holder.stdout.readline()
    fails(1, "domain 9 can't be joined", "--domain", "9", CYCLONEDDS_URI=in_use)
    holder.kill()
    holder.wait()


def sources(t_ns, way_m):
    """{topic: (type, values)} of a robot that drives eastwards at 0.5 m/s."""
    def stamped(kind, **values):
        message = cyclone_probe.zeros(kind)
        message["header"]["stamp"] = {"sec": t_ns // 10**9, "nanosec": t_ns % 10**9}
        message.update(values)
        return kind, message

    odom, imu = stamped("nav_msgs/msg/Odometry"), stamped("sensor_msgs/msg/Imu")
    odom[1]["twist"]["twist"]["linear"]["x"] = 0.5
    imu[1]["angular_velocity_covariance"][0] = 1e-4
    fix = stamped("sensor_msgs/msg/NavSatFix", latitude=48.0, longitude=11.0 + way_m * 1.34e-5, altitude=500.0,
                  position_covariance_type=2, position_covariance=[0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.04])
    vo = stamped("nav_msgs/msg/Odometry", child_frame_id="base_link")
    vo[1]["pose"]["pose"]["position"]["x"], vo[1]["pose"]["pose"]["orientation"]["w"] = way_m, 1.0
    return {"/odom": odom, "/imu/data": imu, "/fix": fix, "/vo": vo}


def check_sources(work, given):
    """/odom, /fix and /vo by Cyclone, /imu/data by Fast DDS: a run on LCM's streams counts and fuses them."""
    (work / "devices.yaml").write_text(
        "format: waymark-config/1\nestimator: landmark_ekf\ninitial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\n"
        "calibration: recording/calibration.yaml\nlandmarks: recording/landmarks.csv\n"
        f"publish: {{lcm_url: '{lcm_tools.URL}'}}\nrealtime: {{lock_memory: false}}\n"
        "devices: {lcm: [{stream: motion}, {stream: imu}, {stream: gnss}, {stream: localizer}]}\n")
    bridge = subprocess.Popen([given.bin / "waymark-ros2", "--domain", DOMAIN, "--url", lcm_tools.URL, "--odom", "/odom", "--imu",
                               "/imu/data", "--fix", "/fix", "--visual-odom", "/vo"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert "/odom /imu/data /fix /vo" in bridge.stdout.readline()
    check_types()
    run = subprocess.Popen([given.bin / "waymark", "run", "--config", work / "devices.yaml", "--out", work / "driven", "--duration", "120"],
                           stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    senders = {}
    for topic, kind in IN.items():
        if topic == "/initialpose":
            continue
        fast = topic == "/imu/data"
        command = [given.probe, "send", DOMAIN, topic, dds_name(kind), "1000"] if fast else [
            sys.executable, HERE / "cyclone_probe.py", "send", DOMAIN, topic, kind, "1000"]
        senders[topic] = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    for process in senders.values():
        assert process.stdout.readline() == b"matched\n"
    time.sleep(1.5)  # the bridge knows them, too
    for i in range(100):
        for topic, (kind, message) in sources(time.time_ns(), 0.01 * i).items():
            raw = cdr(kind, message)
            stream = senders[topic].stdin
            stream.write(struct.pack("=I", len(raw)) + raw if topic == "/imu/data" else pickle.dumps(message))
            stream.flush()
        time.sleep(0.02)
    for process in senders.values():
        process.stdin.close()
        assert process.wait(timeout=20) == 0
    bridge.send_signal(signal.SIGTERM)
    out, err = bridge.communicate(timeout=10)
    print(out.strip().splitlines()[-1])
    taken = int(out.split(" taken, 0 refused")[0].rsplit(" ", 1)[-1])
    assert 380 <= taken <= 400, out + err  # the readers are of best effort, as sensors' are: a loaded computer may lose some
    run.send_signal(signal.SIGTERM)
    out, err = run.communicate(timeout=30)
    assert run.returncode == 0, out + err
    counts = json.loads((work / "driven/health.json").read_text())["sources"]
    received = {name: source["received"] for name, source in counts.items()}
    bad = {name: source["malformed"] for name, source in counts.items()}
    print("received by the run:", received, "malformed:", bad)
    assert min(received.values()) >= 95 and not any(bad.values()), counts


def check(given):
    global cyclone_probe, get_typestore, lcm_tools, np, Stores
    import cyclone_probe
    import lcm_tools
    import numpy as np
    from rosbags.typesys import Stores, get_typestore
    with in_a_network.work_folder("ros2") as work:
        lcm_tools.write_recording(work / "recording", given.seconds)
        lcm_tools.config(work / "config.yaml", "odometry", "commands: {lcm: true}\n")
        check_poses(work, given)
        check_sources(work, given)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("probe", type=pathlib.Path)
    parser.add_argument("--seconds", type=int, default=12)
    parser.add_argument("--age-ms", type=float, default=0)
    parser.add_argument("--stall", action="store_true", help="the bridge stands still for a second: 50 poses wait, none is lost")
    given = parser.parse_args()
    for what in (given.bin / "waymark-ros2", given.probe):
        if not what.exists():
            in_a_network.skip(f"there is no {what}")
    in_a_network.begin("cyclonedds", "rosbags")
    check(given)


if __name__ == "__main__":
    sys.exit(main())
