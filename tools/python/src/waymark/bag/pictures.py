# SPDX-License-Identifier: Apache-2.0
"""Pictures of ROS as JPEGs: a JPEG goes through as it is, all others become grey."""

import io
import re
from collections.abc import Callable
from typing import Any

import numpy as np
from PIL import Image

from ..recording import jpeg_of, jpeg_size
from ..tables import Array
from .decoding import BadMessage

_SIDE_MAX = 65535  # pixels; of JPEG
# Bits that sensors give; a picture of 16 bits is scaled by the smallest of these that holds all that came so far.
_DEPTHS = (8, 10, 12, 14, 16)
# Encodings as sensor_msgs/image_encodings.hpp and OpenCV name them: Pillow's raw mode, bytes of a pixel.
_PACKED = {"mono8": ("L", "L", 1), "8uc1": ("L", "L", 1), "rgb8": ("RGB", "RGB", 3), "bgr8": ("RGB", "BGR", 3), "8uc3": ("RGB", "BGR", 3),
           "rgba8": ("RGB", "RGBX", 4), "bgra8": ("RGB", "BGRX", 4), "8uc4": ("RGB", "BGRX", 4)}
# YUV 4:2:2 has a grey level in every other byte: the second of UYVY (ROS's yuv422), the first of YUYV.
_EVERY_OTHER = {"yuv422": 1, "uyvy": 1, "yuv422_uyvy": 1, "yuv422_yuy2": 0, "yuyv": 0, "yuy2": 0, "yuv422_yuyv": 0}
# Planar YUV begins with the grey levels of the whole picture.
_LUMA_FIRST = {"nv12", "nv21", "nv24", "nv16", "nv61", "yuv420", "yuv420p", "i420", "yv12", "yuv444p"}
_BAYER = re.compile(r"bayer_(rggb|bggr|gbrg|grbg)(8|10|12|14|16)$")
_COLOURS16 = {"rgb16": (3, 1), "bgr16": (3, -1), "rgba16": (4, 1), "bgra16": (4, -1)}  # channels, order of the first three
_DEPTH_PICTURES = {"16uc1", "32fc1", "64fc1", "16sc1"}  # REP 118: distances in mm or m
_VIDEO = re.compile(r"h\.?26[45]|hevc|avc|av1|vp[89]|theora|mpeg", re.I)


class NotTaken(Exception):
    """Why a topic's pictures are no pictures for a recording."""


class Depths:
    """Bits that a camera's pictures of 16 bits use, over all pictures so far."""

    def __init__(self, note: Callable[[str], None]):
        self._note = note
        self._bits = 0

    def grey(self, values: Array) -> Array:
        """Grey levels, uint8, of a picture of uint16."""
        largest = int(values.max()) if values.size else 0
        bits = next(depth for depth in _DEPTHS if largest < 1 << depth)
        if bits > self._bits:
            if self._bits:
                self._note(f"its pictures of 16 bits use {self._bits} at first and {bits} later: the later ones are scaled by {bits}")
            elif bits < 16:
                self._note(f"its pictures of 16 bits use {bits} of them: they are scaled by these")
            self._bits = bits
        return np.asarray(values >> (self._bits - 8), dtype=np.uint8)


