# SPDX-License-Identifier: Apache-2.0
"""Maps as arrays: floor plans (map.yaml with its layers), landmarks, and the map that a run made.

Frames and units are those of recordings (docs/recording-format.md). All functions may be called in any thread.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from PIL import Image

from .documents import read_mapping
from .tables import Array, Table, as_column, read_table, write_table

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""Values of `FloorPlan.cells`, as nav_msgs/OccupancyGrid has them."""

_GREY = {FREE: 254, OCCUPIED: 0, UNKNOWN: 205}  # as map_saver of ROS writes them
_SHARES = {"free_thresh": 0.196, "occupied_thresh": 0.65, "negate": 0.0}  # defaults of map_server
_SIDE_MAX_PX = 1 << 15  # of a picture; larger ones are a mistake or an attack


@dataclass(frozen=True)
class FloorPlan:
    """A raster map. Row 0 of each array is the lowest y, so that `cells[row, column]` grows along the map's axes.

    resolution_m: side of a cell. origin: x (m), y (m) and yaw (rad) of the outer corner of cell [0, 0] in the map.
    cells: int8, FREE, OCCUPIED or UNKNOWN; None without an image. edges: bool, joints of wall and floor that `edge_mcl` and `pf_edges`
    see; drivable: bool, where the robot can be. None: the map has no such layer. All arrays have one shape.
    """

    resolution_m: float
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    cells: Array | None = None
    edges: Array | None = None
    drivable: Array | None = None

    def __post_init__(self) -> None:
        shapes = {layer.shape for layer in (self.cells, self.edges, self.drivable) if layer is not None}
        if len(shapes) != 1 or any(len(shape) != 2 for shape in shapes):
            raise ValueError(f"a floor plan needs layers of one shape (rows, columns); these have {sorted(shapes) or 'none'}")
        for name in ("cells", "edges", "drivable"):
            if getattr(self, name) is not None and not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"a floor plan's {name} are not finite: some are NaN or infinite")
        if not (np.isfinite(self.resolution_m) and self.resolution_m > 0 and np.isfinite(self.origin).all()):
            raise ValueError(f"a floor plan's resolution has to be positive and its origin finite: {self.resolution_m}, {self.origin}")

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        layer = next(layer for layer in (self.cells, self.edges, self.drivable) if layer is not None)
        return int(layer.shape[0]), int(layer.shape[1])

    def cell_of(self, x_m: Array, y_m: Array) -> tuple[Array, Array]:
        """Rows and columns (int64) of the cells in which points of the map lie; outside of the plan they are outside of its shape.

        ValueError: a point is not finite.
        """
        if not (np.isfinite(x_m).all() and np.isfinite(y_m).all()):
            raise ValueError("a point whose cell is asked for is not finite")
        c, s = np.cos(self.origin[2]), np.sin(self.origin[2])
        dx, dy = np.asarray(x_m) - self.origin[0], np.asarray(y_m) - self.origin[1]
        along, across = (c * dx + s * dy) / self.resolution_m, (c * dy - s * dx) / self.resolution_m
        return np.floor(across).astype(np.int64), np.floor(along).astype(np.int64)

    def centre_of(self, row: Array, column: Array) -> tuple[Array, Array]:
        """x and y (m, map) of the middle of cells."""
        c, s = np.cos(self.origin[2]), np.sin(self.origin[2])
        along, across = (np.asarray(column) + 0.5) * self.resolution_m, (np.asarray(row) + 0.5) * self.resolution_m
        return self.origin[0] + c * along - s * across, self.origin[1] + s * along + c * across


def _levels(picture: Image.Image) -> tuple[Array, Array | None]:
    """Grey levels of 8 bits as the runtime has them, the mean of colours; and where the picture isn't transparent at all."""
    if picture.mode.startswith("I"):  # 16 bits
        return (np.asarray(picture, dtype=np.int64) * 255 + 32767) // 65535, None
    if picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info:
        colours = np.asarray(picture.convert("RGBA"), dtype=np.int64)
        return (2 * colours[..., :3].sum(axis=2) + 3) // 6, colours[..., 3] == 255
    if picture.mode in ("L", "1"):
        return np.asarray(picture.convert("L"), dtype=np.int64), None
    return (2 * np.asarray(picture.convert("RGB"), dtype=np.int64).sum(axis=2) + 3) // 6, None


