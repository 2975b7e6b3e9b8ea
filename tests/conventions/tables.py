#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/conventions.md, measured: each ground is a module of this folder, whose rows() run what they state.

    tables.py [--write] [GROUND ...]

Without --write the rows are compared with the page: exit status 1 and the differences where a library does something else now, or
the page states what nobody measured."""

import difflib
import importlib
import re
import sys
import warnings
from pathlib import Path

from expected import marked

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/conventions.md"
GROUNDS = ("tags", "lenses", "pictures", "rotations", "graphs", "geodesy", "receivers", "buses", "drives", "links", "imus", "filters", "tables_of_data", "files", "robots")
HEAD = ["| what is asked | what it does | version | what Waymark does |", "| --- | --- | --- | --- |"]


def measured(ground):
    """The lines of a ground's table."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rows = importlib.import_module(ground).rows()
    return HEAD + ["| " + " | ".join((marked(row[0]), *row[1:])) + " |" for row in rows]


def main():
    names = [name for name in sys.argv[1:] if name != "--write"] or GROUNDS
    page, count, wrong = PAGE.read_text(encoding="utf-8"), 0, 0
    for name in names:
        lines = measured(name)
        count += len(lines) - len(HEAD)
        found = re.search(rf"(<!-- measured by tests/conventions/{name}.py -->\n\n)(.*?)(\n\n|\Z)", page, re.DOTALL)
        if not found:
            raise SystemExit(f"{PAGE}: there is no place for the ground {name}")
        if "--write" in sys.argv:
            page = page[:found.start(2)] + "\n".join(lines) + page[found.end(2):]
        else:
            differences = list(difflib.unified_diff(found[2].splitlines(), lines, "docs/conventions.md", f"{name}.py", lineterm="", n=0))
            wrong += bool(differences)
            print(*differences, sep="\n", end="\n" if differences else "")
    if "--write" in sys.argv:
        PAGE.write_text(page, encoding="utf-8")
    print(f"{count} rows of {len(names)} grounds, {wrong} grounds differ")
    return wrong > 0


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))
    sys.exit(main())
