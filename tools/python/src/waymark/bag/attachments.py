# SPDX-License-Identifier: Apache-2.0
"""Files that `waymark export` attached: calibration, DBC, map, truth."""

from pathlib import Path

import yaml
from mcap.reader import make_reader

from ..mcapio.writer import is_attachment
from ..recording import FORMAT, RecordingWriter


def write_attachments(path: Path, writer: RecordingWriter) -> bool:
    """Writes the attached files of a recording into a new one; whether there were any."""
    with path.open("rb") as file:
        found = {item.name: bytes(item.data) for item in make_reader(file).iter_attachments() if is_attachment(item.name)}
    meta = yaml.safe_load(found.pop("recording.yaml", b"{}"))
    if not isinstance(meta, dict) or meta.get("format") != FORMAT:
        return False
    cameras = set(writer.cameras())
    for name, data in sorted(found.items()):
        folder, _, camera = name.removesuffix(".csv").rpartition("/")
        if folder != "video" or camera in cameras:  # stamps without their pictures are no stream
            writer.file(name, data)
    writer.meta = meta
    return True
