#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What packages depend on beside libraries, which cmake/staged.cmake finds when they are made: depends.py BUILD.

  1. every program that the robot's unit starts is of a package that is declared (cmake/WaymarkPackages.cmake), and no other is;
  2. the robot's programs load no library of the desk's: those bring a hundred packages.
Skipped (77) where dpkg is missing, as on other distributions."""
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv[1]).resolve()
DESK = re.compile(r"lib(opencv|ceres|glog|avcodec|avformat|embree|hpdf|tinyxml2|ddsc|gst|glib)")


def declared():
    """Packages that the robot's depends on, from CPack's own file."""
    text = (BUILD / "CPackConfig.cmake").read_text()
    return set(re.search(r'set\(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "(.*)"\)', text).group(1).split(", "))


def of_service():
    """Packages with the programs that the unit starts beside waymark's own; all but essential ones have to be declared."""
    unit = (ROOT / "config/waymark.service").read_text()
    programs = {path for path in re.findall(r"^Exec\w+=[-+@!:]*(/\S+)", unit, re.MULTILINE) if not path.startswith("/usr/bin/waymark")}
    owners = {subprocess.run(["dpkg", "-S", path], capture_output=True, text=True, check=True).stdout.split(":")[0] for path in programs}
    return {p for p in owners
            if subprocess.run(["dpkg-query", "-W", "-f=${Essential}", p], capture_output=True, text=True, check=True).stdout != "yes"}


def main():
    if not shutil.which("dpkg-query"):
        print("skipped: there is no dpkg")
        return 77
    print(f"the unit starts programs of {sorted(of_service())}")
    assert declared() == of_service(), f"declared: {declared()}"
    programs = [BUILD / p for p in ("bin/waymark", "bin/waymark-play", "bin/waymark-web", "lib/waymark/waymark-camera", "lib/libwaymark.so.0")]
    for program in (p for p in programs if p.exists()):
        loaded = re.findall(r"NEEDED +(\S+)", subprocess.run(["objdump", "-p", program], capture_output=True, text=True, check=True).stdout)
        heavy = [name for name in loaded if DESK.match(name)]
        assert loaded and not heavy, f"{program.name} loads {heavy or 'nothing'}"
        print(f"{program.name}: {len(loaded)} libraries")
    return 0


if __name__ == "__main__":
    sys.exit(main())
