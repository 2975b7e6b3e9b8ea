# SPDX-License-Identifier: Apache-2.0
"""ROS 2 messages by rosbags, without ROS: its own types, those of Foxglove's annotations, and Waymark's."""

from collections.abc import Callable
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from .geometry import quaternion
from .tables import Array

_OTHERS = {
    # Numbers for plots; `state` and `verdict` are words for tools that show them.
    "waymark_msgs/msg/Innovation": "std_msgs/Header header\nint32 landmark\nfloat64 observed\nfloat64 expected\n"
    "float64 innovation\nfloat64 sigma\nfloat64 normalised\nfloat64 nis\nfloat64 gate\nbool fused\nstring verdict\n",
    "waymark_msgs/msg/Status": "std_msgs/Header header\nstring state\nbool tracking\nfloat64 lost_probability\n"
    "float64 sigma_xy_m\nfloat64 sigma_heading_rad\nfloat64 age_of_fusion_s\nint32 resets\n",
    "waymark_msgs/msg/Bound": "std_msgs/Header header\nfloat64 horizontal_m\nfloat64 heading_rad\nbool usable\nstring unusable\n",
    "foxglove_msgs/msg/Point2": "float64 x\nfloat64 y\n",
    "foxglove_msgs/msg/Color": "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n",
    "foxglove_msgs/msg/CircleAnnotation": "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nfloat64 diameter\n"
    "float64 thickness\nfoxglove_msgs/Color fill_color\nfoxglove_msgs/Color outline_color\n",
    "foxglove_msgs/msg/PointsAnnotation": "uint8 UNKNOWN=0\nuint8 POINTS=1\nuint8 LINE_LOOP=2\nuint8 LINE_STRIP=3\n"
    "uint8 LINE_LIST=4\nbuiltin_interfaces/Time timestamp\nuint8 type\nfoxglove_msgs/Point2[] points\n"
    "foxglove_msgs/Color outline_color\nfoxglove_msgs/Color[] outline_colors\nfoxglove_msgs/Color fill_color\n"
    "float64 thickness\n",
    "foxglove_msgs/msg/TextAnnotation": "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nstring text\n"
    "float64 font_size\nfoxglove_msgs/Color text_color\nfoxglove_msgs/Color background_color\n",
    "foxglove_msgs/msg/ImageAnnotations": "foxglove_msgs/CircleAnnotation[] circles\nfoxglove_msgs/PointsAnnotation[] points\n"
    "foxglove_msgs/TextAnnotation[] texts\n",
    "can_msgs/msg/Frame": "std_msgs/Header header\nuint32 id\nbool is_rtr\nbool is_extended\nbool is_error\nuint8 dlc\n"
    "uint8[8] data\n",
    "ros2_socketcan_msgs/msg/FdFrame": "std_msgs/Header header\nuint32 id\nbool is_extended\nbool is_error\nuint8 len\n"
    "uint8[<=64] data\n",
    "apriltag_msgs/msg/Point": "float64 x\nfloat64 y\n",
    "apriltag_msgs/msg/AprilTagDetection": "string family\nint32 id\nint32 hamming\nfloat32 goodness\nfloat32 decision_margin\n"
    "apriltag_msgs/Point centre\napriltag_msgs/Point[4] corners\nfloat64[9] homography\n",
    "apriltag_msgs/msg/AprilTagDetectionArray": "std_msgs/Header header\napriltag_msgs/AprilTagDetection[] detections\n",
    "aruco_msgs/msg/Marker": "std_msgs/Header header\nuint32 id\ngeometry_msgs/PoseWithCovariance pose\nfloat64 confidence\n",
    "aruco_msgs/msg/MarkerArray": "std_msgs/Header header\naruco_msgs/Marker[] markers\n",
    "aruco_opencv_msgs/msg/MarkerPose": "uint16 marker_id\ngeometry_msgs/Pose pose\n",
    "aruco_opencv_msgs/msg/BoardPose": "string board_name\ngeometry_msgs/Pose pose\n",
    "aruco_opencv_msgs/msg/ArucoDetection": "std_msgs/Header header\naruco_opencv_msgs/MarkerPose[] markers\n"
    "aruco_opencv_msgs/BoardPose[] boards\n",
    "fiducial_msgs/msg/Fiducial": "int32 fiducial_id\nint32 direction\nfloat64 x0\nfloat64 y0\nfloat64 x1\nfloat64 y1\nfloat64 x2\n"
    "float64 y2\nfloat64 x3\nfloat64 y3\n",
    "fiducial_msgs/msg/FiducialArray": "std_msgs/Header header\nint32 image_seq\nfiducial_msgs/Fiducial[] fiducials\n",
    "fiducial_msgs/msg/FiducialTransform": "int32 fiducial_id\ngeometry_msgs/Transform transform\nfloat64 image_error\n"
    "float64 object_error\nfloat64 fiducial_area\n",
    "fiducial_msgs/msg/FiducialTransformArray": "std_msgs/Header header\nint32 image_seq\nfiducial_msgs/FiducialTransform[] transforms\n",
    "vision_msgs/msg/Point2D": "float64 x\nfloat64 y\n",
    "vision_msgs/msg/Pose2D": "vision_msgs/Point2D position\nfloat64 theta\n",
    "vision_msgs/msg/BoundingBox2D": "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n",
    "vision_msgs/msg/BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n",
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score\n",
    "vision_msgs/msg/ObjectHypothesisWithPose": "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n",
    "vision_msgs/msg/Detection2D": "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
    "vision_msgs/BoundingBox2D bbox\nstring id\n",
    "vision_msgs/msg/Detection3D": "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
    "vision_msgs/BoundingBox3D bbox\nstring id\n",
    "vision_msgs/msg/Detection2DArray": "std_msgs/Header header\nvision_msgs/Detection2D[] detections\n",
    "vision_msgs/msg/Detection3DArray": "std_msgs/Header header\nvision_msgs/Detection3D[] detections\n",
}


