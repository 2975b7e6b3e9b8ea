# SPDX-License-Identifier: Apache-2.0
"""CSV files of recordings and runs as columns: read and written without a loss."""

import csv
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[Any]
"""An array of numpy; docstrings name shape and unit."""
Table: TypeAlias = dict[str, Array]
"""Columns by name, all of one length: int64 (stamps, identities), float64 (NaN: empty) or str."""

_WORDS = {"sensor", "source", "state", "verdict", "residual", "picture", "cause"}
_COUNTS = {"id", "landmark", "frame", "polyline", "resets", "usable", "unusable"}
_MEASURES = re.compile(r"_(m|mps|mps2|rad|radps|px|deg|hz|s)$")  # units of numbers
_BLOCK_ROWS = 4096  # written at once
ABSENT = -1
"""An empty field of a column of integers."""


def is_integer(column: str) -> bool:
    """Whether a column holds integers: stamps, identities, counts."""
    return column.endswith("_ns") or column in _COUNTS


def is_text(column: str) -> bool:
    """Whether a column holds words."""
    return column in _WORDS


def _column(name: str, fields: list[str], path: Path) -> Array:
    if is_text(name):
        return np.array(fields, dtype=str)
    wanted = "whole number" if is_integer(name) else "number"
    for row, field in enumerate(fields):
        if "_" in field or not field.isascii():  # Python's own spellings of numbers
            raise ValueError(f"{path}:{row + 2}: '{field}' is not a {wanted} (column {name})")
    try:
        if is_integer(name):
            return np.array([int(field) if field else ABSENT for field in fields], dtype=np.int64)
        return np.array([float(field) if field else np.nan for field in fields], dtype=np.float64)
    except (ValueError, OverflowError):
        for row, field in enumerate(fields):
            try:
                float(field or "nan") if not is_integer(name) else np.int64(int(field or "0"))
            except ValueError:
                raise ValueError(f"{path}:{row + 2}: '{field}' is not a {wanted} (column {name})") from None
            except OverflowError:
                raise ValueError(f"{path}:{row + 2}: '{field}' does not fit into 64 bits (column {name})") from None
        raise


def _fields(rows: Iterator[list[str]], path: Path) -> tuple[list[str], list[list[str]]]:
    """Names and fields of the columns."""
    names = [name.strip() for name in next(rows, [])]
    if not names or all(re.fullmatch(r"[-+.\d]*", name) for name in names):
        raise ValueError(f"{path}:1: there is no header line")
    if len(set(names)) < len(names):
        raise ValueError(f"{path}:1: the column {max(names, key=names.count)} appears twice")
    fields: list[list[str]] = [[] for _ in names]
    for number, row in enumerate(rows, start=2):
        if not row:
            continue
        if len(row) > len(names):
            raise ValueError(f"{path}:{number}: {len(row)} fields, but {len(names)} columns")
        for i, column in enumerate(fields):
            column.append(row[i] if i < len(row) else "")
    return names, fields


def read_table(path: str | Path) -> Table:
    """The columns of a CSV file. ValueError names file and line of what can't be read."""
    path = Path(path)
    with path.open(newline="", encoding="utf-8-sig") as file:
        try:
            names, fields = _fields(csv.reader(file), path)
        except UnicodeDecodeError:
            raise ValueError(f"{path}: this is no text in UTF-8 (UTF-16, or no text at all?); save it as UTF-8") from None
        except csv.Error:
            raise ValueError(f"{path}: this is no CSV: zero bytes, or a field without its end") from None
    return {name: _column(name, column, path) for name, column in zip(names, fields)}


def field_text(value: Any) -> str:
    """A value as CSV has it: the shortest text that reads back as the same number; empty for an absent one."""
    if isinstance(value, (str, np.str_)):
        return str(value)
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    return "" if np.isnan(value) else repr(float(value))


NS_MOST = 4_000_000_000_000_000_000
"""ns, about 127 years: the runtime reads stamps up to this."""


