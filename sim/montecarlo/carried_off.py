# SPDX-License-Identifier: Apache-2.0
"""A recorded drive cut in two and put together again without the middle: the robot is set down elsewhere, driving.

The bus and the pictures of the second part follow those of the first one on the recording's clock; tick counts and rolling counters
go on as if nothing had happened. A picture that the seam would tear (taken before it, arriving after it) is left out."""
import csv
import math
import random
import re
import struct

DRIVING_MPS, CARRIED_M, AHEAD_S, LARGE_PX = 0.3, 5, 7, 8


def load(file):
    with open(file, newline="") as rows:
        return list(csv.DictReader(rows))


def save(file, rows, columns):
    with open(file, "w", newline="") as out:
        writer = csv.DictWriter(out, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


class Truth:
    def __init__(self, drive):
        rows = load(drive / "truth.csv")
        self.t_ns = [int(r["t_ns"]) for r in rows]
        self.xy_m = [(float(r["x_m"]), float(r["y_m"])) for r in rows]
        self.begin_ns, self.end_ns = self.t_ns[0], self.t_ns[-1]

    def index(self, t_ns):
        step = (self.end_ns - self.begin_ns) / (len(self.t_ns) - 1)
        return max(1, min(len(self.t_ns) - 1, round((t_ns - self.begin_ns) / step)))

    def at(self, t_ns):
        return self.xy_m[self.index(t_ns)]

    def speed_mps(self, t_ns):
        i = self.index(t_ns)
        return math.dist(self.xy_m[i], self.xy_m[i - 1]) / (1e-9 * (self.t_ns[i] - self.t_ns[i - 1]))

    def driven_s(self, t_ns):
        """Seconds of driving from the beginning until then."""
        until = self.index(t_ns) if t_ns > self.begin_ns else 0
        steps = (1e-9 * (self.t_ns[i] - self.t_ns[i - 1]) for i in range(1, until + 1) if self.speed_mps(self.t_ns[i]) > DRIVING_MPS)
        return sum(steps)


def seam(drive, seed):
    """(at, to) in ns: when it is carried off and where the drive goes on, CARRIED_M away or more, driving, with AHEAD_S of it left.
    None where the drive is too short for that."""
    truth, draw = Truth(drive), random.Random(f"carried off {seed}")
    whole_ns = truth.end_ns - truth.begin_ns
    for _ in range(500):
        at = truth.begin_ns + int(whole_ns * draw.uniform(0.2, 0.5))
        to = at + int(max(0, truth.end_ns - AHEAD_S * 1e9 - at) * draw.random())
        if truth.speed_mps(to) > DRIVING_MPS and math.dist(truth.at(at), truth.at(to)) > CARRIED_M:
            return at, to
    return None


def first_view(drive, at_ns, to_ns):
    """Seconds from the seam to the first picture of the second part in which a landmark is labelled that should be LARGE_PX high."""
    truth = Truth(drive)
    place = {r["id"]: (float(r["x_m"]), float(r["y_m"])) for r in load(drive / "truth-landmarks.csv")}
    height_m = {r["id"]: float(r["height_m"]) for r in load(drive / "landmarks/appearance.csv")}
    cameras = re.findall(r"^  (\w+):\n    model:[^\n]*\n[^\n]*\n    intrinsics: \[([\d.]+)", (drive / "calibration.yaml").read_text(), re.M)
    when = [{int(r["frame"]): int(r["t_ns"]) for r in load(drive / f"video/{name}.csv")} for name, _ in cameras]
    first = math.inf
    for label in load(drive / "labels/landmarks.csv"):
        camera, landmark = int(label["camera"]), label["id"]
        t_ns = when[camera].get(int(label["frame"]), -1)
        if to_ns <= t_ns < first and landmark in height_m:
            distance_m = math.dist(truth.at(t_ns), place[landmark])
            if float(cameras[camera][1]) * height_m[landmark] / distance_m >= LARGE_PX:
                first = t_ns
    return None if first == math.inf else 1e-9 * (first - to_ns)


def bits_of(text):
    """{CAN id: [(first bit, bits)]} of the little-endian counts in a DBC that go on for ever: ticks and rolling counters."""
    counts, message = {}, None
    for line in text.splitlines():
        if found := re.match(r"BO_ (\d+) ", line):
            message = int(found[1])
        elif found := re.match(r" SG_ (TICKS_\w+|\w+_ALIVE) : (\d+)\|(\d+)@1", line):
            counts.setdefault(message, []).append((int(found[2]), int(found[3])))
    return counts


def carry_bus(drive, folder, at_ns, to_ns):
    counts = bits_of((drive / "vehicle.dbc").read_text())
    before, here, skipped, lines = {}, {}, {}, []
    for line in (drive / "can.log").read_text().splitlines():
        stamp, interface, frame = line.split()
        t_ns, (name, data) = round(float(stamp[1:-1]) * 1e6) * 1000, frame.split("#")
        identity, value = int(name, 16), int.from_bytes(bytes.fromhex(data), "little")
        read = [value >> first & (1 << bits) - 1 for first, bits in counts.get(identity, [])]
        if t_ns < at_ns:
            here[identity] = read
        elif t_ns < to_ns:
            before[identity] = read
            continue
        else:
            if identity not in skipped:
                skipped[identity] = [b - h for b, h in zip(before.get(identity, read), here.get(identity, read))]
            for (first, bits), count, gone in zip(counts.get(identity, []), read, skipped[identity]):
                mask = (1 << bits) - 1
                value = value & ~(mask << first) | (count - gone & mask) << first
            t_ns += at_ns - to_ns
        data = value.to_bytes(len(data) // 2, "little").hex().upper()
        lines.append(f"({t_ns // 10**9}.{t_ns // 1000 % 10**6:06}) {interface} {name}#{data}\n")
    (folder / "can.log").write_text("".join(lines))


def pictures_of(avi):
    """The JPEGs of an AVI in their order."""
    data, at, found = avi.read_bytes(), 12, []
    while at + 8 <= len(data):
        name, size = data[at : at + 4], struct.unpack("<I", data[at + 4 : at + 8])[0]
        if name in (b"LIST", b"RIFF"):
            at += 12
            continue
        if name == b"00dc":
            found.append(data[at + 8 : at + 8 + size])
        at += 8 + size + size % 2
    return found


def carry_camera(drive, folder, camera, at_ns, to_ns):
    (folder / "video" / camera).mkdir(parents=True)
    rows = []
    for row, picture in zip(load(drive / f"video/{camera}.csv"), pictures_of(drive / f"video/{camera}.avi"), strict=True):
        t_ns, arrival_ns = int(row["t_ns"]), int(row["arrival_ns"])
        if t_ns >= to_ns:
            row |= {"t_ns": t_ns + at_ns - to_ns, "arrival_ns": arrival_ns + at_ns - to_ns}
        elif arrival_ns >= at_ns:
            continue
        row["frame"] = len(rows)
        rows.append(row)
        (folder / f"video/{camera}/{row['frame']:06}.jpg").write_bytes(picture)
    save(folder / f"video/{camera}.csv", rows, list(rows[0]))


def carry_off(drive, folder, at_ns, to_ns):
    """Writes FOLDER, a recording: DRIVE up to at_ns, and from to_ns on as if that were at_ns. Nothing of DRIVE changes."""
    folder.mkdir()
    for file in ("vehicle.dbc", "can-signals.yaml", "calibration.yaml", "landmarks.csv", "landmarks"):
        (folder / file).symlink_to((drive / file).resolve())
    carry_bus(drive, folder, at_ns, to_ns)
    for camera in sorted(file.stem for file in (drive / "video").glob("*.avi")):
        carry_camera(drive, folder, camera, at_ns, to_ns)
    truth = load(drive / "truth.csv")
    kept = [r for r in truth if not at_ns <= int(r["t_ns"]) < to_ns]
    for row in kept:
        row["t_ns"] = int(row["t_ns"]) + (at_ns - to_ns if int(row["t_ns"]) >= to_ns else 0)
    save(folder / "truth.csv", kept, list(truth[0]))
    about = (drive / "recording.yaml").read_text()
    (folder / "recording.yaml").write_text(re.sub(r"^streams:.*\n", "", about, flags=re.M))
