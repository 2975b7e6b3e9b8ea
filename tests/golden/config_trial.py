#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark config set` with a robot that runs, and what is left where someone is killed meanwhile. Needs what lcm_tools.py needs (else 77).

A robot on a circle sees landmarks; its twist and its sightings come over LCM. Other configurations: one with a misspelt key is refused; one
with the landmarks of another building begins and is withdrawn; one that is as good is taken, and its forerunner is a version."""
import json
import math
import pathlib
import re
import signal
import subprocess
import sys
import threading
import time

import lcm_tools
from lcm_tools import WAYMARK, in_a_network

V_MPS, W_RADPS, LANDMARKS = 0.5, 0.25, 8
GOOD_FOR_S, WITHIN_S, PATIENCE_S = 2, 6, 20
OFF_M = 0.3
ROBOT = ("calibration: {calibration}.yaml\nlandmarks: {landmarks}\ninitial_pose: {{x_m: 0, y_m: 0, heading_rad: 0, sigma_xy_m: 2, sigma_heading_rad: 0.5}}\n"
         "devices: {{lcm: [{{stream: motion}}], sightings: lcm}}\nstart: {{saved_pose: pose.yaml, save_every_s: 0.2}}\n")


def truth(t_s):
    heading = W_RADPS * t_s
    return V_MPS / W_RADPS * math.sin(heading), V_MPS / W_RADPS * (1 - math.cos(heading)), heading


def landmark(i):
    radius, angle = (5.0, 3.5)[i % 2], 2 * math.pi * i / LANDMARKS + 0.1
    return radius * math.cos(angle), V_MPS / W_RADPS + radius * math.sin(angle)


class World(threading.Thread):
    """The robot's sensors, and an ear for its run."""

    def __init__(self):
        super().__init__(daemon=True)
        import lcm
        import waymark
        self.types, self.node, self.ear = waymark, lcm.LCM(lcm_tools.URL), lcm.LCM(lcm_tools.URL)
        self.begin, self.health, self.pose = time.monotonic(), None, None
        self.ear.subscribe("WAYMARK_HEALTH", lambda _, data: setattr(self, "health", waymark.health_t.decode(data)))
        self.ear.subscribe("WAYMARK_POSE", lambda _, data: setattr(self, "pose", waymark.pose_t.decode(data)))
        threading.Thread(target=self.listen, daemon=True).start()

    def listen(self):
        while True:
            self.ear.handle_timeout(100)

    def run(self):
        for k in range(10**9):
            now_ns = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
            motion = self.types.motion_t()
            motion.t_ns, motion.v_mps, motion.w_radps = now_ns, V_MPS, W_RADPS
            self.node.publish("WAYMARK_MOTION", motion.encode())
            if k % 5 == 0:
                self.publish_sightings(now_ns)
            time.sleep(max(0, self.begin + (k + 1) * 0.02 - time.monotonic()))

    def publish_sightings(self, now_ns):
        seen = self.types.observations_t()
        seen.t_ns, seen.sensor = now_ns, b"eye".ljust(32, b"\0")
        x, y, heading = truth(now_ns * 1e-9 - self.begin)
        for i in range(LANDMARKS):
            lx, ly = landmark(i)
            bearing = math.remainder(math.atan2(ly - y, lx - x) - heading, math.tau)
            if abs(bearing) < 1.5:
                seen.landmark_id[seen.count], seen.bearing_rad[seen.count], seen.range_m[seen.count] = i, bearing, math.hypot(lx - x, ly - y)
                seen.count += 1
        self.node.publish("WAYMARK_SIGHTINGS", seen.encode())

    def wait(self, what, is_so):
        until = time.monotonic() + PATIENCE_S
        while not is_so():
            assert time.monotonic() < until, f"{what}: not within {PATIENCE_S} s"
            time.sleep(0.05)

    def heard_anew(self, run_id=None):
        """The run's identity and process; waits for another one than `run_id`, that tracks within OFF_M of the truth."""
        def is_right():
            if not self.health or self.health.run_id == run_id or self.health.state != 1 or not self.pose:
                return False
            x, y, _ = truth(self.pose.t_ns * 1e-9 - self.begin)
            return math.hypot(self.pose.position_m[0] - x, self.pose.position_m[1] - y) < OFF_M
        self.health = self.pose = None
        self.wait("a run that tracks", is_right)
        return self.health.run_id, self.health.pid


def write(work):
    (work / "calibration.yaml").write_text("sensors: {eye: {mounting: {xyz_m: [0, 0, 0], rpy_deg: [0, 0, 0]}, bearing_sigma_rad: 0.01, range_sigma_m: 0.03}}\n")
    for name, first in (("landmarks", 0), ("elsewhere", 100)):
        (work / f"{name}.csv").write_text("id,x_m,y_m,z_m,sigma_m\n" + "".join(f"{first + i},{landmark(i)[0]},{landmark(i)[1]},0,0.01\n" for i in range(LANDMARKS)))
    (work / "blind.yaml").write_text("wheels: {radius_m: 0.1, ticks_per_turn: 1000, track_m: 0.5}\n")
    for name, calibration, landmarks, more in (("robot", "calibration", "landmarks", ""), ("elsewhere", "calibration", "elsewhere", ""),
                                               ("better", "calibration", "landmarks", "# better\n"),
                                               ("misspelt", "calibration", "landmarks", "landmarkz: 1\n"), ("sensorless", "blind", "landmarks", "")):
        lcm_tools.config(work / f"{name}.yaml", "landmark_ekf", ROBOT.format(calibration=calibration, landmarks=landmarks + ".csv") + more)


