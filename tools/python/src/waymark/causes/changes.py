# SPDX-License-Identifier: Apache-2.0
"""Changes of a recording's files and of its configuration, and a copy of the recording that has them. The copy links to the
unchanged files; the originals are only read."""

import io
import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import yaml
from PIL import Image

from ..geometry import from_rpy

TURNS = {Image.Transpose.FLIP_LEFT_RIGHT: "mirror (left and right)", Image.Transpose.FLIP_TOP_BOTTOM: "mirror (top and bottom)",
         Image.Transpose.ROTATE_90: "turn by 90 degrees to the left", Image.Transpose.ROTATE_180: "turn by 180 degrees",
         Image.Transpose.ROTATE_270: "turn by 90 degrees to the right"}
"""Ways to turn or mirror a picture, and their words."""
CONFIG = ""
"""In place of a file's name: the configuration."""


class Impossible(ValueError):
    """The file has nothing that the change is for."""


@dataclass(frozen=True)
class Edit:
    """A change of one file."""

    file: str

    def apply(self, before: bytes) -> bytes:
        """The changed file."""
        raise NotImplementedError

    def words(self) -> str:
        """What is done to a table or a picture; "" where the changed line shows it."""
        return ""

    def place(self, before: bytes, after: bytes) -> "Place":
        """The first line that changes."""
        old, new = before.decode("utf-8", "replace").splitlines(), after.decode("utf-8", "replace").splitlines()
        number = next((i for i, text in enumerate(new) if i >= len(old) or text != old[i]), 0)
        shown = new[number].strip() if new else ""
        return Place(self.file, number + 1, shown if len(shown) <= 90 else shown[:87] + "...", self.words())


@dataclass(frozen=True)
class Detected(Edit):
    """An edit of what a detector found in pictures, for a trial alone: on the robot the detector finds it anew."""

    edit: Edit


@dataclass(frozen=True)
class Pictured(Edit):
    """The opposite of Detected: an edit of pictures' stamps or of a detector's settings, which a trial on what was found does without."""

    edit: Edit


def for_trial(edits: Iterable[Edit]) -> list[Edit]:
    """Of these the edits of what a trial drives."""
    return [edit.edit if isinstance(edit, Detected) else edit for edit in edits if not isinstance(edit, Pictured)]


def for_robot(edits: Iterable[Edit]) -> list[Edit]:
    """Of these the edits of the robot's own files."""
    return [edit.edit if isinstance(edit, Pictured) else edit for edit in edits if not isinstance(edit, Detected)]


@dataclass(frozen=True)
class Place:
    """Where to write what: `text` in a line (0: none of a picture), or `words` for each row, of which `text` is the first."""

    file: str
    line: int
    text: str
    words: str = ""

    def said(self) -> str:
        """FILE:LINE: what to write."""
        text = f"`{self.text}`" if self.text else ""
        return ": ".join(part for part in (f"{self.file}:{self.line}" if self.line else self.file, self.words, text) if part) + (" and so each row" if self.words and text else "")


# ── tables ───────────────────────────────────────────────────────────────────────────────────────────────────────────

@dataclass(frozen=True)
class Rows(Edit):
    """Fields of each row by a function; `only` rows of this sensor."""

    columns: tuple[str, ...]
    change: Callable[..., Sequence[str]]
    said: str
    only: str = ""
    optional: bool = False

    def words(self) -> str:
        return self.said

    def apply(self, before: bytes) -> bytes:
        head, *lines = before.decode().splitlines()
        names = head.strip().split(",")
        if not set(self.columns) <= set(names):
            if self.optional:
                return before
            raise Impossible(f"{self.file} has no {', '.join(self.columns)}")
        at = [names.index(name) for name in self.columns]
        last = max(at)
        sensor = names.index("sensor") if self.only and "sensor" in names else -1
        out = [head]
        known: dict[tuple[str, ...], Sequence[str]] = {}  # all points of a scan have one stamp
        for line in lines:
            row = line.split(",")
            if len(row) > last and (sensor < 0 or row[sensor] == self.only):
                values = tuple([row[i] for i in at])
                if values not in known:
                    known[values] = self.change(*values)
                for i, value in zip(at, known[values]):
                    row[i] = value
                line = ",".join(row)
            out.append(line)
        return ("\n".join(out) + "\n").encode()


