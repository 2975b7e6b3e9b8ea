# SPDX-License-Identifier: Apache-2.0
"""`waymark import BAG`: an MCAP file or a ROS bag as a recording."""

import argparse
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection

from ..mcapio import streams
from ..recording import RecordingWriter
from ..ros import typestore
from . import tables
from .attachments import write_attachments
from .collection import Collection
from .takers import TAKERS, tf_static

_EXAMPLES = """examples:
  waymark import drive.mcap --out recordings/drive
  waymark import rosbag2_2026_05_01/ --out recordings/drive --motion /odom --truth /vicon/pose
  waymark check config/robot.yaml recordings/drive

A bag is an MCAP file, a folder of rosbag2, or a .bag of ROS 1. Taken: pictures and camera_info, odometry and twist, IMU, NavSatFix,
AprilTag detections, CAN frames, /tf_static (mountings), and what `waymark export` wrote. The rest is listed.
Exit code: 0 done, 1 the work failed, 2 usage."""


class ImportFailure(Exception):
    """What a user did wrong, or what a bag lacks."""


def _choose(into: Collection, kind: str, wanted: str | None, option: str) -> str | None:
    """The topic of a kind: the wanted one, else the one with the most messages."""
    topics = into.rows.get(kind, {})
    if wanted:
        if wanted not in topics:
            raise ImportFailure(f"{option} {wanted}: the bag has no such topic of that kind; it has: {', '.join(sorted(topics)) or 'none'}")
        return wanted
    return max(sorted(topics), key=lambda topic: len(topics[topic])) if topics else None


def _choose_one(into: Collection, kind: str, wanted: str | None, option: str, what: str) -> str | None:
    """The chosen topic of a kind of which a recording has one; the others are refused."""
    topic = _choose(into, kind, wanted, option)
    for other in into.rows.get(kind, {}):
        if other != topic:
            into.refuse(other, f"{what} {topic}; {option} {other} takes this one")
    return topic


def _write_motion(into: Collection, given: argparse.Namespace) -> None:
    topic = _choose_one(into, "motion", given.motion, "--motion", "motion comes from")
    if not topic:
        return
    written = tables.motion(into.rows["motion"][topic])
    if written:
        into.writer.table(*written)
    elif topic in into.rows.get("poses", {}):
        into.note(topic, "its twist is always 0: differences of its poses are used (increments.csv)")
        into.writer.table("increments.csv", tables.increments(into.rows["poses"][topic]))
    else:
        into.refuse(topic, "its twist is always 0")


def _write_imu(into: Collection, given: argparse.Namespace) -> None:
    topic = _choose_one(into, "imu", given.imu, "--imu", "the IMU is")
    if not topic:
        return
    into.writer.table("imu.csv", tables.imu(into.rows["imu"][topic]))
    place = tables.mounting(into, into.frame_ids_imu[topic], given.base, optical=False)
    if place:
        into.writer.calibration["imu"] = {"mounting": {"rpy_deg": place["rpy_deg"]}}
    else:
        into.note(topic, f"/tf_static has no way from '{into.frame_ids_imu[topic]}' to '{given.base}': axes as {given.base}'s are assumed")


def _write_positions(into: Collection, given: argparse.Namespace) -> None:
    topic = _choose(into, "fixes", given.gnss, "--gnss")
    if topic:
        table, origin = tables.gnss(into.rows["fixes"][topic], given.origin)
        into.writer.table("gnss.csv", table)
        into.writer.calibration["gnss"] = {"origin": origin}
    if topic := given.truth and _choose(into, "poses", given.truth, "--truth"):
        into.writer.table("truth.csv", tables.truth(into.rows["poses"][topic]))
    for topic in into.rows.get("poses", {}):
        if topic != given.truth and topic not in into.rows.get("motion", {}):
            into.refuse(topic, f"poses are an answer, not a sensor; --truth {topic} takes them as truth.csv")


def _write_cameras(into: Collection, base: str) -> None:
    for topic, rows in sorted(into.rows.get("tags", {}).items()):
        into.writer.table("marker-corners.csv", tables.tags(rows, into.camera(topic)))
    for name, frame in sorted(into.frame_ids.items()):
        camera = into.cameras.setdefault(name, {})
        place = tables.mounting(into, frame, base, optical=True)
        if place:
            camera["mounting"] = place
        else:
            into.note(f"camera {name}", f"/tf_static leads from '{frame}' to no '{base}': write its mounting into calibration.yaml")
    cameras = {name: camera for name, camera in sorted(into.cameras.items()) if "model" in camera}
    for name in sorted(set(into.cameras) - set(cameras)):
        into.note(f"camera {name}", "without camera_info; calibrate it (`waymark calibrate camera`), or write its lens into calibration.yaml")
    if cameras:
        into.writer.calibration["cameras"] = cameras
    if into.families:
        into.writer.calibration["x_marker_families"] = sorted(into.families)


def _is_ours(connection: Connection) -> bool:
    return connection.topic.startswith("/recording/") and connection.msgtype.startswith("waymark_msgs/msg/")


