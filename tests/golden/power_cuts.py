#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a power cut leaves of a run's files: saved pose, saved map, black box. A run of `slam` is traced (strace); its writes,
renames and syncs are played on a model of a disk that keeps no more than it must:

  - of a file's bytes, those of its last fsync; beyond them any prefix, or zeros (blocks that were allocated and not written);
  - of names (made, renamed, removed), those of the folder's last fsync; beyond them the first ones in their order, any number.

At many random moments the power is cut: saved pose and saved map are whole, and never older than the last one that was through
to the disk; the program starts from some of these states, goes on with the map, and its black box is kept and replays. So that
the test is known to bite: with the file's fsync taken out of the same trace, broken files are found.

    power_cuts.py CUTS    needs strace (else 77)"""
import ast
import pathlib
import random
import re
import shutil
import subprocess
import sys
import zlib

import lcm_tools
import restarts
from lcm_tools import in_a_network

RANDOM = random.Random(11)
CALLS = "openat,write,fsync,fdatasync,rename,renameat,renameat2,unlink,unlinkat,link,linkat,ftruncate,close"
LINE = re.compile(r"^(?P<t>[\d.]+) (?P<name>\w+)\((?P<arguments>.*)\) += (?P<result>-?\d+)")
TEXT = re.compile(r'"((?:[^"\\]|\\.)*)"')


class File:
    def __init__(self):
        self.now, self.durable = bytearray(), b""


class Disk:
    """Below one folder, from a trace's calls."""

    def __init__(self, root, syncs=True):
        self.root, self.syncs, self.descriptors = str(root) + "/", syncs, {}
        self.names, self.durable_names, self.pending = {}, {}, []  # path: File; what a folder's sync has not seen yet

    def change(self, change):
        self.pending.append(change)
        apply(self.names, change)

    def take(self, name, arguments, result):
        texts = [ast.literal_eval(f'b"{t}"').decode("utf-8", "surrogateescape") for t in TEXT.findall(arguments)] if name != "write" else []
        if result < 0 or any(not t.startswith(self.root) for t in texts if t.startswith("/")) and name != "openat":
            return
        if name == "openat":
            self.open(texts[0], arguments, result)
        elif name == "close":
            self.descriptors.pop(int(arguments), None)
        elif name in ("rename", "renameat", "renameat2"):
            self.change(("rename", texts[0], texts[1]))
        elif name in ("unlink", "unlinkat"):
            self.change(("remove", texts[0]))
        elif name in ("link", "linkat"):
            self.change(("make", texts[1], self.names[texts[0]]))
        else:
            self.use(name, arguments, result)

    def open(self, path, arguments, result):
        if not (path + "/").startswith(self.root):
            self.descriptors.pop(result, None)
        elif "O_DIRECTORY" in arguments:
            self.descriptors[result] = "folder"
        else:
            if "O_CREAT" in arguments and path not in self.names:
                self.change(("make", path, File()))
            elif "O_TRUNC" in arguments:
                self.names[path].now = bytearray()
            self.descriptors[result] = self.names.get(path)

    def use(self, name, arguments, result):
        file = self.descriptors.get(int(arguments.split(",")[0]))
        if file == "folder" and name == "fsync":
            self.durable_names, self.pending = dict(self.names), []
        elif isinstance(file, File) and name == "write":
            file.now += ast.literal_eval(f'b"{TEXT.search(arguments)[1]}"')[:result]
        elif isinstance(file, File) and name in ("fsync", "fdatasync") and self.syncs:
            file.durable = bytes(file.now)
        elif isinstance(file, File) and name == "ftruncate":
            del file.now[int(arguments.split(",")[1]):]

    def cut(self):
        """What may be there after a cut now: {path: bytes}."""
        names = dict(self.durable_names)
        for change in self.pending[:RANDOM.randint(0, len(self.pending))]:
            apply(names, change)
        return {path: self.content(file) for path, file in names.items()}

    def content(self, file):
        now = bytes(file.now)
        if not now.startswith(file.durable):  # written anew since: the old bytes are gone, the new ones not yet there
            return now[:RANDOM.randint(0, len(now))]
        kept = RANDOM.choice((len(file.durable), RANDOM.randint(len(file.durable), len(now)), len(now)))
        return now[:kept] + b"\0" * (RANDOM.randint(0, len(now) - kept) if RANDOM.random() < 0.5 else 0)


def apply(names, change):
    if change[0] == "make":
        names[change[1]] = change[2]
    elif change[1] in names:
        file = names.pop(change[1])
        if change[0] == "rename":
            names[change[2]] = file


