#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The apt repository of toolchain/apt_repository.py as apt sees it, from a folder: it takes the index and a package where the signature
is right, and refuses a changed index, a changed package, another key and a repository without a signature. apt has a root of its
own here: this computer's is not touched. Skipped (77) without apt, dpkg-deb or gpg."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
WRITER = ROOT / "toolchain/apt_repository.py"


def run(*command, check=True, **how):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **how)
    assert not check or done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done


def package(folder, name, version, architecture="all", text=""):
    tree = folder / f"{name}-{version}"
    (tree / "DEBIAN").mkdir(parents=True)
    (tree / "DEBIAN/control").write_text(f"Package: {name}\nVersion: {version}\nArchitecture: {architecture}\nMaintainer: a <a@b.c>\n"
                                         f"Description: test\n {text or 'Nothing'}.\n")
    deb = folder / f"{name}_{version}_{architecture}.deb"
    run("dpkg-deb", "--root-owner-group", "-b", tree, deb)
    shutil.rmtree(tree)
    return deb


class Apt:
    """apt with a root and a list of sources of its own."""

    def __init__(self, folder, repository, keyring, suite="stable"):
        self.root = folder
        for name in ("etc/apt/sources.list.d", "etc/apt/preferences.d", "etc/apt/apt.conf.d", "etc/apt/trusted.gpg.d", "lists/partial",
                     "cache/archives/partial", "dpkg"):
            (folder / name).mkdir(parents=True)
        (folder / "dpkg/status").write_text("")
        (folder / "etc/apt/sources.list.d/waymark.sources").write_text(
            f"Types: deb\nURIs: file:{repository}\nSuites: {suite}\nComponents: main\nSigned-By: {keyring}\n")
        (folder / "apt.conf").write_text(
            f'Dir::Etc "{folder}/etc/apt";\nDir::State::Lists "{folder}/lists";\nDir::State::status "{folder}/dpkg/status";\n'
            f'Dir::Cache "{folder}/cache";\nAPT::Architecture "amd64";\nAPT::Architectures {{"amd64";}};\nAPT::Sandbox::User "root";\n'
            'Acquire::Languages "none";\n')

    def __call__(self, *command, check=True):
        return run("apt-get", *command, check=check, cwd=self.root, env={**os.environ, "APT_CONFIG": str(self.root / "apt.conf"), "LC_ALL": "C"})


def key_of(home, name):
    home.mkdir(mode=0o700)
    env = {**os.environ, "GNUPGHOME": str(home)}
    run("gpg", "--batch", "--passphrase", "", "--quick-generate-key", name, "ed25519", "sign", "never", env=env)
    return {**env, "WAYMARK_SIGNING_KEY": name, "SOURCE_DATE_EPOCH": "1700000000"}


def check_suites(folder, repository, env):
    """A newer system's packages are newer, and of another suite."""
    run("python3", WRITER, repository, package(folder, "waymark", "1.1-1+debian13", "amd64"), env=env)
    for suite, version in (("stable", "1.1-1"), ("debian13", "1.1-1+debian13")):
        its = Apt(folder / suite, repository, repository / "waymark-archive-keyring.gpg", suite)
        its("update")
        its("download", "waymark")
        assert [p.name for p in (folder / suite).glob("*.deb")] == [f"waymark_{version}_amd64.deb"], suite
    assert "Suites: debian13\n" in (repository / "waymark-debian13.sources").read_text()


