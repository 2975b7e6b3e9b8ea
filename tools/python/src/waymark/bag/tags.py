# SPDX-License-Identifier: Apache-2.0
"""Tags that other detectors reported, as rows of marker-corners.csv (corners) and markers.csv (poses).

Ours: the middle of a pixel is whole; corners from the upper left one on, clockwise, of the print as OpenCV's readers see it. The others:

  AprilTag's library (apriltag_msgs)   the middle of a pixel is at a half; corners against the clock from the lower left one on
                                       (apriltag.c: homography_project of (-1,1), (1,1), (1,-1), (-1,-1)). Its four oldest families are drawn
                                       the other way up than OpenCV's and ours (cv::aruco::DICT_APRILTAG_*): half a turn
  NVIDIA's (isaac_ros_apriltag)        those of AprilTag's library the other way round: clockwise from the upper left one on (apriltag_node.cpp). Its
                                       pose tells whether the order is that
  OpenCV's aruco (fiducial_msgs)       as ours
  poses (aruco_msgs, aruco_opencv_msgs, ros2_aruco_interfaces, ar_track_alvar_msgs, apriltag_ros of ROS 1, fiducial_msgs, vision_msgs)
                                       in the camera's optical frame (REP 103). OpenCV: x to the right, y up, z out of the print.
                                       AprilTag: z into it, y down. aruco_ros: y out of it, z up. The axis that points towards the camera,
                                       or away from it, tells which
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..geometry import OPTICAL, from_rpy, rotation
from ..tables import Array, Table
from . import lenses
from .cameras import Found
from .decoding import BadMessage
from .lens_fit import equidistant, radtan

_HALF_TURNED = {"16h5", "25h9", "36h10", "36h11"}
_FAMILY = re.compile(r"(\d+)[h_](\d+)$", re.ASCII)  # how users spell it, too: tag36_11, DICT_APRILTAG_36h11
_UPRIGHT = ("standard", "circle", "custom")  # in the names of the families that the library draws as OpenCV's readers see them
_UPRIGHT_ORDER, _HALF_TURNED_ORDER = (3, 2, 1, 0), (1, 0, 3, 2)
_HALF_PX = 0.5
_SQUARE = np.array([(-1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (-1.0, -1.0, 1.0)])  # apriltag.c: corners of a tag, first to last, x y 1
_SAME_CORNER = 0.1  # of the tag's size in the picture: the library makes the corners of the homography
_SINGULAR = 1e-12
_ALIKE = 0.7  # cosine of the upper edge by the corners and by the pose
_NO_IDENTITY = re.compile(r"[a-z]*\d+h\d+|\d+x\d+(_\d+)?|\d*\.\d+")  # of a class: a family, a dictionary, a length
_NUMBER = re.compile(r"(\d+)\D*$")
_OUTSIDE = 0.01  # share of tags with a corner beyond the picture: detectors read whole tags alone
_MANY = 100  # tags; a robot that moves sees them in more than a quarter of the picture
FARTHEST_M = 100.0  # a print of 1 m is 10 pixels wide there at a focal length of 1000, about the least that detectors read
_IDENTITY_MOST = 2**31 - 1  # of a landmark
_FACING_MIN = 0.05  # cosine; a print seen more askew than that, 87 degrees, isn't read by any detector


def _identity(number: Any) -> int:
    if not 0 <= int(number) <= _IDENTITY_MOST:
        raise BadMessage(f"a tag of the number {int(number)}; 0 to {_IDENTITY_MOST} are possible")
    return int(number)


class Seen(NamedTuple):
    """A tag with its four corners in pixels, u0 v0 ... u3 v3 in our order, or with its pose: its place in m and the direction of its upper
    edge from left to right, both in the camera's body frame. `remark`: what was corrected, for the topic."""

    id: int
    corners: list[float] | None
    place: list[float] | None = None
    remark: str = ""


def family_of(name: str) -> str:
    """A family's name as the library has it."""
    found = _FAMILY.search(name.lower())
    plain = f"{found[1]}h{found[2]}" if found else ""
    return f"tag{plain if plain in _HALF_TURNED and not _is_upright(name) else name.removeprefix('tag')}"


def _is_upright(family: str) -> bool:
    return any(word in family.lower() for word in _UPRIGHT)


def _is_half_turned(family: str) -> bool:
    return family_of(family).removeprefix("tag") in _HALF_TURNED


def is_known(family: str) -> bool:
    """Whether it is known which way up AprilTag's library draws the family."""
    return _is_upright(family) or _is_half_turned(family)


