# SPDX-License-Identifier: Apache-2.0
"""libwaymark.so in this process: the library, its errors, and its structs as arrays."""

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import cffi
import numpy as np

from . import declarations
from .tables import Array

ffi: Any = cffi.FFI()
ffi.cdef(declarations.text())

_INSIDE = Path(__file__).with_name("native")
_kept: list[Any] = []


class WaymarkError(Exception):
    """An error of the library; `status` is its name ("bad configuration" ...)."""

    def __init__(self, status: str, text: str):
        super().__init__(text)
        self.status = status


@cache
def library() -> Any:
    """The library: the one that WAYMARK_LIBRARY names, else the wheel's, else the installed one (package libwaymark0)."""
    named = os.environ.get("WAYMARK_LIBRARY")
    bundled = _INSIDE / "libwaymark.so.0"
    for name in sorted(_INSIDE.glob("lib*.so.*")):
        if not named and name != bundled:
            _kept.append(ffi.dlopen(str(name), ffi.RTLD_GLOBAL))  # what the wheel's library needs
    path = named or (str(bundled) if bundled.is_file() else "libwaymark.so.0")
    try:
        return ffi.dlopen(path)
    except OSError as error:
        raise ImportError(f"{path}: {error}. Install libwaymark0, or name a library by WAYMARK_LIBRARY") from None


def check(call: Callable[..., Any], *arguments: Any, also: tuple[int, ...] = ()) -> int:
    """Calls a function whose last argument is the error; WaymarkError unless its status is WM_OK or one of `also`."""
    error = ffi.new("wm_error *")
    status = int(call(*arguments, error))
    if status not in (0, *also):
        raise WaymarkError(text(library().waymark_name(library().WAYMARK_NAMES_STATUS, status)), text(error.text))
    return status


def text(characters: Any) -> str:
    """A C string."""
    words: str = ffi.string(characters).decode("utf-8", "replace")
    return words


def names(kind: str) -> Array:
    """Words of the numbers of an enum: "STATE", "CAUSE", "RESIDUAL", "VERDICT", "UNUSABLE" or "EVENT"."""
    count = getattr(library(), f"WM_{kind}_KIND_COUNT" if kind == "EVENT" else f"WM_{kind}_COUNT")
    which = getattr(library(), f"WAYMARK_NAMES_{kind}")
    return np.array([text(library().waymark_name(which, number)) for number in range(count)])


@cache
def dtype(name: str) -> np.dtype[Any]:
    """A struct of the library as numpy's type."""
    return _dtype(ffi.typeof(name))


_BASIC = {"int64_t": "i8", "uint64_t": "u8", "int32_t": "i4", "uint32_t": "u4", "int": "i4", "uint16_t": "u2", "uint8_t": "u1",
          "int8_t": "i1", "double": "f8", "float": "f4", "char": "S1"}


def _dtype(kind: Any) -> np.dtype[Any]:
    if kind.kind == "array":
        item = _dtype(kind.item)
        return np.dtype(f"S{kind.length}") if item == np.dtype("S1") else np.dtype((item, (kind.length,)))
    if kind.kind in ("struct", "union"):
        fields = kind.fields
        return np.dtype({"names": [name for name, _ in fields], "formats": [_dtype(field.type) for _, field in fields],
                         "offsets": [field.offset for _, field in fields], "itemsize": ffi.sizeof(kind)})
    return np.dtype(_BASIC.get(kind.cname, "i4"))  # an enum is an int