def _rows(message: Any, height: int, bytes_a_row: int) -> Array:
    """The bytes of a picture, a row of them for each row of it."""
    data = np.frombuffer(message.data, dtype=np.uint8)
    step = int(message.step) or (len(data) // height if len(data) == height * bytes_a_row else bytes_a_row)
    if step < bytes_a_row:
        raise BadMessage(f"its rows have {step} bytes; {message.width} pixels of {message.encoding} need {bytes_a_row}")
    needed = (height - 1) * step + bytes_a_row
    if len(data) < needed:
        raise BadMessage(f"the picture has {len(data)} bytes; {message.width} x {height} of {message.encoding} need {needed}")
    return np.lib.stride_tricks.as_strided(data, (height, bytes_a_row), (step, 1), writeable=False)


def _words(message: Any) -> Array:
    rows = np.ascontiguousarray(_rows(message, message.height, 2 * message.width))
    return rows.view(">u2" if message.is_bigendian else "<u2").astype(np.uint16)


def _demosaiced(mosaic: Array) -> Array:
    """Grey by weights 1 2 1 along and across: a quarter red, a half green, a quarter blue at each pixel of any Bayer pattern."""
    values = np.pad(mosaic.astype(np.uint32), 1, mode="reflect")
    lines = values[:-2] + 2 * values[1:-1] + values[2:]
    return np.asarray((lines[:, :-2] + 2 * lines[:, 1:-1] + lines[:, 2:] + 8) >> 4, dtype=mosaic.dtype)


def jpeg_of_image(message: Any, depths: Depths) -> bytes:
    """The JPEG of a sensor_msgs/Image."""
    width, height, encoding = int(message.width), int(message.height), message.encoding.strip().lower()
    if encoding in _DEPTH_PICTURES:
        raise NotTaken(f"depth or raw distances ({message.encoding}), no picture that a detector reads")
    if not 0 < width <= _SIDE_MAX or not 0 < height <= _SIDE_MAX:
        raise BadMessage(f"a picture of {width} x {height} pixels")
    if encoding in _PACKED:
        return _packed(message, *_PACKED[encoding])
    if encoding in _EVERY_OTHER:
        return jpeg_of(_rows(message, height, 2 * width)[:, _EVERY_OTHER[encoding] :: 2])
    if encoding in _LUMA_FIRST:
        return jpeg_of(_rows(message, height, width))
    if encoding in ("mono10", "mono12", "mono14", "mono16"):
        return jpeg_of(depths.grey(_words(message)))
    if bayer := _BAYER.match(encoding):
        if min(width, height) < 2:
            raise BadMessage(f"a Bayer picture of {width} x {height} pixels")
        mosaic = np.ascontiguousarray(_rows(message, height, width)) if bayer[2] == "8" else _words(message)
        grey = _demosaiced(mosaic)
        return jpeg_of(grey if bayer[2] == "8" else depths.grey(grey))
    if encoding in _COLOURS16:
        channels, order = _COLOURS16[encoding]
        rows = np.ascontiguousarray(_rows(message, height, 2 * channels * width)).view(">u2" if message.is_bigendian else "<u2")
        colour = rows.reshape(height, width, channels)[:, :, :3][:, :, ::order]
        weighted = colour.astype(np.uint32) @ np.array([299, 587, 114], dtype=np.uint32) // 1000  # ITU-R BT.601
        return jpeg_of(depths.grey(weighted.astype(np.uint16)))
    raise NotTaken(f"pictures in '{message.encoding}' are not read; mono, rgb, bgr, Bayer, YUV 4:2:2 and NV12 are")


def _packed(message: Any, mode: str, raw: str, size: int) -> bytes:
    """By Pillow's own unpacking, which knows the order of the channels and the length of the rows."""
    width, height = int(message.width), int(message.height)
    rows = _rows(message, height, size * width)
    data = np.frombuffer(message.data, dtype=np.uint8)
    if len(data) < height * rows.strides[0]:
        data = np.ascontiguousarray(rows).ravel()  # the last row ends with its last pixel
    step = rows.strides[0] if len(data) >= height * rows.strides[0] else size * width
    picture = Image.frombuffer(mode, (width, height), data, "raw", raw, step, 1)
    return jpeg_of(np.asarray(picture.convert("L")))


def jpeg_of_compressed(message: Any, depths: Depths) -> bytes:
    """The JPEG of a sensor_msgs/CompressedImage."""
    data, form = message.data.tobytes(), message.format.strip()
    if "compresseddepth" in form.lower() or form.lower().split(";")[0].strip() in _DEPTH_PICTURES:
        raise NotTaken("depth (" + form + "), no picture that a detector reads")
    if _VIDEO.search(form):
        raise NotTaken(f"a video stream ({form}) whose pictures depend on each other: make pictures of it with "
                       "`ros2 run image_transport republish`, or give the video to `waymark import VIDEO`")
    if not data:
        raise BadMessage("the picture is empty: 0 bytes")
    if data[:2] == b"\xff\xd8":
        return _whole_jpeg(data)
    try:
        with Image.open(io.BytesIO(data)) as picture:
            if picture.mode.startswith("I;16") or picture.mode == "I":
                return jpeg_of(depths.grey(np.asarray(picture).astype(np.uint16)))
            return jpeg_of(np.asarray(picture.convert("L")))
    except Exception:  # what a decoder of pictures raises on damaged bytes is its own matter
        raise BadMessage(f"its {len(data)} bytes are no picture ({form or 'no format given'})") from None


def _whole_jpeg(data: bytes) -> bytes:
    """A JPEG that has its size and its end (ITU-T T.81, B.1.1.3); what follows the end is padding of the sender. One of four inks becomes grey."""
    try:
        jpeg_size(data)
    except ValueError:
        raise BadMessage(f"its {len(data)} bytes begin as a JPEG and have no size of a picture") from None
    if b"\xff\xd9" not in data.rstrip(b"\0")[-4096:]:
        raise BadMessage(f"the JPEG of {len(data)} bytes is cut: it has no end")
    try:
        with Image.open(io.BytesIO(data)) as picture:
            return jpeg_of(np.asarray(picture.convert("L"))) if picture.mode == "CMYK" else data
    except Exception:  # the robot's own decoder judges it
        return data