def _corners(points: list[tuple[float, float]], order: tuple[int, ...], shift_px: float) -> list[float]:
    out = [float(value) - shift_px for k in order for value in points[k]]
    if not np.isfinite(out).all():
        raise BadMessage("a corner is no number")
    (ax, ay), (bx, by) = np.subtract(out[4:6], out[:2]), np.subtract(out[6:], out[2:4])
    if ax * by <= ay * bx:  # the diagonals' cross product, twice the area of corners that go round clockwise, v down
        raise BadMessage("a tag's corners go round the other way than this type's detectors report them, as of a mirrored print")
    return out


def _pose(identity: int, place: Any, turn: Any, half_turned: bool = False) -> Seen:
    """A pose in the optical frame."""
    identity = _identity(identity)
    p = np.array([place.x, place.y, place.z], dtype=float)
    q = np.array([turn.x, turn.y, turn.z, turn.w], dtype=float)
    if not np.isfinite(p).all() or not np.isfinite(q).all() or not q.any() or not p[2] > 0:
        raise BadMessage(f"the pose of tag {identity} is none: it lies not before the camera, or its quaternion is 0")
    axes = rotation(q)
    towards = -p / np.linalg.norm(p)
    facing = {"z": float(axes[:, 2] @ towards), "y": float(axes[:, 1] @ towards)}
    if max(map(abs, facing.values())) < _FACING_MIN:
        raise BadMessage(f"the pose of tag {identity} shows it from its edge")
    if abs(facing["z"]) >= abs(facing["y"]):
        up, out = (axes[:, 1], axes[:, 2]) if facing["z"] > 0 else (-axes[:, 1], -axes[:, 2])
    else:
        up, out = (axes[:, 2], axes[:, 1]) if facing["y"] > 0 else (-axes[:, 2], -axes[:, 1])
    right = np.cross(up, out) * (-1 if half_turned else 1)
    return Seen(identity, None, [*map(float, OPTICAL @ p), *map(float, OPTICAL @ right)])


def _first_by(homography: Any, points: list[tuple[float, float]]) -> int:
    """Which of four corners is the library's first one, by the tag's homography; 0 where that is not filled, or fits none."""
    h, seen = np.array(homography, dtype=float).reshape(3, 3), np.array(points)
    if not np.isfinite(h).all() or abs(np.linalg.det(h)) <= _SINGULAR * np.abs(h).max() ** 3:
        return 0
    there = _SQUARE @ h.T
    off = [float(np.abs(np.roll(seen, -k, axis=0) - there[:, :2] / there[:, 2:]).max()) for k in range(4)]
    first = int(np.argmin(off))
    return first if off[first] < _SAME_CORNER * np.ptp(seen, axis=0).max() else 0


def apriltag(tag: Any) -> Seen:
    """A tag of apriltag_msgs/AprilTagDetectionArray."""
    order = _HALF_TURNED_ORDER if _is_half_turned(tag.family) else _UPRIGHT_ORDER
    points = [(c.x, c.y) for c in tag.corners]
    first = _first_by(tag.homography, points)
    remark = f"its corners begin {first} later than those of AprilTag's library, by their homography: they are taken in its order" if first else ""
    return Seen(_identity(tag.id), _corners(points[first:] + points[:first], order, _HALF_PX), remark=remark)


def isaac(tag: Any) -> Seen:
    """A tag of isaac_ros_apriltag_interfaces/AprilTagDetectionArray."""
    turned = _is_half_turned(tag.family)
    order = tuple(3 - k for k in (_HALF_TURNED_ORDER if turned else _UPRIGHT_ORDER))
    corners = _corners([(c.x, c.y) for c in tag.corners], order, _HALF_PX)
    pose = tag.pose.pose.pose
    if pose.position.z > 0:
        ahead, left, up, *right = _pose(tag.id, pose.position, pose.orientation, turned).place or [0.0] * 6
        edge = np.array([left * right[0] - ahead * right[1], up * right[0] - ahead * right[2]])  # of the picture, by the derivative of -left/ahead, -up/ahead
        by_corners = np.subtract(corners[2:4], corners[:2])
        if edge @ by_corners < _ALIKE * np.linalg.norm(edge) * np.linalg.norm(by_corners):
            raise BadMessage(f"the corners of tag {tag.id} and its pose contradict each other: they are of another version's order")
    return Seen(_identity(tag.id), corners)


