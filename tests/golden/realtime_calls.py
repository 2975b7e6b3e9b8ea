#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""All that the estimator's thread can call is marked WM_REALTIME, is the estimator itself (whose symbols tests/contract/symbols.py
checks), or is on the short list below. Followed through the object files from the thread's function on.

    realtime_calls.py BUILD [OBJDUMP] [--list]"""
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BEGIN = "estimator_thread"
# Before its loop and after it: stack, counters of allocations and page faults.
OUTSIDE_THE_LOOP = {"wm_prefault_stack", "wm_allocations_of_this_thread", "wm_page_faults_of_this_thread"}
# Of the C library. No lock, no heap; clock_nanosleep is the thread's only system call (system_calls.py traces it).
LIBRARY = {"memcpy", "memset", "memmove", "memcmp", "strlen", "clock_gettime", "clock_nanosleep", "snprintf", "remainder", "hypot", "sqrt", "floor",
           "fabs", "sin", "cos", "sincos", "atan2", "fmin", "fmax", "isnan"}
CHECKED = re.compile(r"^__(\w+)_chk$|^__stack_chk_fail$")


def functions_of(obj, objdump):
    """{function: names that its code refers to}"""
    out = subprocess.run([objdump, "-dr", "--no-show-raw-insn", obj], check=True, capture_output=True, text=True).stdout
    found, now, target = {}, None, None
    for line in [*out.splitlines(), ""]:
        relocated = re.search(r"\sR_\w+\s+([A-Za-z_]\w*)", line)
        if target and not relocated:  # with a relocation the target printed is what stands behind the instruction
            now.add(target)
        target = None
        if match := re.match(r"^[0-9a-f]+ <([^>]+)>:$", line):
            now = found.setdefault(match[1], set())
        elif now is not None and relocated:
            now.add(relocated[1])
        elif now is not None and (match := re.search(r"\t(?:call|jmp|bl|b)\w*\s+[0-9a-f]+ <([A-Za-z_]\w*)>$", line)):
            target = match[1]
    return found


def marked():
    text = "\n".join(path.read_text() for path in ROOT.glob("firmware/*/*.h"))
    return set(re.findall(r"^WM_REALTIME [^;(]*?\b(\w+)\(", text, re.M))


def main():
    build = pathlib.Path(sys.argv[1])
    objdump = next((a for a in sys.argv[2:] if not a.startswith("--")), "objdump")
    defined = {}  # name: (object, names that it refers to)
    pure = set()
    for entry in json.loads((build / "compile_commands.json").read_text()):  # a build folder may hold objects of former targets, too
        where = re.search(r" -o (\S+)", entry["command"])[1]
        obj = build / where
        if not obj.exists():
            continue
        if where.startswith(("estimator/", "msgs/")):
            out = subprocess.run(["nm", "--defined-only", obj], capture_output=True, text=True).stdout
            pure |= {line.split()[-1] for line in out.splitlines()}
        elif where.startswith("firmware/") and "/cli/" not in where:
            for name, refers in functions_of(obj, objdump).items():
                defined.setdefault((where, name), refers)
    files_of = {}
    for where, name in defined:
        files_of.setdefault(name, []).append(where)
    real_time = marked()
    start = next(where for where, name in defined if name == BEGIN)
    waiting, seen, offences, reached = [(start, BEGIN)], set(), [], set()
    while waiting:
        where, name = waiting.pop()
        if (where, name) in seen:
            continue
        seen.add((where, name))
        for called in sorted(defined[where, name]):
            plain = CHECKED.match(called)[1] or "memcpy" if CHECKED.match(called) else called
            if called in OUTSIDE_THE_LOOP and name == BEGIN or called in pure or plain.removeprefix("v") in LIBRARY:
                continue
            if (where, called) in defined and len(files_of[called]) >= 1 and called not in real_time and not called.startswith("wm_"):
                waiting.append((where, called))  # of the same file
            elif called in files_of:
                reached.add(called)
                if called not in real_time:
                    offences.append(f"{name} ({where}) calls {called}, which is not marked WM_REALTIME")
                waiting.append((files_of[called][0], called))
            elif not called.startswith(("k", ".", "wm_")) or called.startswith("wm_"):
                if not re.match(r"^(k[A-Z]|_GLOBAL|stack_guard)", called):
                    offences.append(f"{name} ({where}) calls {called}, which may wait or allocate")
    if "--list" in sys.argv:
        print("\n".join(sorted(reached)))
    print("\n".join(sorted(set(offences))))
    print(f"{len(seen)} functions reached, {len(reached)} of other files; {len(set(offences))} offences")
    return bool(offences) or len(seen) < 20


if __name__ == "__main__":
    sys.exit(main())
