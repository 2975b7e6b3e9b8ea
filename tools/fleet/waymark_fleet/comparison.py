# SPDX-License-Identifier: Apache-2.0
"""What a change did to many drives: pairs of runs, their differences, and a verdict for each figure."""
import dataclasses
import json
import math
import pathlib

from . import statistics
from .plan import PlanError

RESULTS_FORMAT = "waymark-results/1"
# Family-wise: of all figures together, one of a hundred comparisons of nothing has a false alarm at most [Holm1979].
ALPHA = 0.01
# A drive's error that changed by more than this factor changed much, whatever the others did.
LARGE_CHANGE = 1.25
# Errors below these are none: their ratios are noise.
_LEAST_M, _LEAST_DEG = 1e-4, 1e-3
# Pairs below this cannot be told from chance: six of six in one direction have p = 0.03.
PAIRS_MIN = 6


@dataclasses.dataclass(frozen=True)
class Figure:
    """One figure of a drive. `value` of a row; differences are after less before, of which positive is worse."""

    name: str
    title: str
    about: str
    value: object
    is_ratio: bool  # differences are of logarithms: a change in per cent
    tolerance: float  # smaller changes are none, whatever their p: share, or the figure's unit
    is_count: bool = False  # large changes alone, by their signs
    is_time: bool = False  # of the computer; judged where both sides were measured side by side, in one batch


def _number(key, least=0.0):
    def value(row):
        found = row["figures"].get(key, row.get(key))
        return None if found is None or not math.isfinite(found) else max(found, least)
    return value


def _share_lost(row):
    figures = row["figures"]
    by_truth = figures.get("lost_s")
    if by_truth is not None and figures.get("duration_s"):
        return by_truth / figures["duration_s"]
    return figures.get("lost_share")


def _inconsistency(row):
    nees, dof = row["figures"].get("nees_mean"), row["figures"].get("anees_dof")
    return abs(math.log(nees / dof)) if nees and dof else None


def _turned(row):
    return _number("heading_rmse_deg", _LEAST_DEG)(row) or _number("rotation_rmse_deg", _LEAST_DEG)(row)


# Times of one program on one computer (21 batches of 40 drives, two cores, other work beside them): inside a batch, where the cells of a drive run
# one after the other, CPU time changed by at most 2 %, and the latency by 11 %. From batch to batch they changed by up to 37 % and 72 %, for all
# drives alike: other work and the clock rate are the batch's, so no number of drives makes p of such a change true.
FIGURES = [
    Figure("position", "position error", "root mean square of a drive", _number("position_rmse_m", _LEAST_M), True, 0.01),
    Figure("position_large", "drives that changed much", f"position error changed by more than a factor of {LARGE_CHANGE}",
           _number("position_rmse_m", _LEAST_M), True, 0.0, True),
    Figure("heading", "heading error", "root mean square of a drive", _turned, True, 0.01),
    Figure("nees", "inconsistency", "|ln(NEES / degrees of freedom)|: 0 where the stated covariance is right", _inconsistency, False, 0.02),
    Figure("lost", "share of the time lost", "by truth, else by the run's own state", _share_lost, False, 0.0005),
    Figure("latency", "time of an update", "90 of 100 are shorter, by the program's clock", _number("correct_p90_us"), True, 0.15,
           is_time=True),
    Figure("cpu", "CPU time", "of a whole replay", _number("cpu_s"), True, 0.10, is_time=True),
]


def load(side):
    """(folder, rows) of FOLDER or FOLDER:KEY=VALUE[,KEY=VALUE]: those rows alone."""
    folder, colon, chosen = side.rpartition(":")
    if not colon or "=" not in chosen:
        folder, chosen = side, ""
    file = pathlib.Path(folder) / "results.json"
    try:
        whole = json.loads(file.read_text())
    except OSError as error:
        raise PlanError(f"{file}: {error.strerror}; `waymark batch PLAN --out {folder}` writes it") from None
    except ValueError as error:
        raise PlanError(f"{file}: {error}") from None
    if whole.get("format") != RESULTS_FORMAT:
        raise PlanError(f"{file}: its format is not {RESULTS_FORMAT}")
    rows = whole["cells"]
    for item in filter(None, chosen.split(",")):
        key, _, value = item.partition("=")
        if key not in ("recording", "configuration", "program", "seed"):
            raise PlanError(f"{side}: '{key}': choose by recording, configuration, program or seed")
        left = [row for row in rows if str(row[key]) == value]
        if not left:
            raise PlanError(f"{side}: no run has the {key} '{value}'; there are {', '.join(sorted({str(row[key]) for row in rows}))}")
        rows = left
    return pathlib.Path(folder), rows


