# SPDX-License-Identifier: Apache-2.0
"""Takers of pictures, camera_info and tags, and the cameras of the recording that they make."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..recording import Frame, jpeg_size
from ..tables import Array, Table
from . import cameras, names, pictures, tables, tags
from .collection import Collection, stamp_ns
from .decoding import Bad, BadMessage, Topic
from .pictures import Depths
from .views import TagRows


_FIRST = 5  # pictures; the size of most of them is the camera's


def _picture(into: Collection, topic: str, message: Any, log_ns: int, make: Callable[[Any, Depths], bytes]) -> None:
    camera = into.sight.cameras.by_topic.get(topic)
    if camera is None:
        return
    depths = into.sight.depths.setdefault(topic, Depths(lambda text: into.note(topic, text), names.is_distance(topic)))
    jpeg = make(message, depths)
    t_ns = stamp_ns(message, log_ns)
    frame = Frame(t_ns, into.arrival_ns(topic, t_ns, log_ns), jpeg)
    camera.frame = camera.frame or message.header.frame_id.lstrip("/")
    if camera.size is None:
        camera.waiting.append(frame)
        if len(camera.waiting) == _FIRST:
            begin(into, topic, camera)
    else:
        _write_picture(into, topic, camera, frame)


def begin(into: Collection, topic: str, camera: cameras.Camera) -> None:
    """Decides the size of a camera's pictures, and writes the first ones."""
    sizes = [jpeg_size(frame.jpeg) for frame in camera.waiting]
    if not sizes:
        return
    camera.size = max(sizes, key=sizes.count)
    into.sight.topics.setdefault(camera.name, topic)
    for frame in camera.waiting:
        try:
            _write_picture(into, topic, camera, frame)
        except BadMessage as problem:
            into.spoilt(topic, frame.t_ns, str(problem))
    camera.waiting.clear()


def _write_picture(into: Collection, topic: str, camera: cameras.Camera, frame: Frame) -> None:
    size = jpeg_size(frame.jpeg)
    if size != camera.size:
        assert camera.size
        raise BadMessage(f"a picture of {size[0]} x {size[1]} among those of {camera.size[0]} x {camera.size[1]}")
    try:
        into.writer.frame(camera.name, frame)
    except ValueError:  # AVI's lengths have 32 bits
        raise BadMessage("the video has 4 GB, the most that an AVI file holds") from None


