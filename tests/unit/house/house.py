#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the house rules of docs/design.md that a compiler does not: who may include whom, what the estimator may not
touch, and what every source file carries. Reads the working tree only; prints each offence with file and line."""
import pathlib
import re
import sys

ROOT = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()

# Room -> rooms whose public headers it may include (its own always).
MAY_USE = {
    "msgs": [],
    "estimator": ["msgs"],
    "drivers": ["msgs"],
    "firmware": ["msgs", "estimator", "drivers"],
    "tools": ["msgs", "estimator", "drivers", "firmware"],
    "sim": ["msgs", "estimator", "drivers", "firmware", "tools"],
}

# Inside firmware/, bottom up: a folder includes its own headers and those of the folders before it, as "folder/header.h".
FIRMWARE_FOLDERS = ["rt", "findings", "config", "sources", "fusion", "output", "replay", "library", "live", "cli"]

# Headers that would give the estimator a clock, a file, a thread, a heap or a terminal.
ESTIMATOR_NEVER = re.compile(
    r"<(time\.h|stdio\.h|stdlib\.h|pthread\.h|unistd\.h|errno\.h|sys/.*|linux/.*|chrono|thread|mutex|atomic|iostream|fstream"
    r"|cstdio|cstdlib|string|vector|map|unordered_map|memory|functional|random|sstream|lcm/.*|opencv2/.*)>")

# Inside estimator/: folder -> folders whose headers it may include (its own always). A detector includes no other detector
# and no filter, a filter no other filter.
SENSING = ["", "math", "memory", "sensors", "image", "vision"]
FILTER = ["", "aid", "math", "memory", "state", "belief", "motion", "maps", "sensors", "filters", "filters/core", "filters/planar", "filters/relocalize"]
FOLDER_MAY_USE = {
    "": [],
    "math": [],
    "memory": [],
    "state": ["math", "memory"],
    "belief": ["math", "memory", "state"],
    "motion": ["", "math", "memory"],
    "maps": ["math", "memory"],
    "sensors": ["", "math", "memory"],
    "image": ["math", "memory", "sensors"],
    "vision": [],
    "vision/cascade": SENSING,
    "vision/edges": [*SENSING, "vision/edges_hough"],
    "vision/edges_hough": SENSING,
    "vision/landmarks": SENSING,
    "vision/lines": SENSING,
    "vision/markers": SENSING,
    "vision/stereo": SENSING,
    "filters": [],
    "filters/core": ["", "math", "memory", "motion", "sensors"],
    "filters/planar": ["math", "memory", "state", "belief", "motion", "sensors", "filters/core"],
    "filters/relocalize": ["math", "memory", "maps", "sensors", "filters/core"],
    "aid": ["", "math", "memory", "state", "motion", "maps", "sensors", "filters/core", "filters/planar", "filters/relocalize"],
    "filters/edge_mcl": FILTER,
    "filters/floors": FILTER,
    "filters/landmark_ekf": FILTER,
    "filters/odometry": FILTER,
    "filters/pf_edges": FILTER,
    "filters/slam": FILTER,
    "filters/stereo_ekf": FILTER,
}
# (file, header): arrows that still point the wrong way. Only ever shorter.
FOLDER_EXCEPTIONS = set()

INCLUDE = re.compile(r'^\s*#\s*include\s+([<"])([^>"]+)[>"]')


# Headers of the estimator for the other rooms that are not installed. A folder in it is one of the estimator's.
INTERNAL = "waymark/internal/"


def public_headers(room):
    if room in ("firmware", "tools", "sim"):  # headers stand beside their sources; none is installed
        return {str(p.relative_to(ROOT / room)) for p in (ROOT / room).rglob("*.h")}
    base = ROOT / room / "include"
    return {str(p.relative_to(base)) for p in base.rglob("*.h")} | {str(p.relative_to(base)) for p in base.rglob("*.hpp")}


def check_includes():
    owner = {header: room for room in MAY_USE for header in public_headers(room)}
    for room, uses in MAY_USE.items():
        for path in sources(room):
            # Detectors that lean on a library stand behind the estimator's contract for detectors.
            detector = ["estimator"] if "detectors" in path.relative_to(ROOT).with_suffix("").parts and room == "drivers" else []
            for number, line in enumerate(path.read_text().splitlines(), 1):
                match = INCLUDE.match(line)
                if not match:
                    continue
                where, header = f"{path.relative_to(ROOT)}:{number}", match.group(2)
                if header in owner and owner[header] != room and owner[header] not in uses + detector:
                    yield f"{where}: {room}/ may not include {header}, which is {owner[header]}/'s"
                elif room != "estimator" and (ROOT / "estimator" / header).is_file() and not (ROOT / room / header).is_file():
                    yield f"{where}: {header} is private to the estimator: other rooms include its include/ folder alone"
                elif match.group(1) == '"' and header.startswith("waymark/") and header not in owner \
                        and not header.startswith("waymark/lcm/"):
                    yield f"{where}: {header} is in no room's include folder"
                if room == "estimator" and ESTIMATOR_NEVER.search(line):
                    yield f"{where}: the estimator is pure: {header} is not for it"


def check_folders():
    room = ROOT / "estimator"
    seen = set()
    for path in sources("estimator"):
        inside = path.relative_to(room)
        folder = str(inside.parent) if str(inside.parent) != "." else ""
        if inside.parts[0] == "include":
            # The public headers include msgs and each other. What only the project's rooms may include keeps its folder's rules.
            shared = str(inside.parent).partition(INTERNAL)
            folder = shared[2] if shared[1] else None
        elif folder not in FOLDER_MAY_USE:
            yield f"estimator/{inside}:1: {folder}/ is not in house.py's table of folders: add what it may include"
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            match = INCLUDE.match(line)
            if not match or match.group(1) != '"':
                continue
            header = match.group(2).removeprefix(INTERNAL)
            if header.startswith("waymark/"):
                continue
            target = header.rpartition("/")[0]
            if folder is not None and (target == folder or target in FOLDER_MAY_USE[folder]):
                continue
            if (str(inside), header) in FOLDER_EXCEPTIONS:
                seen.add((str(inside), header))
                continue
            yield f"estimator/{inside}:{number}: {folder or inside.parts[0]}/ may not include {header}"
    for file, header in sorted(FOLDER_EXCEPTIONS - seen):
        yield f"estimator/{file} does not include {header} any more: take it off FOLDER_EXCEPTIONS"


def check_firmware_folders():
    room = ROOT / "firmware"
    for path in sources("firmware"):
        inside = path.relative_to(room)
        if inside.parts[0] not in FIRMWARE_FOLDERS:
            yield f"firmware/{inside}:1: {inside.parts[0]}/ is not in house.py's list of folders: add it where it belongs"
            continue
        below = FIRMWARE_FOLDERS[:FIRMWARE_FOLDERS.index(inside.parts[0]) + 1]
        for number, line in enumerate(path.read_text().splitlines(), 1):
            match = INCLUDE.match(line)
            if not match or match.group(1) != '"' or match.group(2).startswith("waymark/"):
                continue
            if match.group(2).split("/")[0] not in below or not (room / match.group(2)).exists():
                yield f"firmware/{inside}:{number}: {inside.parts[0]}/ may not include {match.group(2)}"


def check_names():
    """Names in wm:: stand in one header each: the linker silently merges two inline variables of one name, whatever their types."""
    defined = re.compile(r"^(?:inline constexpr [\w:<>, ]*?(\w+)(?:\[\w*\])* = |(?:struct|class|union|enum|enum class) (\w+)\b[^;]*$)")
    first = {}
    for path in sources("estimator"):
        if path.suffix != ".hpp":
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            match = defined.match(line)
            name = match and (match[1] or match[2])
            where = f"{path.relative_to(ROOT)}:{number}"
            if name and first.setdefault(name, where) != where:
                yield f"{where}: {name} is defined in {first[name]}, too"


def check_sources():
    for room in [*MAY_USE, "tests"]:
        for path in sources(room):
            text = path.read_text()
            if not text.startswith("// SPDX-License-Identifier: Apache-2.0"):
                yield f"{path.relative_to(ROOT)}:1: the first line is not the SPDX line"
            lines = text.count("\n")
            if lines > 600:
                yield f"{path.relative_to(ROOT)}: {lines} lines: more than one thing? (600 at most)"


def sources(room):
    return sorted(p for ext in ("*.c", "*.h", "*.cpp", "*.hpp") for p in (ROOT / room).rglob(ext))


def main():
    offences = [*check_includes(), *check_folders(), *check_firmware_folders(), *check_names(), *check_sources()]
    count = sum(len(sources(room)) for room in MAY_USE)
    if count == 0:
        print(f"no sources under {ROOT}: wrong folder?")
        return 1
    for offence in offences:
        print(offence)
    print(f"{count} files, {len(offences)} offences")
    return 1 if offences else 0


if __name__ == "__main__":
    sys.exit(main())
