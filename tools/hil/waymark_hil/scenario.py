# SPDX-License-Identifier: Apache-2.0
"""The robot's configuration for a target, derived from the user's and the recording: its files, and devices that the player feeds."""
import csv
import pathlib
import re
import shutil

import yaml

from . import HilError
from .recording import read_yaml

URL = "udpm://239.255.76.67:7667?ttl=0"
FORMATS = ["MJPG", "GREY", "YUYV"]  # what the player writes
FIRST_VIDEO = 40  # /dev/video40 and so on: above those that a computer has
# Keys that name a file, with the recording's own where the configuration has none.
_FILES = {"calibration": "calibration.yaml", "landmarks": "landmarks.csv", "dbc": "vehicle.dbc", "can_signals": "can-signals.yaml", "map": "map/map.yaml"}
# Keys of a robot that a test must not touch, and what stands in their place below the test's folder.
_OWN = {("start", "saved_pose"): "state/pose.yaml", ("start", "saved_map"): "state/map.wmmap", ("black_box", "folder"): "state/box"}
_NOT_HERE = [("commands", "socket"), ("publish", "picture_socket")]


class _Plain(yaml.SafeDumper):
    """Scalars as they were written, without quotes where YAML needs none."""

    yaml_implicit_resolvers = {}

    def ignore_aliases(self, data):
        return True


def dump(config):
    """A configuration as text."""
    return yaml.dump(config, Dumper=_Plain, sort_keys=False, default_flow_style=None, allow_unicode=True, width=140)


def _copy_named(home, name, folder, place):
    """Copies a file that a configuration names, with what belongs to it. Returns its path from the test's folder."""
    source = pathlib.Path(name) if pathlib.Path(name).is_absolute() else home / name
    if not source.is_file():
        raise HilError(f"{home}: names {name}, which does not exist")
    target = folder / "files" / place / source.name
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(source, target)
    beside = source.parent / "landmarks"  # how landmarks look (docs/landmarks.md)
    if place == "landmarks" and beside.is_dir():
        shutil.copytree(beside, target.parent / "landmarks", dirs_exist_ok=True)
    if source.suffix in (".yaml", ".yml"):  # a map's layers, a steering table of its own
        for word in set(re.findall(r"[^\s,'\"\[\]{}:]+", source.read_text(encoding="utf-8", errors="replace"))):
            named = source.parent / word
            if word.strip("./") and named.is_file() and named != source and not pathlib.Path(word).is_absolute() and ".." not in word:
                (target.parent / word).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(named, target.parent / word)
    return str(target.relative_to(folder))


def _files(config, home, recording, folder):
    """Each key that names a file: copied, or the recording's."""
    for key, usual in _FILES.items():
        if key in config:
            config[key] = _copy_named(home, config[key], folder, key)
        elif (recording.path / usual).is_file():
            config[key] = f"recording/{usual}"
    for number, bus in enumerate((config.get("devices") or {}).get("can") or []):
        for key in ("dbc", "can_signals"):
            if key in bus:
                bus[key] = _copy_named(home, bus[key], folder, f"bus{number}-{key}")
    for one in ((config.get("vision") or {}).get("cascade") or {}).get("classes") or []:
        if "file" in one:
            one["file"] = _copy_named(home, one["file"], folder, "cascade")


def _buses(given, recording):
    """[(the recording's interface, entry of devices.can)]. An interface that the configuration does not have is not played, unless it has none at all."""
    if not given:
        return [(bus.name, {"interface": bus.name}) for bus in recording.buses]
    if len(given) == 1 and len(recording.buses) == 1:
        return [(recording.buses[0].name, dict(given[0]))]
    return [(bus.name, dict(entry)) for bus in recording.buses for entry in given if entry.get("interface") == bus.name]


def _cameras(given, recording, config):
    """Entries of devices.cameras for the cameras that a detector looks at."""
    used = None
    for detector in (config.get("vision") or {}).values():
        names = (detector or {}).get("cameras") if isinstance(detector, dict) else None
        used = [*(used or []), *(names or [camera.name for camera in recording.cameras])]
    out = []
    for camera in recording.cameras if config.get("vision") else []:
        if camera.name not in used:
            continue
        entry = next((one for one in given if one.get("name") == camera.name), {})
        wanted = entry.get("format")
        out.append({"name": camera.name, "device": f"/dev/video{FIRST_VIDEO + len(out)}",
                    "format": wanted if wanted in FORMATS else "MJPG" if camera.is_jpeg else "GREY", "rate_hz": f"{camera.rate_hz:.4g}"})
    return out


def _start(recording):
    """The recording's start pose. Its stamp is of the recording's clock, and near the first motion: it is left out."""
    start = (recording.about.get("vehicle") or {}).get("initial_pose")
    return {key: value for key, value in start.items() if key != "t_ns"} if isinstance(start, dict) else None


def begin_at(config, folder, published, t_ns):
    """Writes FOLDER/robot.yaml anew with a start pose at t_ns of the recording's clock: the last that a replay published until then. What the
    start pose states beside the place (its sigmas) stays. False where the replay had none."""
    with open(published, newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if int(row["t_ns"]) <= t_ns]
    if not rows:
        return False
    start = {key: value for key, value in config["initial_pose"].items() if key.startswith("sigma_")}
    has_height = "z_m" in config["initial_pose"]
    keys = ["x_m", "y_m", *(["z_m"] if has_height else []), "qx", "qy", "qz", "qw"]
    config["initial_pose"] = {**{key: rows[-1][key] for key in keys}, **start}
    (folder / "robot.yaml").write_text(dump(config), encoding="utf-8")
    return True


def derive(path, recording, folder, single_core, survives):
    """Writes FOLDER/robot.yaml and the files that it names. Returns the configuration, [(the recording's interface, the run's)], and
    the entries of its cameras. `survives`: the run is started again and keeps its pose."""
    config, home = read_yaml(path), pathlib.Path(path).parent
    devices = config.get("devices") or {}
    if not isinstance(devices, dict):
        raise HilError(f"{path}: devices: is not a mapping")
    _files(config, home, recording, folder)
    buses = _buses(devices.get("can") or [], recording)
    cameras = _cameras(devices.get("cameras") or [], recording, config)
    config["devices"] = {key: value for key, value in (
        ("can", [entry for _, entry in buses]), ("cameras", cameras),
        ("lcm", [{"stream": name} for name in recording.streams]), ("sightings", "lcm" if recording.has_sightings else None)) if value}
    if not config["devices"]:
        raise HilError(f"{path}: {recording.path} has no CAN interface, camera or stream that it uses")
    if "initial_pose" not in config and (start := _start(recording)):
        config["initial_pose"] = start
    config.setdefault("publish", {}).setdefault("lcm_url", URL)
    for section, key in _NOT_HERE:
        (config.get(section) or {}).pop(key, None)
    for (section, key), place in _OWN.items():
        if key in (config.get(section) or {}):
            config[section][key] = place
    if survives:
        config.setdefault("start", {}).setdefault("saved_pose", _OWN["start", "saved_pose"])
    if single_core:  # below the threads of interrupts (50): an estimator above them would cost CAN frames
        config.setdefault("realtime", {}).setdefault("priority", "40")
    for section in [name for name in ("commands", "publish", "start", "black_box") if config.get(name) == {}]:
        del config[section]
    (folder / "robot.yaml").write_text(dump(config), encoding="utf-8")
    return config, [(name, entry["interface"]) for name, entry in buses], cameras
