# SPDX-License-Identifier: Apache-2.0
"""`waymark import BAG`: an MCAP file or a ROS bag as a recording."""

import argparse
import shutil
import sys
import time
from pathlib import Path

from ..mcapio import streams
from ..recording import RecordingWriter
from . import sight, tables
from .attachments import write_attachments
from .collection import Collection
from .containers import Bag, Unreadable
from .reading import Progress, read

_LINE_EVERY_S = 5.0  # between two lines of progress where standard error is no terminal

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


def import_bag(path: Path, out: Path, given: argparse.Namespace, progress: Progress | None = None) -> Collection:
    """Writes the recording of a bag; what was found stands in the collection."""
    with RecordingWriter(out) as writer, Bag(path, out) as bag:
        into = Collection(writer)
        own = read(bag, into, progress)
        ours = write_attachments(bag, writer)
        for topic, rows in sorted(own.items()):
            columns = [name for name in rows[0].__dataclass_fields__ if name not in ("header", "__msgtype__")]
            writer.table(topic.removeprefix("/recording/").replace("_", "-") + ".csv", streams.rows_to_table(rows, columns))
        into.can.finish()
        if ours:  # an export of ours: what isn't taken follows from the recording
            into.refused.clear()
            if "/truth/pose" in into.rows.get("poses", {}):
                writer.table("truth.csv", tables.truth(into.rows["poses"]["/truth/pose"]))
        else:
            _write_motion(into, given)
            _write_imu(into, given)
            _write_positions(into, given)
            sight.write(into, given.base, None if given.tags is None else given.tags == "rectified")
        for note in bag.all_notes():
            into.note(path.name, note)
    return into


class _Shown:
    """Progress on standard error: a number that runs on a terminal, a line every so often elsewhere."""

    def __init__(self) -> None:
        self._begin = self._said = time.monotonic()
        self._is_terminal = sys.stderr.isatty()

    def __call__(self, share: float) -> None:
        now = time.monotonic()
        if now - self._said < (0.1 if self._is_terminal else _LINE_EVERY_S):
            return
        self._said = now
        left_s = (now - self._begin) * (1 - share) / max(share, 1e-3)
        text = f"waymark import: {100 * share:.0f} %, {left_s:.0f} s left"
        print(f"\r{text}\033[K" if self._is_terminal else text, end="" if self._is_terminal else "\n", file=sys.stderr, flush=True)

    def close(self) -> None:
        """Clears the running number."""
        if self._is_terminal:
            print("\r\033[K", end="", file=sys.stderr)


def _failed(given: argparse.Namespace, progress: _Shown, text: str) -> int:
    progress.close()
    shutil.rmtree(given.out, ignore_errors=True)
    print(f"waymark import: {given.bag}: {text}", file=sys.stderr)
    return 1


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
    parser.add_argument("--tags", choices=("raw", "rectified"), help="whose pixels the corners of tags are (default: as their node reads)")
    given = parser.parse_args(argv)
    if given.out.exists() and any(given.out.iterdir()):
        parser.error(f"{given.out} is not empty: give a new folder")
    progress = _Shown()
    try:
        into = import_bag(given.bag, given.out, given, progress)
    except (ImportFailure, Unreadable) as problem:
        return _failed(given, progress, str(problem))
    except MemoryError:
        return _failed(given, progress, "there is not enough memory")
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _failed(given, progress, f"{where}{error.strerror or 'reading or writing fails'}")
    progress.close()
    for topic, texts in sorted(into.notes.items()):
        for text in texts:
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
