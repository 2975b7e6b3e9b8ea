#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""portable.py WAYMARK [OTHER]: the portable daemon needs nothing of an image: no dynamic linker, no shared library, no symbol
of any glibc, no kernel newer than 4.9; it runs (under qemu-user where it is another architecture's). With OTHER, the usual
daemon of this computer, its replay gives the same bits, also where system calls newer than 4.9 are refused."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

OLD_KERNEL = pathlib.Path(os.environ.get("WM_BIN_DIR", "build/bin")).parent / "tests/old_kernel"
QEMU = {"AArch64": "qemu-aarch64", "ARM": "qemu-arm"}


def readelf(option, path):
    return subprocess.run(["readelf", "-W", option, path], capture_output=True, text=True, check=True).stdout


def offences(path):
    if "INTERP" in readelf("-l", path):
        yield "asks for a dynamic linker"
    for library in re.findall(r"\(NEEDED\).*\[(.*)\]", readelf("-d", path)):
        yield f"needs {library}"
    # A symbol of another version would say so, as name@GLIBC_2.34.
    for symbol in set(re.findall(r"\S+@GLIBC\S*", readelf("--dyn-syms", path))):
        yield f"needs {symbol}"
    kernel = re.search(r"OS: Linux, ABI: (\d+)\.(\d+)", readelf("-n", path))
    if not kernel or tuple(map(int, kernel.groups())) > (4, 9):
        yield f"is for another kernel: {kernel and kernel.group(0)}"


def runner(path):
    machine = re.search(r"Machine:\s+(\S+)", readelf("-h", path)).group(1)
    return [QEMU[machine], "-L", "/nowhere"] if machine in QEMU else []


def write_recording(folder):
    folder.mkdir()
    (folder / "recording.yaml").write_text(
        "format: waymark-recording/1\nname: bends\nduration_s: 4\nstreams: [motion.csv]\n"
        "vehicle: {initial_pose: {t_ns: 0, x_m: 0, y_m: 0, heading_rad: 0}}\n")
    (folder / "motion.csv").write_text(
        "t_ns,v_mps,w_radps\n" + "".join(f"{i * 20_000_000},{0.5 + i * 0.001:.3f},{0.3 - i * 0.002:.3f}\n" for i in range(200)))


def same_bits(path, other):
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        write_recording(work / "rec")
        (work / "config.yaml").write_text("format: waymark-config/1\nestimator: odometry\npublish: {lcm: false}\n")
        said = []
        ways = {"usual": [other], "portable": [*runner(path), path]}
        if OLD_KERNEL.exists():  # an emulator's own calls are this computer's, and are refused, too
            ways["portable, old kernel"] = [OLD_KERNEL, *runner(path), path]
        for name, command in ways.items():
            out = work / name
            subprocess.run([*command, "replay", work / "rec", "--config", work / "config.yaml", "--out", out],
                           check=True, capture_output=True)
            said.append((out / "trajectory.csv").read_bytes())
        assert len(said[0]) > 1000 and all(text == said[0] for text in said), "trajectories differ"
        print(f"the same {len(said[0])} bytes of trajectory: {', '.join(ways)}")


def main():
    path = pathlib.Path(sys.argv[1]).resolve()
    if not path.exists():
        print(f"skipped: {path} isn't there (./dev board native portable makes it)")
        return 77
    found = list(offences(path))
    for offence in found:
        print(f"{path.name} {offence}")
    if found:
        return 1
    if runner(path) and not shutil.which(runner(path)[0]):
        print("skipped the run: there is no qemu-user")
        return 0
    said = subprocess.run([*runner(path), path, "--version"], capture_output=True, text=True, check=True).stdout
    print(f"{said.strip()}: static, {path.stat().st_size / 1e6:.1f} MB with debug information")
    if len(sys.argv) > 2:
        same_bits(path, sys.argv[2])
    return 0


if __name__ == "__main__":
    sys.exit(main())
