# SPDX-License-Identifier: Apache-2.0
"""What happened in an event log of a black box: when the pose was lost or doubted, where, and why, by the causes and findings
that the runtime writes (health.json), at the time at which it began and at the end of the log."""
import collections
import csv
import itertools
import json
import math
import pathlib
import statistics
import subprocess
import tempfile

from . import wmlog

# Version of the judgement: a new one judges kept logs again.
VERSION = 2
# Refused innovations of these last seconds before the doubt show its cause; the monitor's shortest window has 2 s.
WINDOW_S = 3.0
# The causes of unknown identities and of silence need the monitor's shortest window after the beginning.
LATER_S = 5.0
# A common offset: most refused innovations are so near to their median.
SHARE_ALIKE, BEARINGS_ALIKE_RAD, RANGES_ALIKE = 0.7, 0.12, 0.08
# Offsets below these explain no refusal: bearings and ranges of usual sensors are better.
BEARING_OFF_RAD, RANGE_OFF = 0.15, 0.10
REFUSED_MIN = 6
# Found again so far from where it was expected, the robot was carried, or it slipped.
ELSEWHERE_M, ELSEWHERE_RAD = 0.5, 0.5
# A source whose last event is so much older than the log's end is silent: sensors send several times a second.
SILENT_S = 1.5
# A gyro's noise does not repeat one value for so long while the wheels turn; a coarse one repeats values at all times.
STUCK_S, REPEATS_MOST = 3.0, 0.2
_REFUSED = ("gate", "searching")
_DOUBT = ("lost", "degraded", "dead_reckoning")

# What each cause usually is. Those of the runtime have sections in docs/troubleshooting.md.
CAUSES = {
    "program-ended": ("the program or the computer ended without its regular end", "pose-lost"),
    "motion": ("odometry is wrong: an encoder, a gyro or the wheels", "motion-sensor"),
    "identities-unknown": ("identities that the map does not have", "identities-unknown"),
    "silent": ("a source gave no data any more", "source-silent"),
    "off-map": ("the pose is outside of the map", "start-off-map"),
    "bearings-off": ("all bearings are off by the same angle: the sensor, or the robot in place, was turned", "calibration-off"),
    "ranges-off": ("all ranges are off by the same factor: unit, scale or map", "observations-biased"),
    "elsewhere": ("the robot was carried, or slipped: it was found again elsewhere", "pose-lost"),
    "contradicted": ("what is observed contradicts the pose, without a common offset", "observations-refused"),
    "landmark-moved": ("landmarks are not where the map has them", "landmark-moved"),
    "none": ("no cause was found", "pose-doubtful"),
}


def _poses(run):
    """[(t_ns, x, y, heading, state)]"""
    with (run / "trajectory.csv").open() as file:
        return [(int(r["t_ns"]), float(r["x_m"]), float(r["y_m"]), 2 * math.atan2(float(r["qz"]), float(r["qw"])), r["state"])
                for r in csv.DictReader(file)]


def _begin(poses):
    """Index of the first doubt after tracking that lasts: lost and degraded at once, dead reckoning for LATER_S."""
    tracked = False
    for i, (t_ns, *_, state) in enumerate(poses):
        if state in ("lost", "degraded") and tracked:
            return i
        if state == "dead_reckoning" and tracked:
            after = [p[4] for p in poses[i:] if p[0] <= t_ns + LATER_S * 1e9]
            if all(other in _DOUBT for other in after):
                return i
        tracked = tracked or state == "tracking"
    return None


def _replay(program, log, out):
    done = subprocess.run([*program, "replay", str(log), "--out", str(out)], capture_output=True, text=True, check=False)
    if done.returncode != 0 or not (out / "trajectory.csv").is_file():
        raise ValueError(f"{log}: {done.stderr.strip() or 'its replay gave no poses'}")
    return json.loads((out / "health.json").read_text())


