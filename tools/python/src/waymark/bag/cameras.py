# SPDX-License-Identifier: Apache-2.0
"""Cameras of a bag: which topics show one camera, which of them is taken, and whose lens a camera_info is."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from ..recording import Frame
from . import lenses, names
from .decoding import Topic
from .lenses import Lens
from .names import InfoName, Name

PICTURE_KINDS = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
INFO_KIND = "sensor_msgs/msg/CameraInfo"
_ENOUGH = 0.9  # share of the most messages of a camera's topics; one with fewer is incomplete


@dataclass
class Camera:
    """A camera with the topic of pictures that is taken of it."""

    name: str
    topic: Name
    frame: str = ""
    size: tuple[int, int] | None = None
    waiting: list[Frame] = field(default_factory=list)  # the first pictures, while the size is not known


@dataclass
class Info:
    """What a topic of camera_info said: its first calibrated message (`message`), and how many came before that."""

    topic: InfoName
    frame: str = ""
    message: Any = None
    empty: int = 0
    changed_ns: int | None = None


@dataclass
class Found:
    """A camera as the recording has it. `info` and `is_rectified`: whose lens it is."""

    name: str
    lens: Lens
    frame: str
    folder: tuple[str, ...]
    info: Any = None
    is_rectified: bool = False
    has_pictures: bool = True
    is_spare: bool = False  # its pictures are not taken: it counts where tags were seen by it


@dataclass
class Cameras:
    """Topics of pictures and camera_info of a bag."""

    by_topic: dict[str, Camera] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    infos: dict[str, Info] = field(default_factory=dict)
    _others: list[Name] = field(default_factory=list)  # topics of pictures that are not taken

    def plan(self, topics: Iterable[Topic], unreadable: dict[str, str]) -> None:
        """Chooses a topic of pictures for each camera. `unreadable`: topics whose first message is no picture, with the reason."""
        groups: dict[tuple[str, ...], dict[str, tuple[Name, Topic, int]]] = {}
        folders: set[tuple[str, ...]] = set()
        for topic in topics:
            if topic.kind == INFO_KIND:
                folders.add(names.camera_info(topic.name).folder)
            if topic.kind in PICTURE_KINDS:
                name = names.picture(topic.name)
                known = groups.setdefault(name.group, {})
                count = (topic.count or 0) + (known[topic.name][2] if topic.name in known else 0)
                known[topic.name] = (name, topic, count)
        drawn = {name for known in groups.values() for name in known if names.is_drawn(name)}
        if len(drawn) < sum(map(len, groups.values())):  # else they are all that there is
            self.left_out.update({name: "a node has drawn on these pictures what it found, by their name" for name in drawn})
            groups = {key: kept for key, known in groups.items() if (kept := {name: rest for name, rest in known.items() if name not in drawn})}
        taken: set[str] = set()
        for _, choices in sorted(groups.items(), key=lambda item: (len(item[0]), item[0])):
            most = max(count for _, _, count in choices.values())

            def rank(choice: tuple[Name, Topic, int], most: int = most) -> tuple[Any, ...]:
                name, topic, count = choice
                return (topic.name in unreadable or not count, name.folder not in folders, count < _ENOUGH * most, name.is_rectified,
                        topic.kind != PICTURE_KINDS[0], len(topic.name), topic.name)

            best, _, _ = min(choices.values(), key=rank)
            camera = best.camera if best.camera not in taken else names.camera_name(["_".join(best.group)]).strip("_")
            while camera in taken:
                camera += "_2"
            taken.add(camera)
            for name, topic, _ in choices.values():
                if name is best:
                    self.by_topic[topic.name] = Camera(camera, name)
                else:
                    self.left_out[topic.name] = unreadable.get(topic.name) or f"the pictures of camera {camera} are those of {best.topic}"
                    self._others.append(name)

    def give_up(self, topic: str) -> None:
        """A topic that turned out to be no pictures."""
        if camera := self.by_topic.pop(topic, None):
            self._others.append(camera.topic)

    def camera_info(self, topic: str, message: Any, t_ns: int) -> None:
        """Keeps the first camera_info that has a lens."""
        info = self.infos.get(topic)
        if info is None:
            lenses.of(message, False, None)  # a definition that lacks a field shows here, where it costs a message
            info = self.infos[topic] = Info(names.camera_info(topic))
        info.frame = info.frame or message.header.frame_id.lstrip("/")
        if info.message is None:
            if lenses.is_calibrated(message):
                info.message = message
            else:
                info.empty += 1
        elif info.changed_ns is None and lenses.is_calibrated(message) and _differ(info.message, message):
            info.changed_ns = t_ns

    # ── at the end ──

    def found(self) -> list[Found]:
        """All cameras with their lenses: those with pictures, and those that a camera_info alone has."""
        out, used = [], set()
        cameras = [camera for camera in sorted(self.by_topic.values(), key=lambda camera: camera.name) if camera.size]
        for camera in cameras:
            info = self._info_of(camera, cameras)
            if not isinstance(info, Info):
                text = f"{info or 'without camera_info'}; calibrate it (`waymark calibrate camera`), or write its lens into calibration.yaml"
                out.append(Found(camera.name, Lens(None, [text]), camera.frame, camera.topic.folder))
                continue
            used.add(info.topic.topic)
            out.append(self._with(Found(camera.name, Lens(None), camera.frame or info.frame, camera.topic.folder), info,
                                  camera.topic.is_rectified or info.topic.is_rectified, camera.size))
        folders = {name.folder for name in self._others}
        for topic, info in sorted(self.infos.items()):
            if topic in used or any(info.topic.folder == camera.topic.folder for camera in cameras):
                continue
            name = info.topic.camera
            if name not in {found.name for found in out}:
                out.append(self._with(Found(name, Lens(None), info.frame, info.topic.folder, has_pictures=False, is_spare=info.topic.folder in folders),
                                      info, info.topic.is_rectified, None))
        return out

    @staticmethod
    def _with(found: Found, info: Info, is_rectified: bool, size: tuple[int, int] | None) -> Found:
        if info.message is None:
            found.lens = Lens(None, [f"all {info.empty} messages of {info.topic.topic} are of a camera that is not calibrated (K is 0 or 1); calibrate it "
                                     "(`waymark calibrate camera`), or write its lens into calibration.yaml"])
            return found
        found.lens = lenses.of(info.message, is_rectified, size)
        found.info, found.is_rectified = info.message, is_rectified
        if info.empty:
            found.lens.notes.append(f"the first {info.empty} messages of {info.topic.topic} are of a camera that is not calibrated (K is 0 or 1): the next is taken")
        if info.changed_ns is not None:
            found.lens.notes.append(f"its camera_info changes at {info.changed_ns / 1e9:.3f} s: the first one is taken")
        return found

    def _info_of(self, camera: Camera, cameras: list[Camera]) -> Info | str | None:
        """By the namespace, else by the frame, else the only one that is left; why it is not known which, where several are alike."""
        infos = list(self.infos.values())
        name = camera.topic
        beside = [info for info in infos if info.topic.folder in (name.folder, (*name.folder, name.topic.rsplit("/", 1)[-1]), name.group[:-1])]
        sharing = [other for other in cameras if other.topic.folder == name.folder]
        if len(sharing) > 1:  # /image_left and /image_right with /camera_info: their own, or by the frame
            own = [info for info in beside if name.rest and info.topic.rest == name.rest]
            beside = own or [info for info in beside if info.frame and info.frame == camera.frame]
        if beside:
            return min(beside, key=lambda info: (info.topic.folder != name.folder, info.message is None, info.topic.is_rectified != name.is_rectified,
                                                 info.topic.rest != name.rest, info.topic.topic))
        same = [info for info in infos if info.frame and info.frame == camera.frame]
        fitting = [info for info in same if info.message is not None and (int(info.message.width), int(info.message.height)) == camera.size]
        for choice in (fitting, same):
            if choice:
                near = max(names.common(info.topic.folder, name.folder) for info in choice)
                nearest = sorted((info for info in choice if names.common(info.topic.folder, name.folder) == near), key=lambda info: info.topic.topic)
                others = [info for info in nearest[:-1] if info.message is not None and nearest[-1].message is not None and _differ(info.message, nearest[-1].message)]
                return f"{others[0].topic.topic} and {nearest[-1].topic.topic} both have its frame and size, and other lenses" if others else nearest[-1]
        alone = len(cameras) == 1 and len(infos) == 1 and not (infos[0].frame and camera.frame)
        return infos[0] if alone else None


def _differ(a: Any, b: Any) -> bool:
    """Whether two camera_infos are of different lenses."""
    return any(list(lenses.values(a, name)) != list(lenses.values(b, name)) for name in "kd") or a.width != b.width or a.height != b.height


def of_detections(cameras: list[Found], topic: str, frame: str) -> Found | None:
    """The camera that saw what a topic reports: that of its frame, else that of its namespace, else the only one."""
    folder = tuple(part for part in topic.split("/") if part)[:-1]
    same = [camera for camera in cameras if frame and camera.frame == frame]
    near = [camera for camera in cameras if names.common(camera.folder, folder)]
    alone = [camera for camera in cameras if not camera.is_spare]
    choice = same or near or (alone if len(alone) == 1 and not (frame and alone[0].frame) else [])
    return max(choice, key=lambda camera: (camera.has_pictures, names.common(camera.folder, folder), camera.name)) if choice else None
