# SPDX-License-Identifier: Apache-2.0
"""waymark suggest: noises, priors and states that would make a run's observations more likely."""

import argparse
import dataclasses
import json
import math
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from ..causes.changes import CONFIG, Impossible, Value
from ..causes.trial import remove, scratch_folder
from ..native import WaymarkError
from ..numbers import finite
from ..replaying import EventLog, replay
from .drive import AFTER_GAP, GAP_LEAST_S, GAP_MOST_S, GAP_SHARE, NEXT, Run, Score, Scores, Span
from .parameters import of_configuration
from .search import ALL, PROMISE, Figure, Gain, Search, Suggestion, gain_of, residuals_of

UNITS = {"bearing": "rad", "heading": "rad", "elevation": "rad", "pixel": "px"}
# A state is not observable where its sigma keeps so much of its prior's; its prior is wrong beyond so many sigmas.
UNOBSERVED, BEYOND_SIGMAS = 0.95, 3.0
FILES = ("calibration", "landmarks", "dbc", "can_signals", "map", "file", "saved_pose", "saved_map", "folder", "socket", "picture_socket")
"""Keys of a configuration whose values are names of files, from its own folder."""
USAGE = 2

EPILOG = """examples:
  waymark suggest config/robot.yaml recordings/monday --out config/robot-suggested.yaml
  waymark suggest runs/monday
  waymark suggest config/robot.yaml recordings/tuesday --against config/robot-suggested.yaml
docs/suggest.md explains the method."""


class Refused(ValueError):
    """The command line, or what it names, is wrong."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="waymark suggest", formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EPILOG, description=(
        "After a run that worked: which noises, priors and states would make its observations more likely. The run's\nevents go through the estimator "
        "again with each change, and what gains also in parts of the drive that the\nsearch did not see is suggested, with its gain. Truth is not used."))
    parser.add_argument("config", type=Path, metavar="CONFIG", help="a configuration, or alone the folder of a run")
    parser.add_argument("recording", type=Path, nargs="?", metavar="RECORDING", help="folder of a recording, with a configuration")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the suggested configuration to this file")
    parser.add_argument("--against", type=Path, metavar="FILE", help="no search: measure this configuration against CONFIG or RUN's")
    parser.add_argument("--only", default="", metavar="WORDS", help="search parameters that begin so alone, as sightings.noise,motion.states")
    parser.add_argument("--from", dest="from_s", type=finite, default=0.0, metavar="S", help="score from here on, s from the first stamp")
    parser.add_argument("--to", dest="to_s", type=finite, default=0.0, metavar="S", help="only until here, s from the first stamp; 0: to the end")
    parser.add_argument("--minutes", type=finite, default=10.0, help="the search ends after this time; then its result depends on the computer (10)")
    parser.add_argument("--json", action="store_true", help="the figures, for programs")
    return parser


@dataclasses.dataclass(frozen=True)
class Occasion:
    """What is searched."""

    config: str
    text: str  # of the configuration
    recording: str
    estimator: str
    run: Run
    reference: Score

    def facts(self) -> dict[str, Any]:
        """For programs."""
        return {"config": self.config, "recording": self.recording, "estimator": self.estimator, "scored_s": self.run.span.seconds,
                "gap_s": self.run.span.gap_ns * 1e-9, "updates": int(self.reference.seen[NEXT].sum()),
                "updates_after_gaps": int(self.reference.seen[AFTER_GAP].sum())}


def _run_of(options: argparse.Namespace, scratch: Path) -> tuple[Path, Path | None]:
    """The event log, and the configuration; None: the log's own."""
    if options.recording is None:
        if not options.config.is_dir():
            raise Refused(f"{options.config}: no folder of a run; waymark suggest RUN, or waymark suggest CONFIG RECORDING")
        return options.config / "events.wmlog", None
    replay(options.recording, options.config, out=scratch / "run")
    return scratch / "run" / "events.wmlog", options.config