def image(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """A raw picture becomes a grey JPEG."""
    _picture(into, topic, message, log_ns, pictures.jpeg_of_image)


def compressed_image(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """A JPEG goes through as it is; another kind becomes a grey JPEG."""
    _picture(into, topic, message, log_ns, pictures.jpeg_of_compressed)


def camera_info(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """The first one with a lens is the camera's calibration."""
    into.sight.cameras.camera_info(topic, message, stamp_ns(message, log_ns))


def detections(kind: str) -> Callable[[Collection, str, Any, int], None]:
    """The taker of a type of detections of tags."""
    reader = tags.READERS[kind]

    def take(into: Collection, topic: str, message: Any, log_ns: int) -> None:
        t_ns = tags.stamp_ns(message) or log_ns
        arrival_ns = into.arrival_ns(topic, t_ns, log_ns)
        found = tags.tags_of(message)
        bad: list[str] = []
        for tag in found:
            try:
                seen = reader.read(tag)
            except BadMessage as problem:
                bad.append(str(problem))
                continue
            if seen is None:
                continue
            frame = tags.frame_of(tag, message)
            rows = into.sight.tags.setdefault((topic, frame), TagRows(kind, frame, seen.corners is not None))
            rows.whole.extend((t_ns, arrival_ns, seen.id))
            rows.values.extend(seen.corners or seen.place or [])
            if seen.remark:
                into.find(topic, seen.remark)
        if getattr(message, "boards", ()):
            into.note(topic, "its boards are not taken: a recording has single tags")
        if bad and len(bad) == len(found):
            raise BadMessage(bad[0])
        for why in bad:
            into.sight.bad_tags.setdefault(topic, Bad(t_ns, why)).count += 1
        if reader.families:
            for family in {tag.family for tag in message.detections}:
                into.sight.families.add(tags.family_of(family))
                if not tags.is_known(family):
                    into.note(topic, f"'{family}' is no family whose way up is known: its corners are taken as of the newer ones; a print that comes out "
                                     "upside down is half a turn from them")

    return take


def problem_of(topic: Topic, raw: Any) -> str | None:
    """Why a topic's first message is no picture that can be taken; None where it is one."""
    try:
        message = topic.decode(raw)
        make = pictures.jpeg_of_image if topic.kind == cameras.PICTURE_KINDS[0] else pictures.jpeg_of_compressed
        make(message, Depths(lambda text: None, names.is_distance(topic.name)))
    except pictures.NotTaken as problem:
        return str(problem)
    except Exception:  # one bad message says nothing of the topic; reading names it
        return None
    return None


def write(into: Collection, base: str, rectified_tags: bool | None) -> None:
    """Writes the tables of tags, and cameras into calibration.yaml."""
    for name, topic in into.sight.topics.items():
        twice = into.writer.restamp(name, into.clocks[topic])
        if twice:
            into.note(topic, f"{twice} of its pictures have the stamp of another one: a run takes the first")
    found = into.sight.cameras.found()
    seeing = {id(cameras.of_detections(found, topic, rows.frame)) for (topic, _), rows in into.sight.tags.items()}
    found = [camera for camera in found if not camera.is_spare or id(camera) in seeing]
    entries: dict[str, dict[str, Any]] = {}
    for camera in found:
        label = f"camera {camera.name}"
        for note in camera.lens.notes:
            into.note(label, note)
        if not camera.frame:
            into.note(label, "its messages name no frame: write its mounting into calibration.yaml")
        elif place := tables.mounting(into, camera.frame, base, optical=True):
            entries.setdefault(camera.name, dict(camera.lens.entry or {}))["mounting"] = place
        else:
            into.note(label, f"{into.frames.why_not(camera.frame, base)}: write its mounting into calibration.yaml")
        if camera.lens.entry:
            entries.setdefault(camera.name, dict(camera.lens.entry))
    _write_tags(into, found, rectified_tags, base)
    entries = {name: entry for name, entry in sorted(entries.items()) if "model" in entry}
    if entries:
        into.writer.calibration["cameras"] = entries
    if into.sight.families:
        into.writer.calibration["x_marker_families"] = sorted(into.sight.families)
    if "marker-corners.csv" in into.writer.streams():
        family = min(into.sight.families, default="aruco_4x4_50")
        into.note("marker-corners.csv", f"poses need the edge of the prints: write `markers: {{family: {family}, size_m: ...}}` into calibration.yaml")


def _write_tags(into: Collection, found: list[cameras.Found], rectified: bool | None, base: str) -> None:
    """Corners in marker-corners.csv, poses in markers.csv; where a camera has both, its corners."""
    written: dict[str, list[Table]] = {"marker-corners.csv": [], "markers.csv": []}
    of_corners: set[str] = set()
    for topic, bad in into.sight.bad_tags.items():
        into.note(topic, f"{bad.count} of its tags {'is' if bad.count == 1 else 'are'} left out; the first at {bad.t_ns / 1e9:.3f} s: {bad.why}")
    for (topic, frame), rows in sorted(into.sight.tags.items(), key=lambda item: (not item[1].has_corners, item[0])):
        camera = cameras.of_detections(found, topic, rows.frame)
        is_lone = sum(name == topic for name, _ in into.sight.tags) == 1
        name = camera.name if camera else into.camera(topic if is_lone else frame)
        columns = rows.columns()
        columns[0], columns[-1] = into.clocks[topic](columns[0], columns[-1])
        if rows.has_corners:
            pixels = np.stack(columns[2:10], axis=1).reshape(-1, 4, 2)
            if camera and camera.lens.entry and (said := tags.of_another_picture(camera.lens.entry, pixels)):
                into.find(topic, f"{said} Write the lens of the pictures that the detector read into calibration.yaml")
            if camera and (tags.READERS[rows.kind].is_of_rectified if rectified is None else rectified):
                try:
                    columns = _in_raw(into, topic, camera, columns, is_said=rectified is not None)
                except BadMessage as problem:
                    into.refuse(topic, str(problem))
                    continue
            of_corners.add(name)
            if camera and camera.lens.entry:
                written["marker-corners.csv"].append(tags.corner_table(columns, name))
            else:
                file = f"marker-corners-{name}.csv"
                written.setdefault(file, []).append(tags.corner_table(columns, name))
                into.note(topic, f"its corners need the lens of camera {name}, which the bag doesn't have: they are kept in {file}; write the lens into "
                                 "calibration.yaml (`waymark calibrate camera`) and name the file marker-corners.csv")
        elif name in of_corners:
            into.refuse(topic, "poses of tags whose corners are taken")
        elif not _is_optical(rows.frame, camera):
            into.refuse(topic, f"its poses are in '{rows.frame}', which is no camera's optical frame")
        else:
            if tags.READERS[rows.kind].is_half_turned:
                into.note(topic, "its messages name no family: the poses are taken as of tag36h11, which is read half a turn from the library's way up")
            if (far := float(np.median(columns[2]))) > tags.FARTHEST_M:
                into.find(topic, f"half of its tags are more than {far:.4g} m away, farther than a print is read: the edge of the prints that its detector "
                                 "was given is in another unit; set it in metres there, or give corners")
            place = tables.mounting(into, rows.frame, base, optical=True)
            written["markers.csv"].append(tags.pose_table(columns, name, place["rpy_deg"] if place else [0.0, 0.0, 0.0]))
    for file, parts in written.items():
        if parts:
            whole = {column: np.concatenate([part[column] for part in parts]) for column in parts[0]}
            into.writer.table(file, tables.without_arrival(whole))


def _is_optical(frame: str, camera: cameras.Found | None) -> bool:
    """Whether poses are in a camera's optical frame: that of its pictures, one that is named so, or, without any camera, one named after it."""
    return "optical" in frame or (frame in ("", camera.frame) if camera else "cam" in frame or not frame)


def _in_raw(into: Collection, topic: str, camera: cameras.Found, columns: list[Array], is_said: bool) -> list[Array]:
    """Corners of the rectified picture as those of the raw one."""
    pixels = np.stack(columns[2:10], axis=1).reshape(-1, 2)
    moved = tags.to_raw(camera, pixels)
    if moved is None:
        return columns
    if not is_said:
        into.note(topic, f"its corners are taken as those of the rectified picture, which apriltag_ros reads, and written as pixels of the raw one by the "
                         f"lens of camera {camera.name}; `--tags raw` takes them as they are")
    return [columns[0], columns[1], *moved.reshape(-1, 8).T, columns[10]]
