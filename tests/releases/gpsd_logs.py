#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""gpsd's own regression logs through our reader of its reports: each field of each report is what a JSON reader has, a missing one is absent, and no
line is a fault. Prints how many reports have which mode, status and fields.

    gpsd_logs.py [FOLDER...]     (folders of gpsd's source; by default Debian's, 12 to unstable, by apt-get source)

Exit code 1: a field differs. 77: no source can be had."""
import collections
import datetime
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
SUITES = ("bookworm", "trixie", "sid")
FIELDS = "mode status lat lon altHAE alt epx epy eph epv speed track eps epd heading".split()
KINDS = {"TPV": 1, "GST": 2, "ATT": 3, "DEVICE": 4, "ERROR": 5}
READS = ["drivers/gnss/gpsd_report.c", "drivers/yaml/*.c", "msgs/src/status.c"]


def source(suite, work):
    """The folder of a suite's gpsd; None where it can't be had."""
    sources = pathlib.Path("/etc/apt/sources.list.d/debian.sources")
    archive = next((line.split()[1] for line in sources.read_text().splitlines() if line.startswith("URIs")), None) if sources.is_file() else None
    if archive is None:
        return None
    folder = work / suite
    (folder / "lists/partial").mkdir(parents=True)
    (folder / "debian.list").write_text(f"deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] {archive} {suite} main\n")
    apt = ["apt-get", "-qq", "-o", f"Dir::Etc::sourcelist={folder}/debian.list", "-o", "Dir::Etc::sourceparts=-", "-o", f"Dir::State::lists={folder}/lists",
           "-o", "APT::Sandbox::User=root"]
    for words in (["update"], ["source", "--download-only", "gpsd"]):
        if subprocess.run([*apt, *words], cwd=folder, capture_output=True, check=False).returncode:
            return None
    archive = next((path for path in folder.glob("gpsd_*.orig.tar.*") if path.suffix != ".asc"), None)
    if archive is None or subprocess.run(["tar", "xf", archive], cwd=folder, check=False).returncode:
        return None
    return next(folder.glob("gpsd-*"), None)


def differs(report, line):
    """What our reader has otherwise than the JSON of a report; empty: nothing."""
    if line.startswith("!"):
        return line
    kind, time_ns, *numbers = line.split()
    wanted = KINDS.get(report.get("class"), 0)
    if int(kind) != wanted:
        return f"class {kind}"
    for name, text in zip(FIELDS, numbers) if wanted else ():
        value = report.get(name)
        if not (math.isnan(float(text)) if value is None or isinstance(value, str) else float(text) == value):
            return f"{name} {text}"
    if wanted and report.get("time"):
        stamp = datetime.datetime.fromisoformat(report["time"].replace("Z", "+00:00"))
        if abs(int(time_ns) * 1e-9 - stamp.timestamp()) > 1e-3:
            return f"time {time_ns}"
    return ""


def judge(folder, program):
    """How many reports of a gpsd's logs there are, and how many differ."""
    seen, wrong, count = collections.Counter(), 0, 0
    for path in sorted((folder / "test/daemon").glob("*.log.chk")):
        lines = [line for line in path.read_bytes().split(b"\n") if line.startswith(b"{")]
        read = subprocess.run([program], input=b"".join(line + b"\n" for line in lines), capture_output=True, check=True).stdout.decode().splitlines()
        for line, ours in zip(lines, read, strict=True):
            report, count = json.loads(line.decode(errors="replace")), count + 1
            if said := differs(report, ours):
                wrong += 1
                print(f"{path.name}: {said}: {line[:200].decode(errors='replace')}")
            if report.get("class") == "TPV":
                lacks = [name for name, keys in (("place", ("lat", "lon")), ("altHAE", ("altHAE",)), ("accuracy", ("epx", "eph")), ("time", ("time",)))
                         if not any(key in report for key in keys)]
                seen[report.get("mode"), report.get("status", "none"), ", ".join(lacks) or "nothing"] += 1
    print(f"== {folder.name}: {count} reports, {wrong} differ")
    print("| mode | status | lacks | reports |\n| --- | --- | --- | --- |")
    for (mode, status, lacks), number in sorted(seen.items(), key=str):
        print(f"| {mode} | {status} | {lacks} | {number} |")
    return wrong


def main():
    with tempfile.TemporaryDirectory(prefix="waymark-gpsd-") as work:
        work = pathlib.Path(work)
        folders = [pathlib.Path(name) for name in sys.argv[1:]] or [folder for suite in SUITES if (folder := source(suite, work))]
        if not folders:
            print("skipped: gpsd's source can't be had")
            return 77
        files = [path for pattern in READS for path in ROOT.glob(pattern)]
        include = [f"-I{ROOT / name}" for name in ("drivers/gnss", "drivers/include", "msgs/include")]
        subprocess.run([os.environ.get("CC", "gcc"), "-O1", "-D_GNU_SOURCE", "-o", work / "lines", ROOT / "tests/releases/gpsd_logs.c", *files, *include, "-lyaml", "-lm"],
                       check=True)
        return int(sum(judge(folder, work / "lines") for folder in folders) > 0)


if __name__ == "__main__":
    sys.exit(main())