def _occasion(options: argparse.Namespace, scratch: Path) -> tuple[Occasion, Scores]:
    path, config = _run_of(options, scratch)
    log = EventLog(path)
    begin, last = log.span()
    if not log.kinds():
        raise Refused(f"{path}: has no events")
    end = last + 1
    end = min(end, begin + round(options.to_s * 1e9)) if options.to_s > 0 else end
    begin += round(options.from_s * 1e9)
    if end - begin < 2e9:
        raise Refused(f"{path}: less than 2 s lie between --from and --to")
    gap = min(GAP_MOST_S, max(GAP_LEAST_S, (end - begin) * 1e-9 * GAP_SHARE))
    scores = Scores(Run(path, config, Span(begin, end, round(gap * 1e9))), scratch)
    reference = scores.with_states({})
    if reference is None:
        raise Refused(f"{log.estimator}: the estimator can't start with this run's parameters")
    if not reference.seen[NEXT].sum():
        raise Refused(f"{log.estimator}: no observation is compared with a prediction in this run, so that nothing measures a gain")
    scores.run = dataclasses.replace(scores.run, reference=reference)
    text = config.read_text() if config else log.config
    if "estimator" not in (yaml.safe_load(text) or {}):
        text = f"{text.rstrip()}\nestimator: {log.estimator}\n"  # which the sources chose
    return Occasion(str(options.config), text, log.recording, log.estimator, scores.run, reference), scores


# ── what is printed ──────────────────────────────────────────────────────────────────────────────────────────────────

def _figure(figure: Figure) -> dict[str, float]:
    return {"nats": figure.value, "sigma": figure.sigma, "times_as_likely": math.exp(figure.value)}


def _gain(gain: Gain) -> dict[str, Any]:
    return {"both": _figure(gain.both), "next": _figure(gain.of[NEXT])} | ({"after_gap": _figure(gain.of[AFTER_GAP])} if gain.has_gap else {})


def _fits(occasion: Occasion, before: Score, after: Score, splits: list[bool]) -> list[dict[str, Any]]:
    out = []
    for channel in (NEXT, AFTER_GAP):
        now, then = residuals_of(before, channel, splits), residuals_of(after, channel, splits)
        out += [{"source": occasion.reference.sources[key[0]], "residual": key[1], "after_gap": channel == AFTER_GAP,
                 **{name: [getattr(now[key], name), getattr(then[key], name)] for name in ("nis", "rms", "refused")}} for key in now if key in then]
    return out


def _notes(score: Score) -> Iterator[dict[str, str]]:
    """Of states that a prior does not fit."""
    for name, (value, sigma) in score.end.items():
        at, prior = score.begin.get(name, (0.0, 0.0))
        if prior <= 0 or sigma <= 0 or name.startswith("noise."):
            continue
        moved = abs(value - at)
        if moved > BEYOND_SIGMAS * max(prior, sigma):
            yield {"state": name, "text": f"ends at {value:.4g} +- {sigma:.2g}, {moved / prior:.1f} of its prior's sigmas from {at:.4g}: calibration.yaml should have this value"}
        elif sigma > UNOBSERVED * prior:
            yield {"state": name, "text": f"is not observable in this drive: its sigma stays at its prior's ({prior:.2g}); it may be off"}


def _gain_lines(gain: Gain) -> Iterator[str]:
    said = [("an observation, predicted from all before it", gain.of[NEXT])] + [("after a gap, predicted by motion alone", gain.of[AFTER_GAP])] * gain.has_gap
    for what, figure in said:
        yield f"{what:44} {math.exp(figure.value):6.3f} times as likely  ({figure.value:+.4f} +- {figure.sigma:.4f} nats)"


