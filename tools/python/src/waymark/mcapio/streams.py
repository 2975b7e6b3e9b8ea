# SPDX-License-Identifier: Apache-2.0
"""Tables of a recording's sensors as messages, a row a message: each table has a type of its columns.

The type's name follows from the file's ("sightings.csv" is waymark_msgs/msg/Sightings), the channel's metadata has the file's
name and its columns. Numbers go through without a loss, so that the table can be made again.
"""

from typing import Any

import numpy as np
from rosbags.typesys import get_types_from_msg

from ..ros import Messages
from ..tables import ABSENT, Table, is_integer, is_text

FILE_KEY, COLUMNS_KEY = "waymark.file", "waymark.columns"


def stream_type(file: str) -> str:
    """The type of a table's rows."""
    return "waymark_msgs/msg/" + "".join(part.capitalize() for part in file.removesuffix(".csv").split("-"))


def _field(column: str) -> str:
    kind = "string" if is_text(column) else "int64" if is_integer(column) else "float64"
    return f"{kind} {column.lower()}"


def register(messages: Messages, file: str, columns: list[str]) -> str:
    """Makes the type of a table's rows known; its name."""
    name = stream_type(file)
    definition = "std_msgs/Header header\n" + "\n".join(map(_field, columns)) + "\n"
    messages.store.register(get_types_from_msg(definition, name))
    return name


def row(messages: Messages, kind: str, table: Table, i: int, frame: str) -> Any:
    """A row as a message."""
    values = {name.lower(): column[i].item() for name, column in table.items()}
    return messages.make(kind, header=messages.header(table["t_ns"][i], frame), **values)


def rows_to_table(rows: list[Any], columns: list[str]) -> Table:
    """Messages of one channel as the table that they were made of."""
    out: Table = {}
    for name in columns:
        values = [getattr(message, name.lower()) for message in rows]
        out[name] = np.array(values, dtype=str if is_text(name) else np.int64 if is_integer(name) else np.float64)
    return {name: column for name, column in out.items() if name != "arrival_ns" or (column != ABSENT).any()}
