# SPDX-License-Identifier: Apache-2.0
"""The C interface of libwaymark.so as declarations for cffi, from its own headers."""

import re
from pathlib import Path

FILE = Path(__file__).with_name("native") / "waymark.cdef"
"""In a wheel; made when it is built."""


def _repository() -> list[Path]:
    root = Path(__file__).resolve().parents[4]
    return [root / "firmware/library/include/waymark", root / "msgs/include/waymark"]


def _read(name: str, folders: list[Path], seen: set[str]) -> str:
    """A header with those that it includes before it; comments are gone."""
    seen.add(name)
    path = next((folder / name for folder in folders if (folder / name).is_file()), None)
    if path is None:
        raise FileNotFoundError(f"waymark/{name} is in none of {', '.join(map(str, folders))}")
    text = re.sub(r"//[^\n]*", "", path.read_text(encoding="utf-8"))
    before = [_read(other, folders, seen) for other in re.findall(r'#include [<"]waymark/(\S+)[>"]', text) if other not in seen]
    return "".join(before) + text


def of_headers(folders: list[Path]) -> str:
    """Declarations of waymark/waymark.h and what it includes: without the preprocessor's lines, with its constants in place."""
    text = _read("waymark.h", folders, set())
    constants = dict(re.findall(r"^#define (WM_\w+) (\(?[\w +]+\)?)\s*$", text, re.M))
    text = re.sub(r"^#(?:[^\n]*\\\n)*[^\n]*\n", "", text, flags=re.M)
    text = re.sub(r"\bstatic inline [^;{]*\{(?:[^{}]|\{[^{}]*\})*\}", "", text)
    text = re.sub(r'extern "C" \{|^\}\s*$|__attribute__\(\((?:[^()]|\([^()]*\))*\)\)', "", text, flags=re.M)
    text = re.sub(r"\bWM_NODISCARD\b", "", text)
    for _ in range(3):  # a constant may name another one
        text = re.sub(r"\bWM_\w+\b", lambda match: constants.get(match[0], match[0]), text)
    # Functions of other libraries than this one stay undeclared.
    text = re.sub(r"^[a-z][^;{}()]*\b(?!waymark_)\w+\([^;{}]*\);", "", text, flags=re.M)
    return re.sub(r"\n\s*\n+", "\n", text).strip() + "\n"


def text() -> str:
    """The declarations: those of the wheel, else of the repository that this file is in."""
    return FILE.read_text(encoding="utf-8") if FILE.is_file() else of_headers(_repository())
