# SPDX-License-Identifier: Apache-2.0
"""Bytes of a message as an object, by the definition that the bag itself has, else by ROS 2's common types."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from ..ros import typestore
from . import xcdr2

_ZSTD = b"\x28\xb5\x2f\xfd"  # RFC 8878; no CDR and no ROS 1 message of a header begins so
_MESSAGE_MAX = 1 << 30  # bytes of a message that was compressed alone; more is damage
_RULE = "=" * 80


class BadMessage(Exception):
    """Why one message can't be taken, as a sentence without its subject."""


@dataclass
class Bad:
    """Messages of a topic, or tags, that can't be taken: the first one's stamp and reason, and how many."""

    t_ns: int
    why: str
    count: int = 0


@dataclass(eq=False)
class Topic:
    """A stream of messages of one type. `why`: the reason why its messages can't be read, "" where they can."""

    name: str
    kind: str
    decode: Callable[[Any], Any]
    count: int | None = None
    why: str = ""


@lru_cache(maxsize=1)
def _common() -> Typestore:
    return typestore()


def kind_of(name: str) -> str:
    """A type's name as ROS 2 has it: "nav_msgs/Odometry" and "nav_msgs::msg::dds_::Odometry_" are "nav_msgs/msg/Odometry"."""
    parts = [part for part in name.replace("::", "/").split("/") if part not in ("", "dds_")]
    if len(parts) == 2:
        parts.insert(1, "msg")
    if "::" in name:
        parts[-1] = parts[-1].removesuffix("_")
    return "/".join(parts)


@lru_cache(maxsize=256)  # a bag has many topics of one type
def _store_of(kind: str, definition: str, style: str) -> Typestore | None:
    """The types of a definition ("msg" or "idl"); None where it is none."""
    store = get_typestore(Stores.EMPTY)
    try:
        if style == "idl":
            types: dict[str, Any] = {}
            for part in definition.split(f"{_RULE}\nIDL: ")[1:] or [definition]:
                types.update(get_types_from_idl(part.split("\n", 1)[1] if part is not definition else part))
        else:
            types = dict(get_types_from_msg(definition, kind))
        own = set(store.fielddefs)
        store.register({name: fields for name, fields in types.items() if name not in own})
        store.get_msgdef(kind)
    except Exception:  # a parser of a foreign text raises whatever the text leads to; its definition is not used then
        return None
    return store


def topic(name: str, kind: str, definition: str, style: str, wire: str, count: int | None = None) -> Topic:
    """A topic with its decoder. `style` of the definition: "msg", "idl" or "". `wire`: "cdr" or "ros1"."""
    kind = kind_of(kind)
    if wire not in ("cdr", "ros1"):
        return Topic(name, kind, _none, count, f"its messages are encoded as '{wire or 'nothing'}'; those of ROS (cdr, ros1) are read")
    decode: Callable[[Any], Any] | None = None

    def first(data: Any) -> Any:  # the types are made when a message needs them: most topics of a bag are not read
        nonlocal decode
        if decode is None:
            decode = _decoder(kind, definition, style, wire)
        return decode(data)

    return Topic(name, kind, first, count)


def _none(_data: Any) -> Any:
    raise BadMessage("its encoding is not read")


def _decoder(kind: str, definition: str, style: str, wire: str) -> Callable[[Any], Any]:
    store = _store_of(kind, definition, style) if definition.strip() else None
    if store is None and wire == "cdr" and kind in _common().types:
        store = _common()
    if store is None:
        what = "no definition that can be read" if definition.strip() else "no definition"
        raise BadMessage(f"the bag has {what} of {kind}")
    read = store.deserialize_cdr if wire == "cdr" else store.deserialize_ros1

    def decode(data: Any) -> Any:
        if bytes(data[:4]) == _ZSTD:
            data = _unpacked(data)
        begin = bytes(data[:2]) if wire == "cdr" else b""
        if begin in xcdr2.PARAMETER_LISTS:
            raise BadMessage("it is a list of parameters (PL_CDR), in which no ROS type is written; plain CDR is read")
        try:
            if begin in xcdr2.PLAIN or begin in xcdr2.DELIMITED:
                data = xcdr2.rewritten(bytes(data), store, kind)
            return read(data, kind)
        except Exception:  # what a decoder raises on bytes that don't fit the type is its own matter
            raise BadMessage(f"its {len(data)} bytes are no {kind}") from None

    return decode


def _unpacked(data: Any) -> bytes:
    """A message that was compressed alone (rosbag2's compression mode MESSAGE)."""
    import zstandard

    try:
        with zstandard.ZstdDecompressor().stream_reader(bytes(data)) as stream:
            out = stream.read(_MESSAGE_MAX)
    except zstandard.ZstdError:
        raise BadMessage(f"its {len(data)} bytes are compressed by zstd and damaged") from None
    return bytes(out)
