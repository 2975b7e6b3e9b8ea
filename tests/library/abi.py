#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The interface of libwaymark.so, functions and structs, is the one in tests/library/libwaymark.abi, which programs of users
were compiled with. Judged by abidiff (Debian: abigail-tools).

    abi.py BUILD             difference from the committed interface; 77 where there is no library or no abidiff
    abi.py BUILD accept      writes the file anew: for a change that is meant. A change that breaks programs needs a new
                             SOVERSION (firmware/library/CMakeLists.txt) and name in waymark.map"""
import pathlib
import platform
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
KEPT = ROOT / "tests/library/libwaymark.abi"
HEADERS = [ROOT / "firmware/library/include", ROOT / "msgs/include"]
PUBLIC = ["--drop-private-types", "--exported-interfaces-only"]


def write(library, out):
    where = [word for folder in HEADERS for word in ("--headers-dir", str(folder))]
    subprocess.run(["abidw", *PUBLIC, *where, "--no-elf-needed", "--no-corpus-path", "--no-comp-dir-path", "--no-show-locs", "--out-file",
                    str(out), str(library)], check=True)
    # A compiler's cache may have objects of another checkout.
    out.write_text(re.sub(r"path='[^']*/(?=(?:estimator|firmware|drivers|msgs)/)", "path='", out.read_text()))


def main():
    library = pathlib.Path(sys.argv[1]) / "lib/libwaymark.so"
    if not library.exists() or not shutil.which("abidiff") or platform.machine() != "x86_64":
        print("skipped: no libwaymark.so in this build, no abidiff (abigail-tools), or another machine than x86-64")
        return 77
    if sys.argv[2:] == ["accept"]:
        write(library, KEPT)
        print(f"{KEPT}: {KEPT.stat().st_size} bytes")
        return 0
    where = [word for folder in HEADERS for word in ("--headers-dir2", str(folder))]
    done = subprocess.run(["abidiff", *PUBLIC, *where, str(KEPT), str(library)], capture_output=True, text=True, check=False)
    print(done.stdout + done.stderr or "the interface of libwaymark.so is the committed one")
    if done.returncode:
        print("A change that is meant: python3 tests/library/abi.py build accept")
    return bool(done.returncode)


if __name__ == "__main__":
    sys.exit(main())
