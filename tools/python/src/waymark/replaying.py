# SPDX-License-Identifier: Apache-2.0
"""Replays in this process, and event logs as arrays, by libwaymark.so."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .native import check, dtype, ffi, library, names, text
from .run import PLANE, SPACE
from .tables import Array, Table


@dataclass(frozen=True)
class Estimate:
    """What a replay gave: tables with the columns of a run's trajectory.csv, published.csv and innovations.csv."""

    trajectory: Table
    published: Table
    innovations: Table
    report: dict[str, float]


def _poses(estimates: Array) -> Table:
    at = estimates["pose_map_base"]
    out: Table = {"t_ns": estimates["t_ns"], "x_m": at["p_m"][:, 0], "y_m": at["p_m"][:, 1], "z_m": at["p_m"][:, 2]}
    out |= {f"q{axis}": at["q_xyzw"][:, i] for i, axis in enumerate("xyzw")}
    covariance = estimates["covariance"]
    if len(estimates) and estimates["dof"][0] == 6:
        axes = ("x", "y", "z", "rx", "ry", "rz")
        out |= {f"cov_{axes[i]}{axes[j]}": covariance[:, 6 * i + j] for i, j in SPACE}
    else:
        out |= {f"cov_{name}": covariance[:, 6 * i + j] for (i, j), name in zip(PLANE, ("xx", "xy", "yy", "xt", "yt", "tt"))}
    return out | {"state": names("STATE")[estimates["state"]]}


def _published(rows: Array, bounds: Array) -> Table:
    poses = _poses(rows["now"])
    odom = rows["pose_odom_base"]
    return {"t_ns": poses.pop("t_ns"), "made_ns": rows["made_ns"], "fused_until_ns": rows["fused_until_ns"], **poses,
            "odom_x_m": odom["x_m"], "odom_y_m": odom["y_m"], "odom_heading_rad": odom["heading_rad"], "resets": rows["jumps"],
            "lost_probability": rows["now"]["lost_probability"], "cause": names("CAUSE")[rows["now"]["cause"]],
            "bound_m": bounds["horizontal_m"], "bound_heading_rad": bounds["heading_rad"], "usable": bounds["usable"].astype(np.int64),
            "unusable": bounds["why"].astype(np.int64)}


def _innovations(rows: Array) -> Table:
    return {"t_ns": rows["t_ns"], "source": rows["source"], "landmark": rows["landmark_id"].astype(np.int64),
            "residual": names("RESIDUAL")[rows["residual"]],
            **{name: rows[name] for name in ("observed", "expected", "variance", "nis", "gate")},
            "verdict": names("VERDICT")[rows["verdict"]]}


_KINDS = {2: "wm_estimate", 3: "wm_innovation", 4: "wm_published", 5: "wm_bound"}


def replay(input: str | Path, config: str | Path | None = None, *, changes: Mapping[str, object] | None = None,
           out: str | Path | None = None, landmarks: str | Path | None = None, calibration: str | Path | None = None,
           map: str | Path | None = None, seed: int = 1, from_s: float = 0.0, until_s: float = 0.0, lost: bool = False,
           note: Callable[[str], None] | None = None, progress: Callable[[float], None] | None = None,
           keeps: Callable[[Any], bool] | None = None) -> Estimate:
    """Localizes from a recording, or from the event log of a run, as `waymark replay` does, with the same bits.

    `changes` are values of the configuration by their keys: {"sightings.noise.bearing_factor": 2}. An event log needs no
    configuration. With `out` the files of a run are written, too. `keeps` gets each observation of an event log (a wm_event) and tells
    whether it is fused. WaymarkError has the library's message.
    """
    records: dict[int, bytearray] = {kind: bytearray() for kind in _KINDS}
    failed: list[BaseException] = []

    def keep(error: Any, value: BaseException, trace: Any) -> None:
        failed.append(value)

    def take(_: Any, kind: int, record: Any, size: int) -> None:
        if kind in records:
            records[kind] += ffi.buffer(record, size)

    def say(_: Any, line: Any) -> None:
        if note:
            note(text(line))

    def show(_: Any, done: float) -> None:
        if progress:
            progress(done)

    def path(value: str | Path | None) -> Any:
        return ffi.NULL if value is None else ffi.new("char[]", str(value).encode())

    def is_kept(_: Any, event: Any) -> int:
        return int(keeps is None or keeps(event))

    lines = None if changes is None else "\n".join(f"{key}: {value}" for key, value in changes.items())
    texts = {"input": path(input), "config": path(config), "changes": path(lines), "out": path(out), "landmarks": path(landmarks),
             "calibration": path(calibration), "map": path(map)}
    calls = {"take": ffi.callback("void(void *, waymark_record, const void *, size_t)", take, onerror=keep),
             "note": ffi.callback("void(void *, const char *)", say, onerror=keep),
             "progress": ffi.callback("void(void *, double)", show, onerror=keep),
             "keeps": ffi.callback("int32_t(void *, const wm_event *)", is_kept, onerror=keep) if keeps else ffi.NULL}  # referenced until the call has returned
    options = ffi.new("waymark_replay_options *", {"bytes": ffi.sizeof("waymark_replay_options"), **texts, "seed": seed,
                                                   "from_s": from_s, "until_s": until_s, "lost": lost, **calls})
    report = ffi.new("waymark_report *")
    check(library().waymark_replay, options, report, ffi.sizeof("waymark_report"))
    if failed:
        raise failed[0]
    arrays = {kind: np.frombuffer(bytes(data), dtype(_KINDS[kind])) for kind, data in records.items()}
    return Estimate(_poses(arrays[2]), _published(arrays[4], arrays[5]), _innovations(arrays[3]),
                    {name: getattr(report, name) for name in ("poses", "events", "recorded_s", "events_missing", "log_was_cut")})


