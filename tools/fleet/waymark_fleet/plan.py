# SPDX-License-Identifier: Apache-2.0
"""A plan: recordings, configurations and programs, of which each combination is a cell."""
import argparse
import dataclasses
import glob
import json
import math
import os
import pathlib
import shutil

from .sums import of_text

FORMAT = "waymark-plan/1"
# Kept of each run: what reports, `diff` and `eval` read. An event log repeats what the recording has.
KEPT = ["trajectory.csv", "innovations.csv", "map-estimate.csv", "map-estimate.wmmap", "looked-for.csv", "reference.csv", "health.json", "timing.json"]
_KEYS = {"format", "recordings", "configurations", "programs", "seeds", "replay", "eval", "keep"}


class PlanError(ValueError):
    """A plan or the command line is wrong: where, and what to do."""


def finite(text):
    """A number; the type of an option. NaN and infinity are refused."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"'{text}' is not a finite number")
    return value


@dataclasses.dataclass(frozen=True)
class Cell:
    """One run: a program, a configuration, a recording and a seed."""

    recording: str  # names: of a row of the results
    configuration: str
    program: str
    seed: int
    data: pathlib.Path  # recording's folder or event log
    truth: pathlib.Path | None  # recording whose truth judges the run
    config: pathlib.Path | None  # none: the event log's own
    command: tuple[str, ...]  # the program
    judge: tuple[str, ...]  # waymark eval
    replay: tuple[str, ...] = ()  # more options of replay
    evaluation: tuple[str, ...] = ()  # and of eval
    keep: tuple[str, ...] = tuple(KEPT)

    def key(self, sums):
        """Name of the cell in the store: the sum of all that its result depends on, and of nothing else."""
        parts = {"version": 1, "program": sums.once(sums.program, self.command), "data": sums.once(sums.folder, self.data),
                 "seed": self.seed, "config": sums.once(sums.configuration, self.config) if self.config else None, "replay": self.replay, "keep": self.keep}
        if self.truth:
            parts |= {"truth": sums.once(sums.folder, self.truth), "judge": sums.once(sums.program, self.judge), "eval": self.evaluation}
        for option, value in zip(self.replay, self.replay[1:]):
            if os.path.exists(value):
                parts[option] = sums.once(sums.folder, value)
        return of_text(json.dumps(parts, sort_keys=True))[:32]


def desk_program(name, beside):
    """The command of a program of the desk: beside this one, or in PATH."""
    here = pathlib.Path(beside) / name
    found = str(here) if os.access(here, os.X_OK) else shutil.which(name)
    if not found:
        raise PlanError(f"the program {name} is neither in {beside} nor in PATH; package waymark-tools has it")
    return (found,)


def read(path, beside):
    """The cells of a plan, in the order of recordings, configurations, programs and seeds: those of a recording together,
    so that programs are measured one soon after the other."""
    path = pathlib.Path(path)
    plan = _mapping(path)
    unknown = sorted(set(plan) - _KEYS)
    if unknown:
        raise PlanError(f"{path}: {unknown[0]}: unknown key; known here: {', '.join(sorted(_KEYS))}")
    if plan.get("format") != FORMAT:
        raise PlanError(f"{path}: format: write `format: {FORMAT}`")
    home = path.resolve().parent
    recordings = _recordings(path, home, plan.get("recordings"))
    configurations = _configurations(path, home, plan.get("configurations"))
    programs = _programs(path, home, plan.get("programs"), beside)
    judge = desk_program("waymark-eval", beside)
    options = {name: tuple(map(str, plan.get(name) or ())) for name in ("replay", "eval")}
    seeds = plan.get("seeds", [1])
    if not isinstance(seeds, list) or not all(isinstance(seed, int) for seed in seeds) or not seeds:
        raise PlanError(f"{path}: seeds: write a list of whole numbers, as [1, 2]")
    cells = []
    for name, data, truth, evaluation in recordings:
        is_log = data.is_file()
        if not is_log and not configurations:
            raise PlanError(f"{path}: configurations: the recording {data} needs one; an event log alone has its own")
        for configuration, config in configurations or [("own", None)]:
            for program, command in programs:
                for seed in seeds[:1] if is_log else seeds:  # an event log brings its own seed
                    cells.append(Cell(name, configuration, program, seed, data, truth, config, command, judge, options["replay"],
                                      options["eval"] + evaluation, tuple(plan.get("keep", KEPT))))
    return cells


def _mapping(path):
    try:
        import yaml  # here, so that --help needs no package
    except ImportError:
        raise PlanError("plans are read by PyYAML, which is not there; install the package python3-yaml") from None
    try:
        plan = yaml.safe_load(path.read_text())
    except OSError as error:
        raise PlanError(f"{path}: {error.strerror}; docs/fleet.md has a plan to begin with") from None
    except yaml.YAMLError as error:
        raise PlanError(f"{path}: {error}") from None
    if not isinstance(plan, dict):
        raise PlanError(f"{path}: a plan is a mapping of keys; docs/fleet.md has one to begin with")
    return plan


def _recordings(path, home, given):
    """(name, folder or log, recording with truth or none, options of eval) each. Names are the shortest that differ."""
    out = []
    for entry in given if isinstance(given, list) else [given]:
        entry = entry if isinstance(entry, dict) else {"path": entry}
        if not isinstance(entry.get("path"), str) or set(entry) - {"path", "truth", "eval"}:
            raise PlanError(f"{path}: recordings: an entry is a path, or a mapping with path, truth and eval; found {entry}")
        found = sorted(glob.glob(str(home / entry["path"]), recursive=True))
        found = [pathlib.Path(one) for one in found if one.endswith(".wmlog") or os.path.isfile(os.path.join(one, "recording.yaml"))]
        if not found:
            raise PlanError(f"{path}: recordings: {home / entry['path']}: neither a recording nor an event log is there")
        for data in found:
            truth = home / entry["truth"].replace("{name}", data.stem) if "truth" in entry else data if data.is_dir() else None
            if truth is not None and not (truth / "recording.yaml").is_file():
                raise PlanError(f"{path}: recordings: {truth} is not a recording; truth names the one that judges {data}")
            options = tuple(map(str, entry.get("eval", ())))
            known = truth is not None and ((truth / "truth.csv").is_file() or "gnss" in options)
            out.append((data, truth if known else None, options))
    parts = [(data.parent / data.stem if data.is_file() else data).parts for data, _, _ in out]
    for length in range(1, 12):
        names = ["/".join(part[-length:]) for part in parts]
        if len(set(names)) == len({data for data, _, _ in out}):
            break
    return [(name, *one) for name, one in zip(names, out)]


def _configurations(path, home, given):
    entries = given.items() if isinstance(given, dict) else [(pathlib.Path(str(one)).stem, one) for one in given or ()]
    out = []
    for name, value in entries:
        found = sorted(glob.glob(str(home / str(value))))
        if not found:
            raise PlanError(f"{path}: configurations: {home / str(value)}: there is no such file")
        out += [(name if len(found) == 1 else pathlib.Path(one).stem, pathlib.Path(one)) for one in found]
    if len({name for name, _ in out}) < len(out):
        raise PlanError(f"{path}: configurations: two have the same name; write them as NAME: PATH")
    return out


def _programs(path, home, given, beside):
    """Commands: a path from the plan's folder, a name in PATH, or a list with an emulator before the program."""
    if given is None:
        return [("waymark", desk_program("waymark", beside))]
    if not isinstance(given, dict):
        raise PlanError(f"{path}: programs: write NAME: PATH, or NAME: [EMULATOR, OPTION, PATH]")
    out = []
    for name, words in given.items():
        words = [str(word) for word in (words if isinstance(words, list) else [words])]
        command = tuple(str(home / word) if (home / word).exists() else word for word in words)
        for word in (command[0], command[-1]):
            if not os.access(word, os.R_OK) and not shutil.which(word):
                raise PlanError(f"{path}: programs: {name}: {word} is neither a file nor in PATH")
        out.append((str(name), command))
    return out
