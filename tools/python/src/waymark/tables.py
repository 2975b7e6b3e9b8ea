# SPDX-License-Identifier: Apache-2.0
"""CSV files of recordings and runs as columns: read and written without a loss."""

import csv
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[Any]
"""An array of numpy; docstrings name shape and unit."""
Table: TypeAlias = dict[str, Array]
"""Columns by name, all of one length: int64 (stamps, identities), float64 (NaN: empty) or str."""

_WORDS = {"sensor", "source", "state", "verdict", "residual", "picture", "cause"}
_COUNTS = {"id", "landmark", "frame", "polyline", "resets"}
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
    try:
        if is_integer(name):
            return np.array([int(field) if field else ABSENT for field in fields], dtype=np.int64)
        return np.array([float(field) if field else np.nan for field in fields], dtype=np.float64)
    except ValueError:
        for row, field in enumerate(fields):
            try:
                float(field or "nan") if not is_integer(name) else int(field or "0")
            except ValueError:
                raise ValueError(f"{path}:{row + 2}: '{field}' is not a number (column {name})") from None
        raise


def read_table(path: str | Path) -> Table:
    """The columns of a CSV file. ValueError names file and line of what can't be read."""
    path = Path(path)
    with path.open(newline="", encoding="utf-8") as file:
        rows = csv.reader(file)
        names = next(rows, None)
        if not names:
            raise ValueError(f"{path}:1: there is no header line")
        fields: list[list[str]] = [[] for _ in names]
        for number, row in enumerate(rows, start=2):
            if not row:
                continue
            if len(row) > len(names):
                raise ValueError(f"{path}:{number}: {len(row)} fields, but {len(names)} columns")
            for i, column in enumerate(fields):
                column.append(row[i] if i < len(row) else "")
    return {name: _column(name, column, path) for name, column in zip(names, fields)}


def field_text(value: Any) -> str:
    """A value as CSV has it: the shortest text that reads back as the same number; empty for an absent one."""
    if isinstance(value, (str, np.str_)):
        return str(value)
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    return "" if np.isnan(value) else repr(float(value))


def _to_write(path: str | Path, name: str, column: Array) -> Array:
    if is_text(name) or not is_integer(name) or column.dtype.kind != "f":
        return column
    whole = np.isfinite(column) & (column == np.round(column))
    if not whole.all():
        row = int(np.argmin(whole))
        raise ValueError(f"{path}: column {name} holds whole numbers, but row {row} has {column[row]}")
    return column.astype(np.int64)


def write_table(path: str | Path, table: Table) -> None:
    """Writes columns of equal lengths as CSV. ValueError: their lengths differ, or a column of integers has something else, as NaN."""
    columns = [_to_write(path, name, np.asarray(column)) for name, column in table.items()]
    if len({len(column) for column in columns}) > 1:
        raise ValueError(f"{path}: the columns have different lengths")
    with Path(path).open("w", newline="", encoding="utf-8") as file:
        file.write(",".join(table) + "\n")
        for row in zip(*(column.tolist() for column in columns)):
            file.write(",".join(map(field_text, row)) + "\n")
