#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What the packages say they need (cmake/WaymarkPackages.cmake) against what is linked: for each library of each program the
package that has it is named, and no other. depends.py BUILD. Versions against dpkg-shlibdeps. Skipped (77) where dpkg-dev
is missing, as on other distributions."""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv[1]).resolve()


def declared(component):
    """{package: least version} of one component, from CPack's own file."""
    text = (BUILD / "CPackConfig.cmake").read_text()
    said = re.search(rf'set\(CPACK_DEBIAN_{component}_PACKAGE_DEPENDS "(.*)"\)', text).group(1)
    return {item.split(" ")[0]: (re.search(r"\([>=]+ (.*)\)", item) or ["", "0"])[1] for item in said.split(", ")}


def needed(programs):
    """The same by dpkg-shlibdeps."""
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "debian").mkdir()
        (pathlib.Path(folder) / "debian/control").write_text("Source: waymark\n\nPackage: waymark\nArchitecture: any\n")
        done = subprocess.run(["dpkg-shlibdeps", "-O", *programs], cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"dpkg-shlibdeps: {done.stderr}")
    items = done.stdout.strip().removeprefix("shlibs:Depends=").split(", ")
    return {item.split(" ")[0]: (re.search(r"\(>= (.*)\)", item) or ["", "0"])[1] for item in items}


def of_service():
    """Packages with the programs that the unit starts beside waymark's own; all but essential ones have to be declared."""
    unit = (ROOT / "config/waymark.service").read_text()
    programs = {path for path in re.findall(r"^Exec\w+=[-+@!:]*(/\S+)", unit, re.MULTILINE) if not path.startswith("/usr/bin/waymark")}
    owners = {subprocess.run(["dpkg", "-S", path], capture_output=True, text=True, check=True).stdout.split(":")[0] for path in programs}
    return {p: "0" for p in owners
            if subprocess.run(["dpkg-query", "-W", "-f=${Essential}", p], capture_output=True, text=True, check=True).stdout != "yes"}


def older(a, b):
    return subprocess.run(["dpkg", "--compare-versions", a, "lt", b]).returncode == 0


def main():
    if not shutil.which("dpkg-shlibdeps"):
        print("skipped: there is no dpkg-shlibdeps")
        return 77
    offences = 0
    page, player, camera = BUILD / "bin/waymark-web", BUILD / "bin/waymark-play", BUILD / "lib/waymark/waymark-camera"
    calibrate, simulate = BUILD / "bin/waymark-calibrate", BUILD / "bin/waymark-simulate"
    bridge, library = BUILD / "bin/waymark-ros2", BUILD / "lib/libwaymark.so.0"
    tools = sorted(p for p in (BUILD / "bin").glob("waymark-*") if "montecarlo" not in p.name and p not in (page, player, bridge, calibrate, simulate) and p.open("rb").read(2) != b"#!")
    components = [("RUNTIME", [BUILD / "bin/waymark", player, *(p for p in (page, camera) if p.exists())]), ("TOOLS", tools), ("CALIBRATE", [calibrate])]
    components += [(name, [program]) for name, program in (("SIM", simulate), ("GST", BUILD / "lib/waymark/waymark-gst"), ("ROS2", bridge), ("LIBRARY", library)) if program.exists()]
    for component, programs in components:
        says, needs = declared(component), needed(programs)
        if component == "RUNTIME":
            needs |= of_service()
        says.pop("waymark", None)
        for package, version in needs.items():
            if package not in says:
                print(f"{component}: {package} (>= {version}) is linked or started and not declared")
                offences += 1
            elif older(says[package], version):
                print(f"{component}: {package} (>= {says[package]}) is declared, {version} is needed")
                offences += 1
        for package in says.keys() - needs.keys():
            print(f"{component}: {package} is declared, not linked and not started")
            offences += 1
        print(f"{component}: {len(needs)} packages: {', '.join(sorted(needs))}")
    return 1 if offences else 0


if __name__ == "__main__":
    sys.exit(main())
