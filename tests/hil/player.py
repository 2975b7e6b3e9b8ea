# SPDX-License-Identifier: Apache-2.0
"""`waymark play` into the guest's virtual CAN and V4L2 devices: two buses, together 2000 frames a second, and two cameras at 30 Hz, recorded
there by `waymark record` and v4l2-ctl, and compared with what was played: nothing is lost or changed, and stamps of CAN and pictures
agree. Then with faults that real interfaces have."""
import json
import re
import shutil
import struct
import subprocess

import drives

SECONDS, RATE_HZ, PICTURES_HZ, WIDTH, HEIGHT = 8, 1900, 30, 320, 200
FIRST_NS = 40 * 10**9
SKEW_MS = 1.0


def frames():
    """(t_ns, interface, frame as candump writes it): classic ones on can0; FD, 29 bits, remote and error frames on can1."""
    for i in range(RATE_HZ * SECONDS):
        yield FIRST_NS + i * 10**9 // RATE_HZ, "can0", f"{0x100 + i % 16:03X}#{i:016X}"
    for i in range(100 * SECONDS):
        kind = ("12345678#AABB", f"18FF0102##1{i:024X}", "123#R", f"20000080#{i % 256:016X}", "7FF#")[i % 5]
        yield FIRST_NS + i * 10**7 + 12345000, "can1", kind


def write_avi(path, pictures):
    """Uncompressed grey, as `waymark record` writes it."""
    def chunk(name, data):
        return name + struct.pack("<I", len(data)) + data
    header = b"vidsY800" + bytes(48)
    form = struct.pack("<IIIHH4s", 40, WIDTH, HEIGHT, 1, 8, b"Y800") + bytes(20)
    head = chunk(b"LIST", b"hdrl" + chunk(b"avih", bytes(56)) + chunk(b"LIST", b"strl" + chunk(b"strh", header) + chunk(b"strf", form)))
    movie = chunk(b"LIST", b"movi" + b"".join(chunk(b"00dc", p) for p in pictures))
    path.write_bytes(chunk(b"RIFF", b"AVI " + head + movie))