def _number(factor: float, offset: float, text: str) -> str:
    try:
        if re.fullmatch(r"[+-]?\d+", text) and float(factor).is_integer() and float(offset).is_integer():
            return str(int(text) * int(factor) + int(offset))
        return f"{factor * float(text) + offset:.12g}"
    except ValueError:
        return text  # empty, or no number: stays


def column(file: str, name: str, factor: float = 1, offset: float = 0, only: str = "", optional: bool = False) -> Rows:
    """A column's numbers times `factor` plus `offset`."""
    if offset and factor != 1:
        said = f"{name} = {offset:.9g} {factor:+.9g} {name}"
    else:
        said = f"{name} {offset:+.12g}" if offset else f"{name} times {factor:.9g}"
    return Rows(file, (name,), lambda text: [_number(factor, offset, text)], said, only, optional)


def stretched(file: str, name: str, rate: float, begin: int, only: str = "", optional: bool = False) -> Rows:
    """Stamps less `rate` times the time since `begin`, ns."""
    def change(text: str) -> list[str]:
        return [str(int(text) - round(rate * (int(text) - begin)))] if re.fullmatch(r"-?\d+", text) else [text]
    return Rows(file, (name,), change, f"{name} less {rate:.5g} times the time since the start", only, optional)


def swapped(file: str, a: str, b: str) -> Rows:
    """Two columns exchanged."""
    return Rows(file, (a, b), lambda x, y: (y, x), f"swap the columns {a} and {b}")


def identities(file: str, table: dict[int, int], only: str = "") -> Rows:
    """Other identities."""
    sums = {a + b for a, b in table.items()}
    said = f"id = {sums.pop()} - id: " if len(sums) == 1 and len(table) > 2 else ""
    said += "id " + ", ".join(f"{a} -> {b}" for a, b in sorted(table.items()))
    return Rows(file, ("id",), lambda text: [str(table.get(int(text), int(text))) if re.fullmatch(r"-?\d+", text) else text],
                said, only)


@dataclass(frozen=True)
class Counted(Edit):
    """Counters of so many bits, whose counts go on."""

    bits: int
    columns: tuple[str, ...] = ("left", "right")

    def words(self) -> str:
        return f"{' and '.join(self.columns)}: counts that go on at {2**self.bits}"

    def apply(self, before: bytes) -> bytes:
        head, *lines = before.decode().splitlines()
        at = [head.strip().split(",").index(name) for name in self.columns]
        rows = [line.split(",") for line in lines if line]
        for i in at:
            counts = np.array([int(row[i]) for row in rows])
            half = 2 ** (self.bits - 1)
            steps = (np.diff(counts) + half) % (2 * half) - half
            for row, count in zip(rows, np.concatenate([counts[:1], counts[0] + np.cumsum(steps)])):
                row[i] = str(count)
        return ("\n".join([head, *(",".join(row) for row in rows)]) + "\n").encode()