def _stamps(name: str, column: Array, where: str) -> Array:
    """datetime64 or timedelta64 of any unit as whole nanoseconds."""
    kind = "datetime64" if column.dtype.kind == "M" else "timedelta64"
    if not name.endswith("_ns"):
        raise ValueError(f"{where}: {name} holds {column.dtype}; only stamps (columns that end in _ns) are times")
    unit = np.datetime_data(column.dtype)[0]
    if unit in ("generic", "Y", "M"):
        raise ValueError(f"{where}: {name} is {column.dtype}, which has no length in nanoseconds; {kind}[ns] has")
    if np.isnat(column).any():
        raise ValueError(f"{where}: {name} has no time (NaT) in row {int(np.argmax(np.isnat(column)))}")
    seconds = column.astype(f"{kind}[s]").astype(np.int64)
    if len(seconds) and max(abs(int(seconds.min())), abs(int(seconds.max()))) > NS_MOST // 10**9:
        raise ValueError(f"{where}: {name} has a time that doesn't fit into 64-bit nanoseconds")
    return column.astype(f"{kind}[ns]").astype(np.int64)


def _whole(name: str, column: Array, where: str) -> Array:
    """Floating point as whole numbers."""
    whole = np.isfinite(column) & (column == np.floor(column)) & (np.abs(column) <= NS_MOST)
    if not whole.all():
        row = int(np.argmin(whole))
        unit = "; are these seconds? (1e9 * t).round().astype(np.int64) makes nanoseconds of them" if name.endswith("_ns") else ""
        raise ValueError(f"{where}: column {name} holds whole numbers, but row {row} has {float(column[row])!r}{unit}")
    return column.astype(np.int64)


def _needed(name: str) -> str:
    return "whole nanoseconds (int64) or datetime64" if name.endswith("_ns") else "numbers" if _MEASURES.search(name) else "numbers or names"


def as_column(name: str, values: Any, where: str) -> Array:
    """Values as a column of a table of that name: int64, float64 or str. ValueError in words where they can't be one."""
    if isinstance(values, np.ma.MaskedArray) and np.any(values.mask):
        mask = np.broadcast_to(values.mask, values.shape)
        if is_integer(name):
            raise ValueError(f"{where}: {name} has no value (masked) in row {int(np.argmax(mask))}")
        values = np.where(mask, np.nan, np.asarray(values.data, dtype=np.float64))
    column = np.asarray(values)
    if column.ndim != 1:
        raise ValueError(f"{where}: {name} has the shape {column.shape}; a column is one-dimensional")
    if column.dtype.kind in "Mm":
        return _stamps(name, column, where)
    if column.dtype.kind == "S":
        column = np.char.decode(column, "utf-8")
    if column.dtype.kind == "U":
        bad = next((text for text in sorted(set(column.tolist())) if any(mark in text for mark in ',"\r\n')), None)
        if column.size and (is_integer(name) or _MEASURES.search(name)):
            raise ValueError(f"{where}: {name} holds text ({str(column[0])!r}); {_needed(name)} are needed")
        if bad is not None:
            raise ValueError(f"{where}: {name} is {bad!r}; names have no comma, quote or line end")
        return column
    if column.dtype.kind not in ("iuf" if is_integer(name) else "biuf"):
        kind = type(column.flat[0]).__name__ if column.dtype.kind == "O" and column.size else str(column.dtype)
        raise ValueError(f"{where}: {name} holds {kind}; {_needed(name)} are needed")
    if is_integer(name) and column.dtype.kind in "iu" and column.size:
        far = np.flatnonzero((column > NS_MOST) | (column < -NS_MOST))
        if len(far):
            raise ValueError(f"{where}: {name} has {int(column[far[0]])} in row {int(far[0])}; whole numbers up to {NS_MOST} are read")
    return _whole(name, column, where) if is_integer(name) and column.dtype.kind == "f" else column


def as_table(table: Mapping[str, Any], where: str) -> Table:
    """Columns of one length, each as `as_column` makes it."""
    out = {name: as_column(name, values, where) for name, values in table.items()}
    lengths = {name: len(column) for name, column in out.items()}
    if len(set(lengths.values())) > 1:
        usual = max(lengths.values(), key=list(lengths.values()).count)
        other = ", ".join(f"{name} {count}" for name, count in lengths.items() if count != usual)
        raise ValueError(f"{where}: the columns have different lengths: {other} where others have {usual}")
    return out


def write_table(path: str | Path, table: Mapping[str, Any]) -> None:
    """Writes columns of equal lengths as CSV; stamps may be datetime64 of any unit. ValueError names the column that can't be written."""
    columns = as_table(table, str(path))
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        file.write(",".join(columns) + "\n")
        rows = max(map(len, columns.values()), default=0)
        for begin in range(0, rows, _BLOCK_ROWS):  # as objects of Python a row is ten times as large
            for row in zip(*(column[begin : begin + _BLOCK_ROWS].tolist() for column in columns.values())):
                file.write(",".join(map(field_text, row)) + "\n")