def picture(number, camera):
    """Grey steps that have the number in them; flat areas, which JPEG keeps."""
    row = bytes(40 + (number * 7 + camera * 50 + x // 64 * 30) % 160 for x in range(WIDTH))
    return row * HEIGHT


def write_recording(folder):
    (folder / "video").mkdir(parents=True)
    (folder / "recording.yaml").write_text(f"format: waymark-recording/1\nduration_s: {SECONDS}\n")
    (folder / "can.log").write_text("".join(f"({t // 10**9}.{t % 10**9 // 1000:06d}) {i} {f}\n" for t, i, f in sorted(frames())))
    for camera, name in enumerate(("left", "right")):
        count = PICTURES_HZ * SECONDS
        write_avi(folder / f"video/{name}.avi", [picture(i, camera) for i in range(count)])
        rows = [f"{i},{FIRST_NS + i * 10**9 // PICTURES_HZ + 5_000_000}\n" for i in range(count)]
        (folder / f"video/{name}.csv").write_text("frame,t_ns\n" + "".join(rows))


def write_scenario(scenario, work, root, simulate):
    """The recording, and the configuration of who records it."""
    write_recording(scenario / "recording")
    world = work / "play-world"
    shutil.rmtree(world, ignore_errors=True)
    subprocess.run([simulate, root / "config/worlds/crossing.yaml", "--no-video", "--duration", "2", "--out", world], check=True)
    for name in ("vehicle.dbc", "can-signals.yaml"):
        shutil.copy(world / name, scenario)
    (scenario / "robot.yaml").write_text(
        "format: waymark-config/1\nestimator: odometry\ndbc: vehicle.dbc\ncan_signals: can-signals.yaml\n"
        "devices:\n  can: [{interface: vcan0}, {interface: vcan1}]\n")


def prepare(work, root, here, simulate):
    scenario = work / "share/play"
    write_scenario(scenario, work, root, simulate)
    shutil.copy(simulate.with_name("waymark-play"), scenario)
    (scenario / "faults.yaml").write_text(
        "format: waymark-faults/1\nfaults:\n"
        "- {name: down, fault: bus_down, bus: can0, from_s: 1, until_s: 2}\n"
        "- {name: off, fault: bus_off, bus: can1, from_s: 2, until_s: 3}\n"
        "- {name: unplugged, fault: camera_unplugged, camera: left, from_s: 3, until_s: 4}\n"
        "- {name: stalled, fault: camera_stalled, camera: right, from_s: 3, until_s: 4}\n"
        "- {name: load, fault: bus_load, bus: can0, rate_hz: 2000, from_s: 5, until_s: 6}\n")


def read_can(path, interface):
    """(t_ns, frame) of an interface."""
    out = []
    for line in path.read_text().splitlines():
        time, name, frame = line.split()[:3]
        if name == interface:
            whole, part = time.strip("()").split(".")
            # The kernel marks frames of CAN FD (CANFD_FDF, 4) since Linux 5.18.
            frame = re.sub("##5", "##1", frame)
            out.append((int(whole) * 10**9 + int(part) * 1000, frame))
    return out


def taken(path):
    """Stamps of the pictures that v4l2-ctl took, in nanoseconds."""
    return [int(whole) * 10**9 + int(part.ljust(9, "0")) for whole, part in re.findall(r"dqbuf.* ts: *(\d+)\.(\d+)", path.read_text())]


def read_stamps(path):
    return [int(row["t_ns"]) for row in drives.rows(path)]


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def judge_whole(recorded, recording, offset_ns):
    """What was recorded is what was played, `offset_ns` later."""
    failures, late = [], {}
    for name, to in (("can0", "vcan0"), ("can1", "vcan1")):
        sent = [(t, f) for t, i, f in sorted(frames()) if i == name]
        heard = read_can(recorded / "can.log", to)
        same = [f for _, f in sent] == [f for _, f in heard]
        late[name] = [h[0] - s[0] - offset_ns for s, h in zip(sent, heard)]
        print(f"play: {to}: {len(heard)} frames recorded of {len(sent)}, {'the same in their order' if same else 'NOT the same'}")
        if not same:
            failures.append(f"play: {to} has other frames than the recording")
    for name in ("left", "right"):
        wanted = read_stamps(recording / f"video/{name}.csv")
        heard = taken(recorded.with_name(f"{recorded.name}-{name}.txt"))
        late[name] = [h - w - offset_ns for w, h in zip(wanted, heard)]
        print(f"play: {name}: {len(heard)} pictures taken of {len(wanted)}")
        if len(heard) != len(wanted):
            failures.append(f"play: {name}: {len(heard)} pictures of {len(wanted)}")
    if not all(late.values()):
        return failures
    for name, values in late.items():
        print(f"play: stamps of {name} are late by {percentile(values, 0.5) / 1e3:.0f} us (p50), {percentile(values, 0.99) / 1e3:.0f} us (p99), "
              f"{max(values) / 1e3:.0f} us at most")
    pairs = [abs(a - b) / 1e6 for a, b in zip(late["left"], late["right"])]
    # Of each picture against the frame of can0 that was due just before it.
    at = {s[0]: x for s, x in zip(sorted(f for f in frames() if f[1] == "can0"), late["can0"])}
    times = sorted(at)
    wanted = read_stamps(recording / "video/left.csv")
    skews = [abs(x - at[max(t for t in times[max(0, (w - FIRST_NS) * RATE_HZ // 10**9 - 3):(w - FIRST_NS) * RATE_HZ // 10**9 + 3] if t <= w)]) / 1e6
             for w, x in zip(wanted, late["left"])]
    print(f"play: skew between CAN and pictures {percentile(skews, 0.99):.3f} ms (p99), between the two cameras {percentile(pairs, 0.99):.3f} ms (p99)")
    if percentile(skews, 0.99) > SKEW_MS or percentile(pairs, 0.99) > SKEW_MS:
        failures.append("play: the skew is too large")
    return failures


def judge(work, waymark, root):
    out = work / "share/out/play"
    played = json.loads((out / "played.json").read_text())
    failures = judge_whole(out / "rec", work / "share/play/recording", played["offset_ns"])
    broken = json.loads((out / "broken.json").read_text())
    done = {f["name"]: f["done"] for f in broken["faults"]}
    print(f"play: with faults: {done}; {[(s['name'], s['sent'], s['failed']) for s in broken['streams']]}")
    if not all(done.values()) or len(done) != 5 or any(s["failed"] for s in broken["streams"]):
        failures.append("play: not all faults are done")
    at = lambda ns: (ns - broken["begin_ns"]) * 1e-9
    can0 = [(at(t), f) for t, f in read_can(out / "broken/can.log", "vcan0")]
    can1 = [(at(t), f) for t, f in read_can(out / "broken/can.log", "vcan1")]
    for what, count, least, most in (
            ("frames while the bus is down", sum(1.02 < t < 1.98 for t, _ in can0), 0, 0),
            ("frames after it", sum(2.5 < t < 3 for t, _ in can0), 0.9 * 0.5 * RATE_HZ, 1.1 * 0.5 * RATE_HZ),
            ("error frames of bus-off and restart", sum(f.startswith(("20000040", "20000100")) for _, f in can1), 2, 2),
            ("frames while the bus is off", sum(2.02 < t < 2.98 for t, _ in can1), 0, 0),
            ("added frames", sum(f == "7FF#0000000000000000" for _, f in can0), 1900, 2000),
            ("pictures while unplugged", sum(3.1 < at(t) < 3.98 for t in taken(out / "broken-left.txt")), 0, 0),
            ("pictures while stalled", sum(3.1 < at(t) < 3.98 for t in taken(out / "broken-right.txt")), 0, 0),
            ("pictures after it", sum(7 < at(t) < 8 for t in taken(out / "broken-left.txt")), 20, 31)):
        print(f"play: {count} {what}")
        if not least <= count <= most:
            failures.append(f"play: {count} {what}, {least:.0f} to {most:.0f} are right")
    return failures