def parameters(config: str) -> dict[str, dict[str, float]]:
    """Value, initial, min and max of each number that the estimator of a configuration's text reads, by their keys: "motion.noise.speed_mps"."""
    out: dict[str, dict[str, float]] = {}

    def take(_: Any, parameter: Any) -> None:
        out[text(parameter.key)] = {name: getattr(parameter, name) for name in ("value", "initial", "min", "max")}

    check(library().waymark_parameters, config.encode(), ffi.callback("void(void *, const waymark_parameter *)", take), ffi.NULL)
    return out


def _offset(kind: np.dtype[Any], field: str) -> int:
    """Bytes before a field of a struct."""
    assert kind.fields is not None
    return int(kind.fields[field][1])


class EventLog:
    """An event log, events.wmlog of a run: its texts, and its events as arrays by kind."""

    def __init__(self, path: str | Path):
        handle = ffi.new("waymark_log **")
        check(library().waymark_log_open, str(path).encode(), handle)
        log = handle[0]
        try:
            self.program, self.estimator, self.recording, self.config, self.calibration = (
                text(library().waymark_log_get_text(log, which)) for which in range(5))
            self.sources = self._names(library().waymark_log_source_name, log)
            self.sensors = self._names(library().waymark_log_sensor_name, log)
            self.missing, self._raw = self._read(log)
        finally:
            library().waymark_log_close(log)

    @staticmethod
    def _names(name_of: Any, log: Any) -> list[str]:
        out: list[str] = []
        while name := text(name_of(log, len(out))):
            out.append(name)
        return out

    @staticmethod
    def _read(log: Any) -> tuple[int, dict[str, bytearray]]:
        event, missing = ffi.new("wm_event *"), ffi.new("uint64_t *")
        raw: dict[str, bytearray] = {}
        kinds = names("EVENT").tolist()
        end, small, points = library().WM_END, ffi.offsetof("wm_event", "as") + 96, kinds.index("points")
        while check(library().waymark_log_next, log, event, ffi.sizeof("wm_event"), missing, also=(end,)) != end:
            size = ffi.sizeof("wm_event") if event.kind == points else small
            raw.setdefault(kinds[event.kind], bytearray()).extend(ffi.buffer(event, size))
        return int(missing[0]), raw

    def kinds(self) -> list[str]:
        """Kinds of its events: "quantities", "sighting", "points" ..."""
        return sorted(self._raw)

    def span(self) -> tuple[int, int]:
        """First and last stamp of all its events, ns; zeros without any."""
        whole = dtype("wm_event")
        fields = {kind: np.dtype({"names": ["t_ns"], "formats": ["i8"], "offsets": [_offset(whole, "t_ns")], "itemsize": self._size(kind)}) for kind in self._raw}
        stamps = np.concatenate([np.zeros(0, np.int64), *(np.frombuffer(bytes(raw), fields[kind])["t_ns"] for kind, raw in self._raw.items())])
        return (int(stamps.min()), int(stamps.max())) if len(stamps) else (0, 0)

    @staticmethod
    def _size(kind: str) -> int:
        """Bytes that are kept of an event."""
        whole = dtype("wm_event")
        return int(whole.itemsize) if kind == "points" else _offset(whole, "as") + 96

    def events(self, kind: str) -> Array:
        """The events of a kind in their order, with fields t_ns, arrival_ns, seq, source and those of the kind's struct."""
        whole = dtype("wm_event")
        data = bytes(self._raw.get(kind, b""))
        if kind not in (whole["as"].names or ()):
            raise ValueError(f"'{kind}' is not a kind of events with values; this log has {', '.join(self.kinds())}")
        body, offset = whole["as"][kind], _offset(whole, "as")
        size = self._size(kind)
        heads = ("t_ns", "arrival_ns", "seq", "source")
        layout: Any = {
            "names": [*heads, *(body.names or ())], "itemsize": size,
            "formats": [*(whole[name] for name in heads), *(body[name] for name in body.names or ())],
            "offsets": [*(_offset(whole, name) for name in heads), *(offset + _offset(body, name) for name in body.names or ())]}
        return np.frombuffer(data, np.dtype(layout))
