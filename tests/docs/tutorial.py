#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs a tutorial's page as a reader does: tutorial.py PAGE BIN [FOLDER]. In a folder of its own, in the order of the page,
- a block behind `<!-- file NAME -->` is written to that file;
- a block `sh` runs, all of them in one shell that ends at the first error;
- each line of a block behind `<!-- shows -->` must stand in the output of the last `sh` block: words equal, numbers within a fifth or 0.5.
FOLDER keeps what it made, with the time of each block."""
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"(?:<!-- (file (?P<name>\S+)|shows) -->\n)?```(?P<language>\w+)\n(?P<text>.*?)```", re.S)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


def blocks(page):
    """(kind, name, text) of each block that does something; kind: file, run, shows."""
    for found in BLOCK.finditer(page):
        if found["name"]:
            yield "file", found["name"], found["text"]
        elif found[1]:
            yield "shows", "", found["text"]
        elif found["language"] == "sh":
            yield "run", "", found["text"]


def is_like(stated, shown):
    """Both lines have the same words, and numbers that are near each other; more may follow in the one that was shown."""
    words, others = stated.split(), shown.split()
    if len(others) < len(words):
        return False
    for a, b in zip(words, others):
        if NUMBER.sub("#", a) != NUMBER.sub("#", b):
            return False
        for x, y in zip(map(float, NUMBER.findall(a)), map(float, NUMBER.findall(b))):
            if abs(x - y) > max(0.2 * abs(x), 0.5 if abs(x) >= 1 else 0.02):
                return False
    return True


class Shell:
    """One bash for all blocks of a page."""

    def __init__(self, folder):
        self.process = subprocess.Popen(["bash"], cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, text=True)

    def run(self, text):
        """(exit code of the first command that failed or 0, output)"""
        self.process.stdin.write(f"( set -e; true\n) && set -e -o pipefail; trap 'echo \"=ended $?\"' EXIT\n{text}\nset +e; trap - EXIT; echo '=ended 0'\n")
        self.process.stdin.flush()
        out = []
        for line in self.process.stdout:
            if line.startswith("=ended "):
                return int(line.split()[1]), "".join(out)
            out.append(line)
        return 1, "".join(out)


def walk(page, folder):
    shell, output, count = Shell(folder), "", 0
    for kind, name, text in blocks(page.read_text()):
        if kind == "file":
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text)
        elif kind == "run":
            begin = time.monotonic()
            code, output = shell.run(text)
            print(f"{time.monotonic() - begin:6.1f} s  {text.strip().splitlines()[-1]}", flush=True)
            if code:
                sys.exit(f"{page.name}: this block failed with exit code {code}:\n{text}\n{output}")
        else:
            for line in filter(None, text.splitlines()):
                if not any(is_like(line, shown) for shown in output.splitlines()):
                    sys.exit(f"{page.name} states that this is shown:\n{line}\nShown was:\n{output}")
                count += 1
    print(f"{page.name}: {count} lines are shown as stated")


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    page, programs = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory(prefix="waymark-tutorial-") as made:
        folder = pathlib.Path(sys.argv[3]) if len(sys.argv) == 4 else pathlib.Path(made)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "config").symlink_to(ROOT / "config")
        (folder / "build").mkdir()
        (folder / "build/bin").symlink_to(programs)
        walk(page, folder)


if __name__ == "__main__":
    main()
