# SPDX-License-Identifier: Apache-2.0
"""Drives of the small robot with one fault each, at a random time: what black boxes of a fleet hold. Units: m, rad, s."""
import dataclasses
import math
import random
import re

import common  # noqa: F401  (puts small_robot on the path)
import small_robot

START_NS = small_robot.START_NS


@dataclasses.dataclass(frozen=True)
class Fault:
    """A fault, and how the cause that is reported has to begin."""

    name: str
    cause: str
    change: object  # function(folder, time of the fault in s, random source)
    dies: bool = False


def _rows(folder, name, change, at_s):
    """Changes the rows of a table from a time on. change(fields) returns False to leave the row out."""
    path = folder / name
    head, *lines = path.read_text().splitlines()
    names, out = head.split(","), [head]
    for line in lines:
        fields = dict(zip(names, line.split(",")))
        if int(fields["t_ns"]) < START_NS + at_s * 1e9 or change(fields) is not False:
            out.append(",".join(fields.values()))
    path.write_text("\n".join(out) + "\n")


def _can(folder, change, at_s):
    """Changes the data of the CAN frames from a time on: change(id, hex) returns hex, or None to leave it out."""
    path = folder / "can.log"
    out = []
    for line in path.read_text().splitlines():
        seconds, identifier, data = re.match(r"\(([0-9.]+)\) can0 (\w+)#(\w*)", line).groups()
        late = float(seconds) - START_NS * 1e-9 >= at_s
        data = change(identifier, data) if late else data
        if data is not None:
            out.append(f"({seconds}) can0 {identifier}#{data}")
    path.write_text("\n".join(out) + "\n")


def carried(folder, at_s, source):
    """The robot is lifted and set down elsewhere: from then on it sees the room from there."""
    angle = source.choice([-1, 1]) * source.uniform(1.2, 2.8)
    path = small_robot.drive()
    c, s = math.cos(angle), math.sin(angle)
    moved = [(t, x, y, h, *rest) if t < at_s else (t, c * x - s * y, s * x + c * y, h + angle, *rest) for t, x, y, h, *rest in path]
    sightings = small_robot._sightings(moved, random.Random(source.random()))
    (folder / "sightings.csv").write_text(small_robot.table(sightings))


def covered(folder, at_s, _):
    _rows(folder, "sightings.csv", lambda f: False, at_s)


def turned(folder, at_s, source):
    """The sensor is knocked: its bearings are off by a constant."""
    by = source.choice([-1, 1]) * source.uniform(0.35, 0.9)
    _rows(folder, "sightings.csv", lambda f: f.update(bearing_rad=f"{float(f['bearing_rad']) + by:.6f}"), at_s)


def scaled(folder, at_s, source):
    factor = source.choice([source.uniform(0.6, 0.75), source.uniform(1.3, 1.6)])
    _rows(folder, "sightings.csv", lambda f: f.update(range_m=f"{float(f['range_m']) * factor:.6f}"), at_s)


def unknown(folder, at_s, _):
    _rows(folder, "sightings.csv", lambda f: f.update(id=str(int(f["id"]) + 100)), at_s)


def dead_wheel(side):
    def change(folder, at_s, _):
        kept = {}

        def frozen(identifier, data):
            if identifier != "100":
                return data
            part = slice(0, 8) if side == "left" else slice(8, 16)
            kept.setdefault("data", data[part])
            return kept["data"] + data[8:] if side == "left" else data[:8] + kept["data"]
        _can(folder, frozen, at_s)
    return change


def stuck_gyro(folder, at_s, _):
    kept = {}

    def frozen(identifier, data):
        return kept.setdefault("data", data) if identifier == "101" else data
    _can(folder, frozen, at_s)


def none(*_):
    pass


FAULTS = [Fault("carried", "elsewhere", carried), Fault("sensor covered", "silent", covered), Fault("sensor turned", "bearings-off", turned),
          Fault("ranges scaled", "ranges-off", scaled), Fault("unknown identities", "identities-unknown", unknown),
          Fault("left encoder dead", "motion", dead_wheel("left")), Fault("right encoder dead", "motion", dead_wheel("right")),
          Fault("gyro stuck", "motion", stuck_gyro), Fault("program killed", "program-ended", none, dies=True)]


def write(folder, fault, seed, duration_s=60.0):
    """A drive with a fault. Returns the time of the fault in s after the start."""
    source = random.Random(seed)
    small_robot.DURATION_S = duration_s
    small_robot.write(folder, seed)
    # One place, one map: that of all robots of the fleet.
    (folder / "landmarks.csv").write_text(small_robot.table(
        [{"id": i + 1, "x_m": x, "y_m": y, "z_m": 0.2, "sigma_m": 0.01} for i, (x, y) in enumerate(small_robot.LANDMARKS)]))
    at_s = source.uniform(0.3, 0.6) * duration_s
    fault.change(folder, at_s, source)
    return at_s