Mounting = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Place, m, and roll, pitch, yaw, rad, in base_link."""


@dataclass(frozen=True)
class Seen(Edit):
    """Points on the floor as a camera with another mounting would have placed them."""

    before: Mounting
    after: Mounting

    def words(self) -> str:
        return "see the points anew with that mounting"

    def apply(self, before: bytes) -> bytes:
        head, _, body = before.decode().rstrip().partition("\n")
        names = head.strip().split(",")
        fields = body.replace("\n", ",").split(",")
        x, y = (names.index(name) for name in ("x_m", "y_m"))
        points = np.column_stack([*(np.array(fields[k::len(names)], float) for k in (x, y)), np.zeros(len(fields) // len(names))])
        (old, old_turn), (new, new_turn) = ((np.array(place), from_rpy(*turn)) for place, turn in (self.before, self.after))
        rays = (points - old) @ old_turn @ new_turn.T
        down = rays[:, 2] < -1e-3 * np.linalg.norm(rays, axis=1)  # others don't meet the floor
        floor = new + rays * np.where(down, -new[2] / np.where(down, rays[:, 2], 1), 0)[:, None]
        columns = [fields[k::len(names)] for k in range(len(names))]
        columns[x], columns[y] = ([f"{value:.4f}" for value in floor[:, axis].tolist()] for axis in (0, 1))
        return "\n".join([head, *(",".join(row) for row, is_seen in zip(zip(*columns), down.tolist()) if is_seen), ""]).encode()


Matrix = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True)
class Measured(Edit):
    """Coded markers as a detector would have measured them with another calibration: places times a matrix, in the sensor's frame, and yaws that
    are seen from above by the angles of another mounting, rad."""

    only: str  # this sensor
    by: Matrix = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    before: tuple[float, float, float] = (0, 0, 0)
    after: tuple[float, float, float] = (0, 0, 0)

    def apply(self, before: bytes) -> bytes:
        (old_roll, old_pitch, _), (roll, pitch, _) = self.before, self.after
        turn = from_rpy(roll, pitch, 0) @ from_rpy(old_roll, old_pitch, 0).T  # of level axes

        def moved(*texts: str) -> list[str]:
            return [f"{value:.9g}" for value in np.array(self.by) @ [float(text) for text in texts]] if all(texts) else list(texts)

        def turned(text: str) -> list[str]:
            x, y, _ = turn @ (math.cos(float(text)), math.sin(float(text)), 0.0) if text else (0.0, 0.0, 0.0)
            return [f"{math.atan2(y, x):.9g}" if text else text]

        for prefix in ("", "other_"):
            for columns, change in (((f"{prefix}x_m", f"{prefix}y_m", f"{prefix}z_m"), moved), ((f"{prefix}yaw_rad",), turned)):
                before = Rows(self.file, columns, change, "", self.only, bool(prefix)).apply(before)
        return column(self.file, "along_sigma_m", self.by[0][0], 0, self.only, True).apply(before)


@dataclass(frozen=True)
class Replaced(Edit):
    """Other content."""

    content: bytes

    def apply(self, before: bytes) -> bytes:
        return self.content


@dataclass(frozen=True)
class Sorted(Edit):
    """Rows in the order of their stamps."""

    def words(self) -> str:
        return "sort the rows by t_ns"

    def apply(self, before: bytes) -> bytes:
        head, *lines = before.decode().splitlines()
        at = head.split(",").index("t_ns")
        lines.sort(key=lambda line: int(line.split(",")[at]))
        return ("\n".join([head, *lines]) + "\n").encode()

    def place(self, before: bytes, after: bytes) -> Place:
        return Place(self.file, 0, "", self.words())


# ── YAML ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

@dataclass(frozen=True)
class Value(Edit):
    """A value of a YAML file at a path of keys and indices; other text, and comments, stay."""

    path: tuple[str | int, ...]
    text: str

    def apply(self, before: bytes) -> bytes:
        text = before.decode()
        node, walked = yaml.compose(text, yaml.SafeLoader), 0
        while walked < len(self.path):
            below, steps = _child(node, self.path[walked:])
            if below is None:
                break
            node, walked = below, walked + steps
        if walked == len(self.path) and node is not None:
            return (text[:node.start_mark.index] + self.text + text[_end(text, node):]).encode()
        return _inserted(text, node, self.path[walked:], self.text, self.file).encode()

    def place(self, before: bytes, after: bytes) -> Place:
        return replace(super().place(before, after), text=f"{self.path[-1]}: {self.text}")

    def dotted(self) -> str:
        """The path as a key of the configuration."""
        return ".".join(str(step) for step in self.path)


def _end(text: str, node: yaml.Node) -> int:
    end: int = node.end_mark.index
    while end > node.start_mark.index and text[end - 1].isspace():
        end -= 1
    return end


def _child(node: yaml.Node | None, path: tuple[str | int, ...]) -> tuple[yaml.Node | None, int]:
    """What a node has at the first steps of a path, and how many: keys may be dotted."""
    if isinstance(node, yaml.SequenceNode) and isinstance(path[0], int) and path[0] < len(node.value):
        return node.value[path[0]], 1
    keys = {key.value: value for key, value in node.value} if isinstance(node, yaml.MappingNode) else {}
    return next(((keys[key], steps) for steps in range(1, len(path) + 1) if (key := ".".join(map(str, path[:steps]))) in keys), (None, 0))


def _inserted(text: str, node: yaml.Node | None, path: tuple[str | int, ...], value: str, file: str) -> str:
    for step in reversed(path[1:]):
        value = f"{{{step}: {value}}}"
    if node is None:
        return f"{text.rstrip()}\n{path[0]}: {value}\n".lstrip()
    if not isinstance(node, yaml.MappingNode) or isinstance(path[0], int):
        raise Impossible(f"{file} has no {'.'.join(map(str, path))}")
    if node.flow_style:
        at = node.start_mark.index + 1
        return f"{text[:at]}{path[0]}: {value}{', ' if node.value else ''}{text[at:]}"
    at = node.value[0][0].start_mark
    return f"{text[:at.index]}{path[0]}: {value}\n{' ' * at.column}{text[at.index:]}"


def numbers(values: Iterable[float]) -> str:
    """A list of numbers in YAML."""
    return "[" + ", ".join(f"{value + 0.0:.6g}" for value in values) + "]"


# ── DBC ──────────────────────────────────────────────────────────────────────────────────────────────────────────────

_LAYOUT = re.compile(r"(\d+)\|(\d+)@([01])([+-])\s*\(([^,]+),([^)]+)\)")


@dataclass(frozen=True)
class Signal(Edit):
    """A signal of a DBC: the other byte order (of the same bytes, or of the same first bit), the other sign, a first bit that
    is off by some, or fewer bits, the lower ones."""

    message: str
    signal: str
    layout: str  # "order", "order, start", "sign", "bit", "bits"
    shift: int = 0  # of "bits": how many are left

    def apply(self, before: bytes) -> bytes:
        text = before.decode("utf-8", "replace")
        found = re.search(rf"(?m)^\s*BO_ \d+ {re.escape(self.message)}\s*:(?:(?!^\s*BO_ ).|\n)*?^\s*SG_ {re.escape(self.signal)}\s[^:]*:\s*", text)
        layout = _LAYOUT.match(text, found.end()) if found else None
        if not layout:
            raise Impossible(f"{self.file} has no signal {self.signal}")
        start, bits, order, sign, scale, offset = layout.groups()
        if self.layout == "bits":
            left = int(bits) - self.shift
            if left <= 0:
                raise Impossible(f"{self.signal} has not more bits")
            if order == "0":  # Motorola's first bit is the highest one, and the next ones are below it
                byte, down = divmod(int(start) // 8 * 8 + 7 - int(start) % 8 + left, 8)
                start = str(8 * byte + 7 - down)
            return f"{text[:layout.start()]}{start}|{self.shift}@{order}{sign} ({scale},{offset}){text[layout.end():]}".encode()
        first = int(start) + self.shift
        if first < 0:
            raise Impossible("no bit before the first")
        if self.layout == "order":  # Intel counts from a byte's lowest bit, Motorola begins at its highest one
            first = first // 8 * 8 + (7 if order == "1" else 0)
        order = {"0": "1", "1": "0"}[order] if self.layout.startswith("order") else order
        sign = {"+": "-", "-": "+"}[sign] if self.layout == "sign" else sign
        return f"{text[:layout.start()]}{first}|{bits}@{order}{sign} ({scale},{offset}){text[layout.end():]}".encode()


# ── pictures ─────────────────────────────────────────────────────────────────────────────────────────────────────────

@dataclass(frozen=True)
class Turned(Edit):
    """A floor plan's picture turned or mirrored."""

    way: Image.Transpose

    def words(self) -> str:
        return f"{TURNS[self.way]} the picture"

    def apply(self, before: bytes) -> bytes:
        out = io.BytesIO()
        with Image.open(io.BytesIO(before)) as picture:
            picture.transpose(self.way).save(out, "PNG")
        return out.getvalue()

    def place(self, before: bytes, after: bytes) -> Place:
        return Place(self.file, 0, "", self.words())


