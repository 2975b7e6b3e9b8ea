#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""LCM's own tools read what a run sends. Needs lcm-logger and lcm-gen, and LCM's Python binding (tests/judges/setup.sh);
without them, or without the right to a network namespace, the test is skipped (exit code 77).

In a network of its own with nothing but a loopback:
  1. a run is recorded by lcm-logger; the binding reads the log with code that lcm-gen made; poses, health, innovations,
     observations and landmarks decode, and poses agree with published.csv;
  2. the page of `waymark web` has its state, and nothing for another site;
  3. without a route for multicast the run says so once, goes on, and writes the same number of poses; a route that
     appears later is found.
"""
import contextlib
import functools
import json
import math
import os
import pathlib
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "common"))
import in_a_network  # noqa: E402
from in_a_network import ROUTE  # noqa: E402
from judged import BIN, ROOT, rows  # noqa: E402

WAYMARK = BIN / "waymark"
URL = "udpm://239.255.76.67:7667?ttl=0"


# For who needs LCM's tools and its Python binding.
again = functools.partial(in_a_network.again, "lcm", programs=("lcm-logger", "lcm-gen"))
own_network = functools.partial(in_a_network.begin, "lcm", programs=("lcm-logger", "lcm-gen"))


def config(path, estimator, more="", publish=""):
    """Writes a configuration of a run on this network's LCM."""
    path.write_text(f"format: waymark-config/1\nestimator: {estimator}\npublish: {{lcm_url: '{URL}'{publish}}}\nrealtime: {{lock_memory: false}}\n{more}")


@contextlib.contextmanager
def ended():
    """A list of processes; those that still run after a with are killed."""
    processes = []
    try:
        yield processes
    finally:
        for process in processes:
            process.kill()


def write_recording(folder, seconds):
    """A robot on a circle among four landmarks."""
    folder.mkdir()
    (folder / "recording.yaml").write_text(
        f"format: waymark-recording/1\nname: circle\nduration_s: {seconds}\nstreams: [motion.csv, sightings.csv]\n"
        "vehicle: {initial_pose: {t_ns: 0, x_m: 0, y_m: 0, heading_rad: 0}}\n")
    (folder / "calibration.yaml").write_text(
        "sensors: {eye: {mounting: {xyz_m: [0, 0, 0], rpy_deg: [0, 0, 0]}, bearing_sigma_rad: 0.01, range_sigma_m: 0.05}}\n")
    landmarks = [(5, 0), (0, 5), (-5, 0), (0, -5)]
    (folder / "landmarks.csv").write_text(
        "id,x_m,y_m,z_m,sigma_m\n" + "".join(f"{i},{x},{y},0,0.01\n" for i, (x, y) in enumerate(landmarks)))
    v, w = 0.5, 0.25
    (folder / "motion.csv").write_text(
        "t_ns,v_mps,w_radps\n" + "".join(f"{i * 20_000_000},{v},{w}\n" for i in range(seconds * 50)))
    sightings = ["t_ns,sensor,id,bearing_rad,range_m\n"]
    for i in range(seconds * 10):
        t = i / 10
        heading, x, y = w * t, v / w * math.sin(w * t), v / w * (1 - math.cos(w * t))
        for number, (lx, ly) in enumerate(landmarks):
            bearing = math.remainder(math.atan2(ly - y, lx - x) - heading, 2 * math.pi)
            sightings.append(f"{i * 100_000_000},eye,{number},{bearing:.6f},{math.hypot(lx - x, ly - y):.6f}\n")
    (folder / "sightings.csv").write_text("".join(sightings))