def _grey(path: Path, about: Path) -> tuple[Array, Array]:
    """A picture's grey levels and where it is opaque, the lowest row first."""
    try:
        with Image.open(path) as picture:
            size = picture.size
            levels = _levels(picture) if max(size) <= _SIDE_MAX_PX else None
    except FileNotFoundError:
        raise FileNotFoundError(f"{about}: its picture {path} is not there") from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError):
        raise ValueError(f"{path}: this is no picture that can be read, or it is cut off") from None
    if levels is None:
        raise ValueError(f"{path}: {size[0]} x {size[1]} pixels; up to {_SIDE_MAX_PX} a side are read")
    grey, opaque = levels
    return grey[::-1], np.ones(grey.shape, dtype=bool) if opaque is None else opaque[::-1]


def _cells(mode: str, shares: dict[str, float], path: Path, file: Path) -> Array:
    """What the pixels of `image` mean, by the rules of map_server that the runtime has, too (wm_map_cells_load)."""
    if mode not in ("trinary", "scale", "raw"):
        raise ValueError(f"{file}: mode: '{mode}' is none of trinary, scale, raw")
    if mode == "raw" and shares["negate"]:
        raise ValueError(f"{file}: negate: the map servers of ROS 1 and 2 differ in what it means with mode raw; write 0")
    grey, opaque = _grey(path, file)
    dark = grey / 100.0 if mode == "raw" else (grey if shares["negate"] else 255 - grey) / 255.0
    cells = np.full(grey.shape, UNKNOWN, dtype=np.int8)
    cells[dark > shares["occupied_thresh"]] = OCCUPIED
    cells[dark < shares["free_thresh"]] = FREE
    cells[~opaque | ((mode == "raw") & (grey > 100))] = UNKNOWN
    return cells


def _number(value: Any, key: str, file: Path) -> float:
    if not isinstance(value, (int, float)):
        raise ValueError(f"{file}: {key}: {value!r} is not a number")
    return float(value)


def read_floor_plan(path: str | Path) -> FloorPlan:
    """A map.yaml (of ROS's map_server, with `layers` of ours) and its pictures. `path` may be a recording's folder.

    ValueError or FileNotFoundError name the file and what is wrong with it.
    """
    file = Path(path) / "map/map.yaml" if Path(path).is_dir() else Path(path)
    about = read_mapping(file)
    for key in ("resolution", "origin"):
        if key not in about:
            raise ValueError(f"{file}: {key} is missing; a map has image, resolution and origin")
    origin, layers = about["origin"], about.get("layers") or {}
    if not isinstance(origin, list) or not 2 <= len(origin) <= 3:
        raise ValueError(f"{file}: origin is [x, y, yaw], and not {origin!r}")
    if not isinstance(layers, dict):
        raise ValueError(f"{file}: layers are {{edges: FILE, drivable: FILE}}")
    layers = {str(name): str(picture) for name, picture in layers.items()}
    resolution_m, (x_m, y_m, yaw) = _number(about["resolution"], "resolution", file), [_number(value, "origin", file) for value in (*origin, 0)[:3]]
    shares = {key: _number(about.get(key, default), key, file) for key, default in _SHARES.items()}
    for key, value in shares.items():
        if not 0 <= value <= 1:
            raise ValueError(f"{file}: {key} is {value}; it has to be from 0 to 1")
    if shares["free_thresh"] > shares["occupied_thresh"]:
        raise ValueError(f"{file}: free_thresh is {shares['free_thresh']}, above occupied_thresh ({shares['occupied_thresh']})")
    cells = None
    if about.get("image") and (file.parent / str(about["image"])).is_file() or not layers:
        cells = _cells(str(about.get("mode", "trinary")), shares, file.parent / str(about.get("image", "")), file)

    def mask(name: str) -> Array | None:
        if name not in layers:
            return None
        grey, opaque = _grey(file.parent / layers[name], file)
        return np.asarray((grey >= 128) & opaque)

    masks = {name: mask(name) for name in ("edges", "drivable")}
    return FloorPlan(resolution_m, (x_m, y_m, yaw), cells, masks["edges"], masks["drivable"])