def _read(bag: AnyReader, into: Collection, progress: Callable[[int, int], None] | None) -> dict[str, list[Any]]:
    """Takes every message that has a taker; rows of our own tables by their file."""
    own: dict[str, list[Any]] = {}
    taken = [c for c in bag.connections if c.msgtype in TAKERS or c.topic.endswith("tf_static") or _is_ours(c)]
    total = sum(connection.msgcount for connection in taken)
    for count, (connection, log_ns, raw) in enumerate(bag.messages(taken)):
        try:
            message = bag.deserialize(raw, connection.msgtype)
            if _is_ours(connection):
                own.setdefault(connection.topic, []).append(message)
            elif connection.topic.endswith("tf_static"):
                tf_static(into, connection.topic, message, log_ns)
            else:
                TAKERS[connection.msgtype](into, connection.topic, message, log_ns)
        except OSError:
            raise
        except Exception as error:  # what the decoder raises on bytes that don't fit the type is its own matter
            raise ImportFailure(f"{connection.topic}: the message of {log_ns} ns ({len(raw)} bytes) is no {connection.msgtype}: "
                                f"{error or type(error).__name__}") from error
        if progress and count % 500 == 0:
            progress(count, total)
    for connection in bag.connections:
        if connection not in taken:
            into.refuse(connection.topic, f"{connection.msgtype}: a recording has no place for it")
    return own


def import_bag(path: Path, out: Path, given: argparse.Namespace, progress: Callable[..., None] | None = None) -> Collection:
    """Writes the recording of a bag; what was found stands in the collection."""
    with AnyReader([path], default_typestore=typestore()) as bag, RecordingWriter(out) as writer:
        into = Collection(writer)
        own = _read(bag, into, progress)
        ours = write_attachments(path, writer) if path.suffix == ".mcap" else False
        for topic, rows in sorted(own.items()):
            columns = [name for name in rows[0].__dataclass_fields__ if name not in ("header", "__msgtype__")]
            writer.table(topic.removeprefix("/recording/").replace("_", "-") + ".csv", streams.rows_to_table(rows, columns))
        for frame in sorted(into.can, key=lambda frame: frame.t_ns):
            writer.can(frame)
        if ours:  # an export of ours: what isn't taken follows from the recording
            into.refused.clear()
            if "/truth/pose" in into.rows.get("poses", {}):
                writer.table("truth.csv", tables.truth(into.rows["poses"]["/truth/pose"]))
        else:
            _write_motion(into, given)
            _write_imu(into, given)
            _write_positions(into, given)
            _write_cameras(into, given.base)
    return into


def _has_end(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - 8, 0))
        return file.read() == b"\x89MCAP0\r\n"


def main(argv: list[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(prog="waymark import", description="Makes a recording of an MCAP file or a ROS bag.",
                                     epilog=_EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bag", metavar="BAG", type=Path)
    parser.add_argument("--out", metavar="FOLDER", type=Path, required=True, help="the recording's folder; new or empty")
    parser.add_argument("--motion", metavar="TOPIC", help="odometry or twist that drives (default: the one with the most messages)")
    parser.add_argument("--imu", metavar="TOPIC", help="IMU to take (default: the one with the most messages)")
    parser.add_argument("--gnss", metavar="TOPIC", help="NavSatFix to take (default: the one with the most messages)")
    parser.add_argument("--origin", metavar=("LAT", "LON", "ALT"), type=float, nargs=3, help="of the map (default: the first fix)")
    parser.add_argument("--truth", metavar="TOPIC", help="poses that are the truth; `waymark eval` compares with them")
    parser.add_argument("--base", metavar="FRAME", default="base_link", help="the robot's frame in /tf_static (default base_link)")
    given = parser.parse_args(argv)
    if given.out.exists() and any(given.out.iterdir()):
        parser.error(f"{given.out} is not empty: give a new folder")
    progress = None
    if sys.stderr.isatty():
        progress = lambda done, total: print(f"\r{100 * done // max(total, 1)} %", end="", file=sys.stderr)  # noqa: E731
    try:
        into = import_bag(given.bag, given.out, given, progress)
    except Exception as error:  # the readers of bags raise whatever a broken file leads to
        shutil.rmtree(given.out, ignore_errors=True)
        cut = given.bag.suffix == ".mcap" and given.bag.is_file() and not _has_end(given.bag)
        hint = "; the file has no end, as of a recorder that was killed: `mcap recover` (of MCAP's makers) completes it" if cut else ""
        print(f"waymark import: {given.bag}: {error or type(error).__name__}{hint}", file=sys.stderr)
        return 1
    if progress:
        print("\r\033[K", end="", file=sys.stderr)
    for topic, text in sorted(into.notes.items()):
        print(f"note: {topic}: {text}")
    for topic, text in sorted(into.refused.items()):
        print(f"not taken: {topic}: {text}")
    print(f"{given.out}: {', '.join(into.writer.meta['streams']) or 'nothing'}")
    if not into.writer.meta["streams"]:
        shutil.rmtree(given.out, ignore_errors=True)
        print(f"waymark import: {given.bag}: nothing in it is a sensor's stream that a recording has", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
