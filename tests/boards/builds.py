# SPDX-License-Identifier: Apache-2.0
"""A build of ours and how its programs are started here: as they are, under qemu-user with the sysroot's libraries, or (FOLDER@ROOT)
with all libraries of another system, whose root is unpacked in ROOT."""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Build:
    def __init__(self, named):
        folder, _, root = str(named).partition("@")
        self.folder = pathlib.Path(folder).resolve()
        cache = self.folder / "CMakeCache.txt"
        if not cache.exists():
            raise SystemExit(f"{folder}: not a build (no CMakeCache.txt); ./dev build, ./dev board BOARD build")
        found = re.search(r"^CMAKE_TOOLCHAIN_FILE:\w+=(.+)$", cache.read_text(), re.M)
        self.board = pathlib.Path(found[1]).stem if found else "this computer"
        arch = re.search(r"^set\(WM_ARCH (\w+)\)", pathlib.Path(found[1]).read_text(), re.M)[1] if found else None
        self.arch = arch or "x86-64"
        self.sysroot = (ROOT / ".cache/sysroot" / arch).resolve() if arch else None
        self.qemu = {"arm64": "qemu-aarch64", "armhf": "qemu-arm"}.get(arch)
        if root:
            self.board, self.sysroot = pathlib.Path(root).name, pathlib.Path(root).resolve()

    def is_older_than_its_sources(self, program):
        """True if a source of the runtime was written after `program` was linked: builds of unlike sources say nothing."""
        made = (self.folder / program).stat().st_mtime
        rooms = ("msgs", "estimator", "drivers", "firmware")
        return any(file.stat().st_mtime > made for room in rooms for file in (ROOT / room).rglob("*")
                   if file.suffix in (".c", ".cpp", ".h", ".hpp"))

    def command(self, program, *words, emulator_options=()):
        """The words to start `program` (a path inside the build) with."""
        start = []
        if self.qemu:
            start = [self.qemu, *emulator_options, "-L", self.sysroot]
        elif self.sysroot:  # by that system's own loader, of the same processor
            libraries = self.sysroot / "usr/lib/x86_64-linux-gnu"
            start = [libraries / "ld-linux-x86-64.so.2", "--library-path", libraries]
        return [str(word) for word in (*start, self.folder / program, *words)]