def pairs_of(before, after):
    """[(row before, row after)] of the same recording and seed, and of the same configuration and program where a side has several."""
    keys = ["recording", "seed"]
    for key in ("configuration", "program"):
        if any(len({row[key] for row in rows}) > 1 for rows in (before, after)):
            keys.append(key)

    def by_key(rows):
        return {tuple(row[key] for key in keys): row for row in rows}
    first, second = by_key(before), by_key(after)
    both = [key for key in first if key in second]
    if not both:
        raise PlanError("no run is on both sides: the same recordings and seeds are compared, and where a side has several "
                        "configurations or programs, the same ones; choose one by FOLDER:program=NAME")
    return [(first[key], second[key]) for key in both]


def name_of(row, rows):
    """A drive's name: recording, and what else differs among the rows."""
    more = [str(row[key]) for key in ("configuration", "program", "seed") if len({r[key] for r in rows}) > 1]
    return ", ".join([row["recording"], *more])


def difference(figure, before, after):
    """How much worse a drive became: logarithm of the ratio, or difference; None where it is not measured on both sides."""
    if before["status"] != "done" or after["status"] != "done":
        return None
    one, two = figure.value(before), figure.value(after)
    if one is None or two is None or not math.isfinite(one) or not math.isfinite(two):
        return None
    if not figure.is_ratio:
        return two - one
    return 0.0 if one == two else math.log(two / one) if one > 0 and two > 0 else None


def _judge_large(figure, differences):
    much = math.log(LARGE_CHANGE)
    worse, better = sum(d > much for d in differences), sum(d < -much for d in differences)
    return {"worse": worse, "better": better, "change": (worse - better) / len(differences), "low": None, "high": None,
            "p": statistics.sign_test(worse, better)}


def _judge_mean(figure, differences):
    statistic = statistics.trimmed_mean
    if not figure.is_ratio and sum(d == 0 for d in differences) > len(differences) / 2:
        statistic = _mean  # few drives are lost at all: a trimmed mean of them is 0
    found = statistic(differences)
    low, high = statistics.bca_interval(differences, statistic)
    scale = math.expm1 if figure.is_ratio else float
    return {"worse": sum(d > 0 for d in differences), "better": sum(d < 0 for d in differences), "change": scale(found),
            "low": scale(low), "high": scale(high), "p": statistics.signed_rank(differences)}


def _mean(values):
    return sum(values) / len(values)


def judge(pairs, alpha=ALPHA, tolerances=None, is_apart=False):
    """A verdict for each figure: worse, better, or no difference found. `is_apart`: the sides are of two batches, and
    times are judged only where a tolerance is given."""
    out, tolerances = [], tolerances or {}
    for figure in FIGURES:
        differences = [d for one, two in pairs if (d := difference(figure, one, two)) is not None]
        row = {"figure": figure.name, "title": figure.title, "about": figure.about, "is_ratio": figure.is_ratio, "drives": len(differences),
               "tolerance": tolerances.get(figure.name, figure.tolerance),
               "is_judged": not (is_apart and figure.is_time) or figure.name in tolerances}
        if len(differences) >= PAIRS_MIN:
            row |= (_judge_large if figure.is_count else _judge_mean)(figure, differences)
            row["typical_before"], row["typical_after"] = (
                statistics.trimmed_mean([v for pair in pairs if (v := _value(figure, pair[side])) is not None]) for side in (0, 1))
        out.append(row)
    judged = [row for row in out if "p" in row and row["is_judged"]]
    for row, p in zip(judged, statistics.holm([row["p"] for row in judged])):
        row["p_holm"] = p
    for row in out:
        row["verdict"] = _verdict(row, alpha)
    return out


def _verdict(row, alpha):
    if "p" not in row:
        return "not measured"
    if not row["is_judged"]:
        return "two batches"
    if row["p_holm"] >= alpha or abs(row["change"]) <= row["tolerance"]:
        return "no difference found"
    return "worse" if row["change"] > 0 else "better"


def _value(figure, row):
    return figure.value(row) if row["status"] == "done" else None


def worst(pairs, count=10):
    """The drives that became worse most, by the first figure that is measured: [(difference, before, after)]."""
    for figure in FIGURES:
        found = [(d, one, two) for one, two in pairs if (d := difference(figure, one, two)) is not None]
        if found:
            found = sorted((one for one in found if one[0] > 0), key=lambda one: -one[0])
            return figure, found[:count]
    return FIGURES[0], []
