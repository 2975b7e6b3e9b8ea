#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Packages are the same bytes wherever, whenever and by whomever they are made: reproducible.py BUILD.

The installed part of a build is packed twice, from copies in two folders: the second one deeper, with other times of all files, written
in another order, in another time zone, by a user whose umask is 077. Then sources are compiled in both by the commands of the build with
WM_REPRODUCIBLE: the objects, which have the names of their sources in them, are the same. Skipped (77) without cpack or dpkg-deb."""
import hashlib
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv[1]).resolve()
# Packages of programs, of a library, of headers and of scripts. The others are made by the same rules.
COMPONENTS = ("runtime", "library", "dev", "fleet")
COMPILED = ("msgs/src/status.c", "firmware/library/entry.c", "estimator/filters/registry.c")
NOT_INSTALLED = re.compile(r"\.(o|d|ninja)$|/CMakeFiles/|/packages/|/tests/.*(?<!\.cmake)$|/_CPack_Packages/|/Testing/|/bin/waymark-montecarlo")


def files_of(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file() or path.is_symlink())


def sources():
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "-z", "--cached", "--others", "--exclude-standard"], capture_output=True, check=False)
    names = [n for n in listed.stdout.decode().split("\0") if n] if listed.returncode == 0 else []
    return [ROOT / n for n in names if (ROOT / n).is_file()] or [p for p in files_of(ROOT) if BUILD not in p.parents]


def moved(text, place):
    return text.replace(str(BUILD), str(place / "built")).replace(str(ROOT), str(place / "sources"))


def copy(place, backwards):
    """Sources and build below `place`, with its paths in what CMake wrote."""
    pairs = [(path, place / "sources" / path.relative_to(ROOT)) for path in sources()]
    pairs += [(path, place / "built" / path.relative_to(BUILD)) for path in files_of(BUILD)
              if not NOT_INSTALLED.search("/" + str(path.relative_to(BUILD))) and (path.suffix not in (".json", ".xml") or path.stat().st_size < 1e6)]
    for path, to in sorted(pairs, reverse=backwards):
        to.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix in (".cmake", ".pc"):
            to.write_text(moved(path.read_text(), place))
            shutil.copymode(path, to)
        else:
            shutil.copy2(path, to, follow_symlinks=False)
        if backwards and not to.is_symlink():
            os.utime(to, (1000000000, 1000000000))


def pack(place, umask, zone):
    """{name: sum} of the packages."""
    env = {**os.environ, "TZ": zone, "SOURCE_DATE_EPOCH": "1700000000"}
    done = subprocess.run(["cpack", "-G", "DEB", "-B", str(place / "out"), "-D", f"CPACK_COMPONENTS_ALL={';'.join(COMPONENTS)}"],
                          cwd=place / "built", env=env, umask=umask, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return {deb.name: hashlib.sha256(deb.read_bytes()).hexdigest() for deb in (place / "out").glob("*.deb")}


def modes(deb):
    listed = subprocess.run(["dpkg-deb", "-c", deb], capture_output=True, text=True, check=True, env={**os.environ, "TZ": "UTC"}).stdout
    return [line.split() for line in listed.splitlines()]


def check_package(deb):
    for mode, owner, _, day, time, *name in modes(deb):
        assert owner == "root/root" and (day, time) == ("2023-11-14", "22:13"), (deb.name, owner, day, time, name)
        assert not mode.startswith("d") or mode == "drwxr-xr-x", (deb.name, mode, name)
        assert mode.startswith("l") or mode[7] == "r", (deb.name, mode, name)  # everybody reads


def compiled(place, source):
    """The object of a source, by the build's command for it, in the folder of a copy."""
    entry = next(e for e in json.loads((BUILD / "compile_commands.json").read_text()) if e["file"] == str(ROOT / source))
    words = [w for w in shlex.split(moved(entry["command"], place)) if not w.endswith("ccache") and "prefix-map" not in w]
    words += [f"-ffile-prefix-map={place}/sources=.", f"-ffile-prefix-map={place}/built=./build", "-g"]
    out = place / "object.o"
    words[words.index("-o") + 1] = str(out)
    done = subprocess.run([w for w in words if w != "-MD"], cwd=place / "built", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    data = out.read_bytes()
    assert str(place).encode() not in data, f"{source}: its object has the path {place}"
    return data


def main():
    if not (shutil.which("cpack") and shutil.which("dpkg-deb")) or not (BUILD / "lib/libwaymark.so").exists():
        print("skipped: no cpack or dpkg-deb here, or no libwaymark.so in this build")
        return 77
    options = (ROOT / "cmake/WaymarkOptions.cmake").read_text()
    assert "-ffile-prefix-map=${CMAKE_SOURCE_DIR}=. -ffile-prefix-map=${CMAKE_BINARY_DIR}=./build" in options
    with tempfile.TemporaryDirectory(prefix="waymark-reproducible-") as name:
        first, second = pathlib.Path(name) / "a", pathlib.Path(name) / "another/and/deeper"
        copy(first, False), copy(second, True)
        a, b = pack(first, 0o022, "UTC"), pack(second, 0o077, "Pacific/Auckland")
        assert len(a) == len(COMPONENTS) and a.keys() == b.keys(), (a, b)
        for deb in sorted(a):
            check_package(first / "out" / deb)
            if a[deb] != b[deb]:
                for x, y in zip(modes(first / "out" / deb), modes(second / "out" / deb)):
                    if x != y:
                        print("differs:", *x, "|", *y)
            assert a[deb] == b[deb], f"{deb}: two packages of the same build differ: {a[deb]} and {b[deb]}"
            print(f"{a[deb]}  {deb}")
        for source in COMPILED:
            assert compiled(first, source) == compiled(second, source), f"{source}: its object is another in another folder"
    print(f"{len(a)} packages and {len(COMPILED)} objects: the same bytes in two folders, at two times, by two users")
    return 0


if __name__ == "__main__":
    sys.exit(main())
