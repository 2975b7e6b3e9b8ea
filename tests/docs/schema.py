#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The JSON schema of `waymark config --schema`, judged by the package jsonschema: schema.py BIN. It takes each shipped configuration and
the examples in docs/config.md, and refuses what an editor has to mark."""
import json
import pathlib
import re
import subprocess
import sys

import jsonschema
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Core(yaml.SafeLoader):
    """YAML's core schema, as editors and the program read it: `on` is text, 1e-3 is a number."""
    yaml_implicit_resolvers = {}


CORE = {
    "bool": (r"true|True|TRUE|false|False|FALSE", [*"tTfF"]),
    "null": (r"~|null|Null|NULL|", [*"~nN", ""]),
    "int": (r"[-+]?[0-9]+", [*"-+0123456789"]),
    "float": (r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)", [*"-+0123456789."]),
}
for tag, (form, first) in CORE.items():
    Core.add_implicit_resolver(f"tag:yaml.org,2002:{tag}", re.compile(f"^(?:{form})$"), first)

GOOD = {"format": "waymark-config/1", "estimator": "landmark_ekf"}
# What an editor has to mark: (what, keys that are added).
BAD = [
    ("a key that is misspelt", {"merge": {"horizont_ms": 300}}),
    ("a key at the top that is not there", {"merges": {}}),
    ("a unit behind a number", {"merge": {"horizon_ms": "300 ms"}}),
    ("a key in another unit", {"merge": {"horizon_s": 0.3}}),
    ("a number beyond its limit", {"publish": {"rate_hz": 5000}}),
    ("a number that has to be above 0", {"devices": {"gpsd": [{"accuracy_scale": 0}]}}),
    ("a fraction for a whole number", {"realtime": {"cpu": 1.5}}),
    ("text for true or false", {"publish": {"lcm": "yes"}}),
    ("a choice that is not there", {"motion": {"drive": "flying"}}),
    ("an estimator that is not there", {"estimator": "landmark_efk"}),
    ("a parameter of another estimator", {"landmark_ekf": {"key_frames": 40}}),
    ("a source that is not there", {"sources": [{"name": "sighting"}]}),
    ("a source without its name", {"sources": [{"use": False}]}),
    ("a device without its interface", {"devices": {"can": [{"dbc": "vehicle.dbc"}]}}),
    ("a heading in words", {"initial_pose": {"heading_deg": "ninety"}}),
    ("a cascade without classes", {"vision": {"cascade": {}}}),
    ("a list for a map", {"vision": ["edges"]}),
]
# What the program takes, beside the shipped files.
TAKEN = [
    {"landmark_ekf": {"recover.sigma_xy_m": 3}},
    {"sources": [{"name": "sightings:laser", "from_s": float("-inf")}, {"name": "edges:front"}]},
    {"vision": {"edges": None, "apriltag": {"cameras": ["front", 0]}}},
    {"devices": {"cameras": [{"name": "front", "device": "/dev/video0", "controls": {"gain": 20}}], "sightings": "lcm"}},
]


def main():
    text = subprocess.run([f"{sys.argv[1]}/waymark", "config", "--schema"], check=True, capture_output=True, text=True).stdout
    schema = json.loads(text)
    judge = jsonschema.Draft7Validator(schema)
    jsonschema.Draft7Validator.check_schema(schema)
    faults, files = [], 0

    def look(name, config):
        for error in judge.iter_errors(config):
            faults.append(f"{name}: {'.'.join(map(str, error.path))}: {error.message[:200]}")

    for path in sorted((ROOT / "config").rglob("*.yaml")):
        config = yaml.load(path.read_text(), Core)
        if isinstance(config, dict) and config.get("format") == "waymark-config/1":
            look(path.relative_to(ROOT), config)
            files += 1
    for number, block in enumerate(re.findall(r"```yaml\n(.*?)```", (ROOT / "docs/config.md").read_text(), re.DOTALL)):
        look(f"docs/config.md, example {number + 1}", yaml.load(block, Core))
    for more in TAKEN:
        look(more, GOOD | more)
    for what, more in BAD:
        if judge.is_valid(GOOD | more):
            faults.append(f"not refused: {what}: {more}")
    print("\n".join([*faults, f"{files} configurations, {len(BAD)} mistakes, {len(faults)} faults"]))
    return 1 if faults or files < 40 else 0


if __name__ == "__main__":
    sys.exit(main())