def start(work):
    said = open(work / "said.txt", "a")
    return subprocess.Popen([WAYMARK, "run", "--config", work / "robot.yaml"], stdout=subprocess.DEVNULL, stderr=said)


def config(work, *words, code):
    done = subprocess.run([WAYMARK, "config", *words, "--config", work / "robot.yaml", "--good-for", str(GOOD_FOR_S), "--within", str(WITHIN_S)],
                          capture_output=True, text=True)
    print(f"config {' '.join(pathlib.Path(w).name for w in words)}: exit code {done.returncode}: {(done.stderr or done.stdout).strip().splitlines()[-1]}")
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


def is_left(work, before):
    """Nothing of a trial, and the robot's configuration has these bytes."""
    assert not list(work.glob("robot.yaml.trial*")), list(work.iterdir())
    assert (work / "robot.yaml").read_bytes() == before


def trial(work):
    """A trial of the other building's landmarks, for someone to be killed in it."""
    setting = subprocess.Popen([WAYMARK, "config", "set", work / "elsewhere.yaml", "--config", work / "robot.yaml", "--within", "60"],
                               stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    assert "on trial" in setting.stdout.readline()
    return setting


def check_sets(work, world):
    before = (work / "robot.yaml").read_bytes()
    said = config(work, "set", work / "better.yaml", code=1)
    assert "no run of it is heard" in said, said
    is_left(work, before)

    run = start(work)
    first, pid = world.heard_anew()
    said = config(work, "set", work / "misspelt.yaml", code=2)
    assert f"{work}/misspelt.yaml:10: landmarkz" in said, said
    is_left(work, before)
    assert world.heard_anew() == (first, pid), "a wrong file changed the run"

    said = config(work, "set", work / "elsewhere.yaml", code=1)
    assert f"no pose was good for {GOOD_FOR_S} s within {WITHIN_S} s" in said, said
    is_left(work, before)
    second = world.heard_anew(first)
    assert second[1] == pid and not (work / "robot.yaml.versions").exists()

    said = config(work, "set", work / "sensorless.yaml", code=1)  # it opens, and its run doesn't start
    assert "the run did not begin with it" in said and "not heard" not in said, said
    is_left(work, before)
    second = world.heard_anew(second[0])
    assert second[1] == pid, "the process ended"

    config(work, "set", work / "better.yaml", code=0)
    third = world.heard_anew(second[0])
    is_left(work, (work / "better.yaml").read_bytes())
    versions = list((work / "robot.yaml.versions").iterdir())
    assert len(versions) == 1 and versions[0].read_bytes() == before and re.fullmatch(r"\d{8}T\d{6}Z-[0-9a-f]{16}\.yaml", versions[0].name), versions
    assert third[1] == pid and world.heard_anew() == third, "another run after the trial"
    saved = (work / "pose.yaml").read_bytes()
    world.wait("a saved pose", lambda: (work / "pose.yaml").read_bytes() != saved)

    return run, third, before


def check_kills(work, world, run, third, before):
    pid = third[1]
    setting = trial(work)  # the program that waits is killed: the run goes back by itself
    world.wait("the trial's run", lambda: world.health.run_id != third[0])
    setting.kill()
    setting.wait()
    fourth = world.heard_anew(world.health.run_id)
    assert fourth[1] == pid

    setting = trial(work)  # a power cut: all are killed. A start knows nothing of the trial
    world.wait("the trial's run", lambda: world.health.run_id != fourth[0])
    saved = (work / "pose.yaml").read_bytes()
    time.sleep(1)
    assert (work / "pose.yaml").read_bytes() == saved, "a configuration on trial saved its pose"
    setting.kill(), run.kill()
    setting.wait(), run.wait()
    assert (work / "robot.yaml.trial").exists() and (work / "robot.yaml").read_bytes() == (work / "better.yaml").read_bytes()
    run = start(work)
    fifth = world.heard_anew(fourth[0])
    time.sleep(2.5)  # the run looks once a second
    assert world.heard_anew() == fifth, "a trial that nobody holds was taken"

    config(work, "back", code=0)
    world.heard_anew(fifth[0])
    is_left(work, before)
    config(work, "set", work / "better.yaml", "--keep", "1", code=0)
    assert len(list((work / "robot.yaml.versions").iterdir())) == 1
    run.send_signal(signal.SIGTERM)
    assert run.wait(timeout=PATIENCE_S) == 0, (work / "said.txt").read_text()[-2000:]
    config(work, "set", work / "elsewhere.yaml", "--untried", code=0)
    is_left(work, (work / "elsewhere.yaml").read_bytes())
    said = (work / "said.txt").read_text()
    for what in ("is on trial", "back to the configuration before", "is the robot's now"):
        assert what in said, f"'{what}' was not said\n{said}"


def main():
    lcm_tools.own_network("lcm")
    with in_a_network.work_folder("trial") as work:
        write(work)
        lcm_tools.python_types(work)
        world = World()
        world.start()
        check_kills(work, world, *check_sets(work, world))
    print(json.dumps({"trials": "as expected"}))


if __name__ == "__main__":
    sys.exit(main())