def main():
    if not all(map(shutil.which, ("apt-get", "dpkg-deb", "gpg", "gpgv"))):
        print("skipped: no apt, dpkg-deb or gpg here")
        return 77
    with tempfile.TemporaryDirectory(prefix="waymark-apt-") as name:
        folder = pathlib.Path(name)
        folder.chmod(0o755)
        repository, env = folder / "repository", key_of(folder / "key", "waymark@test.example")
        debs = [package(folder, "waymark", "1.0-1", "amd64"), package(folder, "libwaymark0", "1.0-1", "amd64"),
                package(folder, "waymark-fleet", "1.0-1"), package(folder, "waymark", "1.0-1", "arm64")]
        run("python3", WRITER, repository, *debs, env=env)
        assert (repository / "pool/main/libw/libwaymark0/libwaymark0_1.0-1_amd64.deb").exists()
        assert "Date: Tue, 14 Nov 2023 22:13:20 UTC" in (repository / "dists/stable/Release").read_text()

        apt = Apt(folder / "right", repository, repository / "waymark-archive-keyring.gpg")
        apt("update")
        for want in ("waymark", "libwaymark0", "waymark-fleet"):
            apt("download", want)
        assert {p.name for p in (folder / "right").glob("*.deb")} == {d.name for d in debs if "arm64" not in d.name}

        newer = package(folder, "waymark", "1.1-1", "amd64")
        run("python3", WRITER, repository, newer, env=env)  # a second release beside the first
        apt("update")
        apt("download", "waymark")
        assert (folder / "right/waymark_1.1-1_amd64.deb").exists()
        other = package(folder / "other", "waymark", "1.1-1", "amd64", "Other content")
        assert "with other content" in run("python3", WRITER, repository, other, env=env, check=False).stderr

        check_suites(folder, repository, env)

        # The same packages give the same files.
        again = folder / "again"
        run("python3", WRITER, again, newer, *reversed(debs), env={**env, "TZ": "Asia/Tokyo"})
        for file in ("Release", "main/binary-amd64/Packages", "main/binary-arm64/Packages.gz"):
            assert (again / "dists/stable" / file).read_bytes() == (repository / "dists/stable" / file).read_bytes(), file

        # What is refused.
        kept = repository / "pool/main/w/waymark/waymark_1.1-1_amd64.deb"
        right = kept.read_bytes()
        (folder / "right/waymark_1.1-1_amd64.deb").unlink()
        kept.write_bytes(right[:-1] + bytes([right[-1] ^ 1]))
        done = apt("download", "waymark=1.1-1", check=False)
        assert done.returncode and "Hash Sum mismatch" in done.stderr + done.stdout, done
        kept.write_bytes(right)
        stranger = key_of(folder / "stranger", "stranger@test.example")
        (folder / "stranger.gpg").write_bytes(subprocess.run(["gpg", "--batch", "--export"], env=stranger, check=True, capture_output=True).stdout)
        done = Apt(folder / "of-stranger", repository, folder / "stranger.gpg")("update", check=False)
        assert done.returncode and "NO_PUBKEY" in done.stderr, done
        index = repository / "dists/stable/main/binary-amd64/Packages"
        text = index.read_text()
        index.write_text(text.replace("Nothing", "Nothinh"))
        (index.parent / "Packages.gz").unlink()
        done = Apt(folder / "changed", repository, repository / "waymark-archive-keyring.gpg")("update", check=False)
        assert "Hash Sum mismatch" in done.stderr + done.stdout, done
        unsigned = {**env, "WAYMARK_SIGNING_KEY": ""}
        assert "not signed" in run("python3", WRITER, folder / "bare", *debs, env=unsigned).stdout
        done = Apt(folder / "unsigned", folder / "bare", repository / "waymark-archive-keyring.gpg")("update", check=False)
        assert done.returncode and "is not signed" in done.stderr, done
        done = run("python3", WRITER, folder / "bare", *debs, env={**env, "WAYMARK_SIGNING_KEY": "nobody@test.example"}, check=False)
        assert done.returncode and "can't sign as 'nobody@test.example'" in done.stderr, done
        for home in ("key", "stranger"):  # its agent would outlive this test
            run("gpgconf", "--homedir", folder / home, "--kill", "all", check=False)
    print("apt takes signed packages from a folder, and refuses changed, unsigned and foreign ones")
    return 0


if __name__ == "__main__":
    sys.exit(main())
