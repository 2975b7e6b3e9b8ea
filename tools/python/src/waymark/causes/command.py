# SPDX-License-Identifier: Apache-2.0
"""waymark causes: the mistake in the files that explains a drive."""

import argparse
import dataclasses
import json
import math
import sys
from pathlib import Path
from typing import Any

from ..native import WaymarkError
from .changes import NAMED, Impossible
from .features import with_features
from .robot import Robot
from .search import APART_MIN, GAIN_MIN, NAMED_MOST, Search, Verdict
from .trial import Change, Drive, Trials, edits_of, scratch_folder

EPILOG = """A mistake is named where it predicts the drive better than every other one, and than none, with a probability of 99 %, on the half of the
drive that its size was not fitted to, and where the corrected drive is right. Exit code 0 where none is named, 2 where one is, 1 where
the recording can't be driven.

example:
  waymark causes config/robot.yaml first-drive --apply first-drive-corrected"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="waymark causes", description="Finds the mistake in a recording's or a configuration's files that explains a drive.",
                                     epilog=EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("config", type=Path, metavar="CONFIG")
    parser.add_argument("recording", type=Path, metavar="RECORDING")
    for name, what in (("landmarks", "instead of the recording's map"), ("calibration", "instead of the recording's"),
                       ("map", "a map.yaml instead of the recording's")):
        parser.add_argument(f"--{name}", type=Path, metavar="FILE", help=what)
    parser.add_argument("--clocks-apart", action="store_true", help="the clocks of two streams of motion run apart, as `waymark check` finds: name whose is off")
    parser.add_argument("--apply", type=Path, metavar="FOLDER", help="a corrected copy of the recording, and of the configuration where that has the mistake")
    parser.add_argument("--json", action="store_true", help="for programs")
    return parser


def _share(drive: Drive) -> dict[str, float]:
    return {"updates_that_fit": round(drive.explained, 4), "mean_square": round(drive.squares, 3) if math.isfinite(drive.squares) else -1.0,
            "lost": round(drive.lost, 4), "degraded": round(drive.degraded, 4), "states_nats": round(drive.unusual, 2)}


def _cause(robot: Robot, change: Change) -> dict[str, Any]:
    fault, size = change
    ways = [robot.files.places(edits) for edits in (fault.edits(size), *fault.other_places(size))]
    return {"name": fault.name, "what": fault.say(size), "size": [round(value, 6) for value in size],
            "fix": ", or ".join("; ".join(place.said() for place in way) for way in ways), "places": [dataclasses.asdict(place) for place in ways[0]]}


def report(robot: Robot, verdict: Verdict) -> dict[str, Any]:
    """What was found, for programs."""
    out: dict[str, Any] = {"rows": verdict.rows, "drives": verdict.drives, "causes": [_cause(robot, c) for c in verdict.causes],
                           "undecided": [_cause(robot, c) for c in verdict.undecided]}
    if verdict.before:
        out["before"] = _share(verdict.before)
    if verdict.after and verdict.before:
        after = verdict.after
        out |= {"after": _share(after), "probability": round(min(verdict.probability, NAMED_MOST), 4), "gain_nats": round(verdict.gain, 3),
                "taken_up": verdict.gain < APART_MIN and not any(fault.is_fact or fault.is_shown or fault.is_local for fault, _ in verdict.causes)}
        before, surely = verdict.before, f"probability {min(verdict.probability, NAMED_MOST):.4g}"
        if verdict.gain >= GAIN_MIN or any(fault.is_shown for fault, _ in verdict.causes):
            better = (f"and each is {math.exp(min(20, verdict.gain)):.1f} times as likely, on the half of the drive that this was not fitted to ({surely})")
        elif before.unusual - after.unusual < 1:
            better = "and they fit as well without it: the filter refuses what it cannot use"
        else:
            better = (f"and what the calibration's states take up is no longer {math.sqrt(2 * before.unusual):.1f} but {math.sqrt(2 * after.unusual):.1f} "
                      f"of their start sigmas together ({surely})")
        out["told"] = (f": corrected in a trial, {100 * after.explained:.0f} % of the updates fit (now {100 * before.explained:.0f} %), {better}; "
                       f"it leaves {100 * (1 - after.explained):.0f} % refused, {100 * after.lost:.0f} % of the time lost")
    return out


def _print(found: dict[str, Any]) -> None:
    print(f"causes       {found['rows']} usual mistakes, {found['drives']} drives: "
          f"{'found what explains the observations' if found['causes'] else 'this drive does not tell apart which' if found['undecided'] else 'none explains the observations'}")
    for cause in found["causes"]:
        print(f"bad   cause          {cause['what']}{found['told']}; fix: {cause['fix']}")
    for cause in found["undecided"]:
        print(f"note  cause          either: {cause['what']}; fix: {cause['fix']}")


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    options = _parser().parse_args(arguments)
    named = {file: path for file, key in NAMED.items() if (path := getattr(options, key, None)) is not None}
    trials: Trials | None = None
    try:
        robot = Robot.read(options.recording, options.config, named, options.clocks_apart)
        folder = scratch_folder()
        driven = with_features(robot, folder)
        trials = Trials(driven, folder)
        verdict = Search(driven, trials, _progress if sys.stderr.isatty() else lambda share: None).run()
        found = report(robot, verdict)
        if options.apply and verdict.causes:
            config = robot.files.apply(edits_of(verdict.causes), options.apply)
            found["applied"] = [str(options.apply)] + ([str(config)] if config else [])
    except (WaymarkError, Impossible, OSError, ValueError) as error:
        print(f"waymark causes: {error}", file=sys.stderr)
        return 1
    finally:
        if trials:
            trials.end()
    if options.json:
        print(json.dumps(found, indent=1))
    else:
        _print(found)
    return 2 if found["causes"] else 0


def _progress(share: float) -> None:
    print(f"\r\033[K{100 * share:3.0f} %", end="", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
