#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Source packages of a suite of Ubuntu or Debian, fetched, checked and unpacked with the patches of their packaging.

    sources.py [--components main,universe] [--also ARCHIVE]... KEYRING ARCHIVE SUITE OUT PACKAGE...

A file's SHA-256 is in the suite's Sources, whose own is in its InRelease, which a key of KEYRING has signed. OUT/PACKAGE
gets the newest version of SUITE-updates and SUITE whose files can all be had. Where no version's packaging can, it gets the
newest upstream release without patches. OUT/versions has a line for each, which says so. --also: where a file is looked for
if ARCHIVE lacks it; its sum is still that of the suite."""
import argparse
import hashlib
import lzma
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.error
import urllib.request

SUMS = re.compile(r"^ ([0-9a-f]{64}) +\d+ (\S+)$", re.M)


def get(url, sha256):
    """The bytes at `url`, or None if it has none. Another sum than `sha256` is an error."""
    try:
        with urllib.request.urlopen(url, timeout=120) as answer:
            data = answer.read()
    except urllib.error.HTTPError as answer:
        if answer.code == 404:
            return None
        raise SystemExit(f"sources.py: {url}: {answer}") from None
    except urllib.error.URLError as failed:
        raise SystemExit(f"sources.py: {url} can't be reached: {failed.reason}") from None
    if sha256 and hashlib.sha256(data).hexdigest() != sha256:
        raise SystemExit(f"sources.py: {url} has another SHA-256 than its index states. An archive that is amid an update? Try later.")
    return data


def signed_index(args, suite):
    """The stanzas of Sources of all components."""
    release = get(f"{args.archive}/dists/{suite}/InRelease", None)
    if release is None:
        raise SystemExit(f"sources.py: {args.archive} has no suite {suite}")
    with tempfile.NamedTemporaryFile() as signed:
        signed.write(release)
        signed.flush()
        checked = subprocess.run(["gpgv", "-q", "--keyring", args.keyring.resolve(), "--output", "-", signed.name], check=False, capture_output=True)
    if checked.returncode:
        raise SystemExit(f"sources.py: no key of {args.keyring} has signed {suite}'s InRelease: {checked.stderr.decode().strip()}")
    sums = {path: digest for digest, path in SUMS.findall(checked.stdout.decode())}
    for component in args.components.split(","):
        path = f"{component}/source/Sources.xz"
        index = get(f"{args.archive}/dists/{suite}/{path}", sums[path])
        if index is None:
            raise SystemExit(f"sources.py: {args.archive} does not have {suite}'s {path}")
        yield from lzma.decompress(index).decode().split("\n\n")


def field(stanza, name):
    return re.search(rf"^{name}: (.*)$", stanza, re.M)[1]


def fetch(args, stanza, name, sha256):
    kept = args.out / "files" / name
    if not kept.exists() or hashlib.sha256(kept.read_bytes()).hexdigest() != sha256:
        folder = field(stanza, "Directory")
        places = [f"{args.archive}/{folder}", *(f"{also}/{re.sub('^pool/universe', 'pool/main', folder)}" for also in args.also)]
        tried = (get(f"{place}/{name}", sha256) for place in places)
        data = next((found for found in tried if found is not None), None)
        if data is None:
            return None
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(data)
    return kept


def unpack(to, upstream, packaging):
    """Upstream's tarballs, then debian/ and its series of patches."""
    shutil.rmtree(to, ignore_errors=True)
    for tarball in upstream:
        part = re.search(r"\.orig-([\w-]+)\.tar", tarball.name)
        folder = to / part[1] if part else to
        folder.mkdir(parents=True, exist_ok=True)
        subprocess.run(["tar", "-xf", tarball, "-C", folder, "--strip-components=1"], check=True)
    if packaging:
        subprocess.run(["tar", "-xf", packaging, "-C", to], check=True)
        series = to / "debian/patches/series"
        for line in series.read_text().splitlines() if series.exists() else []:
            if line.split("#")[0].strip():
                subprocess.run(["patch", "-s", "-p1", "-d", to, "-i", series.parent.resolve() / line.split()[0]], check=True)


def take(args, package, stanzas):
    """Unpacks `package`; a line for the log: its version, and what is missing."""
    upstream = {}
    for stanza in stanzas:  # newest first
        names = {name: digest for digest, name in SUMS.findall(stanza)}
        packaging = next(name for name in names if ".debian.tar." in name or name.endswith(".diff.gz"))
        origs = [name for name in names if re.search(r"\.orig(-[\w-]+)?\.tar\.\w+$", name)]
        got = [fetch(args, stanza, name, names[name]) for name in sorted(origs)]
        if None in got:
            continue
        upstream.setdefault(field(stanza, "Version"), got)
        patches = None if packaging.endswith(".diff.gz") else fetch(args, stanza, packaging, names[packaging])
        if patches:
            unpack(args.out / package, got, patches)
            return f"{package} {field(stanza, 'Version')}"
    if not upstream:
        raise SystemExit(f"sources.py: no version of {package} can be had from {args.archive}")
    version, got = next(iter(upstream.items()))
    unpack(args.out / package, got, None)
    return f"{package} {version} without its packaging's patches, which the archive does not give"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--components", default="main", help="of the suite, with commas")
    parser.add_argument("--also", action="append", default=[], help="another archive that may have a file")
    parser.add_argument("keyring", type=pathlib.Path)
    parser.add_argument("archive")
    parser.add_argument("suite")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("packages", nargs="+")
    args = parser.parse_args()
    found = {package: [] for package in args.packages}
    for suite in (args.suite + "-updates", args.suite):
        for stanza in signed_index(args, suite):
            name = re.match(r"Package: (.*)", stanza.lstrip())
            if name and name[1] in found:
                found[name[1]].append(stanza)
    lines = []
    for package, stanzas in found.items():
        lines.append(take(args, package, stanzas))
        print(lines[-1], file=sys.stderr, flush=True)
    (args.out / "versions").write_text("".join(line + "\n" for line in lines))


if __name__ == "__main__":
    main()
