# SPDX-License-Identifier: Apache-2.0
"""Event logs (firmware/output/event_log.h): their head, the stamps of their events, and a log that ends earlier."""
import dataclasses
import struct

MAGIC = b"WMLOG 2\n"
_ESTIMATOR, _RECORDING, _LANDMARK, _LANDMARK_HASH, _SOURCE, _MAP_HASH, _MAP_PATH, _HEAD_END, _EVENT, _CLOSED = 2, 3, 11, 12, 14, 16, 17, 18, 19, 21

_QUANTITIES, _EVENT_HEAD = 1, 24  # kind of an event, and bytes before its payload (msgs/src/codec_event.c)
WHEEL_TICKS, WHEEL_SPEEDS, YAW_RATE = range(2), range(2, 7), 7  # wm_quantity


@dataclasses.dataclass
class Log:
    """A log; of its events the stamps, and the quantities of CAN."""

    recording: str = ""
    estimator: str = ""
    map_name: str = ""  # hash of the raster map, else of the landmarks
    map_path: str = ""
    landmarks: list = dataclasses.field(default_factory=list)  # (id, x, y) in m
    sources: list = dataclasses.field(default_factory=list)  # names
    events: list = dataclasses.field(default_factory=list)  # (stamp in ns, source, end of its record in the file)
    quantities: dict = dataclasses.field(default_factory=dict)  # wm_quantity: [(stamp in ns, value)]
    is_closed: bool = False  # it has the record of a regular end


def read(path):
    """Reads a log up to where it was cut. ValueError where it is none."""
    data = path.read_bytes()
    if data[:8] != MAGIC:
        raise ValueError(f"{path}: is not an event log")
    log, at, hashes = Log(), len(MAGIC), {}
    while at + 9 <= len(data):
        length, _, tag = struct.unpack_from("<IIB", data, at)
        end = at + 8 + length
        if length < 1 or end > len(data):
            break  # cut by a power failure or a full disk
        content = at + 9
        if tag == _EVENT:
            kind, source, _, t_ns = struct.unpack_from("<BHIq", data, content + 1)
            log.events.append((t_ns, source, end))
            if kind == _QUANTITIES:
                for number in range(data[content + _EVENT_HEAD]):
                    quantity, value = struct.unpack_from("<Bd", data, content + _EVENT_HEAD + 4 + 9 * number)
                    log.quantities.setdefault(quantity, []).append((t_ns, value))
        elif tag == _RECORDING:
            log.recording = data[content:end].decode(errors="replace")
        elif tag == _ESTIMATOR:
            log.estimator = data[content:end].decode(errors="replace")
        elif tag == _SOURCE:
            log.sources.append(data[content + 4:end].decode(errors="replace"))
        elif tag == _LANDMARK:
            identity, x, y = struct.unpack_from("<idd", data, content + 1)
            log.landmarks.append((identity, x, y))
        elif tag in (_LANDMARK_HASH, _MAP_HASH):
            hashes[tag] = f"{struct.unpack_from('<Q', data, content)[0]:016x}"
        elif tag == _MAP_PATH:
            log.map_path = data[content:end].decode(errors="replace")
        elif tag == _CLOSED:
            log.is_closed = True
        at = end
    log.map_name = hashes.get(_MAP_HASH) or hashes.get(_LANDMARK_HASH, "")
    return log


def cut(log, path, to, t_ns):
    """Writes the log without the events after a stamp."""
    ends = [end for at_ns, _, end in log.events if at_ns <= t_ns]
    with path.open("rb") as whole:
        to.write_bytes(whole.read(max(ends, default=0)))
