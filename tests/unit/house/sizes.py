#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Sizes of the code: what a newcomer has to read, as numbers that can be compared from commit to commit.

    sizes.py [CHECKOUT]                      prints them
    sizes.py CHECKOUT CEILINGS               exit code 1 where one is more than 2 % above the one in the file CEILINGS, or below it
    sizes.py CHECKOUT CEILINGS --lower       writes those that are smaller now into CEILINGS

CEILINGS is such a print; behind a number that was raised stands why, after a #. A function or method is found by its form (formatted by
clang-format) or by Python's parser, a class's methods between its braces."""
import ast
import pathlib
import re
import sys

ROOMS = ("msgs", "estimator", "drivers", "firmware", "tools", "sim", "tests")
CODE = {".c", ".h", ".cpp", ".hpp", ".py", ".sh"}
SOURCE = {".c", ".h", ".cpp", ".hpp"}
CLASSES = ("slam", "stereo_ekf", "motion_front_end", "joint_state", "landmark_ekf", "planar_filter", "planar_motion", "space_filter")
METHODS_MANY = 60  # of a class; more are hard to know
LINES_LONG = (40, 60)  # of a function of the estimator
FILE_LONG, FUNCTION_LONG = 600, 70  # lines, in any room
TOLERANCE = 0.02  # of a ceiling: small changes to and fro need no new one
# Recordings and worlds that code was tuned on, by their names.
DATA_SETS = re.compile(r"\b(mrclam|dlr-[a-z]|hall-\w+|office-\w+|crossing-\w+|corridor-\w+|seabed-\w+|loops-\w+|smartloc|plaza|canedge|starry-night|"
                       r"victoria|euroc|kitti|tum-)", re.IGNORECASE)
CONSTANT = re.compile(r"\bk[A-Z]\w* = [-+]?[0-9.]")
METHOD = re.compile(r"^  (?!return\b|static_assert|using\b|friend\b|typedef\b|if\b|for\b|while\b|switch\b|else\b|case\b)"
                    r"[\w\[\]:<>,&* ]*?~?\b\w+\([^=]*$|^  [\w\[\]:<>,&* ]*\boperator\S+\(")


def files(root, folder, endings):
    return sorted(path for path in (root / folder).rglob("*")
                  if path.suffix in endings and path.is_file() and not any(part.startswith(".") for part in path.parts[len(root.parts):]))


def lines(paths):
    return sum(path.read_text(encoding="utf-8", errors="replace").count("\n") for path in paths)


def functions(text):
    """Lengths of functions and of methods: from the line with the name to the brace below its first letter."""
    head = re.compile(r"^(  )?(?!namespace|class|struct|enum|union|static_assert|typedef|using|return|if|for|while|switch|else)[A-Za-z_~][^;]*\(")
    begin = indent = None
    for number, line in enumerate(text.splitlines()):
        match = head.match(line)
        if match and (begin is None or not is_open):
            begin, indent, is_open = number, match[1] or "", False
        if begin is None:
            continue
        is_open = is_open or line.endswith("{")
        if not is_open and line.endswith((";", "}")):
            begin = None
        elif is_open and line == f"{indent}}}":
            yield number - begin + 1
            begin = None


def functions_of_python(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node.end_lineno - node.lineno + 1


def of_room(root, room):
    texts = {path: path.read_text(encoding="utf-8", errors="replace") for path in files(root, room, CODE)}
    lengths = [length for path, text in texts.items() if path.suffix != ".sh"
               for length in (functions_of_python if path.suffix == ".py" else functions)(text)]
    return {
        "lines": sum(text.count("\n") for text in texts.values()),
        "files": len(texts),
        f"files above {FILE_LONG} lines": sum(text.count("\n") > FILE_LONG for text in texts.values()),
        f"functions above {FUNCTION_LONG} lines": sum(length > FUNCTION_LONG for length in lengths),
        "constants (kName = number)": sum(len(CONSTANT.findall(text)) for path, text in texts.items() if path.suffix in SOURCE),
    }


def methods(root):
    """Declared methods of each class of CLASSES."""
    found = {}
    for path in files(root, "estimator", {".hpp"}):
        inside = None
        for line in path.read_text(encoding="utf-8").splitlines():
            begin = re.match(r"class (\w+)\b[^;]*\{$", line)
            if begin:
                inside = begin[1]
                found.setdefault(inside, 0)
            elif line.startswith("};"):
                inside = None
            elif inside and METHOD.match(line):
                found[inside] += 1
    return found


def sizes(root):
    out = {f"{name} of {room}/": count for room in ROOMS for name, count in of_room(root, room).items()}
    out["lines of docs/"] = lines(files(root, "docs", {".md"}))
    estimator = files(root, "estimator", SOURCE)
    texts = {path: path.read_text(encoding="utf-8") for path in estimator}
    out["lines of estimator/filters/"] = lines(files(root, "estimator/filters", SOURCE))
    for folder in ("core", "planar", "landmark_ekf", "slam", "stereo_ekf", "edge_mcl", "relocalize"):
        out[f"lines of estimator/filters/{folder}/"] = lines(files(root, f"estimator/filters/{folder}", SOURCE))
    out["lines of estimator/motion/"] = lines(files(root, "estimator/motion", SOURCE))
    lengths = [length for text in texts.values() for length in functions(text)]
    for most in LINES_LONG:
        out[f"functions of estimator/ above {most} lines"] = sum(length > most for length in lengths)
    counts = methods(root)
    out[f"classes of estimator/ above {METHODS_MANY} methods"] = sum(count > METHODS_MANY for count in counts.values())
    for name in CLASSES:
        if name in counts:
            out[f"methods of {name}"] = counts[name]
    out['comments of estimator/ with "not swept"'] = sum(len(re.findall(r"not swept", text, re.IGNORECASE)) for text in texts.values())
    out["files of estimator/ that name a data set"] = sum(bool(DATA_SETS.search(text)) for text in texts.values())
    for word in (r"reinterpret_cast", r"const_cast", r"memset\((?:static_cast<void \*>\()?this"):
        out[f"{word.split('(')[0].replace(chr(92), '')}{' of this' if 'this' in word else ''} in estimator/"] = sum(len(re.findall(word, text)) for text in texts.values())
    config = (root / "docs/config.md").read_text(encoding="utf-8")
    out["keys of the configuration with a default (docs/config.md)"] = len([row for row in config.splitlines() if row.startswith("| `") and row.count(" | ") >= 3])
    return out


def read_ceilings(file):
    """Name -> the line's number and count."""
    out = {}
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines()):
        count, name = line.split("#")[0].strip().split(" ", 1)
        out[name.strip()] = number, int(count)
    return out


