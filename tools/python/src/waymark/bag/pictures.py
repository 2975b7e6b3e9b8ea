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
# Encodings by the names of sensor_msgs/image_encodings.hpp, OpenCV, V4L2's four letters, FFmpeg and GenICam. Colours: Pillow's raw mode, bytes of
# a pixel. XRGB of DRM and of libcamera is a word of 32 bits, whose lowest byte, blue, comes first.
_COLOURS = {("rgb8", "rgb", "rgb24", "rgb3"): ("RGB", 3), ("bgr8", "8uc3", "8sc3", "bgr", "bgr24", "bgr3"): ("BGR", 3),
            ("rgba8", "rgba", "rgbx8", "rgbx"): ("RGBX", 4), ("bgra8", "8uc4", "bgra", "bgrx8", "bgrx", "xrgb8888", "argb8888"): ("BGRX", 4),
            ("argb8", "argb", "xrgb8"): ("XRGB", 4), ("abgr8", "abgr"): ("XBGR", 4), ("rgb565", "rgbp"): ("BGR;16", 2)}
# Where the grey level is: bytes of a pixel in its row, the first of them that is one, and rows of all planes to those of the picture.
_GREY = {("mono8", "8uc1", "8sc1", "mono", "grey", "gray", "gray8", "y8", "y800", "l8"): (1, 0, 1.0),
         ("yuyv", "yuy2", "yuv422_yuy2", "yuv422_yuyv", "yuyv422", "yvyu", "yvyu422"): (2, 0, 1.0),
         ("uyvy", "yuv422", "yuv422_uyvy", "uyvy422", "vyuy"): (2, 1, 1.0), ("yuv444", "yuv3"): (3, 0, 1.0),
         ("nv12", "nv21", "yuv420", "yuv420p", "yuv420sp", "i420", "iyuv", "yu12", "yv12"): (1, 0, 1.5),
         ("nv16", "nv61", "yuv422p", "422p"): (1, 0, 2.0), ("nv24", "nv42", "yuv444p"): (1, 0, 3.0)}
_GREY16 = {"mono10", "mono12", "mono14", "mono16", "y10", "y12", "y14", "y16", "gray16", "gray16le", "grey16"}
_BAYER = re.compile(r"(bayer_?)?(rggb|bggr|gbrg|grbg|rg|bg|gb|gr|ba)_?(8|10|12|14|16)?$")
# Channels, order of the first three.
_COLOURS16 = {"rgb16": (3, 1), "rgb48": (3, 1), "bgr16": (3, -1), "16uc3": (3, -1), "rgba16": (4, 1), "bgra16": (4, -1), "16uc4": (4, -1)}
_BY_NAME = {name: value for names, value in _COLOURS.items() for name in names}
_GREY_BY_NAME = {name: value for names, value in _GREY.items() for name in names}
_TWO_BYTES = "8uc2"  # of OpenCV: YUYV or UYVY
_DEPTH_PICTURES = {"16uc1", "32fc1", "64fc1", "16sc1"}  # REP 118: distances in mm or m
_VIDEO = re.compile(r"h\.?26[45]|hevc|avc|av1|vp[89]|theora|mpeg", re.I)


class NotTaken(Exception):
    """Why a topic's pictures are no pictures for a recording."""


