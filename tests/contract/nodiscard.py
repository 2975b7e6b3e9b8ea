#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A dropped wm_status is a warning, and so an error of our builds: of a function, of a function pointer, in C and in C++.

    nodiscard.py CC CXX    compilers; a C compiler without the attribute (clang in C17) is left out"""
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
INCLUDES = [f"-I{ROOT / room / 'include'}" for room in ("msgs", "drivers", "estimator")]
HEAD = '#include "waymark/source.h"\n#include "waymark/estimator.h"\nvoid f(wm_source *s, const wm_estimator *e, wm_event *v, wm_error *err);\n' \
       "void f(wm_source *s, const wm_estimator *e, wm_event *v, wm_error *err) {\n  (void)s, (void)e, (void)v, (void)err;\n"
DROPPED = {"a function": 'wm_fail(err, WM_IO, "x");', "a source's pointer": "s->ops->next(s, v, err);", "an estimator's pointer": "e->predict(0, v);"}
TAKEN = {"looked at": "if (s->ops->next(s, v, err) != WM_OK) return;", "dropped on purpose": "(void)e->predict(0, v);"}


def compiles(compiler, language, line):
    words = [compiler, "-x", language, "-std=c17" if language == "c" else "-std=c++20", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", *INCLUDES, "-"]
    return subprocess.run(words, input=f"{HEAD}  {line}\n}}\n", capture_output=True, text=True).returncode == 0


def main():
    compilers = [(sys.argv[2], "c++")]
    if "clang" not in subprocess.run([sys.argv[1], "--version"], capture_output=True, text=True).stdout:
        compilers.append((sys.argv[1], "c"))
    wrong = [f"{language}: a status of {what} may be dropped" for compiler, language in compilers for what, line in DROPPED.items()
             if compiles(compiler, language, line)]
    wrong += [f"{language}: {what}: refused" for compiler, language in compilers for what, line in TAKEN.items() if not compiles(compiler, language, line)]
    print("\n".join(wrong) or f"{len(DROPPED)} dropped statuses refused in {', '.join(language for _, language in compilers)}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
