#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes docs/config.md and docs/errors.md from their sources: the tables of parameters, and the tests of the messages.
docs.py check|write BUILD. `check` prints what differs and fails; `write` brings the files up to date. Both check, and
docs.py references checks alone, that
- each reference cited as [Author2015] stands once in docs/references.md;
- what docs/glossary.md and the walks of design.md, runtime.md, edge_mcl.md and slam.md name in code is there;
- docs/threads.md names all files of the robot's rooms that have atomics, locks or shared memory;
- docs/failures.md's table of faults names tests that there are;
- docs/troubleshooting.md has a section for each finding, and no other;
- docs/images/threads.svg is what its script draws."""
import collections
import difflib
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]

CONFIG_HEAD = """# Configuration

A configuration names an estimator and its parameters, or leaves the choice to sources and maps. What belongs to a robot or a place (calibration, landmarks, DBC,
start pose) comes from the recording's folder unless the configuration says otherwise. It is YAML, read once at start. A mistake stops with file, line, key,
what is there and what is allowed ([errors.md](errors.md)). A key that isn't given has its default; an unknown key is an error.

```yaml
# yaml-language-server: $schema=waymark.schema.json
format: waymark-config/1
estimator: landmark_ekf
sources:                        # the order that holds at equal stamps; what isn't listed follows
  - {name: sightings, lateness_max_ms: 200}
  - {name: gnss, until_s: 25}
merge: {horizon_ms: 300}
publish: {rate_hz: 50}
sightings:
  states: {sensor_yaw_sigma_rad: 0.1}
landmark_ekf: {recover.sigma_xy_m: 3}
```

The first line is for editors (VS Code with the YAML extension, and others with yaml-language-server). `waymark config --schema > waymark.schema.json` writes the
schema beside the configuration, from the tables below. The editor then completes keys, shows their meaning, and marks what the program would refuse. Former keys
are marked, too.

Dots in the tables are nested maps: `publish.rate_hz` is `publish: {rate_hz: 50}`. Units stand in the names.

<!-- Made by tests/golden/docs.py from the tables that read the configuration: change them there. -->

"""

ERRORS_HEAD = """# Messages about bad input

Each row is a test: this input gives this message. Bad configuration stops at start, before anything moves; bad data is
counted, reported and skipped, and the drive goes on. `rec` is the recording's folder; the lines of a configuration follow
`format: waymark-config/1` and `estimator: landmark_ekf`; → is a tab, ⏎ a line's end. In a recording, the source puts
`can.log:LINE:` before a message about a candump line.

<!-- Made by tests/golden/docs.py from the tests' own tables: change them there. -->