def compared(now, ceilings, file):
    """What is to be said, and whether it is wrong."""
    for name in sorted(now.keys() ^ ceilings.keys()):
        yield f"{name}: {'has no line in' if name in now else 'is counted no more, and has a line in'} {file}", True
    for name in now.keys() & ceilings.keys():
        count, ceiling = now[name], ceilings[name][1]
        is_far = abs(count - ceiling) > TOLERANCE * ceiling
        if count > ceiling:
            much = f"{name}: {count}, the ceiling is {ceiling}. Take out as much as came in"
            yield (f"{much}, or write {count} into {file} with the reason behind it, after a #" if is_far else
                   f"{much}: from {TOLERANCE:.0%} above the ceiling on this test fails", is_far)
        elif is_far:
            yield f"{name}: {count}, the ceiling is {ceiling}. Lower it: sizes.py . {file} --lower", True


def lower(now, ceilings, file):
    """The smaller of both, without what is no longer counted and with what is new."""
    rows = file.read_text(encoding="utf-8").splitlines()
    kept = {name: rows[number] if count <= now[name] else f"{now[name]:7} {name}" for name, (number, count) in ceilings.items() if name in now}
    file.write_text("\n".join(kept.get(name, f"{count:7} {name}") for name, count in now.items()) + "\n", encoding="utf-8")


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    now = sizes(root)
    if len(sys.argv) < 3:
        for name, count in now.items():
            print(f"{count:7} {name}")
        return 0
    file = pathlib.Path(sys.argv[2])
    ceilings = read_ceilings(file)
    if sys.argv[3:] == ["--lower"]:
        lower(now, ceilings, file)
        return 0
    said = list(compared(now, ceilings, file))
    print("\n".join(sorted(text for text, _ in said)))
    return 1 if any(wrong for _, wrong in said) else 0


if __name__ == "__main__":
    sys.exit(main())