def _refused(run, begin_ns):
    """Refused innovations before the doubt: {kind: [offset of a bearing in rad, or ratio of a range]}, and their source."""
    out, sources = collections.defaultdict(list), collections.Counter()
    with (run / "innovations.csv").open() as file:
        for row in csv.DictReader(file):
            if not begin_ns - WINDOW_S * 1e9 <= int(row["t_ns"]) <= begin_ns or row["verdict"] not in _REFUSED:
                continue
            observed, expected = float(row["observed"]), float(row["expected"] or "nan")
            sources[row["source"]] += 1
            if row["residual"] == "bearing":
                out["bearing"].append(math.remainder(observed - expected, 2 * math.pi))
            elif row["residual"] == "range" and expected > 0:
                out["range"].append(observed / expected)
    return out, sources.most_common(1)[0][0] if sources else ""


def _common(values, alike, relative):
    """Median of the values if most are near it, else None."""
    if len(values) < REFUSED_MIN:
        return None
    middle = statistics.median(values)
    width = alike * middle if relative else alike
    near = sum(abs(value - middle) < width for value in values)
    return middle if near >= SHARE_ALIKE * len(values) else None


def _pattern(run, begin_ns):
    """(cause, source, text) by what the refused innovations have in common."""
    refused, source = _refused(run, begin_ns)
    bearing = _common(refused["bearing"], BEARINGS_ALIKE_RAD, False)
    ratio = _common(refused["range"], RANGES_ALIKE, True)
    ranges_fit = not refused["range"] or ratio is not None and abs(ratio - 1) < RANGE_OFF
    bearings_fit = not refused["bearing"] or bearing is not None and abs(bearing) < BEARING_OFF_RAD
    if bearing is not None and abs(bearing) >= BEARING_OFF_RAD and ranges_fit:
        return "bearings-off", source, f"bearings off by {math.degrees(bearing):+.0f} degrees"
    if ratio is not None and abs(ratio - 1) >= RANGE_OFF and bearings_fit:
        return "ranges-off", source, f"ranges {abs(100 * (ratio - 1)):.0f} % too {'long' if ratio > 1 else 'short'}"
    return None


def _found(healths, identifier):
    """The first finding of this kind, of the earliest health that has it."""
    for health in healths:
        for finding in health["findings"]:
            if finding["id"] == identifier:
                return finding
    return None


def _again(poses, begin):
    """(m, rad) from the pose before the doubt to the one at which it was found again, or None. What was driven between them is little."""
    before = poses[max(begin - 1, 0)]
    after = next((pose for pose in poses[begin:] if pose[4] == "tracking"), None)
    if after is None:
        return None
    return math.hypot(after[1] - before[1], after[2] - before[2]), abs(math.remainder(after[3] - before[3], 2 * math.pi))


def _silent(log):
    """(source, s) of the source that is silent for longest at the end of the log; (None, 0) where none is."""
    newest = {}
    for t_ns, source, _ in log.events:
        newest[source] = max(newest.get(source, t_ns), t_ns)
    end_ns = max(newest.values(), default=0)
    silent = [(end_ns - t_ns, source) for source, t_ns in newest.items() if end_ns - t_ns > SILENT_S * 1e9]
    if not silent:
        return None, 0.0
    for_ns, source = max(silent)
    return log.sources[source], for_ns * 1e-9


def _moved(log, from_ns, to_ns):
    """Whether the wheels turned between two stamps, by their ticks or speeds."""
    def values(quantity):
        return {value for t_ns, value in log.quantities.get(quantity, ()) if from_ns <= t_ns <= to_ns}
    return any(len(values(quantity)) > 1 for quantity in wmlog.WHEEL_TICKS) or any(values(quantity) - {0.0} for quantity in wmlog.WHEEL_SPEEDS)


def _stuck(log, begin_ns):
    """For how many seconds the yaw rate had one value around the doubt while the wheels turned; 0: it was not stuck.
    The runtime compares turn rates above 0.5 m/s only; slower robots are judged here."""
    rates = log.quantities.get(wmlog.YAW_RATE, ())
    same = [list(group) for _, group in itertools.groupby(rates, key=lambda rate: rate[1])]
    if len(same) <= (1 - REPEATS_MOST) * (len(rates) - max(map(len, same), default=0)):
        return 0.0
    first_ns, last_ns = (-math.inf, math.inf) if begin_ns is None else (begin_ns - WINDOW_S * 1e9, begin_ns + LATER_S * 1e9)
    spans = [(group[-1][0] - group[0][0], group[0][0], group[-1][0]) for group in same if group[-1][0] >= first_ns and group[0][0] <= last_ns]
    span_ns, from_ns, to_ns = max(spans, default=(0, 0, 0))
    return span_ns * 1e-9 if span_ns >= STUCK_S * 1e9 and _moved(log, from_ns, to_ns) else 0.0


