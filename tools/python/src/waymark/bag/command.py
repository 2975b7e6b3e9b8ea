# SPDX-License-Identifier: Apache-2.0
"""`waymark import BAG`: an MCAP file or a ROS bag as a recording."""

import argparse
import shutil
import sys
import time
import warnings
from pathlib import Path

import numpy as np

from ..mcapio import streams
from ..numbers import finite
from ..recording import RecordingWriter
from . import gnss, imu, motion, sight, tables, turns
from .attachments import write_attachments
from .collection import Collection, NoSuchTopic
from .containers import Bag, Unreadable
from .frames import is_world
from .reading import Progress, read

_LINE_EVERY_S = 5.0  # between two lines of progress where standard error is no terminal

_EXAMPLES = """examples:
  waymark import drive.mcap --out recordings/drive
  waymark import rosbag2_2026_05_01/ --out recordings/drive --motion /odom --truth /vicon/pose
  waymark check config/robot.yaml recordings/drive

A bag is an MCAP file, a folder or a .db3 of rosbag2, or a .bag of ROS 1; cut, compressed or renamed, too. Taken: pictures and camera_info, odometry and
twist, IMU, NavSatFix, tags, CAN frames, tf (mountings), and what `waymark export` wrote. The rest is listed. docs/bags.md has the conventions.
Exit code: 0 done, 1 the work failed, 2 usage."""


def _write_moving(into: Collection, given: argparse.Namespace) -> str:
    """Motion, IMU, positions and truth; the robot's frame."""
    base = into.frames.base(given.base)
    if base != given.base:
        into.note("tf", f"it has no '{given.base}': '{base}' is taken as the robot's frame; --base names another")
    for parent, child in sorted(into.frames.replaced):
        into.note("tf", f"tf_static has '{child}' in '{parent}' with other values later: the last ones are taken")
    for (parent, child), why in sorted(into.frames.broken.items()):
        into.note("tf", f"'{child}' in '{parent}' comes with {why}: {'such messages are' if into.frames.has(parent, child) else 'it is'} left out")
    for parent, child in sorted(into.frames.moving):
        if is_world(parent) and not {"odometry", "twists"} & into.samples.keys():
            into.find("tf", f"'{child}' moves in '{parent}', and no topic has that motion: transforms are not taken as one. Record the odometry's own topic "
                            "(nav_msgs/Odometry), or make one of them")
        elif not is_world(parent):
            into.note("tf", f"'{child}' moves in '{parent}': what is mounted on it has no place that stands still")
    if not into.samples and not into.sight.topics and not into.sight.tags:
        for topic in into.frames.topics:
            into.refuse(topic, "transforms place sensors, and the bag has none that is taken")
    turns.settle(into)
    drive = motion.choose(into, given, base)
    sensor = imu.choose(into, given, base, drive)
    if drive:
        motion.write(into, drive, has_gyro=sensor is not None)
    if sensor:
        imu.write(into, sensor, base)
    gnss.write(into, given, base, drive)
    poses = {**into.samples.get("poses", {}), **into.samples.get("odometry", {})}
    if given.truth:
        if given.truth not in poses:
            raise NoSuchTopic("--truth", given.truth, poses)
        into.writer.table("truth.csv", tables.truth(into, given.truth))
    for topic in into.samples.get("poses", {}):
        if topic not in (given.truth, given.motion):
            into.refuse(topic, f"poses are an answer, not a sensor; --truth {topic} takes them as truth.csv, --motion {topic} as odometry")
    return base


def import_bag(path: Path, out: Path, given: argparse.Namespace, progress: Progress | None = None) -> Collection:
    """Writes the recording of a bag; what was found stands in the collection."""
    with RecordingWriter(out) as writer, Bag(path, out) as bag:
        into = Collection(writer)
        own = read(bag, into, progress)
        into.absent = bag.absent()
        ours = write_attachments(bag, writer)
        for topic, rows in sorted(own.items()):
            columns = [name for name in rows[0].__dataclass_fields__ if name not in ("header", "__msgtype__")]
            writer.table(topic.removeprefix("/recording/").replace("_", "-") + ".csv", streams.rows_to_table(rows, columns))
        into.settle()
        if before := into.can.finish(into.clocks):
            into.note("can.log", f"{before} frames have times before 1970, which candump can't write: left out")
        if ours:  # an export of ours: what isn't taken follows from the recording
            into.refused.clear()
            if "/truth/pose" in into.samples.get("poses", {}):
                writer.table("truth.csv", tables.truth(into, "/truth/pose"))
        else:
            sight.write(into, _write_moving(into, given), None if given.tags is None else given.tags == "rectified")
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
    parser.add_argument("--motion", metavar="TOPIC", help="odometry or twist that drives (default: measured before commanded)")
    parser.add_argument("--motion-by", choices=("twists", "poses"), help="which part of odometry drives (default: the twists, where the poses agree)")
    parser.add_argument("--imu", metavar="TOPIC", help="IMU to take (default: the one that fits the motion)")
    parser.add_argument("--as-is", action="store_true", help="take the IMU as it is, without comparing it with the motion")
    parser.add_argument("--gnss", metavar="TOPIC", help="NavSatFix to take (default: the one with the smallest stated errors)")
    parser.add_argument("--origin", metavar=("LAT", "LON", "ALT"), type=finite, nargs=3, help="of the map (default: the first fix)")
    parser.add_argument("--truth", metavar="TOPIC", help="poses that are the truth; `waymark eval` compares with them")
    parser.add_argument("--base", metavar="FRAME", default="base_link", help="the robot's frame in tf (default base_link)")
    parser.add_argument("--tags", choices=("raw", "rectified"), help="whose pixels the corners of tags are (default: as their node reads)")
    given = parser.parse_args(argv)
    if given.out.exists() and any(given.out.iterdir()):
        parser.error(f"{given.out} is not empty: give a new folder")
    progress = _Shown()
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):  # what libraries warn of, the import says in its own words
            warnings.simplefilter("ignore")
            into = import_bag(given.bag, given.out, given, progress)
    except (NoSuchTopic, Unreadable) as problem:
        return _failed(given, progress, str(problem))
    except MemoryError:
        return _failed(given, progress, "there is not enough memory")
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _failed(given, progress, f"{where}{error.strerror or 'reading or writing fails'}")
    progress.close()
    for word, said in (("finding", into.findings), ("note", into.notes)):
        for topic, texts in sorted(said.items()):
            for text in texts:
                print(f"{word}: {topic}: {text}")
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
