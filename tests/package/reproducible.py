#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Packages are the same bytes wherever, whenever and by whomever they are made: reproducible.py BUILD | --whole FOLDER.

The installed part of a build is packed twice, from copies in two folders: the second one deeper, with other times of all files, written
in another order, in another time zone, by a user whose umask is 077. Then sources are compiled in both by the commands of the build with
WM_REPRODUCIBLE: the objects, which have the names of their sources in them, are the same; every source has these options. Skipped (77)
without cpack or dpkg-deb.

--whole: everything is built in both (below FOLDER, which stays), one after the other without a compiler's cache, the second with another
number of compilers at once; all packages are compared, and what differs is named by package and file. What is there is built on."""
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
BUILD = pathlib.Path(sys.argv[1]).resolve()  # no folder with --whole
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


def of_sources(place):
    return [(path, place / "sources" / path.relative_to(ROOT)) for path in sources()]


def of_build(place):
    return [(path, place / "built" / path.relative_to(BUILD)) for path in files_of(BUILD)
            if not NOT_INSTALLED.search("/" + str(path.relative_to(BUILD))) and (path.suffix not in (".json", ".xml") or path.stat().st_size < 1e6)]


def copy(pairs, place, backwards):
    """Files (from, to) below `place`, with its paths in what CMake wrote."""
    for path, to in sorted(pairs, reverse=backwards):
        to.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix in (".cmake", ".pc"):
            to.write_text(moved(path.read_text(), place))
            shutil.copymode(path, to)
        else:
            shutil.copy2(path, to, follow_symlinks=False)
        if backwards and not to.is_symlink():
            os.utime(to, (1000000000, 1000000000))


def run(words, place, umask, zone):
    env = {**os.environ, "TZ": zone, "SOURCE_DATE_EPOCH": "1700000000", "CCACHE_DISABLE": "1"}
    done = subprocess.run(words, cwd=place, env=env, umask=umask, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def pack(place, umask, zone, components=COMPONENTS):
    """{name: sum} of the packages; without components all that there are."""
    chosen = ["-D", f"CPACK_COMPONENTS_ALL={';'.join(components)}"] if components else []
    run(["cpack", "-G", "DEB", "-B", str(place / "out"), *chosen], place / "built", umask, zone)
    return {deb.name: hashlib.sha256(deb.read_bytes()).hexdigest() for deb in (place / "out").glob("*.deb")}


def modes(deb):
    listed = subprocess.run(["dpkg-deb", "-c", deb], capture_output=True, text=True, check=True, env={**os.environ, "TZ": "UTC"}).stdout
    return [line.split() for line in listed.splitlines()]


def check_package(deb):
    for mode, owner, _, day, time, *name in modes(deb):
        assert owner == "root/root" and (day, time) == ("2023-11-14", "22:13"), (deb.name, owner, day, time, name)
        assert not mode.startswith("d") or mode == "drwxr-xr-x", (deb.name, mode, name)
        assert mode.startswith("l") or mode[7] == "r", (deb.name, mode, name)  # everybody reads


def check_commands(folder):
    """Every source of a build for packages, generated ones as well, is compiled without this computer's paths."""
    run(["cmake", "--preset", "release", "-B", folder, "-DWM_TESTS=OFF", "-DWM_REPRODUCIBLE=ON"], ROOT, 0o022, "UTC")
    maps = f"-ffile-prefix-map={ROOT}=. -ffile-prefix-map={folder}=./build"
    bare = [entry["file"] for entry in json.loads((folder / "compile_commands.json").read_text()) if maps not in entry["command"]]
    assert not bare, f"compiled with paths of this computer (WM_PREFIX_MAP): {bare}"


def compare(first, second, a, b):
    """Names what differs in packages {name: sum} of two places; how many do."""
    assert a and a.keys() == b.keys(), (a, b)
    for deb in sorted(a):
        check_package(first / "out" / deb)
        print(f"{a[deb]}  {deb}" if a[deb] == b[deb] else f"{deb}: two packages of the same sources differ: {a[deb]} and {b[deb]}")
        if a[deb] != b[deb]:
            for x, y in zip(modes(first / "out" / deb), modes(second / "out" / deb)):
                if x != y:
                    print("  differs:", *x, "|", *y)
            for place in (first, second):
                (place / "unpacked").mkdir(exist_ok=True)
                run(["dpkg-deb", "-R", place / "out" / deb, place / "unpacked" / deb], place, 0o022, "UTC")
            for path in files_of(first / "unpacked" / deb):
                other = second / "unpacked" / deb / path.relative_to(first / "unpacked" / deb)
                if not path.is_symlink() and not (other.is_file() and path.read_bytes() == other.read_bytes()):
                    print("  other content:", path, other)
    return sum(a[deb] != b[deb] for deb in a)


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


def whole(folder):
    """All of it, built twice; no file of one is of use to the other."""
    first, second = folder / "a", folder / "another/and/deeper"
    sums = []
    for place in (first, second):
        if not (place / "sources").exists():
            copy(of_sources(place), place, place == second)
    for place, umask, zone, jobs in ((first, 0o022, "UTC", 2), (second, 0o077, "Pacific/Auckland", 3)):
        run(["cmake", "--preset", "release", "-B", place / "built", "-DWM_TESTS=OFF", "-DWM_REPRODUCIBLE=ON"], place / "sources", umask, zone)
        run(["cmake", "--build", place / "built", "-j", str(jobs)], place / "sources", umask, zone)
        sums.append(pack(place, umask, zone, components=()))
        print(f"{place}: {len(sums[-1])} packages", flush=True)
    differing = compare(first, second, *sums)
    print(f"{len(sums[0]) - differing} of {len(sums[0])} packages of two whole builds: the same bytes")
    return int(differing > 0)


def main():
    if sys.argv[1] == "--whole":
        return whole(pathlib.Path(sys.argv[2]).resolve())
    if not (shutil.which("cpack") and shutil.which("dpkg-deb")) or not (BUILD / "lib/libwaymark.so").exists():
        print("skipped: no cpack or dpkg-deb here, or no libwaymark.so in this build")
        return 77
    with tempfile.TemporaryDirectory(prefix="waymark-reproducible-") as name:
        check_commands(pathlib.Path(name) / "configured")
        first, second = pathlib.Path(name) / "a", pathlib.Path(name) / "another/and/deeper"
        for place in (first, second):
            copy(of_sources(place) + of_build(place), place, place == second)
        a, b = pack(first, 0o022, "UTC"), pack(second, 0o077, "Pacific/Auckland")
        assert len(a) == len(COMPONENTS) and not compare(first, second, a, b)
        for source in COMPILED:
            assert compiled(first, source) == compiled(second, source), f"{source}: its object is another in another folder"
    print(f"{len(a)} packages and {len(COMPILED)} objects: the same bytes in two folders, at two times, by two users")
    return 0


if __name__ == "__main__":
    sys.exit(main())
