#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What the compiler made of the arithmetic: arithmetic.py OBJDUMP WAYMARK ESTIMATOR_ARCHIVE. In the program there is no fused
multiply-add, which rounds once where others round twice, and on 32-bit ARM no single precision by NEON, which flushes
denormals to zero (docs/design.md, numbers). In the estimator's hot loops there are vectors: NEON, or AVX2 beside plain code.
Of a static program everything inside is read, AprilTag too, but for what other libraries bring already compiled: they are counted apart."""
import re
import subprocess
import sys

FUSED = {
    "x86-64": r"vfn?m(add|sub|addsub|subadd)\d*[ps][sd]",
    "aarch64": r"f(n?madd|n?msub|mla|mls)",
    "arm": r"(vfn?m[as]\.f\d+|v(add|sub|mul|mla|mls|max|min|abd|neg|abs|recpe|rsqrte)\.f32\s+[qd]\d+.*)",
}
VECTORS = {"x86-64": r"\sv?(p[a-z]+|[a-z]+p[sd])\s.*%[xy]mm", "aarch64": r"\bv\d+\.(16b|8b|8h|4h|4s|2s|2d)\b", "arm": r"\sq\d+,|\s\{?d\d+.*,\s*d\d+"}
# Where most of a run's time goes, and how many vector instructions are the least (a quarter of what was there when this was written).
KERNELS = {"score_field.cpp": 50, "likelihood.cpp": 8, "hough.cpp": 3, "votes.cpp": 8, "match.cpp": 5, "patch.cpp": 30}
# What Debian's static libraries bring: names that C reserves (glibc with libm), libjpeg-turbo, libpng, GLib. Nothing that is
# estimated is made by them, but for the sines of AprilTag.
LIBRARIES = re.compile(r"__\w+|(jpeg|png|g)_\w+|get_\w+_row|quantize_float")


def disassembly(objdump, path):
    with subprocess.Popen([objdump, "-d", "--no-show-raw-insn", path], stdout=subprocess.PIPE, text=True) as run:
        yield from run.stdout


def machine_of(lines):
    for line in lines:
        found = re.search(r"file format \S*?(x86-64|aarch64|arm)", line)
        if found:
            return found[1]
    sys.exit("objdump says of no machine")


def is_static(objdump, path):
    return ".interp" not in subprocess.run([objdump, "-h", path], capture_output=True, text=True, check=True).stdout


def main():
    objdump, program, archive = sys.argv[1:]
    brought = LIBRARIES if is_static(objdump, program) else re.compile("(?!)")
    machine = machine_of(disassembly(objdump, program))
    fused = re.compile(r"^\s+[0-9a-f]+:\s+(" + FUSED[machine] + r")\b")
    vector = re.compile(VECTORS[machine])
    count, offences, others, inside = 0, 0, 0, "?"
    for line in disassembly(objdump, program):
        if line.endswith(">:\n"):
            inside = line.split("<", 1)[1][:-3]
        elif line.startswith(" "):
            count += 1
            if fused.match(line) and brought.fullmatch(inside):
                others += 1
            elif fused.match(line):
                print(f"{inside}: {line.split(':', 1)[1].strip()}")
                offences += 1
    print(f"{machine}: {count} instructions, {offences} of them with other roundings" + (f" (and {others} in libraries)" if others else ""))

    vectors, kernel = dict.fromkeys(KERNELS, 0), None
    for line in disassembly(objdump, archive):
        if ":     file format" in line:
            name = line.split(":")[0].removesuffix(".o")
            kernel = name if name in KERNELS else None
        elif kernel and line.startswith(" ") and vector.search(line):
            vectors[kernel] += 1
    print("vector instructions: " + ", ".join(f"{name} {n}" for name, n in vectors.items()))
    for name, n in vectors.items():
        if n < KERNELS[name]:
            print(f"{name}: {n} vector instructions, at least {KERNELS[name]} are needed: is it compiled for vectors?")
            offences += 1
    return 1 if offences or count < 10000 else 0


if __name__ == "__main__":
    sys.exit(main())