class Depths:
    """What a camera's pictures so far show of their encoding: bits that those of 16 bits use, and which byte of two is grey."""

    def __init__(self, note: Callable[[str], None], is_distance: bool | None = None):
        """`is_distance`: whether values of 16 bits are distances, where the topic's name says so; None: the encoding says it."""
        self.is_distance = is_distance
        self._note = note
        self._bits = 0
        self._grey_byte: int | None = None

    def grey_byte(self, rows: Array) -> int:
        """Which byte of two is the grey level: the chroma is nearer to 128, or varies less. Of the first picture that shows it."""
        if self._grey_byte is None:
            spread = [float(np.square(rows[:, k::2].astype(np.float32) - 128).mean()) for k in range(2)]
            if spread[0] == spread[1]:
                return 0
            self._grey_byte = int(spread[1] > spread[0])
            self._note(f"its encoding states two bytes a pixel: the {('first', 'second')[self._grey_byte]} is the grey level, as of {('YUYV', 'UYVY')[self._grey_byte]}")
        return self._grey_byte

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
    width, height, encoding = int(message.width), int(message.height), message.encoding.strip().lower().split(";")[0]
    is_distance = encoding in _DEPTH_PICTURES
    if encoding in ("16uc1", "mono16") and depths.is_distance is not None:
        is_distance = depths.is_distance
    if is_distance:
        raise NotTaken(f"depth or raw distances ({message.encoding}), no picture that a detector reads")
    if bytes(message.data[:3]) == b"\xff\xd8\xff" and "jp" in encoding:  # "jpeg", "mjpeg", "mjpg"
        return _whole_jpeg(bytes(message.data))
    if not 0 < width <= _SIDE_MAX or not 0 < height <= _SIDE_MAX:
        raise BadMessage(f"a picture of {width} x {height} pixels")
    if encoding in _BY_NAME:
        return _packed(message, *_BY_NAME[encoding])
    if encoding == _TWO_BYTES:
        rows = _rows(message, height, 2 * width)
        return jpeg_of(rows[:, depths.grey_byte(rows) :: 2])
    if encoding in _GREY_BY_NAME:
        size, first, planes = _GREY_BY_NAME[encoding]
        return jpeg_of(_rows(message, _height(message, size, planes), size * width)[:, first::size])
    if encoding in _GREY16 or encoding == "16uc1":
        return jpeg_of(depths.grey(_words(message)))
    if bayer := _BAYER.match(encoding):
        if min(width, height) < 2:
            raise BadMessage(f"a Bayer picture of {width} x {height} pixels")
        is_byte = bayer[3] in (None, "8")
        grey = _demosaiced(np.ascontiguousarray(_rows(message, height, width)) if is_byte else _words(message))
        return jpeg_of(grey if is_byte else depths.grey(grey))
    if encoding in _COLOURS16:
        channels, order = _COLOURS16[encoding]
        rows = np.ascontiguousarray(_rows(message, height, 2 * channels * width)).view(">u2" if message.is_bigendian else "<u2")
        colour = rows.reshape(height, width, channels)[:, :, :3][:, :, ::order]
        weighted = colour.astype(np.uint32) @ np.array([299, 587, 114], dtype=np.uint32) // 1000  # ITU-R BT.601
        return jpeg_of(depths.grey(weighted.astype(np.uint16)))
    raise NotTaken(f"pictures in '{message.encoding}' are not read; mono, rgb, bgr, Bayer, YUV 4:2:2 and NV12 are")


def _height(message: Any, size: int, planes: float) -> int:
    """Rows of the picture: drivers that count the rows of all planes leave no bytes for further ones."""
    height, step = int(message.height), int(message.step) or size * int(message.width)
    counts_all = planes > 1 and len(message.data) < planes * (height - 1) * step and height * step <= len(message.data)
    return round(height / planes) if counts_all else height


def _packed(message: Any, raw: str, size: int) -> bytes:
    """By Pillow's own unpacking, which knows the order of the channels and the length of the rows."""
    width, height = int(message.width), int(message.height)
    rows = _rows(message, height, size * width)
    data = np.frombuffer(message.data, dtype=np.uint8)
    if len(data) < height * rows.strides[0]:
        data = np.ascontiguousarray(rows).ravel()  # the last row ends with its last pixel
    step = rows.strides[0] if len(data) >= height * rows.strides[0] else size * width
    picture = Image.frombuffer("RGB", (width, height), data, "raw", raw, step, 1)
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
    if data.rfind(b"\xff\xd9") <= data.rfind(b"\xff\xda"):  # no end after the last scan's begin
        raise BadMessage(f"the JPEG of {len(data)} bytes is cut: it has no end")
    try:
        with Image.open(io.BytesIO(data)) as picture:
            return jpeg_of(np.asarray(picture.convert("L"))) if picture.mode == "CMYK" else data
    except Exception:  # the robot's own decoder judges it
        return data