"""

ERRORS_PARTS = [("wm_errors_config", "Configuration, recording, calibration"), ("wm_errors_can", "CAN: candump, DBC, binding"),
                ("wm_errors_init", "Files of other programs, read by `waymark init`")]


def run(program, *args):
    return subprocess.run([program, *args], check=True, capture_output=True, text=True).stdout


def config_md(tests):
    return CONFIG_HEAD + run(tests / "config_reference")


def errors_md(tests):
    text, rows = ERRORS_HEAD, 0
    for program, title in ERRORS_PARTS:
        if not (tests / program).exists():
            sys.exit(f"{tests / program} is not built: cmake --build the whole first")
        part = run(tests / program, "--markdown")
        rows += part.count("\n")
        text += f"## {title}\n\n| case | input | message |\n| --- | --- | --- |\n{part}\n"
    print(f"{rows} cases")
    return text.rstrip("\n") + "\n"


CITED = re.compile(r"\[([A-Z][A-Za-z]*[a-z](?:(?:19|20)\d\d|ND)[a-z]?)(?:, [^\]\n]+)?\](?!\()")
LISTED = re.compile(r"^\d+\. \*\*\[(\w+)\]\*\*", re.MULTILINE)
CITING = ["estimator", "msgs", "drivers", "firmware", "tools", "sim", "tests", "docs"]


def references():
    """Prints citations without a reference and references that stand twice; returns how many."""
    listed = collections.Counter(LISTED.findall((ROOT / "docs/references.md").read_text()))
    faults = [f"docs/references.md: [{key}] stands {n} times" for key, n in listed.items() if n > 1]
    for room in CITING:
        for path in sorted((ROOT / room).rglob("*")):
            if path.suffix not in (".h", ".hpp", ".c", ".cpp", ".py", ".md") or not path.is_file():
                continue
            for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
                for key in CITED.findall(line):
                    if key not in listed and key != "Author2015":
                        faults.append(f"{path.relative_to(ROOT)}:{number}: [{key}] is not in docs/references.md")
    print("".join(fault + "\n" for fault in faults), end="")
    return len(faults)


CODE = [ROOT / room for room in ("estimator", "msgs")]
BELOW = [ROOT, ROOT / "estimator", ROOT / "estimator/include", ROOT / "estimator/filters"]


def glossary():
    """Prints files and identifiers in the last column of docs/glossary.md that are not in the code; returns how many."""
    text = "".join(path.read_text() for room in CODE for path in room.rglob("*") if path.suffix in (".h", ".hpp", ".c", ".cpp"))
    faults = 0
    for number, line in enumerate((ROOT / "docs/glossary.md").read_text().splitlines(), 1):
        for token in re.findall(r"`([^`]+)`", line.rsplit("|", 2)[-2] if line.startswith("|") else ""):
            if "/" in token or re.search(r"\.(h|c|cpp|hpp)$", token):
                found = any((base / token).exists() for base in BELOW)
            else:
                found = all(part in text for part in re.split(r"::|(?<=\w)\.(?=\w)", token.strip("*")))
            if not found:
                faults += 1
                print(f"docs/glossary.md:{number}: {token} is not in the code")
    return faults


WALKS = {"design.md": ROOT / "estimator", "estimators/edge_mcl.md": ROOT / "estimator", "estimators/slam.md": ROOT / "estimator", "runtime.md": ROOT}


def walks():
    """Prints functions of the pages' walks that are not in the file beside them; returns how many."""
    faults = 0
    row = re.compile(r"^\| \d+ \| `([^`]+)` \| `([^`]+)` \|")
    for page, below in WALKS.items():
        for number, line in enumerate((ROOT / "docs" / page).read_text().splitlines(), 1):
            match = row.match(line)
            path = below / match.group(2) if match else None
            if path and (not path.exists() or match.group(1) + "(" not in path.read_text()):
                faults += 1
                print(f"docs/{page}:{number}: {match.group(1)} is not in {match.group(2)}")
    return faults


# Paths of sources in the prose of these pages.
NAMED = re.compile(r"`((?:firmware|drivers|estimator|msgs|tests|tools|sim)/[\w/.-]+\.(?:c|h|cpp|hpp|py))`")


# Files and folders that a contributor is sent to.
PLACES = re.compile(r"`((?:firmware|drivers|estimator|msgs|tests|tools|sim|config|docs)/(?!NAME)(?:[\w.-]+/)*(?!NAME)[\w.-]*)`")


def named_files():
    """Prints files that CONTRIBUTING.md and docs/*.md name and that are not there; returns how many."""
    faults = 0
    for page in [ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]:
        for number, line in enumerate(page.read_text().splitlines(), 1):
            for path in (PLACES if page.parent == ROOT else NAMED).findall(line):
                if not (ROOT / path).exists():
                    faults += 1
                    print(f"{page.relative_to(ROOT)}:{number}: {path} is not there")
    return faults


