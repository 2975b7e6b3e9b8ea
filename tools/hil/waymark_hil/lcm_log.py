# SPDX-License-Identifier: Apache-2.0
"""What a run sent over LCM, out of a log in the format of LCM's own logger, by code that LCM's own generator made."""
import importlib
import math
import pathlib
import struct
import sys

from . import HilError

# Device states of source_health_t, by the names that people use.
DEVICES = ["recording", "works", "absent", "down", "error-passive", "bus-off", "stalled", "frozen"]
STATES = ["searching", "tracking", "dead_reckoning", "lost", "degraded"]


def types(folder):
    """The module of message types in a folder that `lcm-gen -p --ppath` or the build made."""
    if not (pathlib.Path(folder) / "waymark/pose_t.py").is_file():
        raise HilError(f"{folder}: has no LCM types (waymark/pose_t.py): is waymark installed as a whole?")
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    return importlib.import_module("waymark")


def logged(path):
    """(when it was received, UTC in microseconds; channel; message) of an LCM log, in its order; a last one that was cut off is left out.
    Source: LCM's log format."""
    data, at = pathlib.Path(path).read_bytes(), 0
    while at + 28 <= len(data):
        sync, _, utc_us, name, length = struct.unpack_from(">IqqII", data, at)
        if sync != 0xEDA1DA01 or at + 28 + name + length > len(data):
            return
        at += 28
        yield utc_us, data[at:at + name].decode(errors="replace"), data[at + name:at + name + length]
        at += name + length


def heard(folder, path, prefix="WAYMARK_"):
    """([(utc_us, pose)], [(utc_us, health)]), decoded. A message of another type is left out."""
    waymark, poses, healths = types(folder), [], []
    for utc_us, channel, message in logged(path):
        for name, kind, out in (("POSE", waymark.pose_t, poses), ("HEALTH", waymark.health_t, healths)):
            if channel == prefix + name:
                try:
                    out.append((utc_us, kind.decode(message)))
                except (ValueError, struct.error):
                    continue
    return poses, healths


def heading(pose):
    """Heading of a pose_t, rad."""
    x, y, z, w = pose.orientation_xyzw
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def rows(poses):
    """(t_ns, x, y, heading, z) of each."""
    return [(p.t_ns, p.position_m[0], p.position_m[1], heading(p), p.position_m[2]) for p in poses]


def name_of(source):
    """Name of a source_health_t."""
    return bytes(b & 0xff for b in source.name).rstrip(b"\0").decode(errors="replace")


def source(health, name):
    """What this health has of a source; None where it has none of this name."""
    return next((s for s in health.sources[:health.source_count] if name_of(s) == name), None)


def sigma_m(pose):
    """One sigma of the position in the plane, m."""
    return math.sqrt(max(pose.covariance[0][0] + pose.covariance[1][1], 0.0))  # in this order NaN stays
