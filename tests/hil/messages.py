# SPDX-License-Identifier: Apache-2.0
"""What a run said over LCM, out of the log of LCM's own logger, by code that LCM's own generator made."""
import importlib
import math
import pathlib
import struct
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def types(work):
    """The module of message types, made in `work`."""
    folder = work / "types"
    subprocess.run(["lcm-gen", "-p", "--ppath", folder, *sorted((ROOT / "msgs/lcm").glob("*.lcm"))], check=True)
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    return importlib.import_module("waymark")


def logged(path):
    """(when it was heard, UTC in microseconds; channel; message) of an LCM log, in its order; a last one that was cut off is left out. Source: LCM's log format."""
    data, at = pathlib.Path(path).read_bytes(), 0
    while at + 28 <= len(data):
        sync, _, utc_us, name, length = struct.unpack_from(">IqqII", data, at)
        if sync != 0xEDA1DA01 or at + 28 + name + length > len(data):
            return
        at += 28
        yield utc_us, data[at:at + name].decode(), data[at + name:at + name + length]
        at += name + length


def heard(work, path):
    """Poses and healths, decoded."""
    waymark = types(work)
    poses, healths = [], []
    for _, channel, message in logged(path):
        if channel == "WAYMARK_POSE":
            poses.append(waymark.pose_t.decode(message))
        if channel == "WAYMARK_HEALTH":
            healths.append(waymark.health_t.decode(message))
    return poses, healths


def heading(pose):
    q = pose.orientation_xyzw
    return 2 * math.atan2(q[2], q[3])


def rows(poses):
    """(t_ns, x, y, heading) of each."""
    return [(p.t_ns, p.position_m[0], p.position_m[1], heading(p)) for p in poses]


def name_of(source):
    return bytes(b & 0xff for b in source.name).rstrip(b"\0").decode()


def source(health, name):
    """What this health says of a source; None where it has none of this name."""
    return next((s for s in health.sources[:health.source_count] if name_of(s) == name), None)