def fiducial(tag: Any) -> Seen:
    """A tag of fiducial_msgs/FiducialArray."""
    return Seen(_identity(tag.fiducial_id), _corners([(tag.x0, tag.y0), (tag.x1, tag.y1), (tag.x2, tag.y2), (tag.x3, tag.y3)], (0, 1, 2, 3), 0.0))


def fiducial_pose(tag: Any) -> Seen:
    """A tag of fiducial_msgs/FiducialTransformArray."""
    return _pose(tag.fiducial_id, tag.transform.translation, tag.transform.rotation)


def pose(tag: Any, half_turned: bool = False) -> Seen | None:
    """A tag with a pose, or an identity and a pose. Of a bundle of tags (several identities) none has a pose."""
    identity, at = tag if isinstance(tag, tuple) else (tag.marker_id if hasattr(tag, "marker_id") else tag.id, tag)
    while hasattr(at, "pose"):
        at = at.pose
    return _pose(np.ravel(identity)[0], at.position, at.orientation, half_turned) if np.size(identity) == 1 else None


def apriltag_pose(tag: Any) -> Seen | None:
    """A tag of apriltag_ros for ROS 1, and its predecessors: half a turn from the library's way up."""
    return pose(tag, half_turned=True)


def tags_of(message: Any) -> list[Any]:
    """The tags of a message, as it has them, or pairs of identities and poses."""
    if hasattr(message, "marker_ids"):
        return list(zip(message.marker_ids, message.poses))
    return next(list(getattr(message, name)) for name in ("detections", "markers", "fiducials", "transforms") if hasattr(message, name))


def _headers(tag: Any, message: Any) -> list[Any]:
    parts: list[Any] = [getattr(tag, "pose", None), tag, message]
    return [part.header for part in parts if hasattr(part, "header")]


def frame_of(tag: Any, message: Any) -> str:
    """The frame of a tag: that of its pose, its own, or the message's."""
    return next((name for header in _headers(tag, message) if (name := header.frame_id.lstrip("/"))), "")


def stamp_ns(message: Any) -> int:
    """The stamp of a message, or of its first tag, as ar_track_alvar writes it; 0: none has one."""
    headers = _headers(next(iter(tags_of(message)), None), message)
    return next((t_ns for header in reversed(headers) if (t_ns := header.stamp.sec * 10**9 + header.stamp.nanosec)), 0)


def _number(found: Any, name: str) -> int:
    """The tag of a detection whose class is `name`: its number, or, where that is a family alone, the detection's."""
    text = _NO_IDENTITY.sub("", name.lower())
    number = not name.startswith("-") and _NUMBER.search(text) or (None if text == name.lower() else re.fullmatch(r"(\d+)", str(getattr(found, "id", ""))))
    if not number:
        raise BadMessage(f"a detection of class '{name}', which is no number of a tag")
    return int(number[1])


def _score(hypothesis: Any) -> float:
    score = float(getattr(hypothesis, "hypothesis", hypothesis).score)
    return score if np.isfinite(score) else -np.inf


def vision_pose(found: Any) -> Seen | None:
    """A detection of vision_msgs whose likeliest hypothesis has a number as its class, and a pose."""
    if not len(found.results):
        return None
    best = max(found.results, key=_score)
    about = getattr(best, "hypothesis", best)
    number = _number(found, str(getattr(about, "class_id", getattr(about, "id", ""))))
    where = best.pose.pose if hasattr(best.pose, "pose") else best.pose
    place = where.position
    if not any((place.x, place.y, place.z)):
        raise BadMessage("a detection without a pose: a box alone gives no corners of a tag")
    return _pose(number, place, where.orientation)


@dataclass(frozen=True)
class Reader:
    """How a tag of a type is read; None: it has no pose. `is_of_rectified`: its node reads rectified pictures; `families`: whether its tags name theirs; `is_half_turned`: its poses
    are taken as of a family that is drawn the other way up."""

    read: Callable[[Any], Seen | None]
    is_of_rectified: bool = False
    families: bool = False
    is_half_turned: bool = False


