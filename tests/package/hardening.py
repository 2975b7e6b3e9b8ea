#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Programs are built as Debian builds its own (hardening=+all): at any address (PIE), addresses resolved and read-only before the
program begins (full RELRO), no stack that can be executed; the daemon with canaries on the stack and checked copies, too.

    hardening.py PROGRAM...     of the installed package, or of a build. Needs readelf (else 77)."""
import pathlib
import re
import shutil
import subprocess
import sys


def read(program, *words):
    return subprocess.run(["readelf", "-W", *words, program], check=True, capture_output=True, text=True).stdout


def offences(program):
    head, segments, dynamic, symbols = read(program, "-h"), read(program, "-l"), read(program, "-d"), read(program, "--dyn-syms")
    if not re.search(r"Type:\s+DYN", head) or "INTERP" not in segments:
        yield "is not position-independent"
    if "GNU_RELRO" not in segments or not re.search(r"BIND_NOW|Flags:.*\bNOW\b", dynamic):
        yield "has no full RELRO"
    stack = re.search(r"GNU_STACK\s.*\s(RW|RWE)\s+0x", segments)
    if not stack or stack[1] != "RW":
        yield "has a stack that can be executed"
    if pathlib.Path(program).name != "waymark":
        return
    if "__stack_chk_fail" not in symbols:
        yield "has no canaries on the stack"
    checked = set(re.findall(r"\b(__\w+_chk)\b", symbols)) - {"__stack_chk_fail"}
    if not {"__snprintf_chk", "__memcpy_chk"} & checked:
        yield f"has no checked copies (_FORTIFY_SOURCE): {sorted(checked)}"


def main():
    if not shutil.which("readelf"):
        print("skipped: there is no readelf (binutils)")
        return 77
    found = [f"{program} {offence}" for program in sys.argv[1:] for offence in offences(program)]
    print("\n".join(found) or f"{len(sys.argv) - 1} programs: PIE, full RELRO, no executable stack; the daemon with canaries and checked copies")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
