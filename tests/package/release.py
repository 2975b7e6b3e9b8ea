#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A release in a clone: versions, changelog, tag, source tarball, list of components and sums; and what is refused. Nothing is built."""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
NEXT = "99.0.0"


def run(*command, cwd):
    return subprocess.run([str(c) for c in command], cwd=cwd, capture_output=True, text=True)


def ok(*command, cwd):
    done = run(*command, cwd=cwd)
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout


def refused(clone, version, why):
    done = run("python3", "toolchain/release.py", "prepare", version, cwd=clone)
    assert done.returncode and why in done.stderr, f"{version}: {done.returncode} {done.stderr}"


def package(folder, depends):
    """A Debian package without content."""
    (folder / "p/DEBIAN").mkdir(parents=True)
    (folder / "p/DEBIAN/control").write_text(f"Package: waymark\nVersion: {NEXT}-1\nArchitecture: all\nMaintainer: a <a@b.c>\n"
                                             f"Depends: {depends}\nDescription: test\n")
    (folder / "out").mkdir()
    ok("dpkg-deb", "--root-owner-group", "-b", "p", f"out/waymark_{NEXT}-1_all.deb", cwd=folder)
    return folder / "out"


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        clone = folder / "clone"
        if run("git", "clone", "-q", ROOT, clone, cwd=folder).returncode or not shutil.which("dpkg-deb"):
            print("skipped: no git repository, or no dpkg-deb")
            sys.exit(77)
        ok("git", "config", "user.name", "test", cwd=clone)
        ok("git", "config", "user.email", "test@waymark.example", cwd=clone)
        refused(clone, "1.x", "is not a version")
        refused(clone, "0.0.1", "does not follow")
        (clone / "left").write_text("")
        refused(clone, NEXT, "has changes")
        (clone / "left").unlink()
        changelog = clone / "CHANGELOG.md"  # just after a release it has nothing unreleased
        changelog.write_text(changelog.read_text().replace("## [Unreleased]\n", "## [Unreleased]\n\n### Tests\n\nNew:\n- A line.\n", 1))
        ok("git", "commit", "-qam", "a change", cwd=clone)
        ok("python3", "toolchain/release.py", "prepare", NEXT, cwd=clone)
        assert ok("git", "tag", "--points-at", "HEAD", cwd=clone) == f"v{NEXT}\n"
        assert f"## [Unreleased]\n\n## [{NEXT}] - 2" in (clone / "CHANGELOG.md").read_text()
        for file in ("CMakeLists.txt", "tools/python/pyproject.toml", "toolchain/package/changelog", "docs/boards.md"):
            assert NEXT in (clone / file).read_text(), file
        assert "tagged already" in ok("python3", "toolchain/release.py", "prepare", NEXT, cwd=clone)
        refused(clone, "99.0.1", "has no line")
        out = package(folder, "libc6 (>= 2.36), libwaymark0")
        ok("python3", "toolchain/release.py", "artefacts", out, cwd=clone)
        ok("sha256sum", "--strict", "-c", "SHA256SUMS", cwd=out)
        assert len((out / "SHA256SUMS").read_text().splitlines()) == 3
        ok("tar", "xzf", f"waymark-{NEXT}.tar.gz", cwd=out)
        assert (out / f"waymark-{NEXT}/dev").exists()
        names = {c["name"] for c in json.loads((out / f"waymark-{NEXT}.cdx.json").read_text())["components"]}
        assert {"libc6", "numpy"} <= names and "libwaymark0" not in names, names
    print("release: tag, versions, tarball, components and sums as they should be")


main()
