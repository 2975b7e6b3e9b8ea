#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""An apt repository as a folder of plain files, for any web server or a USB stick:

    apt_repository.py OUT PACKAGE.deb...     writes OUT/pool, OUT/dists/SUITE and a file of sources for each suite; what is in OUT stays in it

A suite is a system: packages 1.0-1+debian13 are of the suite debian13 (waymark-debian13.sources), packages 1.0-1, Debian 12's, of stable (waymark.sources).
Signed where WAYMARK_SIGNING_KEY names a key in gpg's ring (fingerprint or address): Release.gpg, InRelease and the public key
OUT/waymark-archive-keyring.gpg. The same packages give the same files, but for the signatures; their time is SOURCE_DATE_EPOCH."""
import datetime
import gzip
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys

DEBIAN_12, COMPONENT = "stable", "main"
ARCHITECTURES = ("amd64", "arm64", "armhf")
KEYRING = "waymark-archive-keyring.gpg"


def run(*command, **how):
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, **how).stdout


def pool_of(package):
    """Debian's layout: pool/main/w/waymark, pool/main/libw/libwaymark0."""
    return f"pool/{COMPONENT}/{package[:4] if package.startswith('lib') else package[0]}/{package}"


def take(out, deb):
    """Copies a package into the pool. A file of that name with other content would be another package under the same version."""
    name = run("dpkg-deb", "-f", deb, "Package").decode().strip()
    to = out / pool_of(name) / deb.name
    to.parent.mkdir(parents=True, exist_ok=True)
    if to.exists() and to.read_bytes() != deb.read_bytes():
        sys.exit(f"apt_repository: {to} is there with other content: a changed package needs another version")
    shutil.copyfile(deb, to)


def paragraph(out, deb):
    data = deb.read_bytes()
    control = run("dpkg-deb", "-f", deb).decode().rstrip("\n")
    place = f"Filename: {deb.relative_to(out)}\nSize: {len(data)}\nSHA256: {hashlib.sha256(data).hexdigest()}"
    before, _, description = control.partition("\nDescription: ")
    return f"{before}\n{place}\nDescription: {description}\n"


def suite_of(deb):
    """waymark_1.0-1+debian13_amd64.deb: debian13."""
    return deb.stem.split("_")[1].partition("+")[2] or DEBIAN_12


def write_indices(out, suite, debs):
    files = []
    for architecture in ARCHITECTURES:
        mine = [deb for deb in debs if deb.stem.rsplit("_", 1)[1] in (architecture, "all")]
        folder = out / f"dists/{suite}/{COMPONENT}/binary-{architecture}"
        folder.mkdir(parents=True, exist_ok=True)
        text = "\n".join(paragraph(out, deb) for deb in mine).encode()
        (folder / "Packages").write_bytes(text)
        (folder / "Packages.gz").write_bytes(gzip.compress(text, 9, mtime=0))
        files += [folder / "Packages", folder / "Packages.gz"]
    return files


def write_release(dist, files):
    date = datetime.datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), datetime.timezone.utc)
    lines = [f"Origin: Waymark\nLabel: Waymark\nSuite: {dist.name}\nCodename: {dist.name}\nDate: {date:%a, %d %b %Y %H:%M:%S} UTC",
             f"Architectures: {' '.join(ARCHITECTURES)}\nComponents: {COMPONENT}\nDescription: Localization of robots\nSHA256:"]
    lines += [f" {hashlib.sha256(file.read_bytes()).hexdigest()} {file.stat().st_size} {file.relative_to(dist)}" for file in files]
    (dist / "Release").write_text("\n".join(lines) + "\n")


def sign(out, dist, key):
    gpg = ["gpg", "--batch", "--yes", "--local-user", key, "--digest-algo", "SHA512"]
    run(*gpg, "--armor", "--detach-sign", "--output", dist / "Release.gpg", dist / "Release")
    run(*gpg, "--clearsign", "--output", dist / "InRelease", dist / "Release")
    (out / KEYRING).write_bytes(run("gpg", "--batch", "--export", key))


def write_suite(out, suite, debs, key):
    dist = out / "dists" / suite
    for signed in ("Release.gpg", "InRelease"):  # of what the repository was before
        (dist / signed).unlink(missing_ok=True)
    write_release(dist, write_indices(out, suite, debs))
    name = "waymark" if suite == DEBIAN_12 else f"waymark-{suite}"
    (out / f"{name}.sources").write_text(f"Types: deb\nURIs: https://CHANGE-ME/waymark\nSuites: {suite}\nComponents: {COMPONENT}\n"
                                         f"Signed-By: /usr/share/keyrings/{KEYRING}\n")
    if key:
        try:
            sign(out, dist, key)
        except subprocess.CalledProcessError as failed:
            sys.exit(f"apt_repository: gpg can't sign as '{key}': {failed.stderr.decode().strip().splitlines()[-1]}")


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    out, key = pathlib.Path(sys.argv[1]).resolve(), os.environ.get("WAYMARK_SIGNING_KEY")
    os.environ.setdefault("SOURCE_DATE_EPOCH", run(pathlib.Path(__file__).with_name("source_date.sh")).decode().strip())
    for deb in sys.argv[2:]:
        take(out, pathlib.Path(deb))
    debs = sorted(out.glob("pool/**/*.deb"))
    for suite in sorted({suite_of(deb) for deb in debs}):
        write_suite(out, suite, [deb for deb in debs if suite_of(deb) == suite], key)
    print(f"{out}: {len(debs)} packages, "
          + ("signed" if key else "not signed: apt refuses it; WAYMARK_SIGNING_KEY=FINGERPRINT names a key of gpg's ring"))


if __name__ == "__main__":
    main()
