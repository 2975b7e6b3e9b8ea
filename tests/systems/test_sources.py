#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""sources.py against an archive on this computer: the newest version that is whole is taken, with its patches; one without packaging
is named; a wrong sum and a stranger's signature are refused. Skipped (77) without gpg, gpgv or patch."""
import functools
import hashlib
import http.server
import lzma
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading

FETCH = pathlib.Path(__file__).with_name("sources.py")
PATCH = "--- a/value\n+++ b/value\n@@ -1 +1 @@\n-upstream\n+patched\n"


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def run(*command, **how):
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, **how).stdout


def tarball(folder, name, files):
    tree = folder / "tree"
    for path, text in files.items():
        (tree / path).parent.mkdir(parents=True, exist_ok=True)
        (tree / path).write_text(text)
    run("tar", "-C", tree, "-cJf", folder / name, *[p.name for p in tree.iterdir()])
    shutil.rmtree(tree)


def stanza(pool, package, version, names):
    sums = "".join(f" {hashlib.sha256((pool / n).read_bytes()).hexdigest()} {(pool / n).stat().st_size} {n}\n" for n in names)
    return f"Package: {package}\nVersion: {version}\nDirectory: pool\nChecksums-Sha256:\n{sums}"


def sign(archive, suite, text, env):
    folder = archive / "dists" / suite
    (folder / "main/source").mkdir(parents=True, exist_ok=True)
    data = lzma.compress(text.encode())
    (folder / "main/source/Sources.xz").write_bytes(data)
    (folder / "Release").write_text(f"SHA256:\n {hashlib.sha256(data).hexdigest()} {len(data)} main/source/Sources.xz\n")
    run("gpg", "--batch", "--yes", "--clearsign", "-o", folder / "InRelease", folder / "Release", env=env)


def key(home):
    home.mkdir(mode=0o700)
    env = {**os.environ, "GNUPGHOME": str(home)}
    run("gpg", "--batch", "--passphrase", "", "--quick-generate-key", "a@test.example", "ed25519", "sign", "never", env=env)
    (home / "ring.gpg").write_bytes(run("gpg", "--batch", "--export", env=env))
    return env


def make_archive(archive, env):
    """good 2 lacks its packaging, good 1 is whole; of bare there is upstream alone."""
    pool = archive / "pool"
    pool.mkdir(parents=True)
    for name in ("good_1", "good_2", "bare_1"):
        tarball(pool, f"{name}.orig.tar.xz", {"top/value": "upstream\n"})
        tarball(pool, f"{name}-1.debian.tar.xz", {"debian/patches/series": "# none\nfix.patch\n", "debian/patches/fix.patch": PATCH})
    text = {n: stanza(pool, n[:-2], n[-1] + "-1", [f"{n}.orig.tar.xz", f"{n}-1.debian.tar.xz"]) for n in ("good_1", "good_2", "bare_1")}
    for name in ("good_2", "bare_1"):
        (pool / f"{name}-1.debian.tar.xz").unlink()
    sign(archive, "suite", text["good_1"] + "\n" + text["bare_1"], env)
    sign(archive, "suite-updates", text["good_2"], env)


def fetch(address, ring, out, *packages):
    return subprocess.run([sys.executable, FETCH, ring, address, "suite", out, *packages], capture_output=True, text=True, check=False)


def check(folder, address):
    mine, stranger = folder / "mine/ring.gpg", folder / "stranger/ring.gpg"
    done = fetch(address, mine, folder / "out", "good", "bare")
    assert done.returncode == 0, done.stderr
    assert (folder / "out/good/value").read_text() == "patched\n" and (folder / "out/bare/value").read_text() == "upstream\n"
    lines = (folder / "out/versions").read_text().splitlines()
    assert lines[0] == "good 1-1" and lines[1].startswith("bare 1-1 without its packaging's patches"), lines

    (folder / "out/files/good_1.orig.tar.xz").write_bytes(b"what was kept is damaged")
    assert fetch(address, mine, folder / "out", "good").returncode == 0
    done = fetch(address, stranger, folder / "refused", "good")
    assert done.returncode and "no key of" in done.stderr, done
    done = fetch(address, mine, folder / "refused", "unknown")
    assert done.returncode and "no version of unknown can be had" in done.stderr, done
    kept = folder / "archive/pool/good_1.orig.tar.xz"
    kept.write_bytes(kept.read_bytes() + b"x")
    done = fetch(address, mine, folder / "refused", "good")
    assert done.returncode and "another SHA-256" in done.stderr, done
    assert not (folder / "refused/good").exists()


def main():
    if not all(map(shutil.which, ("gpg", "gpgv", "patch"))):
        print("skipped: no gpg, gpgv or patch here")
        return 77
    with tempfile.TemporaryDirectory(prefix="waymark-sources-") as name:
        folder = pathlib.Path(name)
        make_archive(folder / "archive", key(folder / "mine"))
        key(folder / "stranger")
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder / "archive"))
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            check(folder, f"http://127.0.0.1:{server.server_address[1]}")
        finally:
            server.shutdown()
            for home in ("mine", "stranger"):  # its agent would outlive this test
                subprocess.run(["gpgconf", "--homedir", folder / home, "--kill", "all"], check=False)
    print("whole versions with their patches; missing packaging is named; wrong sums and signatures are refused")
    return 0


if __name__ == "__main__":
    sys.exit(main())
