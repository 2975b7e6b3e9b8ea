# SPDX-License-Identifier: Apache-2.0
"""YAML with the numbers that the programs read: `1e-3` is one, `010` is ten, `12:30:00` and `no` are text, as YAML 1.2 has it."""

import re
from pathlib import Path
from typing import Any

import yaml


class _Loader(yaml.SafeLoader):
    """PyYAML's loader has the words of YAML 1.1, where `1e-3` is text, `010` is 8 and `12:30:00` is 45000."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        """A mapping whose keys differ, as the programs want it."""
        seen: set[str] = set()
        for key, _ in node.value:
            if str(key.value) in seen:
                raise yaml.constructor.ConstructorError(None, None, f"the key {key.value} appears twice", key.start_mark)
            seen.add(str(key.value))
        return dict(super().construct_mapping(node, deep))


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


def read_text(path: Path) -> str:
    """A text file in UTF-8, with or without a byte order mark. ValueError: it is none."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path}: this is no text in UTF-8 (UTF-16, or no text at all?); save it as UTF-8") from None


def read_yaml(text: str) -> Any:
    """The content of a YAML text. yaml.YAMLError: it is none."""
    return yaml.load(text, Loader=_Loader)  # noqa: S506  (a safe loader)


def read_mapping(path: Path) -> dict[str, Any]:
    """The keys of a YAML file. ValueError names file and line."""
    try:
        content = read_yaml(read_text(path))
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        twice = isinstance(error, yaml.constructor.ConstructorError) and error.problem
        raise ValueError(f"{path}{f':{mark.line + 1}' if mark else ''}: {twice or 'this is no valid YAML'}") from None
    if not isinstance(content, dict):
        raise ValueError(f"{path}: this is not a mapping of keys")
    return content
