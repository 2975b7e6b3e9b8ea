#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The estimator archive is pure: what it needs from outside is this short list and nothing else. No heap, no clock, no
file, no thread, no terminal, and none of the C library's sines and logarithms, which differ between machines."""
import re
import subprocess
import sys

ALLOWED = {"memcpy", "memset", "memmove", "memcmp", "strlen", "strcmp", "sqrt", "floor"}
# What the compiler brings itself: the machine's vector instructions, and counting bits where there is no instruction for it.
ALLOWED |= {"__cpu_model", "__cpu_indicator_init", "__popcountdi2", "__ctzdi2", "__paritydi2"}
# msgs/, which the estimator stands on.
ALLOWED_PATTERNS = [re.compile(r"^wm_")]
# What compilers and sanitizers add on their own.
TOOLS = re.compile(r"^(__stack_chk_fail|__mem(cpy|set|move)_chk|_GLOBAL_OFFSET_TABLE_|__(asan|ubsan|tsan|sanitizer|sancov)_.*|__gxx_personality_v0|"
                   r"__aeabi_.*|_Unwind_Resume|__gcov_.*)$")


def main():
    archive, nm = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else "nm"
    out = subprocess.run([nm, "-A", archive], check=True, capture_output=True, text=True).stdout
    defined, wanted = set(), {}
    for line in out.splitlines():
        match = re.match(r"^(.*?):\s*(?:[0-9a-f]+ )?\s*([A-Za-z]) (\S+)$", line)
        if not match:
            continue
        where, kind, name = match.groups()
        if kind == "U":
            wanted.setdefault(name, where)
        else:
            defined.add(name)
    if len(defined) < 20:
        print(f"{archive}: only {len(defined)} symbols: is this the estimator?")
        return 1
    offences = [(name, where) for name, where in sorted(wanted.items())
                if name not in defined and name not in ALLOWED and not TOOLS.match(name)
                and not any(p.match(name) for p in ALLOWED_PATTERNS)]
    for name, where in offences:
        print(f"{where}: needs {name}, which the estimator may not use")
    print(f"{len(wanted)} symbols wanted, {len(offences)} offences")
    return 1 if offences else 0


if __name__ == "__main__":
    sys.exit(main())