def run(recording, config, out):
    return subprocess.Popen([WAYMARK, "run", "--config", config, "--recording", recording, "--out", out],
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finish(process, timeout_s=60):
    out, err = process.communicate(timeout=timeout_s)
    assert process.returncode == 0, f"waymark run: exit code {process.returncode}\n{out}{err}"
    return out, err


def published(out):
    return {int(row["t_ns"]): row for row in rows(out / "published.csv")}


def python_types(work):
    """The module of the message types, made by lcm-gen as a user makes it, in work/types."""
    types = work / "types"
    subprocess.run(["lcm-gen", "-p", "--ppath", types, *sorted((ROOT / "msgs/lcm").glob("*.lcm"))], check=True)
    sys.path.insert(0, str(types))
    import waymark
    return waymark


def wait_for_listener(seconds=20):
    """Until some program has a socket on LCM's port: a busy computer takes a second and more to start one."""
    port = f":{int(URL.rsplit(':', 1)[1].split('?')[0]):04X}"
    until = time.monotonic() + seconds
    while not any(line.split()[1].endswith(port) for line in pathlib.Path("/proc/net/udp").read_text().splitlines()[1:]):
        assert time.monotonic() < until, "nothing listens on LCM's port"
        time.sleep(0.01)


def check_logger(work):
    import lcm
    waymark = python_types(work)
    log = work / "lcm.log"
    logger = subprocess.Popen(["lcm-logger", "-q", "-f", f"--lcm-url={URL}", log])
    try:
        wait_for_listener()
        time.sleep(0.5)  # its own test of the network
        finish(run(work / "recording", work / "config.yaml", work / "heard"))
        time.sleep(0.5)
    finally:
        logger.send_signal(signal.SIGINT)
        logger.wait(timeout=10)

    decoders = {"WAYMARK_POSE": waymark.pose_t, "WAYMARK_HEALTH": waymark.health_t,
                "WAYMARK_INNOVATION": waymark.innovation_t, "WAYMARK_OBSERVATIONS": waymark.observations_t,
                "WAYMARK_LANDMARKS": waymark.landmarks_t, "WAYMARK_POSE_BOUND": waymark.bound_t}
    heard = {channel: [] for channel in decoders}
    for event in lcm.EventLog(str(log), "r"):
        if event.channel == "LCM_SELF_TEST":  # liblcm's own, from who begins to listen
            continue
        heard[event.channel].append(decoders[event.channel].decode(event.data))
    counts = {channel: len(messages) for channel, messages in heard.items()}
    print("lcm-logger recorded, and LCM's Python binding decoded:", counts)

    written = published(work / "heard")
    poses = heard["WAYMARK_POSE"]
    least = 20 if "WM_FEWER" in os.environ else 100  # an emulator is slow
    assert len(poses) == len(written) > least, f"{len(poses)} poses heard, {len(written)} written"
    assert all(a.t_ns < b.t_ns for a, b in zip(poses, poses[1:])), "stamps don't rise"
    for pose in poses:
        row = written[pose.t_ns]
        assert pose.position_m[0] == float(row["x_m"]) and pose.position_m[1] == float(row["y_m"])
        assert pose.covariance[0][0] == float(row["cov_xx"]) and pose.covariance[5][5] == float(row["cov_tt"])
        assert pose.made_ns == int(row["made_ns"]) <= pose.sent_ns and pose.jumps == int(row["resets"])
    bounds = heard["WAYMARK_POSE_BOUND"]
    assert [bound.t_ns for bound in bounds] == [pose.t_ns for pose in poses], "a bound for each pose"
    for bound in bounds:
        row = written[bound.t_ns]
        assert bound.usable == int(row["usable"]) and bound.unusable == int(row["unusable"])
        assert math.isclose(bound.horizontal_m, float(row["bound_m"]), rel_tol=1e-8), row["bound_m"]
    utc_ns = poses[-1].t_ns + poses[-1].utc_offset_ns
    assert abs(utc_ns - time.time_ns()) < 60e9 and 0 < poses[-1].utc_uncertainty_ns < 1e8, "the offset of UTC"
    assert counts["WAYMARK_HEALTH"] >= 2 and counts["WAYMARK_LANDMARKS"] >= 1
    health = heard["WAYMARK_HEALTH"][-1]
    names = [bytes(s.name).rstrip(b"\0").decode() for s in health.sources[:health.source_count]]
    assert names == ["motion", "sightings:eye", "commands"], names
    assert [tuple(p) for p in heard["WAYMARK_LANDMARKS"][0].position_m[:2]] == [(5, 0, 0), (0, 5, 0)]
    assert counts["WAYMARK_INNOVATION"] == len(rows(work / "heard/innovations.csv"))
    seen = heard["WAYMARK_OBSERVATIONS"]
    assert all(bytes(o.sensor).rstrip(b"\0") == b"eye" and o.count == 4 for o in seen) and len(seen) > 20


def check_commands(work):
    """While it drives it is told that it stands elsewhere, in a message that LCM's own tools made."""
    import lcm
    import waymark

    node = lcm.LCM(URL)
    config = (work / "config.yaml").read_text().replace("landmark_ekf", "odometry")
    (work / "odometry.yaml").write_text(config)
    process = run(work / "recording", work / "odometry.yaml", work / "told")
    time.sleep(1.5)
    told = waymark.set_pose_t()
    told.position_m, told.orientation_xyzw = [100, -50, 0], [0, 0, 0, 1]
    told.sigma_xy_m, told.sigma_heading_rad = 0.1, 0.1
    node.publish("WAYMARK_SET_POSE", told.encode())
    node.publish("WAYMARK_SET_POSE", b"rubbish")
    finish(process)
    first, *_, last = published(work / "told").values()
    assert abs(float(first["x_m"])) < 1 and abs(float(last["x_m"]) - 100) < 5, last
    print("told to stand at 100, -50: ends at", last["x_m"], last["y_m"])


def check_web(work):
    """The page of `waymark web` while it drives: it needs nothing from elsewhere, and answers to this computer alone."""
    program = WAYMARK.with_name("waymark-web")
    if not program.exists():
        print("waymark-web is not built here")
        return
    web = subprocess.Popen([program, "--url", URL, "--listen", "0"], stdout=subprocess.PIPE, text=True)
    here = web.stdout.readline().strip()
    assert here.startswith("http://localhost:"), here
    port = here.rpartition(":")[2]
    process = run(work / "recording", work / "config.yaml", work / "watched")
    get = lambda path, host="localhost:" + port: urllib.request.urlopen(
        urllib.request.Request(f"http://127.0.0.1:{port}{path}", headers={"Host": host}), timeout=5).read().decode()
    time.sleep(2.5)
    state = json.loads(get("/state.json"))
    assert state["state"] == "tracking" and abs(state["pose"]["x_m"]) < 5, state
    assert [s["name"] for s in state["health"]["sources"]] == ["motion", "sightings:eye", "commands"], state
    assert [l[:3] for l in state["landmarks"]["list"]] == [[0, 5, 0], [1, 0, 5], [2, -5, 0], [3, 0, -5]], state["landmarks"]
    assert len(state["rays"]) == 4 and {ray[4] for ray in state["rays"]} == {"fused"}, state["rays"]
    assert "<canvas" in get("/") and "http:" not in get("/") and "https:" not in get("/page.js")
    for path, host in (("/state.json", "evil.example:" + port), ("/nothing", "localhost"), ("/../etc/passwd", "localhost")):
        try:
            get(path, host)
            assert False, f"{path} for {host} is answered"
        except urllib.error.HTTPError as e:
            assert e.code in (403, 404)
    finish(process)
    web.send_signal(signal.SIGTERM)
    assert web.wait(timeout=10) == 0
    print("the page says", state["state"], "and", state["consistency"])


def check_no_route(work):
    subprocess.run(["ip", "route", "del", "224.0.0.0/4"], check=True)
    process = run(work / "recording", work / "config.yaml", work / "silent")
    time.sleep(1.5)
    subprocess.run(ROUTE, check=True)  # the network comes while it drives
    _, err = finish(process)
    said = [line for line in err.splitlines() if "LCM" in line]
    print("\n".join(said))
    assert len([line for line in said if "no route" in line]) == 1, err
    assert len([line for line in said if "connected again" in line]) == 1, err
    assert "not good" not in err, err  # liblcm's own page of help
    assert len(published(work / "silent")) > 100


def main():
    own_network()
    with in_a_network.work_folder("lcm") as work:
        write_recording(work / "recording", 4)
        config(work / "config.yaml", "landmark_ekf", "commands: {lcm: true}\n")
        check_logger(work)
        check_commands(work)
        check_web(work)
        check_no_route(work)


if __name__ == "__main__":
    sys.exit(main())
