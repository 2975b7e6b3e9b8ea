#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Who else is on a run's channels, and who may command it.

  1. two runs with one publish.channel_prefix: each names the other's process and computer, once, and that it is gone at its
     end; health counts it. Two runs with different prefixes do not notice each other;
  2. `commands: {socket: FILE}` takes set_pose_t from a program that may write the file, and not over LCM; the file is for
     owner and group alone, gone at the end; another run on it is refused, one that a killed run left is replaced;
  3. `commands: {lcm: true}` after the default route moved to another network's interface: a command is heard.

Needs lcm-gen, and the right to a network namespace (else 77)."""
import json
import signal
import socket
import stat
import subprocess
import sys
import time

import lcm_tools
from judged import rows
from lcm_tools import WAYMARK, config, in_a_network, write_recording


def configure(work, name, prefix, more=""):
    config(work / f"{name}.yaml", "odometry", more, f", channel_prefix: {prefix}")


def start(work, name, recording="recording"):
    return subprocess.Popen([WAYMARK, "run", "--config", work / f"{name}.yaml", "--recording", work / recording, "--out", work / f"out-{name}"],
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def end(process):
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, out + err
    return err


def health(work, name):
    return json.loads((work / f"out-{name}/health.json").read_text())


def check_other_runs(work):
    for name, prefix in (("a", "WAYMARK_"), ("b", "WAYMARK_"), ("alone", "OTHER_")):
        configure(work, name, prefix)
    write_recording(work / "short", 4)
    runs = {"a": start(work, "a"), "alone": start(work, "alone"), "b": start(work, "b", "short")}
    said = {name: end(process) for name, process in runs.items()}
    host = socket.gethostname()
    for name, other in (("a", "b"), ("b", "a")):
        lines = [line for line in said[name].splitlines() if "another run" in line and "same channels" in line]
        assert len(lines) == 1, said[name]
        assert f"process {runs[other].pid} on '{host}'" in lines[0] and "(WAYMARK_...)" in lines[0], lines[0]
        assert health(work, name)["other_runs"] == 1
        assert "published on the same channels meanwhile (1)" in said[name], said[name]
    assert "another run" not in said["alone"] and health(work, "alone")["other_runs"] == 0, said["alone"]
    gone = [line for line in said["a"].splitlines() if f"process {runs['b'].pid}" in line and "is gone" in line]
    assert len(gone) == 1, said["a"]
    print(lines[0])


def last_x_m(work, name):
    return float(rows(work / f"out-{name}/published.csv")[-1]["x_m"])


def set_pose(work, x_m):
    waymark = lcm_tools.python_types(work)
    told = waymark.set_pose_t()
    told.position_m, told.orientation_xyzw = [x_m, 0, 0], [0, 0, 0, 1]
    told.sigma_xy_m, told.sigma_heading_rad = 0.1, 0.1
    return told.encode()


def wait_for(path, process):
    until = time.monotonic() + 20
    while not path.exists():
        assert process.poll() is None and time.monotonic() < until, process.communicate()
        time.sleep(0.01)


def check_commands(work):
    file = work / "commands"
    configure(work, "local", "WAYMARK_", f"commands: {{socket: {file}}}\n")
    configure(work, "second", "SECOND_", f"commands: {{socket: {file}}}\n")
    killed = start(work, "local")
    wait_for(file, killed)
    killed.send_signal(signal.SIGKILL)
    killed.communicate()
    assert file.exists()  # left behind
    process = start(work, "local")
    time.sleep(1.5)
    about = file.stat()
    assert stat.S_ISSOCK(about.st_mode) and stat.S_IMODE(about.st_mode) == 0o660, oct(about.st_mode)
    second = start(work, "second")
    _, err = second.communicate(timeout=20)
    assert second.returncode != 0 and "another process listens" in err, err
    sender = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    sender.sendto(b"rubbish", str(file))
    sender.sendto(set_pose(work, 100.0), str(file))
    packet = b"LC02" + (1).to_bytes(4, "big") + b"WAYMARK_SET_POSE\0" + set_pose(work, -500.0)
    socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(packet, ("239.255.76.67", 7667))
    end(process)
    assert not file.exists(), "the socket's file is left"
    assert 90 < last_x_m(work, "local") < 110, last_x_m(work, "local")
    counts = health(work, "local")["sources"]["commands:local"]
    assert counts["fused"] == 1 and counts["malformed"] == 1, counts
    print("told by the local socket to stand at x = 100 m: ends at", last_x_m(work, "local"))


def plug_in(name, address):
    for command in (f"link add {name} type veth peer name {name}-peer", f"link set {name}-peer up", f"addr add {address}/24 dev {name}", f"link set {name} up"):
        subprocess.run(["ip", *command.split()], check=True)


def check_other_network(work):
    """The default route, by which LCM's multicast goes, moves from Wi-Fi to a cable: sending never fails, and the group was joined on Wi-Fi."""
    subprocess.run(["ip", "route", "del", "224.0.0.0/4", "dev", "lo"], check=True)
    plug_in("wifi", "192.0.2.2")
    subprocess.run(["ip", "route", "add", "default", "dev", "wifi"], check=True)
    configure(work, "network", "WAYMARK_", "commands: {lcm: true}\n")
    write_recording(work / "long", 90)
    process = start(work, "network", "long")
    time.sleep(3)
    plug_in("cable", "198.51.100.2")
    subprocess.run(["ip", "route", "replace", "default", "dev", "cable"], check=True)
    time.sleep(3)
    packet = b"LC02" + (1).to_bytes(4, "big") + b"WAYMARK_SET_POSE\0" + set_pose(work, 100.0)
    socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(packet, ("239.255.76.67", 7667))
    time.sleep(2)
    assert process.poll() is None
    process.send_signal(signal.SIGTERM)
    end(process)
    counts = health(work, "network")["sources"]["commands"]
    assert counts["fused"] == 1, f"a command after the route moved to another interface: {counts}"
    print("told over the other network to stand at x = 100 m: ends at", last_x_m(work, "network"))


def main():
    in_a_network.begin()
    with in_a_network.work_folder("two-runs") as work:
        write_recording(work / "recording", 12)
        check_other_runs(work)
        check_commands(work)
        check_other_network(work)


if __name__ == "__main__":
    sys.exit(main())
