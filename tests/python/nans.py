# SPDX-License-Identifier: Apache-2.0
"""A NaN in each number of some arguments, and whether one came out; the functions of a package, from its source."""

import ast
import dataclasses
import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

NUMBERS = re.compile(r"\b(float|Array|ArrayLike|Table)\b")


def with_nan(value):
    """Copies of a value, each with a NaN in the place of one number."""
    if isinstance(value, dict):
        for key in value:
            for changed in with_nan(value[key]):
                yield {**value, key: changed}
    elif isinstance(value, (list, tuple)):
        for i, part in enumerate(value):
            for changed in with_nan(part):
                yield type(value)([*value[:i], changed, *value[i + 1:]])
    elif isinstance(value, np.ndarray) and value.dtype.kind == "f":
        for i in range(value.size):
            changed = value.copy()
            changed.flat[i] = np.nan
            yield changed
    elif isinstance(value, float):
        yield math.nan


def has_nan(value):
    """Whether a number in it is NaN: of containers, arrays, messages, generators and text."""
    if isinstance(value, dict):
        return any(map(has_nan, value.values()))
    if isinstance(value, (list, tuple, Iterator)):
        return any([has_nan(part) for part in value])
    if isinstance(value, (str, bytes)):
        return "nan" in (value.decode(errors="replace") if isinstance(value, bytes) else value)
    if dataclasses.is_dataclass(value):
        return any(has_nan(getattr(value, field.name)) for field in dataclasses.fields(value))
    array = np.asarray(value)
    return array.dtype.kind == "f" and bool(np.isnan(array).any())


def check(case, cases, least):
    """Of a test case: `cases` (function, arguments) work without a NaN; each NaN comes out or is refused. `least`: NaNs that are tried."""
    count = 0
    for name, (function, arguments) in cases.items():
        with case.subTest(name):
            case.assertFalse(has_nan(function(*arguments)))
        for changed in with_nan(arguments):
            count += 1
            with case.subTest(name, arguments=changed):
                try:
                    out = function(*changed)
                except Exception as error:  # noqa: BLE001 (judged below)
                    case.assertIsInstance(error, (ValueError, SystemExit) + REFUSALS)
                    case.assertGreater(len(str(error)), 10)
                    continue
                case.assertTrue(has_nan(out), f"{name} makes {str(out)[:300]} of it")
    case.assertGreater(count, least)


REFUSALS = ()
"""Further exceptions by which the packages refuse."""


def functions(folder):
    """(name, whether it takes numbers) of each public function and method of a package's sources: `bag.clocks.once`, `maps.FloorPlan.cell_of`.
    By the types of its arguments; without types it may take them where it has any."""
    for path in sorted(Path(folder).rglob("*.py")):
        module = ".".join(path.relative_to(folder).with_suffix("").parts)
        yield from _of_body(ast.parse(path.read_text()).body, "" if module == "__init__" else f"{module.removesuffix('.__init__')}.")


def _of_body(body, prefix):
    for node in body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from _of_body(node.body, f"{prefix}{node.name}.")
        elif isinstance(node, ast.FunctionDef) and (not node.name.startswith("_") or node.name == "__init__"):
            given = [a for a in node.args.args + node.args.kwonlyargs if a.arg not in ("self", "cls")]
            yield prefix + node.name, any(a.annotation is None or NUMBERS.search(ast.unparse(a.annotation)) for a in given)
