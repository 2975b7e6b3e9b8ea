# SPDX-License-Identifier: Apache-2.0
"""MAVLink 2 by its definition (mavlink.io, "Packet Serialization"), without any library: frames to fields and back.

A message's fields are in the order of its definition; "|" is before its extensions. On the wire the fields before it are sorted by
the size of their type, and zeros at the end of the payload are left out."""

import struct
from typing import NamedTuple

DEFINITIONS = {
    "HEARTBEAT": (0, "uint8_t type, uint8_t autopilot, uint8_t base_mode, uint32_t custom_mode, uint8_t system_status, uint8_t mavlink_version"),
    "VISION_POSITION_ESTIMATE": (102, "uint64_t usec, float x, float y, float z, float roll, float pitch, float yaw, |, float covariance 21, "
                                      "uint8_t reset_counter"),
    "TIMESYNC": (111, "int64_t tc1, int64_t ts1, |, uint8_t target_system, uint8_t target_component"),
    "GLOBAL_POSITION_SENSOR": (296, "uint8_t target_system, uint8_t target_component, uint8_t id, uint64_t time_usec, uint32_t processing_time, "
                                    "uint8_t source, uint8_t flags, int32_t lat, int32_t lon, float alt_ellipsoid, float alt, float eph, float epv"),
    "ODOMETRY": (331, "uint64_t time_usec, uint8_t frame_id, uint8_t child_frame_id, float x, float y, float z, float q 4, float vx, float vy, "
                      "float vz, float rollspeed, float pitchspeed, float yawspeed, float pose_covariance 21, float velocity_covariance 21, |, "
                      "uint8_t reset_counter, uint8_t estimator_type, int8_t quality"),
}
LETTERS = {"uint8_t": "B", "int8_t": "b", "uint32_t": "I", "int32_t": "i", "uint64_t": "Q", "int64_t": "q", "float": "f"}


class Frame(NamedTuple):
    name: str
    system: int
    component: int
    fields: dict


def crc(data, value=0xFFFF):
    """CRC-16/MCRF4XX: polynomial 0x1021, reflected."""
    for byte in data:
        value = value >> 8 ^ TABLE[(value ^ byte) & 0xFF]
    return value


def _shifted(value):
    for _ in range(8):
        value = value >> 1 ^ (0x8408 if value & 1 else 0)
    return value


TABLE = [_shifted(byte) for byte in range(256)]


class Layout:
    """Of a message: its fields (type, name, length or 0) as they lie in the payload, and the seed of its checksum."""

    def __init__(self, name):
        self.number, text = DEFINITIONS[name]
        base, _, extensions = text.partition("|, ")
        fields = [[(*words, 0)[:3] if len(words) < 3 else (*words[:2], int(words[2])) for words in (part.split() for part in half.split(",") if part.strip())]
                  for half in (base, extensions)]
        sized = sorted(fields[0], key=lambda field: -struct.calcsize(LETTERS[field[0]]))
        self.fields = sized + fields[1]
        text = name + " " + "".join(f"{kind} {field} " + (chr(length) if length else "") for kind, field, length in sized)
        seed = crc(text.encode("latin-1"))
        self.extra = seed & 0xFF ^ seed >> 8
        self.form = "<" + "".join(f"{length or ''}{LETTERS[kind]}" for kind, _, length in self.fields)


LAYOUTS = {name: Layout(name) for name in DEFINITIONS}
NAMES = {layout.number: name for name, layout in LAYOUTS.items()}


def decode(data):
    """The frames of a datagram; AssertionError where one is not as it should be."""
    out = []
    while data:
        magic, length, incompatible, _, _, system, component = data[:7]
        assert magic == 0xFD and incompatible == 0, data[:10].hex()
        name = NAMES[int.from_bytes(data[7:10], "little")]
        layout, payload = LAYOUTS[name], data[10:10 + length]
        assert int.from_bytes(data[10 + length:12 + length], "little") == crc(bytes([layout.extra]), crc(data[1:10 + length])), f"{name}: checksum"
        assert length == 1 or payload[-1] != 0, f"{name}: zeros at the end are sent"
        values = list(struct.unpack(layout.form, payload.ljust(struct.calcsize(layout.form), b"\0")))
        fields = {field: tuple(values.pop(0) for _ in range(count)) if count else values.pop(0) for _, field, count in layout.fields}
        out.append(Frame(name, system, component, fields))
        data = data[12 + length:]
    return out


def encode(name, system, component, **fields):
    """A frame; fields that are not given are 0."""
    layout, values = LAYOUTS[name], []
    for _, field, count in layout.fields:
        values += fields.get(field, [0] * count) if count else [fields.get(field, 0)]
    payload = struct.pack(layout.form, *values)
    payload = payload[:1] + payload[1:].rstrip(b"\0")
    head = bytes([len(payload), 0, 0, 0, system, component]) + layout.number.to_bytes(3, "little")
    return b"\xfd" + head + payload + crc(bytes([layout.extra]), crc(head + payload)).to_bytes(2, "little")
