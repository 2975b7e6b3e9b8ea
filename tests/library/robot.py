#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The examples of docs/library.md, a robot's own program with its own loop in C and in C++: compiled against libwaymark.so, given
the rows of a recording in the order of their arrival, their poses are those of `waymark replay`, digit by digit. The headers
compile without a warning in each C and C++ that programs of users are in.

    robot.py BUILD [CC [CXX]]          Skipped (77) where there is no libwaymark.so (sanitizers)."""
import csv
import pathlib
import shlex
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/contract"))
import small_robot  # noqa: E402

BUILD = pathlib.Path(sys.argv[1]).resolve()
CC = shlex.split(sys.argv[2]) if len(sys.argv) > 2 else ["cc"]
CXX = shlex.split(sys.argv[3]) if len(sys.argv) > 3 else ["c++"]
EXAMPLES = {standard: (ROOT / "tests/package/downstream" / name, [*compiler, f"-std={standard}"])
            for name, compiler, standards in (("robot.c", CC, ("c11", "c17")), ("robot.cpp", CXX, ("c++17", "c++20", "c++23")))
            for standard in standards}
CLANG, CLANGXX = (next((path for name in (tool, f"{tool}-14") if (path := shutil.which(name))), tool) for tool in ("clang", "clang++"))


def rows(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def with_twists(folder):
    """The small robot with the twists of its true way instead of its CAN bus."""
    small_robot.write(folder)
    for name in ("can.log", "vehicle.dbc", "can-signals.yaml"):
        (folder / name).unlink()
    about = folder / "recording.yaml"
    about.write_text(about.read_text().replace("can.log, vehicle.dbc, can-signals.yaml", "motion.csv"))
    path = small_robot.drive()
    lines = ["t_ns,v_mps,w_radps"]
    for t, *_, w in path[::4]:
        v, _ = small_robot._twist(t)
        lines.append(f"{small_robot.START_NS + round(t * 1e9)},{v:.6f},{w:.6f}")
    (folder / "motion.csv").write_text("\n".join(lines) + "\n")


def in_order(folder):
    """All rows as lines for the program, by their arrival; odometry first, as a replay has it."""
    data = [(int(r["t_ns"]), 0, f"moved {r['t_ns']} {r['v_mps']} {r['w_radps']}") for r in rows(folder / "motion.csv")]
    data += [(int(r["arrival_ns"]), 1, f"saw {r['t_ns']} {r['arrival_ns']} {r['id']} {r['bearing_rad']} {r['range_m']}")
             for r in rows(folder / "sightings.csv")]
    return "\n".join(line for *_, line in sorted(data, key=lambda row: row[:2])) + "\n"


def headers_compile():
    """Each header alone, by gcc and by clang where it is there, with all warnings."""
    includes = [f"-I{ROOT / room}" for room in ("msgs/include", "firmware/library/include")]
    for compiler, language, header, standards in (
            ("gcc", "c", "waymark.h", ("c99", "c11", "c17", "gnu17", "c2x")),
            ("g++", "c++", "waymark.h", ("c++11", "c++17", "c++20", "c++23")), ("g++", "c++", "waymark.hpp", ("c++17", "c++20", "c++23")),
            (CLANG, "c", "waymark.h", ("c99", "c11", "c17")), (CLANGXX, "c++", "waymark.h", ("c++11", "c++20")),
            (CLANGXX, "c++", "waymark.hpp", ("c++17", "c++20", "c++2b")), ("g++", "c++", "waymark.hpp", ("c++17 -fno-exceptions",))):
        for standard in standards if shutil.which(compiler) else ():
            subprocess.run([compiler, "-x", language, *f"-std={standard}".split(), "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror",
                            *includes, "-fsyntax-only", "-"], input=f"#include <waymark/{header}>\n", text=True, check=True)


def poses_of(name, library, work):
    """What the example prints, given the recording's rows."""
    source, compiler = EXAMPLES[name]
    program = work / f"robot-{name}"
    includes = [f"-I{ROOT / room}" for room in ("msgs/include", "firmware/library/include")]
    subprocess.run([*compiler, "-Wall", "-Wextra", "-Werror", *includes, source, library, f"-Wl,-rpath,{library.parent}", "-o", program],
                   check=True)
    usage = subprocess.run([program], capture_output=True, text=True, check=False)
    assert usage.returncode == 2 and "usage" in usage.stderr, usage
    wrong = subprocess.run([program, work / "none.yaml", work], input="", capture_output=True, text=True, check=False)
    assert wrong.returncode in (1, 2) and "none.yaml" in wrong.stderr, wrong
    done = subprocess.run([program, work / "robot.yaml", work / "recording"], input=in_order(work / "recording"), capture_output=True,
                          text=True, check=True)
    assert not done.stderr, done.stderr
    return [line.split() for line in done.stdout.splitlines()]


def main():
    library = BUILD / "lib/libwaymark.so"
    if not library.exists():
        print("skipped: this build has no libwaymark.so")
        return 77
    headers_compile()
    text = (ROOT / "docs/library.md").read_text()
    for source, _ in EXAMPLES.values():
        assert source.read_text() in text, f"docs/library.md does not have {source.name} word by word"
    with tempfile.TemporaryDirectory(prefix="waymark-library-") as name:
        work = pathlib.Path(name)
        with_twists(work / "recording")
        config = work / "robot.yaml"
        config.write_text("format: waymark-config/1\nestimator: landmark_ekf\n")
        subprocess.run([BUILD / "bin/waymark", "replay", work / "recording", "--config", config, "--out", work / "run"], check=True,
                       stdout=subprocess.DEVNULL)
        wanted = rows(work / "run/trajectory.csv")
        for language in EXAMPLES:
            got = poses_of(language, library, work)
            assert len(got) == len(wanted) > 5000, (language, len(got), len(wanted))
            for mine, row in zip(got, wanted):
                theirs = [float(row[name]) for name in ("x_m", "y_m", "cov_xx")]
                assert mine[0] == row["t_ns"] and [float(value) for value in mine[1:]] == theirs, (language, mine, row)
            print(f"{len(got)} poses of the program in {language} are those of the replay, bit by bit")
    return 0


if __name__ == "__main__":
    sys.exit(main())