def read_trace(folder):
    calls = []
    for file in folder.glob("trace.*"):
        for line in file.read_text(errors="surrogateescape").splitlines():
            found = LINE.match(line)
            if found:
                calls.append((float(found["t"]), found["name"], found["arguments"], int(found["result"])))
    return sorted(calls, key=lambda call: call[0])


def fault_of_pose(data):
    text = data.decode(errors="replace")
    return None if text.startswith("# Where") and text.endswith("\n") and "rate_radps:" in text else "the saved pose is broken"


def fault_of_map(data):
    if data[:8] != b"WMMAP 1\n" or len(data) < 44:
        return "the saved map has no head"
    return None if zlib.crc32(data[:40] + data[44:]) == int.from_bytes(data[40:44], "little") else "the saved map is damaged"


CHECKS = {"pose.yaml": fault_of_pose, "map.bin": fault_of_map}


def faults_of(state, robot, was_durable):
    """Of one state after a cut; `was_durable`: names whose first version was through to the disk before."""
    out = []
    for name, check in CHECKS.items():
        data = state.get(f"{robot}/{name}")
        if data is None and name in was_durable:
            out.append(f"{name} is gone")
        if data is not None and check(data):
            out.append(check(data))
    return out


def cut_often(calls, robot, count, syncs=True):
    """States after `count` cuts, and the faults in them."""
    disk, states, faults, was_durable = Disk(robot, syncs), [], [], set()
    moments = sorted(RANDOM.randrange(len(calls)) for _ in range(count))
    for i, call in enumerate(calls):
        disk.take(*call[1:])
        was_durable |= {name for name in CHECKS if f"{robot}/{name}" in disk.durable_names}
        while moments and moments[0] == i:
            moments.pop(0)
            state = disk.cut()
            found = faults_of(state, robot, was_durable)
            faults += found
            states.append((state, set(was_durable)))
    return states, faults


def start_from(state, work, robot, command):
    """The program on what a cut left: starts, with its map where there was one, and keeps what the box has."""
    shutil.rmtree(robot)
    robot.mkdir()
    for path, data in state.items():
        pathlib.Path(path).parent.mkdir(parents=True, exist_ok=True)
        pathlib.Path(path).write_bytes(data)
    done = subprocess.run([*command, "--duration", "0.7"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    if f"{robot}/map.bin" in state:
        assert "continues with the map" in done.stderr, done.stderr
    kept = 0
    for log in (robot / "box").glob("died-*.wmlog"):
        again = subprocess.run([lcm_tools.WAYMARK, "replay", log, "--out", work / "again"], capture_output=True, text=True)
        assert again.returncode >= 0, f"{log}: the replay was ended by signal {-again.returncode}"
        kept += again.returncode == 0
    return kept


def main():
    cuts = int(sys.argv[1])
    if not shutil.which("strace"):
        in_a_network.skip("there is no strace")
    with in_a_network.work_folder("power") as work:
        robot = work / "robot"
        robot.mkdir()
        restarts.write_rest(work / "rest", 0.0, 9)
        (work / "config.yaml").write_text(
            "format: waymark-config/1\nestimator: slam\npublish: {lcm: false}\nrealtime: {lock_memory: false}\n"
            f"start: {{saved_pose: {robot}/pose.yaml, save_every_s: 0.2, saved_map: {robot}/map.bin, save_map_every_s: 0.3}}\n"
            f"black_box: {{folder: {robot}/box, keep_s: 2}}\n")
        command = [lcm_tools.WAYMARK, "run", "--config", work / "config.yaml", "--recording", work / "rest", "--resume"]
        subprocess.run(["strace", "-ff", "-ttt", "-x", "-s", "4000000", "-e", f"trace={CALLS}", "-o", work / "trace", *command], check=True,
                       capture_output=True)
        calls = read_trace(work)
        states, faults = cut_often(calls, robot, cuts)
        assert not faults, faults[:5]
        with_map = [s for s, _ in states if f"{robot}/map.bin" in s]
        assert len(with_map) > cuts // 3, f"{len(with_map)} of {cuts} states have a map"
        _, unsynced = cut_often(calls, robot, cuts, syncs=False)
        assert unsynced, "without the files' syncs nothing was found: the test does not bite"
        kept = [start_from(s, work, robot, command) for s in RANDOM.sample([s for s, _ in states], max(6, cuts // 50))]
        print(f"{cuts} power cuts in {len(calls)} calls: no broken or lost saved pose or map ({len(with_map)} with a map); without the syncs "
              f"{len(unsynced)} faults; {len(kept)} starts from such states, {sum(kept)} logs of the black box replayed")


if __name__ == "__main__":
    sys.exit(main())
