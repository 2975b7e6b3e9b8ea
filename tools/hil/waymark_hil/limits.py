# SPDX-License-Identifier: Apache-2.0
"""Limits of a run, and of what a change may cost: the defaults, and a file that changes them."""
from . import HilError
from .recording import read_yaml

FORMAT = "waymark-hil-limits/1"
# key: (default, what it bounds). None: reported, not judged.
RUN = {
    "position_m": (0.02, "m between a pose over LCM and the replay of what the run saw"),
    "heading_deg": (0.2, "degrees of the same"),
    "truth_ratio": (1.5, "error from the truth, over that of the replay at the desk"),
    "lost_share": (0.0, "share of a stream's data that were lost, dropped or late"),
    "play_late_ms": (5.0, "ms, lateness of the player, 99 of 100 data; later ones are not the run's fault"),
    "skew_ms": (1.0, "ms between the stamps of pictures and of CAN frames, 99 of 100; with --record"),
    "deadlines_missed_share": (0.001, "share of the estimator's loops"),
    "wake_over_cyclictest": (3.0, "wake-up of the estimator's thread, 99 of 100, over that of cyclictest beside it; below 0.2 ms it is in order"),
    "memory_mb": (None, "MB resident at most"),
    "cpu_share": (None, "share of one processor, all threads"),
    "thread_cpu_share": (None, "share of one processor, the busiest thread"),
    "temperature_c": (None, "degrees Celsius at most"),
    "clock_share": (None, "lowest clock rate over the highest seen"),
}
# On a desk that does much else, whose kernel is none of a robot's, these are no faults of the run.
BUSY = {"play_late_ms": 50.0, "skew_ms": None, "deadlines_missed_share": None, "wake_over_cyclictest": None, "lost_share": 0.02}
# figure: (larger change that counts, as a share; smallest difference that counts, in its unit)
COMPARE = {
    "position_rmse_m": (0.05, 0.002), "heading_rmse_deg": (0.05, 0.02), "truth_rmse_m": (0.05, 0.002),
    "correct_p99_us": (0.15, 20.0), "correct_p50_us": (0.10, 5.0), "loop_p99_us": (0.15, 20.0), "detect_p99_us": (0.15, 200.0), "send_p99_us": (0.25, 500.0),
    "wake_p99_us": (0.50, 100.0), "deadlines_missed_share": (0.0, 0.001), "lost_share": (0.0, 0.001), "memory_mb": (0.05, 1.0),
    "cpu_share": (0.10, 0.01), "first_pose_s": (0.25, 0.3),
}


def read(path, is_busy):
    """{key: limit} of a run, and {figure: (share, least)} of a comparison."""
    run = {key: value for key, (value, _) in RUN.items()} | (BUSY if is_busy else {})
    compare = dict(COMPARE)
    if path is None:
        return run, compare
    given = read_yaml(path)
    if given.pop("format", None) != FORMAT:
        raise HilError(f"{path}: format: write `format: {FORMAT}`")
    for section, known in (("run", run), ("compare", compare)):
        for key, value in (given.pop(section, None) or {}).items():
            if key not in known:
                raise HilError(f"{path}: {section}: {key}: unknown; known are {', '.join(known)}")
            known[key] = _number(path, section, key, value) if section == "run" else _pair(path, key, value, COMPARE[key])
    if given:
        raise HilError(f"{path}: {sorted(given)[0]}: unknown key; format, run and compare are known")
    return run, compare


def _number(path, section, key, value):
    if value in (None, "", "null", "~", "off"):
        return None
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise HilError(f"{path}: {section}: {key}: '{value}' is not a number (off: not judged)") from None
    if not number >= 0:
        raise HilError(f"{path}: {section}: {key}: {value} is below 0")
    return number


def _pair(path, key, value, usual):
    if isinstance(value, dict):
        unknown = set(value) - {"share", "least"}
        if unknown:
            raise HilError(f"{path}: compare: {key}: {sorted(unknown)[0]}: unknown; share and least are known")
        pair = tuple(_number(path, f"compare: {key}", name, value[name]) if name in value else usual[i] for i, name in enumerate(("share", "least")))
    else:
        pair = (_number(path, "compare", key, value), usual[1])
    return None if pair[0] is None else (pair[0], pair[1] or 0.0)