def _fit_lines(fits: list[dict[str, Any]], gap_s: float, halves: tuple[float, float] | None) -> Iterator[str]:
    for is_after in (False, True):
        mine = [fit for fit in fits if fit["after_gap"] == is_after]
        if mine:
            yield f"after {gap_s:.1f} s of motion alone" if is_after else f"\n{'innovations':34} {'NIS (1 is right)':>17} {'root mean square':>17} {'refused, %':>17}"
        for fit in mine:
            name = f"{fit['source']} {fit['residual']}, {UNITS.get(fit['residual'], 'm')}"
            (nis, nis_after), (rms, rms_after), (refused, refused_after) = fit["nis"], fit["rms"], fit["refused"]
            yield f"  {name:32} {nis:7.2f} -> {nis_after:6.2f} {rms:7.3g} -> {rms_after:6.3g} {100 * refused:7.1f} -> {100 * refused_after:6.1f}"
    if halves:
        yield f"two filters with half of the landmarks each: difference of the poses {halves[0]:.2f} -> {halves[1]:.2f} (below 3: no contradiction)"


def _report(occasion: Occasion, found: Suggestion, drives: int) -> dict[str, Any]:
    assert found.promise
    return occasion.facts() | {
        "drives": drives, "is_cut": found.is_cut, "withdrawn": found.withdrawn, "share": found.share, "halves": list(found.halves),
        "changes": [{"parameter": c.parameter.key, "now": c.parameter.now, "suggested": c.value, "gain": _gain(c.gain)} for c in found.changes],
        "promise": _gain(found.promise), "fits": _fits(occasion, found.before, found.after, PROMISE if found.changes else ALL), "notes": list(_notes(found.after))}


def _lines(occasion: Occasion, found: Suggestion, report: dict[str, Any]) -> Iterator[str]:
    assert found.promise
    yield (f"{report['recording']}, {report['scored_s']:.1f} s: {report['updates']} updates, and {report['updates_after_gaps']} after gaps of "
           f"{report['gap_s']:.1f} s; {report['drives']} drives")
    if found.is_cut:
        yield "the time was over before the search had ended: --minutes gives it more"
    if found.changes:
        yield f"\n{'parameter':44} {'now':>10} {'suggested':>10}   gain of it alone, nats an update"
        for c in found.changes:
            yield f"{c.parameter.key:44} {c.parameter.now:10.4g} {c.value:10.4g}   {c.gain.both.value:+.4f} +- {c.gain.both.sigma:.4f}"
        yield "\nAll together, on a third of the drive that neither search nor choice has seen:"
        yield from _gain_lines(found.promise)
    else:
        yield "nothing to gain" + (f": {found.withdrawn}" if found.withdrawn else "")
    yield from _fit_lines(report["fits"], report["gap_s"], found.halves if found.changes else None)
    if found.changes and found.share < 1:
        yield f"{100 * found.share:.0f} % of the way to the largest likelihood: with more of it the halves would contradict each other"
    yield from [""] * bool(report["notes"])
    yield from (f"note  {note['state']} {note['text']}" for note in report["notes"])


# ── commands ─────────────────────────────────────────────────────────────────────────────────────────────────────────