def fault_tests():
    """Prints tests in the last column of docs/failures.md's table of faults that are not there; returns how many."""
    made = "".join(path.read_text() for pattern in ("CMakeLists.txt", "*.cmake") for path in (ROOT / "tests").rglob(pattern))
    drives = re.search(r"DRIVES = \{.*?\}", (ROOT / "tests/faults/faults.py").read_text(), re.DOTALL)[0]
    parts = (ROOT / "tests/hil/hil.py").read_text()
    faults, rows = 0, re.findall(r"(?m)^\| [^|]+ \|[^|]*\|[^|]*\|[^|]*\| ([^|]+) \|$", (ROOT / "docs/failures.md").read_text().split("## While CAN")[0])
    for name in (name.split(" (")[0] for row in rows for name in row.split(", ") if name not in ("test", "---")):
        kind, _, what = name.partition(" ")
        found = {"faults": f'"{what}"' in drives, "hil": f'"{what}": [' in parts}.get(kind, re.search(rf"\b{kind.removeprefix('test_estimator_')}\b", made))
        if not found:
            faults += 1
            print(f"docs/failures.md: there is no test {name}")
    return faults if len(rows) > 20 else 1


SHARED = re.compile(r"_Atomic|MAP_SHARED|\batomic_u?int (?!\*)|pthread_(mutex|cond)_t|std::(mutex|atomic|condition_variable)")


def shared():
    """Prints sources of the robot's rooms with atomics or locks that docs/threads.md does not name; returns how many."""
    text, faults = (ROOT / "docs/threads.md").read_text(), 0
    for room in ("estimator", "drivers", "firmware"):
        for path in sorted((ROOT / room).rglob("*")):
            if path.suffix not in (".c", ".h", ".cpp", ".hpp") or not SHARED.search(path.read_text()):
                continue
            if not any(f"`{path.relative_to(ROOT).with_suffix(suffix)}`" in text for suffix in (".c", ".h", ".cpp")):
                faults += 1
                print(f"{path.relative_to(ROOT)}: shared between threads, and not named in docs/threads.md")
    return faults


def drawing():
    """Prints and returns 1 where docs/images/threads.svg is not what its script draws."""
    images = ROOT / "docs/images"
    if run(sys.executable, images / "threads.py") == (images / "threads.svg").read_text():
        return 0
    print("docs/images/threads.svg is not up to date: python3 docs/images/threads.py > docs/images/threads.svg")
    return 1


def findings():
    """Prints findings of the table without a section in docs/troubleshooting.md, and the reverse; returns how many."""
    kinds = set(re.findall(r'\[WM_FOUND_[A-Z_]+\]\s*=\s*\{\s*"([a-z-]+)"', (ROOT / "firmware/findings/kinds.c").read_text()))
    page = (ROOT / "docs/troubleshooting.md").read_text()
    sections, links = set(re.findall(r"(?m)^### (.+)$", page)), set(re.findall(r"\(#([a-z-]+)\)", page))
    faults = sorted(kinds ^ sections) + sorted(links - kinds)
    for name in faults:
        print(f"docs/troubleshooting.md: {name}: {'no section' if name in kinds else 'no such finding in firmware/findings/kinds.c'}")
    return len(faults) if kinds else 1


def checked():
    """How many faults the checks find that need no built program."""
    return references() + glossary() + walks() + named_files() + shared() + fault_tests() + findings() + drawing()


def main():
    if sys.argv[1:] == ["references"]:
        return 1 if checked() else 0
    if len(sys.argv) != 3 or sys.argv[1] not in ("check", "write"):
        sys.exit(__doc__)
    tests = pathlib.Path(sys.argv[2]) / "tests"
    stale = 1 if checked() else 0
    for name, make in (("config.md", config_md), ("errors.md", errors_md)):
        path = ROOT / "docs" / name
        fresh = make(tests)
        old = path.read_text() if path.exists() else ""
        if fresh == old:
            continue
        if sys.argv[1] == "write":
            path.write_text(fresh)
            print(f"wrote docs/{name}")
            continue
        stale = 1
        sys.stdout.writelines(difflib.unified_diff(old.splitlines(True), fresh.splitlines(True), f"docs/{name}", "as made now"))
        print(f"docs/{name} is not up to date: python3 tests/golden/docs.py write BUILD")
    return stale


if __name__ == "__main__":
    sys.exit(main())
