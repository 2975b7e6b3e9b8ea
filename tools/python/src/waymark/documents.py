# SPDX-License-Identifier: Apache-2.0
"""YAML with the numbers that the programs read: `1e-3` is one, `010` is ten, `12:30:00` and `no` are text, as YAML 1.2 has it."""

import re
from typing import Any

import yaml


class _Loader(yaml.SafeLoader):
    """PyYAML's loader has the words of YAML 1.1, where `1e-3` is text, `010` is 8 and `12:30:00` is 45000."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}


def _decimal(_loader: yaml.SafeLoader, node: yaml.ScalarNode) -> int:
    return int(node.value, 16 if "x" in node.value else 10)


_SIGNS_AND_DIGITS = list("-+0123456789")
for _tag, _text, _first in (
        ("merge", r"<<", ["<"]),
        ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
        ("bool", r"true|True|TRUE|false|False|FALSE", list("tTfF")),
        ("int", r"[-+]?[0-9]+|0x[0-9a-fA-F]+", _SIGNS_AND_DIGITS),
        ("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)", [*_SIGNS_AND_DIGITS, "."])):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", re.compile(f"^(?:{_text})$"), _first)
_Loader.add_constructor("tag:yaml.org,2002:int", _decimal)


def read_yaml(text: str) -> Any:
    """The content of a YAML text. yaml.YAMLError: it is none."""
    return yaml.load(text, Loader=_Loader)  # noqa: S506  (a safe loader)
