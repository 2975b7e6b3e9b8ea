#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""An image for containers of a waymark package, without a daemon and without a right:

    oci_image.py OUT.tar PACKAGE.deb [--root ROOT]     `docker load`, `podman load` and `skopeo copy oci-archive:OUT.tar ...` take it

In it are the package and the shared libraries that its programs are linked with, of the Debian in ROOT (default: this computer's), with
their licences, and nothing else: no shell, no package manager. It runs as user 65532 (waymark). /var/lib/dpkg/status.d names the packages
that the files are of, for scanners. The same packages give the same bytes; their time is SOURCE_DATE_EPOCH. compose.yaml beside it runs it."""
import argparse
import gzip
import hashlib
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import tarfile
import tempfile

USER = 65532  # no user of Debian has it; other images without a shell use it, too
TRIPLETS = {"amd64": "x86_64-linux-gnu", "arm64": "aarch64-linux-gnu", "armhf": "arm-linux-gnueabihf"}
# Loaded by name while libcamera runs; there where the package has waymark-camera.
LIBCAMERA = "libcamera"
ACCOUNTS = {"etc/passwd": f"root:x:0:0:root:/:/sbin/nologin\nwaymark:x:{USER}:{USER}:waymark:/:/sbin/nologin\n",
            "etc/group": f"root:x:0:\nvideo:x:44:\nwaymark:x:{USER}:\n"}
HEALTH_S = {"Interval": 10, "Timeout": 8, "StartPeriod": 60}  # `watch --once` waits for 5 s; a start may take a minute


def run(*command):
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True).stdout


def is_program(path):
    with open(path, "rb") as f:
        return f.read(4) == b"\x7fELF"


class Libraries:
    """Of a Debian in `root`: what a program needs, where it lies, whose it is."""

    def __init__(self, root, triplet):
        self.root, self.found, self.owners = root, {}, {}
        self.folders = [folder for name in ("lib", "usr/lib") for folder in (f"{name}/{triplet}", name, f"{name}64")]

    def find(self, name):
        for folder in self.folders:
            path = self.root / folder / name
            if path.exists():
                return path
        sys.exit(f"oci_image: {name} is not in {self.root}: install what the package depends on")

    def add(self, program):
        dynamic = run("readelf", "-d", "-l", program)
        names = re.findall(r"\(NEEDED\).*\[(.+)\]", dynamic)
        interpreter = re.search(r"interpreter: /(\S+)\]", dynamic)
        for name in names + ([interpreter[1]] if interpreter else []):
            if name in self.found:
                continue
            self.found[name] = path = self.root / name if "/" in name else self.find(name)
            self.add(path)

    def owner(self, path):
        """The package of a file, which may be listed below /lib or /usr/lib."""
        if not self.owners:
            for listed in (self.root / "var/lib/dpkg/info").glob("*.list"):
                self.owners.update((line, listed.stem) for line in listed.read_text().split("\n") if "/lib" in line)
        name = f"/{path.relative_to(self.root)}"
        for name in (name, f"/usr{name}", name.removeprefix("/usr")):
            if name in self.owners:
                return self.owners[name]
        return sys.exit(f"oci_image: {path} belongs to no package")


class Layer:
    """Files of an image by their paths, {path: (content, mode, owner)} or a link's target."""

    def __init__(self):
        self.files, self.links, self.folders = {}, {}, {"var/lib/waymark": (0o750, USER), "run/waymark": (0o750, USER), "tmp": (0o1777, 0)}

    def take(self, name, path):
        """A file of this computer; of a link what it names."""
        self.files[name] = (pathlib.Path(path).read_bytes(), 0o755 if os.access(path, os.X_OK) else 0o644)

    def bytes(self, time):
        for name in [*self.files, *self.links, *self.folders]:
            for parent in list(pathlib.PurePath(name).parents)[:-1]:
                self.folders.setdefault(str(parent), (0o755, 0))
        out = io.BytesIO()
        with tarfile.open(fileobj=out, mode="w", format=tarfile.USTAR_FORMAT) as tar:
            for name in sorted([*self.files, *self.links, *self.folders]):
                entry = tarfile.TarInfo(name)
                entry.mtime = time
                if name in self.folders:
                    entry.type, (entry.mode, entry.uid) = tarfile.DIRTYPE, self.folders[name]
                    entry.gid = entry.uid
                elif name in self.links:
                    entry.type, entry.linkname, entry.mode = tarfile.SYMTYPE, self.links[name], 0o777
                else:
                    content, entry.mode = self.files[name]
                    entry.size = len(content)
                tar.addfile(entry, io.BytesIO(self.files[name][0]) if name in self.files else None)
        return out.getvalue()


def add_package(layer, folder):
    """What the package installs; systemd's and udev's files are of no use here."""
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if name.startswith(("lib/systemd", "lib/udev", "usr/lib/systemd", "usr/lib/udev", "usr/share/man", "usr/share/zsh", "usr/share/bash-completion")):
            continue
        if path.is_symlink():
            layer.links[name] = os.readlink(path)
        elif path.is_file():
            layer.take(name, path)


def add_libraries(layer, libraries, architecture):
    owners = set()
    for path in libraries.found.values():
        layer.take(str(path.relative_to(libraries.root)), path)
        owners.add(libraries.owner(path))
    admin = f"--admindir={libraries.root}/var/lib/dpkg"
    for owner in sorted(owners):
        name = owner.split(":")[0]
        layer.files[f"var/lib/dpkg/status.d/{name}"] = (run("dpkg-query", admin, "-s", owner).encode(), 0o644)
        copyright_of = libraries.root / "usr/share/doc" / name / "copyright"
        if copyright_of.exists():
            layer.take(f"usr/share/doc/{name}/copyright", copyright_of)
    layer.take("etc/os-release", libraries.root / "etc/os-release")
    print(f"oci_image: {len(libraries.found)} libraries of {len(owners)} packages ({architecture})")


def image_config(architecture, date, version, layer):
    seconds = {key: value * 10**9 for key, value in HEALTH_S.items()}
    return {"architecture": {"armhf": "arm"}.get(architecture, architecture), "os": "linux", "created": date,
            "config": {"User": f"{USER}:{USER}", "Entrypoint": ["/usr/bin/waymark"], "Cmd": ["run", "--config", "/etc/waymark/robot.yaml"],
                       "Env": ["PATH=/usr/bin:/bin"], "WorkingDir": "/", "StopSignal": "SIGTERM", "Volumes": {"/var/lib/waymark": {}},
                       "Healthcheck": {"Test": ["CMD", "/usr/bin/waymark", "watch", "--once"], "Retries": 3, **seconds},
                       "Labels": {"org.opencontainers.image.title": "waymark", "org.opencontainers.image.version": version,
                                  "org.opencontainers.image.licenses": "Apache-2.0"}},
            "rootfs": {"type": "layers", "diff_ids": ["sha256:" + hashlib.sha256(layer).hexdigest()]},
            "history": [{"created": date, "created_by": "toolchain/oci_image.py"}]}


def archive(layer, config, tag, time):
    """{name: content} of an OCI layout, with the list that `docker load` looks for."""
    files = {}

    def blob(content, kind):
        digest = hashlib.sha256(content).hexdigest()
        files[f"blobs/sha256/{digest}"] = content
        return {"mediaType": f"application/vnd.oci.image.{kind}", "digest": f"sha256:{digest}", "size": len(content)}

    packed = blob(gzip.compress(layer, 9, mtime=0), "layer.v1.tar+gzip")
    about = blob(json.dumps(config).encode(), "config.v1+json")
    manifest = blob(json.dumps({"schemaVersion": 2, "mediaType": "application/vnd.oci.image.manifest.v1+json", "config": about,
                                "layers": [packed]}).encode(), "manifest.v1+json")
    manifest["annotations"] = {"org.opencontainers.image.ref.name": tag}
    files["index.json"] = json.dumps({"schemaVersion": 2, "manifests": [manifest]}).encode()
    files["oci-layout"] = json.dumps({"imageLayoutVersion": "1.0.0"}).encode()
    path = "blobs/sha256/"
    files["manifest.json"] = json.dumps([{"Config": path + about["digest"][7:], "RepoTags": [f"waymark:{tag}"],
                                          "Layers": [path + packed["digest"][7:]]}]).encode()
    whole = Layer()
    whole.folders = {}
    whole.files = {name: (content, 0o644) for name, content in files.items()}
    return whole.bytes(time)


def main():
    options = argparse.ArgumentParser(usage=__doc__)
    options.add_argument("out", type=pathlib.Path)
    options.add_argument("package", type=pathlib.Path)
    options.add_argument("--root", type=pathlib.Path, default=pathlib.Path("/"))
    asked = options.parse_args()
    time = int(os.environ.get("SOURCE_DATE_EPOCH") or run(pathlib.Path(__file__).with_name("source_date.sh")))
    architecture, version = (run("dpkg-deb", "-f", asked.package, field).strip() for field in ("Architecture", "Version"))
    layer, libraries = Layer(), Libraries(asked.root.resolve(), TRIPLETS[architecture])
    with tempfile.TemporaryDirectory(prefix="waymark-image-") as name:
        folder = pathlib.Path(name)
        run("dpkg-deb", "-x", asked.package, folder)
        add_package(layer, folder)
        for path in sorted(folder.rglob("*")):
            if path.is_file() and not path.is_symlink() and is_program(path):
                libraries.add(path)
        if list(folder.rglob("waymark-camera")):
            for module in sorted((libraries.root / "usr/lib" / TRIPLETS[architecture] / LIBCAMERA).glob("*")):
                libraries.found[str(module)] = module
                libraries.add(module)
    add_libraries(layer, libraries, architecture)
    control = run("dpkg-deb", "-f", asked.package)
    layer.files["var/lib/dpkg/status.d/waymark"] = (control.encode(), 0o644)
    layer.files.update({name: (text.encode(), 0o644) for name, text in ACCOUNTS.items()})
    unpacked = layer.bytes(time)
    date = run("date", "-u", "-d", f"@{time}", "+%Y-%m-%dT%H:%M:%SZ").strip()
    whole = archive(unpacked, image_config(architecture, date, version, unpacked), version.rsplit("-", 1)[0], time)
    asked.out.write_bytes(whole)
    print(f"{asked.out}: {len(unpacked) / 1e6:.1f} MB, packed {len(whole) / 1e6:.1f} MB; docker load -i {asked.out}")


if __name__ == "__main__":
    main()
