# SPDX-License-Identifier: Apache-2.0
"""The maps of a robot by VDA 5050: floors of its building (docs/building.md), each in the versions that the robot has."""

import hashlib
import http.client
import re
import shutil
import subprocess
import tarfile
import time
import urllib.request
import zlib
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

import yaml

from .protocol import Refused

UNVERSIONED = "unversioned"
"""The version of a building whose files have none."""
_HASHES = {32: "md5", 40: "sha1", 64: "sha256", 128: "sha512"}  # by the number of hexadecimal digits
_SILENT_S, _WHOLE_S = 20.0, 3600.0  # a download's longest silence, and its longest time
_RECORD_BYTES_MAX = 1 << 22  # of version.yaml, as `waymark map version` has it
_PIECE_BYTES = 1 << 16
_DAMAGED = (tarfile.TarError, EOFError, zlib.error, ValueError, KeyError, TypeError, AttributeError, yaml.YAMLError)


class Map(NamedTuple):
    """A floor in a version."""

    map_id: str
    version: str
    is_enabled: bool


def _is_version(name: str) -> bool:
    return re.fullmatch("[0-9a-f]{16}", name) is not None


class Building:
    """A building's folder. `path` is the folder, or one of its floors as a configuration names it (FOLDER/FLOOR).

    Its versions are made and removed by `waymark map version`, which locks them; any thread may ask.
    """

    def __init__(self, path: Path, bytes_max: int):
        is_floor = not _is_site(path) and _is_site(path.parent)
        self.folder, self._bytes_max = (path.parent if is_floor else path), bytes_max
        self.floor = path.name if is_floor else ""
        self._scratch = self.folder / ".download"  # on the disk of the versions
        if not self.folder.is_dir():
            raise FileNotFoundError(f"{self.folder}: is no folder; make one, which may be empty: maps can be downloaded into it")
        shutil.rmtree(self._scratch, ignore_errors=True)  # of a program that was killed

    def current(self) -> str:
        """The version that robots take; "" without one."""
        try:
            return (self.folder / "versions/current").read_text(encoding="utf-8").strip()
        except FileNotFoundError:
            return ""

    def floors(self, version: str) -> list[str]:
        """Names of a version's floors, in their order; none where it is not there, or can't be read."""
        folder = self.folder if version == UNVERSIONED else self.folder / "versions" / version
        try:
            return [str(floor["name"]) for floor in yaml.safe_load((folder / "site.yaml").read_text(encoding="utf-8"))["floors"]]
        except FileNotFoundError:  # a folder with one map: its floor has this name
            return ["ground"] if any((folder / name).exists() for name in ("landmarks.csv", "map.yaml", "map/map.yaml")) else []
        except (OSError, *_DAMAGED):
            return []

    def enabled_floors(self) -> list[str]:
        """Names of the floors that robots take."""
        return self.floors(self.current() or UNVERSIONED)

    def maps(self) -> list[Map]:
        """All floors in all versions."""
        current, folder = self.current(), self.folder / "versions"
        versions = sorted(entry.name for entry in folder.iterdir() if _is_version(entry.name)) if folder.is_dir() else []
        if not current:
            versions.append(UNVERSIONED)
        return [Map(floor, version, version == (current or UNVERSIONED)) for version in versions for floor in self.floors(version)]

    def _needed(self, map_id: str, version: str) -> Map:
        if found := [entry for entry in self.maps() if entry[:2] == (map_id, version)]:
            return found[0]
        raise Refused(f"there is no map '{map_id}' of version '{version}' on the robot")

    def download(self, map_id: str, version: str, link: str, digest: str | None) -> str:
        """Fetches a version and stores it, whole or not at all; none is enabled by it. Refused says why it is not there."""
        if not _is_version(version):
            raise Refused(f"mapVersion: '{version}' is no name of a version: 16 digits and letters a to f, as `waymark map version SITE --list` prints them")
        if (map_id, version) in [entry[:2] for entry in self.maps()]:
            raise Refused(f"map '{map_id}' of version {version} is on the robot already")
        try:
            self._scratch.mkdir(exist_ok=True)
            archive, unpacked = self._scratch / "archive", self._scratch / "versions" / version
            self._fetch(link, archive, digest)
            self._unpack(archive, unpacked)
            if map_id not in (floors := Building(self._scratch, 0).floors(version)):
                raise Refused(f"the file has no floor '{map_id}'; it has {', '.join(floors) or 'none'}")
            return self._program("--add", str(unpacked))
        except OSError as error:
            raise Refused(f"can't be stored: {error}") from error
        finally:
            shutil.rmtree(self._scratch, ignore_errors=True)

    def _fetch(self, link: str, to: Path, digest: str | None) -> None:
        kind = _HASHES.get(len(digest or ""))
        if digest and not (kind and re.fullmatch("[0-9a-fA-F]+", digest)):
            raise Refused(f"mapHash: '{digest}' is no MD5, SHA-1, SHA-256 or SHA-512 in hexadecimal digits")
        if not re.match("https?://", link):
            raise Refused(f"mapDownloadLink: '{link}' does not begin with http:// or https://")
        seen, got, end_s = hashlib.new(kind or "sha256"), 0, time.monotonic() + _WHOLE_S
        try:
            with urllib.request.urlopen(link, timeout=_SILENT_S) as answer, to.open("wb") as file:
                size = answer.headers.get("Content-Length", "")
                while piece := answer.read(_PIECE_BYTES):
                    got += len(piece)
                    if got > self._bytes_max or time.monotonic() > end_s:
                        raise Refused(f"{link}: has more than {self._bytes_max >> 20} MB (--max-mb)" if got > self._bytes_max else f"{link}: takes more than an hour")
                    seen.update(piece)
                    file.write(piece)
        except (OSError, ValueError, http.client.HTTPException) as error:
            raise Refused(f"{link}: {error}") from error
        if size.isdecimal() and got != int(size):
            raise Refused(f"{link}: was cut off: {got} of {size} bytes came")
        if digest and seen.hexdigest() != digest.lower():
            raise Refused(f"{link}: its {kind} is {seen.hexdigest()}, not the mapHash {digest.lower()}")

    def _unpack(self, archive: Path, to: Path) -> None:
        """The files that version.yaml names, and no other."""
        try:
            with tarfile.open(archive) as tar:
                members = {str(PurePosixPath(member.name)): member for member in tar}
                (record,) = (name for name in members if PurePosixPath(name).name == "version.yaml")
                names = yaml.safe_load(_content(tar, members[record], _RECORD_BYTES_MAX).read())["files"]
                left = self._bytes_max
                for name in ("version.yaml", *names):
                    path, member = to / name, members[str(PurePosixPath(record).parent / name)]
                    if not path.resolve().is_relative_to(to.resolve()):
                        raise Refused(f"the file '{name}' lies outside of the version")
                    path.parent.mkdir(parents=True, exist_ok=True)
                    with _content(tar, member, left) as content, path.open("wb") as file:
                        shutil.copyfileobj(content, file)
                    left -= member.size
        except _DAMAGED as error:
            raise Refused("the file is no version of a building as a tar archive with one version.yaml and the files that it names "
                          f"({type(error).__name__}: {error})") from error

    def enable(self, map_id: str, version: str, reload: Callable[[], str]) -> str:
        """The version becomes current, and the run takes it by `reload`. Refused: it did not, and the one before is current again."""
        if self._needed(map_id, version).is_enabled:
            return "is enabled already"
        before = self.current()
        said = self._program("--use", version)
        try:
            return f"{said}; {reload()}"
        except Refused:
            if before:
                self._program("--use", before)
            else:
                (self.folder / "versions/current").unlink()
            raise

    def delete(self, map_id: str, version: str) -> str:
        """Removes a version with all of its floors. Refused where it is enabled, or not there."""
        if self._needed(map_id, version).is_enabled:
            raise Refused(f"version {version} is enabled; enable another one first")
        return self._program("--remove", version)

    def _program(self, *words: str) -> str:
        """Its last line. Refused: its error."""
        try:
            done = subprocess.run(["waymark-map", "version", str(self.folder), *words], capture_output=True, text=True, check=False)
        except OSError as error:
            raise Refused(f"waymark-map can't be started: {error}") from error
        if done.returncode:
            text = (done.stderr or done.stdout).strip().replace(f"{self._scratch}/versions/", "the file's ")
            raise Refused(re.sub(r" \(waymark map .*\)|waymark map: ", "", text))  # a fleet manager has no shell on the robot
        return done.stdout.strip()


def _is_site(folder: Path) -> bool:
    return any((folder / name).exists() for name in ("site.yaml", "versions"))


def _content(tar: tarfile.TarFile, member: tarfile.TarInfo, bytes_max: int) -> Any:
    """The bytes of a plain file that is not larger."""
    if not member.isreg() or member.size > bytes_max:
        raise Refused(f"the file's '{member.name}' is {'too large' if member.isreg() else 'no plain file'}")
    return tar.extractfile(member)
