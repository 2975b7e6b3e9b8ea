#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A release, by ./dev release. release.py prepare VERSION: sets the version in its files, gives the changelog's top section its name
and date, commits and tags. release.py artefacts OUT: adds source tarball, list of components (CycloneDX) and sums to the packages there."""
import datetime
import json
import os
import pathlib
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[1]
# Compiled into the programs, so that no package depends on them.
COMPILED_IN = ["libeigen3-dev", "libcli11-dev", "nlohmann-json3-dev"]
MAINTAINERS = "Waymark maintainers <maintainers@waymark.example>"


def git(*command):
    return subprocess.run(["git", "-C", str(ROOT), *command], check=True, capture_output=True, text=True).stdout.strip()


def current():
    return re.search(r"^project\(waymark VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE).group(1)


def numbers(version):
    return tuple(int(n) for n in version.split("."))


def replace(path, old, new):
    text = (ROOT / path).read_text()
    if old not in text:
        sys.exit(f"release: {path} does not have '{old}'")
    (ROOT / path).write_text(text.replace(old, new))


def prepare(version):
    if not re.fullmatch(r"\d+\.\d+\.\d+", version):
        sys.exit(f"release: '{version}' is not a version; 0.2.0 is")
    tag, old = f"v{version}", current()
    if git("status", "--porcelain"):
        sys.exit("release: the checkout has changes; commit or remove them first")
    if git("tag", "--list", tag):
        if git("rev-parse", f"{tag}^{{commit}}") != git("rev-parse", "HEAD"):
            sys.exit(f"release: the tag {tag} is at another commit; git checkout {tag}, or take the next version")
        return print(f"{tag} is tagged already")
    if numbers(version) <= numbers(old):
        sys.exit(f"release: {version} does not follow {old}")
    section = re.search(r"^## \[Unreleased\]\n(.*?)(?=^## \[|\Z)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE | re.DOTALL)
    if not section or "\n- " not in section.group(1):
        sys.exit("release: the section [Unreleased] of CHANGELOG.md has no line")
    now = datetime.datetime.now(datetime.timezone.utc)
    replace("CMakeLists.txt", f"project(waymark VERSION {old} ", f"project(waymark VERSION {version} ")
    replace("tools/python/pyproject.toml", f'\nversion = "{old}"', f'\nversion = "{version}"')
    replace("docs/boards.md", f"waymark_{old}-1_arm64.deb", f"waymark_{version}-1_arm64.deb")
    replace("CHANGELOG.md", "## [Unreleased]\n", f"## [Unreleased]\n\n## [{version}] - {now:%Y-%m-%d}\n")
    log = ROOT / "toolchain/package/changelog"
    log.write_text(f"waymark ({version}-1) bookworm; urgency=medium\n\n  * Version {version}. What changed for users is in changelog.gz.\n\n"
                   f" -- {MAINTAINERS}  {now:%a, %d %b %Y %H:%M:%S} +0000\n\n" + log.read_text())
    git("commit", "-qam", f"release {version}")
    git("tag", "-a", tag, "-m", f"Waymark {version}")
    print(f"{tag} is tagged: git push --follow-tags publishes it")


def debian(package):
    """Name and version of an installed package of Debian; None for a name that is none."""
    found = subprocess.run(["dpkg-query", "-W", "-f=${Version}", package], capture_output=True, text=True)
    return {"type": "library", "name": package, "version": found.stdout, "purl": f"pkg:deb/debian/{package}@{found.stdout}"} if found.stdout else None


def components(out):
    """What the artefacts have in them or need."""
    names = set(COMPILED_IN)
    for package in out.glob("*.deb"):
        fields = subprocess.run(["dpkg-deb", "-f", str(package), "Depends"], check=True, capture_output=True, text=True).stdout
        names.update(re.findall(r"(?:^|[,|])\s*([a-z0-9][a-z0-9.+-]+)", fields))
    found = [debian(name) for name in sorted(names) if not re.match(r"(lib)?waymark", name)]
    project = tomllib.loads((ROOT / "tools/python/pyproject.toml").read_text())["project"]
    python = [re.match(r"([\w-]+)(.*)", d).groups() for d in project["dependencies"]]
    return [c for c in found if c] + [{"type": "library", "name": n, "version": v, "purl": f"pkg:pypi/{n}"} for n, v in python]


def artefacts(out):
    version = current()
    name = f"waymark-{version}"
    out.mkdir(parents=True, exist_ok=True)
    tar = subprocess.run(["git", "-C", str(ROOT), "archive", f"--prefix={name}/", "HEAD"], check=True, capture_output=True).stdout
    (out / f"{name}.tar.gz").write_bytes(subprocess.run(["gzip", "-9n"], input=tar, check=True, capture_output=True).stdout)
    bill = {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
            "metadata": {"timestamp": git("log", "-1", "--format=%cI"),
                         "component": {"type": "application", "name": "waymark", "version": version, "licenses": [{"license": {"id": "Apache-2.0"}}]}},
            "components": components(out)}
    (out / f"{name}.cdx.json").write_text(json.dumps(bill, indent=1) + "\n")
    files = sorted(p.name for p in out.iterdir() if p.is_file() and p.name != "SHA256SUMS")
    sums = subprocess.run(["sha256sum", *files], cwd=out, check=True, capture_output=True, text=True).stdout
    (out / "SHA256SUMS").write_text(sums)
    print("\n".join(f"{out / f}  {os.path.getsize(out / f) / 1e6:.1f} MB" for f in [*files, "SHA256SUMS"]))


def main():
    command, argument = (sys.argv[1:] + ["", ""])[:2]
    if len(sys.argv) != 3 or command not in ("prepare", "artefacts"):
        sys.exit(__doc__)
    prepare(argument) if command == "prepare" else artefacts(pathlib.Path(argument).resolve())


if __name__ == "__main__":
    main()
