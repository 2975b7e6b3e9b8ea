# SPDX-License-Identifier: Apache-2.0
"""SHA-256 sums of files, recordings, configurations and programs: what the result of a cell depends on."""
import hashlib
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import threading

_BLOCK_BYTES = 1 << 20
# Everything in a line of YAML that might name a file.
_WORD = re.compile(r"[^\s,'\"\[\]{}]+")


def of_text(text):
    """Sum of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


class Sums:
    """Sums of files. Those of unchanged files (same size and time of the last write) are kept in a file between runs."""

    def __init__(self, kept=None):
        self._kept, self._lock, self._of = kept, threading.Lock(), {}
        try:
            self._known = json.loads(kept.read_text()) if kept else {}
        except (OSError, ValueError):
            self._known = {}

    def file(self, path):
        """Sum of a file's bytes."""
        path = os.path.realpath(path)
        stat = os.stat(path)
        version = [stat.st_size, stat.st_mtime_ns, stat.st_ino]
        with self._lock:
            known = self._known.get(path)
        if known and known[0] == version:
            return known[1]
        made = hashlib.sha256()
        with open(path, "rb") as file:
            while block := file.read(_BLOCK_BYTES):
                made.update(block)
        with self._lock:
            self._known[path] = [version, made.hexdigest()]
        return made.hexdigest()

    def once(self, function, what):
        """function(what), computed once a batch: a recording is that of many cells."""
        at = (function.__name__, what)
        if at not in self._of:
            self._of[at] = function(what)
        return self._of[at]

    def forget(self, *paths):
        """These may have another content than in once()."""
        self._of = {at: made for at, made in list(self._of.items()) if at[1] not in paths}

    def folder(self, path):
        """Sum of the names and bytes of all files below a folder; of a file, its own."""
        path = pathlib.Path(path)
        if path.is_file():
            return self.file(path)
        files = sorted(pathlib.Path(base, name) for base, _, names in os.walk(path, followlinks=True) for name in names)
        return of_text("".join(f"{file.relative_to(path)} {self.file(file)}\n" for file in files))

    def configuration(self, path):
        """Sum of a configuration with all files that it names."""
        return of_text("".join(f"{name} {sum_}\n" for name, sum_ in sorted(self._named(pathlib.Path(path), set()))))

    def _named(self, path, seen):
        if path.resolve() in seen:
            return
        seen.add(path.resolve())
        yield path.name, self.folder(path)
        if path.suffix not in (".yaml", ".yml"):
            return
        for word in set(_WORD.findall(path.read_text(errors="replace"))):
            named = path.parent / word
            if word.strip("./~") and len(word) < 256 and "\0" not in word and named.exists():
                yield from self._named(named, seen)

    def program(self, command):
        """Sum of a program: of each file in its command, and of the libraries that it loads."""
        files = {pathlib.Path(found) for word in command if (found := _program_file(word))}
        root = next((command[i + 1] for i, word in enumerate(command[:-1]) if word == "-L"), None)
        libraries = set().union(*(_libraries(file, root) for file in files))
        parts = [f"{file.name} {self.file(file)}\n" for file in sorted(files | libraries)]
        # Options of the command change what it does; a path to a file does not, its content does.
        words = [word for word in command if not os.path.exists(word) and not shutil.which(word)]
        return of_text("".join(parts) + " ".join(words))

    def keep(self):
        """Writes the known sums."""
        if self._kept:
            write_whole(self._kept, json.dumps(self._known))


def write_whole(path, text):
    """Writes a file so that it is there as a whole or not at all."""
    part = path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}")
    part.write_text(text)
    os.replace(part, path)


def _program_file(word):
    if os.path.isfile(word):
        return word
    return shutil.which(word) if os.sep not in word and not word.startswith("-") else None


def _libraries(program, root):
    """Files of the shared libraries of a program: by the loader, or of another architecture below `root`."""
    names = _needed_by(program)
    if not names:
        return set()
    if root is None or not _is_foreign(program):
        done = subprocess.run(["ldd", program], capture_output=True, text=True, check=False)
        return {pathlib.Path(found) for found in re.findall(r"(/\S+) \(0x", done.stdout)}
    found, wanted = set(), list(names)
    while wanted:
        name = wanted.pop()
        places = [path for path in pathlib.Path(root).glob(f"**/{name}") if path.is_file() and _same_machine(path, program)]
        if places and (first := min(places)) not in found:
            found.add(first)
            wanted += _needed_by(first)
    return found


def _machine(path):
    head = path.open("rb").read(20)
    return struct.unpack_from("<H", head, 18)[0] if head[:4] == b"\x7fELF" else 0


def _same_machine(one, other):
    return _machine(one) == _machine(other)


def _is_foreign(program):
    return not _same_machine(pathlib.Path(program), pathlib.Path("/proc/self/exe"))


def _needed_by(path):
    """DT_NEEDED of a little-endian ELF file, 32 or 64 bit; nothing of another file."""
    data = path.read_bytes()
    if data[:4] != b"\x7fELF":
        return []
    wide = data[4] == 2
    at, size, count = struct.unpack_from("<Q14xHH" if wide else "<I10xHH", data, 32 if wide else 28)
    loads, dynamic = [], None
    for i in range(count):
        if wide:
            kind, offset, address, length = struct.unpack_from("<I4xQQ8xQ", data, at + i * size)
        else:
            kind, offset, address, length = struct.unpack_from("<IIIxxxxI", data, at + i * size)
        if kind == 1:
            loads.append((address, offset, length))
        elif kind == 2:
            dynamic = (offset, length)
    if dynamic is None:
        return []
    word = "<qQ" if wide else "<iI"
    entries = [struct.unpack_from(word, data, at) for at in range(dynamic[0], sum(dynamic), struct.calcsize(word))]
    strings = next((value for tag, value in entries if tag == 5), None)
    place = next((offset + strings - address for address, offset, length in loads if address <= strings < address + length), None)
    if place is None:
        return []
    return [data[place + value:data.index(b"\0", place + value)].decode() for tag, value in entries if tag == 1]
