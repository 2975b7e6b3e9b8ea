# SPDX-License-Identifier: Apache-2.0
"""Files that `waymark export` attached: calibration, DBC, map, truth."""

from typing import Any

import yaml

from ..mcapio.writer import is_attachment
from ..recording import FORMAT, RecordingWriter
from .containers import Bag


def write_attachments(bag: Bag, writer: RecordingWriter) -> bool:
    """Writes the attached files of a recording into a new one; whether there were any."""
    found: dict[str, bytes] = {}
    for file in bag.files:
        found |= file.attachments(is_attachment)
    try:
        meta: Any = yaml.safe_load(found.pop("recording.yaml", b"{}"))
    except yaml.YAMLError:
        return False
    if not isinstance(meta, dict) or meta.get("format") != FORMAT:
        return False
    cameras = set(writer.cameras())
    for name, data in sorted(found.items()):
        folder, _, camera = name.removesuffix(".csv").rpartition("/")
        if folder != "video" or camera in cameras:  # stamps without their pictures are no stream
            writer.file(name, data)
    writer.meta = meta
    return True