def write_floor_plan(path: str | Path, plan: FloorPlan) -> None:
    """Writes a map.yaml with a PNG for each layer beside it. `path` is the file, or the folder of a recording (its map/map.yaml)."""
    file = Path(path) if Path(path).suffix in (".yaml", ".yml") else Path(path) / "map/map.yaml"
    file.parent.mkdir(parents=True, exist_ok=True)

    def picture(name: str, grey: Array) -> str:
        Image.fromarray(np.ascontiguousarray(grey[::-1].astype(np.uint8))).save(file.parent / f"{name}.png")
        return f"{name}.png"

    about: dict[str, object] = {}
    if plan.cells is not None:
        grey = np.select([plan.cells == FREE, plan.cells == OCCUPIED], [_GREY[FREE], _GREY[OCCUPIED]], _GREY[UNKNOWN])
        about["image"] = picture("plan", grey)
    about.update(resolution=float(plan.resolution_m), origin=[float(value) for value in plan.origin], negate=0,
                 occupied_thresh=_SHARES["occupied_thresh"], free_thresh=_SHARES["free_thresh"])
    layers = {name: picture(name, 255 * np.asarray(mask, dtype=bool)) for name, mask in (("edges", plan.edges), ("drivable", plan.drivable))
              if mask is not None}
    if layers:
        about["layers"] = layers
    file.write_text(yaml.safe_dump(about, sort_keys=False), encoding="utf-8")


def read_landmarks(path: str | Path) -> Table:
    """A landmark map: landmarks.csv, truth-landmarks.csv or map-estimate.csv, a run's folder or a recording's.

    Columns: id, x_m, y_m, z_m, sigma_m (m, map), where they are there yaw_rad and cov_xx, cov_xy, cov_yy (m2), cov_tt (rad2).
    """
    folder = Path(path)
    if not folder.is_dir():
        return read_table(folder)
    for name in ("map-estimate.csv", "landmarks.csv"):
        if (folder / name).is_file():
            return read_table(folder / name)
    raise FileNotFoundError(f"{path}: there is neither map-estimate.csv (of a run) nor landmarks.csv (of a recording) in it")


def write_landmarks(path: str | Path, table: Table) -> None:
    """Writes a landmark map that `landmarks:` of a configuration takes. `path` is the file or a recording's folder.

    Needed: id, x_m, y_m; z_m is 0 and sigma_m follows from the covariance, else 0.05 m, where they are missing. ValueError: a column is
    missing, an identity comes twice, or a position is not finite.
    """
    missing = [name for name in ("id", "x_m", "y_m") if name not in table]
    if missing:
        raise ValueError(f"{path}: landmarks need the column {missing[0]}")
    count = len(table["id"])
    out: Table = {"id": as_column("id", table["id"], str(path)).astype(np.int64), "x_m": np.asarray(table["x_m"]), "y_m": np.asarray(table["y_m"]),
                  "z_m": np.asarray(table.get("z_m", np.zeros(count)))}
    if "sigma_m" in table:
        out["sigma_m"] = np.asarray(table["sigma_m"])
    elif "cov_xx" in table:
        out["sigma_m"] = np.sqrt((np.asarray(table["cov_xx"]) + np.asarray(table["cov_yy"])) / 2)
    else:
        out["sigma_m"] = np.full(count, 0.05)
    out.update({name: np.asarray(column) for name, column in table.items() if name not in out})
    if len(np.unique(out["id"])) != count:
        raise ValueError(f"{path}: an identity comes twice")
    if not all(np.isfinite(out[name]).all() for name in ("x_m", "y_m", "z_m")):
        raise ValueError(f"{path}: a position is not finite")
    folder = Path(path)
    write_table(folder / "landmarks.csv" if folder.is_dir() else folder, out)


def covariances(table: Table) -> Array:
    """Covariances (n, 2, 2) of a landmark map's positions in m2: its own, else by sigma_m."""
    out = np.zeros((len(table["id"]), 2, 2))
    if "cov_xx" in table:
        out[:, 0, 0], out[:, 1, 1] = table["cov_xx"], table["cov_yy"]
        out[:, 0, 1] = out[:, 1, 0] = table["cov_xy"]
    else:
        out[:, 0, 0] = out[:, 1, 1] = table["sigma_m"] ** 2
    return out