READERS = {
    "apriltag_msgs/msg/AprilTagDetectionArray": Reader(apriltag, is_of_rectified=True, families=True),
    "isaac_ros_apriltag_interfaces/msg/AprilTagDetectionArray": Reader(isaac, is_of_rectified=True, families=True),
    "fiducial_msgs/msg/FiducialArray": Reader(fiducial),
    "fiducial_msgs/msg/FiducialTransformArray": Reader(fiducial_pose),
    "vision_msgs/msg/Detection2DArray": Reader(vision_pose),
    "vision_msgs/msg/Detection3DArray": Reader(vision_pose),
} | {f"{package}/msg/AprilTagDetectionArray": Reader(apriltag_pose, is_half_turned=True) for package in ("apriltag_ros", "apriltags2_ros", "apriltags_ros")} | {
    kind: Reader(pose) for kind in ("aruco_msgs/msg/MarkerArray", "aruco_markers_msgs/msg/MarkerArray", "aruco_opencv_msgs/msg/ArucoDetection",
                                     "ros2_aruco_interfaces/msg/ArucoMarkers", "aruco_interfaces/msg/ArucoMarkers",
                                     "ar_track_alvar_msgs/msg/AlvarMarkers")}


def of_another_picture(entry: dict[str, Any], pixels: Array) -> str:
    """What corners (n, 4, 2) show of pictures that are larger or smaller than those of the lens; "": nothing."""
    size = np.array(entry["size"])
    outside = int((pixels > size).any((1, 2)).sum())
    text = f"the {size[0]} x {size[1]} pixels of its camera's lens"
    if outside > _OUTSIDE * len(pixels):
        return f"{outside} of {len(pixels)} tags have corners beyond {text}: they were seen in larger pictures."
    if len(pixels) >= _MANY and (pixels < size / 2).all():
        return f"all of {len(pixels)} tags lie in the upper left quarter of {text}: were they seen in pictures of half the size?"
    return ""


def to_raw(camera: Found, pixels: Array) -> Array | None:
    """Pixels (n, 2) of the rectified picture as those of the pictures that the recording's lens is of; None where nothing has to be done.
    BadMessage: P or R of the camera_info is not a number."""
    entry = camera.lens.entry
    if entry is None or camera.info is None or camera.is_rectified:
        return None
    turn = lenses.values(camera.info, "r")
    if not np.isfinite([*turn, *lenses.values(camera.info, "p")]).all():
        raise BadMessage("P or R of its camera's camera_info is not a number: nothing says where its corners are in the raw picture; `--tags raw` takes them as they are")
    if not lenses.has_rectified(camera.info):
        return None
    straight = lenses.of(camera.info, True, (entry["size"][0], entry["size"][1])).entry
    if straight is None or (straight["intrinsics"] == entry["intrinsics"] and not any(entry["distortion"]) and entry["model"] == "pinhole-radtan"):
        return None
    fx, fy, cx, cy = straight["intrinsics"]
    rays = np.column_stack([(pixels[:, 0] - cx) / fx, (pixels[:, 1] - cy) / fy, np.ones(len(pixels))])
    if len(turn) == 9 and abs(np.linalg.det(turn.reshape(3, 3)) - 1) < 1e-3:
        rays = rays @ turn.reshape(3, 3)  # R turns rays of the raw camera into those of the rectified one
    flat = rays[:, :2] / rays[:, 2:]
    bent = radtan(entry["distortion"], flat) if entry["model"] == "pinhole-radtan" else equidistant(entry["distortion"], flat)
    fx, fy, cx, cy = entry["intrinsics"]
    return np.asarray(bent * (fx, fy) + (cx, cy))


def corner_table(columns: list[Array], camera: str) -> Table:
    """marker-corners.csv of rows t, id, eight pixels, arrival."""
    t, identity, *pixels, arrival = columns
    table: Table = {"t_ns": t.astype(np.int64), "sensor": np.full(len(t), camera), "id": identity.astype(np.int64)}
    table |= {f"{axis}{k}_px": pixels[2 * k + (axis == "v")] for k in range(4) for axis in "uv"}
    return table | {"arrival_ns": arrival.astype(np.int64)}


def pose_table(columns: list[Array], camera: str, rpy_deg: list[float]) -> Table:
    """markers.csv of rows t, id, x, y, z, the upper edge's direction, arrival. `rpy_deg`: the camera's mounting; the yaw of the edge is the one
    that is seen from above, the robot being level."""
    t, identity, x, y, z, *edge, arrival = columns
    level = from_rpy(np.radians(rpy_deg[0]), np.radians(rpy_deg[1]), 0.0)
    ahead, left, _ = level @ np.stack(edge)
    return {"t_ns": t.astype(np.int64), "sensor": np.full(len(t), camera), "id": identity.astype(np.int64), "x_m": x, "y_m": y, "z_m": z,
            "yaw_rad": np.arctan2(left, ahead), "arrival_ns": arrival.astype(np.int64)}
