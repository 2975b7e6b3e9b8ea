# SPDX-License-Identifier: Apache-2.0
"""Numbers of command lines."""

import argparse
import math


def finite(text: str) -> float:
    """A number; the type of an option. NaN and infinity are refused."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"'{text}' is not a finite number")
    return value