def _cause(log, run, poses, begin, healths):
    """(cause, source or part, text). `healths`: at the beginning, a little later, and at the end."""
    motion = _found(healths, "motion-sensor")
    if motion:
        return "motion", motion["about"], motion["text"]
    stuck_s = _stuck(log, poses[begin][0] if begin is not None else None)
    if stuck_s:
        return "motion", "motion", f"the yaw rate had one value for {stuck_s:.0f} s while the wheels turned (stuck gyro?)"
    unknown = _found(healths, "identities-unknown")
    doubt = next((f for h in healths if h["cause"] == "unknown_identities" for f in h["findings"] if f["id"] == "pose-doubtful"), None)
    if unknown or doubt:
        return "identities-unknown", (unknown or doubt)["about"], (unknown or doubt)["text"]
    if any(health["cause"] == "off_map" for health in healths):
        return "off-map", "map", "the pose is outside of the map"
    source, for_s = _silent(log)
    if source and (begin is None or any(health["cause"] == "silent" for health in healths)):
        return "silent", source, f"silent for the last {for_s:.1f} s"
    if begin is None:
        return "none", "", ""
    worn = next((f for f in healths[0]["findings"] if f["id"] == "calibration-off" and f["text"].startswith(("noise.way", "noise.turn", "motion."))), None)
    if worn:
        return "motion", "motion", worn["text"]
    pattern = _pattern(run, poses[begin][0])
    if pattern:
        return pattern
    again = _again(poses, begin)
    if again and (again[0] > ELSEWHERE_M or again[1] > ELSEWHERE_RAD):
        return "elsewhere", "", f"found again {again[0]:.1f} m away, turned by {math.degrees(again[1]):.0f} degrees"
    doubtful = _found(healths, "pose-doubtful")
    moved = _found(healths, "landmark-moved") or _found(healths, "landmark-contradicted")
    if moved and not doubtful:
        return "landmark-moved", moved["about"], moved["text"]
    if doubtful or any(health["cause"] for health in healths):
        return "contradicted", doubtful["about"] if doubtful else "", doubtful["text"] if doubtful else healths[0]["cause"]
    return "none", "", ""


def judge(program, path, kind):
    """What happened in a log, or None where nothing did. `kind`: "lost" or "died" as the black box kept it, "" for any log."""
    log = wmlog.read(path)
    with tempfile.TemporaryDirectory(prefix="waymark-mine-") as scratch:
        run = pathlib.Path(scratch) / "run"
        if not log.events:
            return None
        end = _replay(program, path, run)
        poses = _poses(run)
        begin = _begin(poses)
        healths = [end]
        if begin is not None:
            begin_ns = poses[begin][0]
            for number, at_ns in enumerate((begin_ns, begin_ns + round(LATER_S * 1e9))):
                part, out = pathlib.Path(scratch) / f"part{number}.wmlog", pathlib.Path(scratch) / f"part{number}"
                wmlog.cut(log, path, part, at_ns)
                healths.insert(number, _replay(program, part, out))
        cause = _cause(log, run, poses, begin, healths)
        if kind == "died" and cause[0] == "none":
            cause = "program-ended", "program", "the log has no regular end"
        if not kind and begin is None and cause[0] == "none":
            return None
        at = poses[max((begin if begin is not None else len(poses)) - 1, 0)] if poses else (0, math.nan, math.nan, 0, "")
        states = collections.Counter(pose[4] for pose in poses)
        return {"kind": kind or ("lost" if states["lost"] else "doubted"), "cause": cause[0], "about": cause[1], "text": cause[2],
                "x_m": at[1], "y_m": at[2], "t_ns": at[0], "recording": log.recording, "estimator": log.estimator, "map": log.map_name,
                "map_path": log.map_path, "landmarks": log.landmarks,
                "way": [[round(p[1], 2), round(p[2], 2)] for p in poses[::max(1, len(poses) // 120)]]}