# ── a copy ───────────────────────────────────────────────────────────────────────────────────────────────────────────

@dataclass
class Files:
    """Where the files are: of the recording, those that the configuration or the command line names in their place, and the
    configuration. `named`: by the file's name in a recording."""

    recording: Path
    config: Path
    named: dict[str, Path] = field(default_factory=dict)

    def read(self, file: str) -> bytes:
        """A file as it is."""
        path = self.config if file == CONFIG else self.named.get(file, self.recording / file)
        if not path.is_file():
            raise Impossible(f"{path} is not there")
        return path.read_bytes()

    def edited(self, edits: Sequence[Edit], file: str) -> bytes:
        """A file with all of its edits."""
        data = self.read(file)
        for edit in edits:
            data = edit.apply(data) if edit.file == file else data
        return data

    def copy(self, edits: Sequence[Edit], out: Path) -> dict[str, Path]:
        """Makes the folder `out`: the recording with the edits. Returns the changed ones of the `named` files."""
        changed = {edit.file for edit in edits if edit.file != CONFIG}
        link(self.recording.resolve(), out, changed)
        for file in changed:
            (out / file).parent.mkdir(parents=True, exist_ok=True)
            (out / file).write_bytes(self.edited(edits, file))
        return {file: out / file for file in changed if file in self.named}

    def places(self, edits: Sequence[Edit]) -> list[Place]:
        """What to write, and where."""
        out = []
        for edit in for_robot(edits):
            before = self.read(edit.file)
            after = edit.apply(before)
            if after != before and not (isinstance(edit, Rows) and edit.optional):
                place = edit.place(before, after)
                out.append(replace(place, file=str(self.config)) if edit.file == CONFIG else place)
        return out

    def apply(self, edits: Sequence[Edit], out: Path) -> Path | None:
        """Writes the corrected copy that a person asked for: with a comment at what was changed. Returns the configuration in it
        where that is changed, or names a file that is."""
        edits = for_robot(edits)
        if out.exists():
            raise FileExistsError(f"{out}: is there already; name a new folder")
        moved = self.copy(edits, out)
        notes = [f"# waymark check --apply: {edit.file}: {edit.words() or edit.place(self.read(edit.file), edit.apply(self.read(edit.file))).said()}"
                 for edit in edits if edit.file != CONFIG]
        meta = out / "recording.yaml"
        text = meta.read_text()
        meta.unlink()
        meta.write_text(text.rstrip() + "\n" + "\n".join(notes) + "\n")
        if not moved and not any(edit.file == CONFIG for edit in edits):
            return None
        config = self.edited(edits, CONFIG)
        for file, path in {**self.named, **moved}.items():
            key = NAMED[file]
            config = Value(CONFIG, (key,), f'"{path.resolve()}"').apply(config)
        (out / self.config.name).write_bytes(config)
        return out / self.config.name


NAMED = {"calibration.yaml": "calibration", "landmarks.csv": "landmarks", "vehicle.dbc": "dbc", "can-signals.yaml": "can_signals",
         "map/map.yaml": "map"}
"""Files of a recording that a configuration may name in their place, by its keys."""


def link(original: Path, out: Path, changed: set[str], inner: str = "") -> None:
    """Makes the folder `out` of links to the files of a recording but for those that are changed."""
    out.mkdir(parents=True)
    for path in original.iterdir():
        name = f"{inner}{path.name}"
        if path.is_dir() and any(file.startswith(f"{name}/") for file in changed):
            link(path, out / path.name, changed, f"{name}/")
        elif name not in changed:
            (out / path.name).symlink_to(path)


def degrees(radians: float) -> float:
    """Within half a turn."""
    return math.degrees(math.remainder(radians, 2 * math.pi))