def _moved(node: Any, path: tuple[str | int, ...], old: Path, new: Path) -> Iterator[Value]:
    """Names of files, as they are found from the folder of the new file."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        if key in FILES and isinstance(value, str) and not Path(value).is_absolute():
            yield Value(CONFIG, (*path, key), json.dumps(os.path.relpath(old / value, new)))
        yield from _moved(value, (*path, key), old, new)


def _write(occasion: Occasion, found: Suggestion, out: Path) -> None:
    """The configuration with the new values; its other lines stay."""
    facts, data = occasion.facts(), occasion.text.encode()
    old, new = Path(occasion.config).resolve().parent, out.resolve().parent
    edits = list(_moved(yaml.safe_load(occasion.text), (), old, new)) if old != new else []
    for edit in [*edits, *(Value(CONFIG, tuple(c.parameter.key.split(".")), f"{c.value:.6g}") for c in found.changes)]:
        data = edit.apply(data)
    head = [f"Made by `waymark suggest` from {facts['config']}", f"and {facts['scored_s']:.0f} s of {facts['recording']} ({facts['updates']} updates), without truth.",
            "Promise, measured on a third of the drive that was kept for it:", *(_gain_lines(found.promise) if found.promise else ()),
            "Try it on another drive before you keep it: waymark suggest CONFIG RECORDING --against THIS_FILE",
            *(f"{c.parameter.key}: before {c.parameter.now:g}; gain of it alone {c.gain.both.value:+.4f} nats an update" for c in found.changes)]
    out.write_text("".join(f"# {line}\n" for line in head) + data.decode())


def _compare(options: argparse.Namespace, occasion: Occasion, scores: Scores) -> None:
    """Measures another configuration of the same estimator."""
    text = options.against.read_text()
    of_configuration(text)  # refuses one that can't be read
    other = (yaml.safe_load(text) or {}).get("estimator")
    if other not in (None, occasion.estimator):
        raise Refused(f"{options.against}: its estimator is {other}, not {occasion.estimator}")
    before = scores.with_states({}, has_halves=True)
    scores.run = dataclasses.replace(scores.run, config=options.against)
    after = scores.with_states({}, has_halves=True)
    if before is None or after is None:
        raise Refused(f"{options.against}: the estimator can't start with it")
    gain, fits = gain_of(before, after, ALL), _fits(occasion, before, after, ALL)
    if options.json:
        print(json.dumps(occasion.facts() | {"gain": _gain(gain), "halves": [before.nees, after.nees], "fits": fits}, indent=1))
        return
    print(f"{occasion.recording}, {occasion.run.span.seconds:.1f} s: {options.against} against {occasion.config}")
    print("\n".join([*_gain_lines(gain), *_fit_lines(fits, occasion.run.span.gap_ns * 1e-9, (before.nees, after.nees))]))


def _search(options: argparse.Namespace, occasion: Occasion, scores: Scores) -> None:
    only = tuple(word for word in options.only.split(",") if word)
    parameters = of_configuration(occasion.text, only)
    if not parameters:
        raise Refused("--only: no parameter that is searched begins so" if only else f"{occasion.estimator}: has no parameter that is searched")
    begin = time.monotonic()

    def show(done: float, what: str) -> None:
        left = (time.monotonic() - begin) * (1 - done) / max(done, 1e-3)
        print(f"\r\033[K{what}: {100 * done:.0f} %, about {left:.0f} s left", end="", file=sys.stderr, flush=True)

    has_progress = sys.stderr.isatty() and not options.json
    found = Search(scores, parameters, options.minutes, show if has_progress else lambda done, what: None).run()
    found.after = scores.with_states({c.parameter.key: c.value for c in found.changes}) or found.after
    if has_progress:
        print("\r\033[K", end="", file=sys.stderr)
    report = _report(occasion, found, scores.drives)
    print(json.dumps(report, indent=1) if options.json else "\n".join(_lines(occasion, found, report)))
    if options.out and found.changes:
        _write(occasion, found, options.out)
        if not options.json:
            print(f"\nwritten to {options.out}")


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    options, scratch, scores = _parser().parse_args(arguments), scratch_folder(), None
    try:
        occasion, scores = _occasion(options, scratch)
        (_compare if options.against else _search)(options, occasion, scores)
    except (WaymarkError, Refused, Impossible, OSError, ValueError, yaml.YAMLError) as error:
        print(f"waymark suggest: {error}", file=sys.stderr)
        is_usage = isinstance(error, Refused) or isinstance(error, WaymarkError) and error.status in ("bad usage", "bad configuration", "not found")
        return USAGE if is_usage else 1
    finally:
        if scores:
            scores.pool.end()
        remove(scratch)
    return 0


if __name__ == "__main__":
    sys.exit(main())
