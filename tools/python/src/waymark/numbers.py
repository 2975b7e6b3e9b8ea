# SPDX-License-Identifier: Apache-2.0
"""Numbers of command lines."""

import argparse
import math
from collections.abc import Callable
from typing import Any


def finite(text: str) -> float:
    """A number; the type of an option. NaN and infinity are refused."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"'{text}' is not a finite number")
    return value


def between(low: float, high: float, number: Callable[[float], Any]) -> Callable[[str], Any]:
    """The type of an option whose number (`int` or `float`) lies there."""
    def read(text: str) -> Any:
        value = finite(text)
        if not low <= value <= high or number(value) != value:
            raise argparse.ArgumentTypeError(f"{text} is not in range [{low:g} - {high:g}]")
        return number(value)
    return read