def typestore() -> Typestore:
    """ROS 2's common types (Humble) and the others above."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, definition in _OTHERS.items():
        store.register(get_types_from_msg(definition, name))
    return store


class Messages:
    """Makes messages by short names: `make("Header", stamp=..., frame_id=...)`; fields that are not given are zero."""

    def __init__(self) -> None:
        self.store = typestore()
        self._kinds: dict[str, tuple[Any, list[tuple[str, Callable[[], Any]]]]] = {}
        self._names: dict[str, str] = {}
        for name in self.store.types:
            package, _, short = name.rpartition("/")
            self._names.setdefault(short, name)
            self._names[f"{package.split('/')[0]}/{short}"] = name
        for name in ("std_msgs/msg/Header", "geometry_msgs/msg/Point", "geometry_msgs/msg/Pose", "nav_msgs/msg/Path"):
            self._names[name.rpartition("/")[2]] = name

    def definition(self, kind: str) -> bytes:
        """The definition of a type and of all that it is made of, as MCAP's "ros2msg" has it."""
        return str(self.store.generate_msgdef(kind, ros_version=2)[0]).encode()

    def encode(self, message: Any, kind: str) -> bytes:
        """A message as CDR."""
        return bytes(self.store.serialize_cdr(message, kind))

    def type(self, name: str) -> str:
        """The whole name of a type."""
        return name if name in self.store.types else self._names[name]

    def make(self, name: str, /, **fields: Any) -> Any:
        """A message of a type, complete with zeros."""
        kind, zeros = self._kinds.get(name) or self._kind(name)
        for field, zero in zeros:
            if field not in fields:
                fields[field] = zero()
        return kind(**fields)

    def _kind(self, name: str) -> tuple[Any, list[tuple[str, Callable[[], Any]]]]:
        kind = self.store.types[self.type(name)]
        fields = self.store.get_msgdef(kind.__msgtype__).fields
        self._kinds[name] = kind, [(field, self._zero(description)) for field, description in fields]
        return self._kinds[name]

    def _zero(self, description: Any) -> Callable[[], Any]:
        """A function that makes a field's zero."""
        node, what = description
        if node.name == "BASE":
            value = {"string": "", "bool": False}.get(what[0], 0.0 if what[0].startswith("float") else 0)
            return lambda: value
        if node.name == "NAME":
            return lambda: self.make(what)
        (inner, kind), length = what
        fixed = length if node.name == "ARRAY" else 0
        if inner.name == "BASE" and kind[0] != "string":
            return lambda: np.zeros(fixed, dtype=kind[0])
        zero = self._zero((inner, kind))
        return lambda: [zero() for _ in range(fixed)]

    def time(self, t_ns: int) -> Any:
        """A stamp. Stamps before 0 don't exist in ROS and become 0."""
        t_ns = max(int(t_ns), 0)
        return self.make("builtin_interfaces/Time", sec=t_ns // 10**9, nanosec=t_ns % 10**9)

    def header(self, t_ns: int, frame: str) -> Any:
        """A header with stamp and frame."""
        return self.make("Header", stamp=self.time(t_ns), frame_id=frame)

    def point(self, xyz: Any) -> Any:
        """A point in metres."""
        return self.make("Point", x=float(xyz[0]), y=float(xyz[1]), z=float(xyz[2]))

    def pose(self, position: Any, xyzw: Any) -> Any:
        """A pose: position in metres and quaternion."""
        x, y, z, w = map(float, xyzw)
        return self.make("Pose", position=self.point(position), orientation=self.make("Quaternion", x=x, y=y, z=z, w=w))

    def pose_of(self, matrix: Array) -> Any:
        """A pose by its 4x4 matrix."""
        return self.pose(matrix[:3, 3], quaternion(matrix[:3, :3]))

    def transform(self, t_ns: int, parent: str, child: str, matrix: Array) -> Any:
        """A stamped transform by its 4x4 matrix."""
        x, y, z = map(float, matrix[:3, 3])
        qx, qy, qz, qw = map(float, quaternion(matrix[:3, :3]))
        vector, turn = self.make("Vector3", x=x, y=y, z=z), self.make("Quaternion", x=qx, y=qy, z=qz, w=qw)
        return self.make("TransformStamped", header=self.header(t_ns, parent), child_frame_id=child,
                         transform=self.make("geometry_msgs/Transform", translation=vector, rotation=turn))

    def cloud(self, t_ns: int, frame: str, xyz: Array, **columns: Array) -> Any:
        """A PointCloud2 of points (n, 3) in metres, with further columns (n,) by name, all as float32."""
        names = ["x", "y", "z", *columns]
        values = np.column_stack([np.reshape(xyz, (-1, 3)), *columns.values()]).astype("<f4")
        fields = [self.make("PointField", name=name, offset=4 * i, datatype=7, count=1) for i, name in enumerate(names)]
        return self.make("PointCloud2", header=self.header(t_ns, frame), height=1, width=len(values), fields=fields,
                         point_step=4 * len(names), row_step=values.nbytes, data=values.view(np.uint8).ravel(), is_dense=bool(np.isfinite(values[:, :3]).all()))

    def colour(self, r: float, g: float, b: float, a: float = 1.0) -> Any:
        """A colour of a marker, 0 to 1."""
        return self.make("std_msgs/ColorRGBA", r=r, g=g, b=b, a=a)
