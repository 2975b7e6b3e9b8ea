# SPDX-License-Identifier: Apache-2.0
"""rosbag2's SQLite files (.db3), with what a recorder that was killed left in the write-ahead file beside them."""

import os
import shutil
import sqlite3
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from . import decoding
from .decoding import Topic
from .order import BagFile, Batch

MAGIC = b"SQLite format 3\0"
_STYLES = {"ros2msg": "msg", "ros2idl": "idl"}


class SqliteFile(BagFile):
    """A database of rosbag2."""

    def __init__(self, path: Path):
        super().__init__(path)
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._database = sqlite3.connect(self._address(), uri=True)
        try:
            self._read_topics()
        except sqlite3.Error:
            self.notes.append("its tables are not those of rosbag2, or they are damaged: nothing of it is read")

    def _address(self) -> str:
        """Where the database is opened: it itself, never changed; with a write-ahead file a copy, into which SQLite merges that."""
        path, ahead = self.path, self.path.with_name(self.path.name + "-wal")
        with path.open("rb") as file:
            head = file.read(32)
        page = int.from_bytes(head[16:18], "big")
        whole = int.from_bytes(head[28:32], "big") * (65536 if page == 1 else page)  # sqlite.org/fileformat.html
        if path.stat().st_size < whole and not ahead.is_file():  # SQLite refuses a file that is cut; one with empty pages it reads up to them
            self._folder = tempfile.TemporaryDirectory(prefix="waymark-bag-")
            out = Path(self._folder.name) / "bag.db3"
            shutil.copyfile(path, out)
            os.truncate(out, whole)
            return out.as_uri() + "?mode=ro&immutable=1"
        if ahead.is_file() and ahead.stat().st_size:
            self._folder = tempfile.TemporaryDirectory(prefix="waymark-bag-")
            path = Path(self._folder.name) / "bag.db3"
            shutil.copyfile(self.path, path)
            shutil.copyfile(ahead, f"{path}-wal")
            return path.as_uri()
        return path.resolve().as_uri() + "?mode=ro&immutable=1"

    def _read_topics(self) -> None:
        cursor = self._database.cursor()
        definitions: dict[str, tuple[str, str]] = {}
        try:
            for kind, encoding, text in cursor.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"):
                definitions[str(kind)] = (_text(text), _STYLES.get(_text(encoding), ""))
        except sqlite3.Error:
            pass  # bags before ROS 2 Iron have no definitions
        rows = cursor.execute("SELECT id, name, type, serialization_format FROM topics").fetchall()
        for key, name, kind, wire in rows:
            text, style = definitions.get(_text(kind), ("", ""))
            self._topics[key] = decoding.topic(_text(name), _text(kind), text, style, _text(wire) or "cdr")
        try:
            counts = dict(cursor.execute("SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id"))
        except sqlite3.Error:
            return  # damaged pages: the counts are not known
        for key, topic in self._topics.items():
            topic.count = counts.get(key, 0)

    def _batches(self, wanted: Callable[[Topic], bool]) -> Iterator[Batch]:
        chosen = {key: topic for key, topic in self._topics.items() if wanted(topic)}
        total = sum(topic.count or 0 for topic in chosen.values())
        query = f"SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({','.join('?' * len(chosen))}) ORDER BY id"
        count = 0
        try:
            for key, log_ns, data in self._database.execute(query, list(chosen)):
                count += 1
                self.done = count / max(total, 1)
                if isinstance(log_ns, int) and isinstance(data, bytes):
                    yield Batch(log_ns, [(log_ns, chosen[key], data)])
        except sqlite3.Error:
            self.notes.append(f"its database is damaged or cut: {count} of its messages are read; `sqlite3 {self.path.name} .recover` may give more")

    def close(self) -> None:
        """Closes the database."""
        self._database.close()
        if self._folder:
            self._folder.cleanup()


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else "" if value is None else str(value)
