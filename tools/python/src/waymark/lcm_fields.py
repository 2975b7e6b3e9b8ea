# SPDX-License-Identifier: Apache-2.0
"""Messages of LCM in Python's own types: names are texts, lists are as long as they are."""

from collections.abc import Iterable, Iterator
from typing import Any

from .lcm_types import load

_BYTES_MAX = 1 << 16  # of a message of any type


def text(characters: bytes | bytearray) -> str:
    """A name that is padded with zeros."""
    return bytes(characters).split(b"\0")[0].decode("utf-8", "replace")


def _blank(kind: str) -> Any:
    """A message of zeros, each name and list with its whole length. ValueError where there is no such type."""
    if kind not in load():
        raise ValueError(f"'{kind}' is not a message type; {', '.join(load())} are")
    made: Any = load()[kind]
    return made.decode(made._get_packed_fingerprint() + bytes(_BYTES_MAX))


def _counts(message: Any) -> dict[str, str]:
    """Each list with a count: its field and that of the count."""
    lists = [name for name in message.__slots__ if isinstance(getattr(message, name), (list, tuple))]
    if "count" in message.__slots__:
        return dict.fromkeys(lists, "count")
    stems = {name.removesuffix("_count"): name for name in message.__slots__ if name.endswith("_count")}
    return {name: count for stem, count in stems.items() for name in lists if name in (stem, f"{stem}s")}


def plain(message: Any) -> dict[str, Any]:
    """The fields of a message by their names: names as texts, lists cut to their counts, messages within it likewise."""
    counts = _counts(message)

    def shown(value: Any) -> Any:
        if isinstance(value, (bytes, bytearray)):
            return text(value)
        if isinstance(value, (list, tuple)):
            return [shown(item) for item in value]
        return plain(value) if hasattr(value, "__slots__") else value

    return {name: shown(value[: getattr(message, counts[name])] if name in counts else value)
            for name in message.__slots__ for value in [getattr(message, name)]}


def _fitted(kind: str, name: str, value: Any, blank: Any) -> Any:
    """A field's value, as long as the type has it."""
    if isinstance(blank, bytes):
        characters = value.encode() if isinstance(value, str) else bytes(value)
        if len(characters) >= len(blank):
            raise ValueError(f"{kind}: {name} has {len(blank) - 1} bytes at most, '{text(characters)}' has {len(characters)}")
        return characters.ljust(len(blank), b"\0")
    if isinstance(blank, tuple) and len(value := list(value)) != len(blank):
        raise ValueError(f"{kind}: {name} has {len(blank)} values, {len(value)} are given")
    return value


def _padded(values: Iterable[Any], blank: tuple[Any, ...]) -> list[Any]:
    """A counted list; numbers that are not given are absent."""
    given = list(values)
    absent = float("nan") if isinstance(blank[0], float) else blank[0]
    return given + [absent] * (len(blank) - len(given))


def build(kind: str, **fields: Any) -> list[Any]:
    """Messages of a type with these fields: names may be texts, lists have any length, of which one message has as many as fit.

    Numbers of a list that is not given are NaN: absent. A type without a count gives one message. ValueError names what is wrong.

        for message in waymark.build("observations_t", t_ns=now_ns, sensor="front", landmark_id=[3, 7], bearing_rad=[0.1, -0.4]):
            node.publish("WAYMARK_SIGHTINGS", message.encode())
    """
    return list(_built(kind, fields))


def _built(kind: str, fields: dict[str, Any]) -> Iterator[Any]:
    blank = _blank(kind)
    for name in fields:
        if name not in blank.__slots__:
            raise ValueError(f"{kind} has no field '{name}'; {', '.join(blank.__slots__)} are")
    counts = _counts(blank)
    lists = {name: list(value) for name, value in fields.items() if name in counts}
    total = len(next(iter(lists.values()), []))
    if different := [f"{name} {len(value)}" for name, value in lists.items() if len(value) != total]:
        raise ValueError(f"{kind}: lists of different lengths: {next(iter(lists))} {total}, {', '.join(different)}")
    step = min((len(getattr(blank, name)) for name in lists), default=1)
    for first in range(0, max(total, 1), step):
        message = _blank(kind)
        for name, value in fields.items():
            if name not in counts:
                setattr(message, name, _fitted(kind, name, value, getattr(blank, name)))
        for name, count in counts.items():
            setattr(message, name, _padded(lists.get(name, [])[first:first + step], getattr(blank, name)))
            if lists:
                setattr(message, count, min(total - first, step))
        yield message
