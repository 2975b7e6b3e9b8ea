#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Calibrations falsified as a careless user would, one at a time: scales by 5 %, a sensor's yaw by 3 degrees, stamps by
0.1 s, the track by 3 %, stated sigmas halved and doubled. Each recording is replayed by `estimator:` alone with and without
it; the position's RMSE after 60 s (after half of a shorter drive) may be 1.25 times the undisturbed one. What a recording
does not state is not falsified. Exit code 1 where a row misses the bar, 77 where the recordings are not there. Drives of
less than 90 s have no verdict. odometry observes nothing, and pf_edges has no calibration states: both are left out.

    falsified.py BIN_DIR SOURCE_DIR DATA_DIR [--only WORD[,WORD]] [--what WORD[,WORD]] [--set KEY=VALUE] [--json]

Of SLAM's rows with a falsified scale the shape is judged (aligned with scale): a sensor's scale and the odometry's are known
only against each other. So are the yaw of a camera pair and of the twist's axes (aligned in space). Poses are on the clock
of motion; with its stamps falsified the better of the two clocks counts.

examples: falsified.py build/bin . ../shared/data --only mrclam,plaza --what range,stamps
          falsified.py build/bin . ../shared/data --only starry --set motion.states.speed_scale_sigma=0.1"""
import json
import pathlib
import re
import sys
import tempfile

import covariances
import defaults
import replays
from replays import each_row, scaled, shifted, turned

RATIO_MOST = 1.25
LEAST_M = 0.01     # errors this small count as equal: a camera's pixel, a laser's millimetres
AFTER_S, SHORT_S = 60, 90
WITHOUT_STATES = ("odometry", "pf_edges")
PLACE_COVARIANCES = ("cov_xx_m2", "cov_xy_m2", "cov_yy_m2")
STEP_COVARIANCES = ("cov_xx", "cov_xy", "cov_yy", "cov_xt", "cov_yt", "cov_tt")
SPEEDS = ("v_mps", "vx_mps", "vy_mps", "vz_mps")
RATES = ("w_radps", "wx_radps", "wy_radps", "wz_radps")
OBSERVED = ("sightings.csv", "markers.csv", "stereo.csv", "points.csv", "gnss.csv")
DRIVEN = ("motion.csv", "motion6.csv", "increments.csv")


class Recording:
    """What can be falsified of a recording: each method gives {file: change}, empty where there is nothing."""

    def __init__(self, folder):
        self.folder = folder
        texts = {name: folder / name for name in ("calibration.yaml", "can-signals.yaml")}
        texts = {name: path.read_text() if path.exists() else "" for name, path in texts.items()}
        self.calibration, self.signals = texts["calibration.yaml"], texts["can-signals.yaml"]

    def tables(self, names, columns, change):
        found = {}
        for name in names:
            if (self.folder / name).exists():
                with open(self.folder / name) as file:
                    head = file.readline().strip().split(",")
                if set(head) & set(columns):
                    found[name] = change
        return found

    def entries(self, keys, factor):
        """Numbers of the calibration, single or in a list, times a factor."""
        pattern = rf"\b({'|'.join(keys)}): (\[[^\]]*\]|[0-9.e-]+)"
        if not re.search(pattern, self.calibration):
            return {}
        def times(text):
            return re.sub(r"-?[0-9.]+(e-?\d+)?", lambda m: f"{float(m[0]) * factor:.9g}", text)
        return {"calibration.yaml": lambda text: re.sub(pattern, lambda m: f"{m[1]}: {times(m[2])}", text)}

    def can_signals(self, quantities, factor):
        """Scale and offset of CAN signals of these quantities, times a factor."""
        bound = re.findall(r"quantity: (\w+),?\s+message: \w+,?\s+signal: (\w+)", self.signals)
        names = [signal for quantity, signal in bound if re.match(quantities, quantity)]
        if not names:
            return {}
        def change(text):
            for name in names:
                text = re.sub(rf"(SG_ {name} [^:]*: [^(]*\()([^,]+),([^)]+)\)",
                              lambda m: f"{m[1]}{float(m[2]) * factor:.12g},{float(m[3]) * factor:.12g})", text)
            return text
        return {"vehicle.dbc": change}

    def way(self, factor):
        wheels = self.entries(["radius_m"], factor) if "wheel_ticks" in self.signals else {}
        return wheels or self.tables(DRIVEN, SPEEDS, scaled(SPEEDS, factor)) | self.can_signals("vehicle_speed|wheel_speed", factor)

    def turn(self, factor):
        return self.tables(DRIVEN, RATES, scaled(RATES, factor)) | self.can_signals("yaw_rate", factor)

    def range(self, factor):
        return self.tables(["sightings.csv"], ["range_m"], scaled(("range_m", *PLACE_COVARIANCES), factor)) | self.entries(["size_m"], factor)

    def yaw(self, degrees):
        return {"calibration.yaml": turned(degrees)} if "rpy_deg" in self.calibration else {}

    def stamps(self, seconds):
        change = shifted(seconds, ("t_ns", "arrival_ns"))
        videos = [f"video/{path.name}" for path in sorted(self.folder.glob("video/*.csv"))]
        return self.tables((*OBSERVED, *videos), ["t_ns"], change)

    def motion_stamps(self, seconds):
        def log(text):
            return re.sub(r"^\((\d+\.\d+)\)", lambda m: f"({float(m[1]) + seconds:.6f})", text, flags=re.M)
        observed = self.stamps(0)
        moved = self.tables(DRIVEN, ["t_ns"], shifted(seconds, ("t_ns", "from_ns", "arrival_ns")))
        return (moved | ({"can.log": log} if self.signals else {})) if observed else {}

    def track(self, factor):
        return self.entries(["track_m"], factor) if re.search("wheel_(ticks|speed)", self.signals) else {}

    def sigmas(self, factor):
        columns = ("bearing_sigma_rad", "range_sigma_m", "elevation_sigma_rad", "sigma_xy_m", "sigma_z_m")
        def change(f):
            for names, times in ((columns, factor), (PLACE_COVARIANCES, factor ** 2)):
                for name in names:
                    if f.get(name):
                        f[name] = repr(float(f[name]) * times)
        return (self.entries(["bearing_sigma_rad", "range_sigma_m", "sigma_px"], factor)
                | self.tables(OBSERVED, (*columns, *PLACE_COVARIANCES), each_row(change)))

    def motion_sigmas(self, factor):
        return (self.entries(["sigma_v_mps", "sigma_w_radps"], factor)
                | self.tables(["increments.csv"], STEP_COVARIANCES, scaled(STEP_COVARIANCES, factor ** 2)))


# Name, method, argument, and the ends of the names of the states that may take it.
FALSIFICATIONS = [(f"{name} {change}", method, argument, states) for name, method, changes, states in (
    ("way", Recording.way, (("+5 %", 1.05), ("-5 %", 0.95)), ("speed_scale", "velocity_scale", "left_scale")),
    ("turn", Recording.turn, (("+5 %", 1.05), ("-5 %", 0.95)), ("yaw_rate_scale",)),
    ("range", Recording.range, (("+5 %", 1.05), ("-5 %", 0.95)), ("range_scale", "speed_scale", "left_scale")),
    ("yaw", Recording.yaw, (("+3 deg", 3), ("-3 deg", -3)), ("yaw_rad", "axes_z_rad", "rotation_z_rad")),
    ("stamps", Recording.stamps, (("+0.1 s", 0.1), ("-0.1 s", -0.1)), ("time_offset_s", "lag_s")),
    ("motion's stamps", Recording.motion_stamps, (("+0.1 s", 0.1), ("-0.1 s", -0.1)), ("time_offset_s", "lag_s")),
    ("track", Recording.track, (("+3 %", 1.03), ("-3 %", 0.97)), ("track_scale", "wheel_difference")),
    ("sigmas", Recording.sigmas, (("x 2", 2), ("/ 2", 0.5)), ()),
    ("motion's sigmas", Recording.motion_sigmas, (("x 2", 2), ("/ 2", 0.5)), ()),
) for change, argument in changes]


def listed(health, ends):
    """States of the calibration whose names end so, with their sigmas."""
    return ", ".join(f"{k} {v['value']:.4g} ± {v['sigma']:.2g}" for k, v in health["calibration"].items() if v and k.endswith(ends))


class Runner:
    """Replays of one case; undisturbed figures are kept for each alignment."""

    def __init__(self, options, case, folder, scratch):
        self.options, self.case, self.folder, self.scratch = options, case, folder, scratch
        words = case.options
        at = words.index("--align") if "--align" in words else len(words)
        self.aligned, self.against = words[at:at + 2], words[:at] + words[at + 2:]
        self.config = scratch / "config.yaml"
        self.config.write_text(defaults.plain(case, options.set))
        duration = float(re.search(r"^duration_s: (\S+)", (folder / "recording.yaml").read_text(), flags=re.M)[1])
        self.is_short = duration < SHORT_S
        self.judged = ("--json", "--from", str(min(AFTER_S, duration / 2)))
        self.health = self.replay(folder, "undisturbed")
        self.undisturbed = {}

    def replay(self, folder, name):
        replays.command(self.options.bin_dir / "waymark", "replay", folder, "--config", self.config, "--out", self.scratch / name)
        return json.loads((self.scratch / name / "health.json").read_text())

    def figures(self, name, recording, alignment):
        words = (*self.judged, *self.against, *alignment)
        return json.loads(replays.command(self.options.bin_dir / "waymark-eval", self.scratch / name, recording, *words))

    def row(self, name, method, argument, states):
        changes = method(Recording(self.folder), argument)
        if not changes:
            return None
        row = {"case": self.case.title(), "falsified": name, "position_rmse_m": None, "nees_inside_95": None, "ratio": None, "states": "",
               "good": None if self.is_short else False}
        with tempfile.TemporaryDirectory(dir=self.scratch) as place:
            changed = pathlib.Path(place) / "recording"
            replays.copy_changed(self.folder, changed, changes)
            aligned = self.aligned
            if self.case.estimator == "slam" and method in (Recording.way, Recording.range):
                aligned = ("--align", "sim2")
            if self.case.estimator == "stereo_ekf" and method is Recording.yaw:
                aligned = ("--align", "se3")
            references = [self.folder]
            if method is Recording.motion_stamps:
                references.append(pathlib.Path(place) / "moved")
                moved = {n: shifted(argument) for n in ("truth.csv", "gnss.csv") if (self.folder / n).exists()}
                replays.copy_changed(self.folder, references[1], moved)
            if aligned not in self.undisturbed:
                self.undisturbed[aligned] = self.figures("undisturbed", self.folder, aligned)["position_rmse_m"]
            try:
                health = self.replay(changed, "falsified")
                out = min((self.figures("falsified", r, aligned) for r in references), key=lambda f: f["position_rmse_m"] or 1e9)
            except replays.Refused as why:
                return row | {"states": f"refused: {str(why).splitlines()[0]}"}
        row |= {key: out[key] for key in ("position_rmse_m", "nees_inside_95")}
        if out["position_rmse_m"] is not None:
            row["ratio"] = max(out["position_rmse_m"], LEAST_M) / max(self.undisturbed[aligned], LEAST_M)
            row["good"] = None if self.is_short else row["ratio"] <= RATIO_MOST
        row["states"] = listed(health, states)
        return row


def judge(options, case, scratch):
    """Rows of a case; the first is the undisturbed one."""
    folder = options.data_dir / case.name
    if case.covariances:
        covariances.copy(folder, scratch / "covariances")
        folder = scratch / "covariances"
    run = Runner(options, case, folder, scratch)
    row = {"case": case.title(), "falsified": "nothing", "position_rmse_m": None, "nees_inside_95": None, "ratio": None, "states": "", "good": None}
    try:
        plain = run.figures("undisturbed", folder, run.aligned)
    except replays.Refused as why:
        yield row | {"states": f"nothing to compare with: {str(why).splitlines()[0]}"}
        return
    states = listed(run.health, ("scale", "yaw_rad", "time_offset_s", "lag_s"))
    yield row | {"position_rmse_m": plain["position_rmse_m"], "nees_inside_95": plain["nees_inside_95"], "states": states}
    words = [w for w in options.what.split(",") if w]
    for falsification in FALSIFICATIONS:
        if not words or any(w in falsification[0] for w in words):
            row = run.row(*falsification)
            if row:
                yield row


def printed(row):
    number = replays.printed
    return (f"{row['case']:36} {row['falsified']:22} {number(row['position_rmse_m'], 4):>8} {number(row['ratio'], 2):>6} "
            f"{number(row['nees_inside_95'], 2):>5}  {'MISSED ' if row['good'] is False else ''}{row['states']}")


def main():
    parser = replays.parser(__doc__, "recordings whose title, as `plaza-1 slam`, contains one of these words")
    parser.add_argument("--what", default="", metavar="WORD[,WORD]", help="falsifications whose name contains one of these words")
    options = parser.parse_args()
    cases = [c for c in defaults.CASES if not c.world and c.estimator not in WITHOUT_STATES and (options.data_dir / c.name).is_dir() and replays.is_chosen(options, c.title())]
    if not cases:
        print(f"skipped: no recording {options.only.replace(',', ' or ')} in {options.data_dir}")
        return 77
    head = f"{'recording, estimator':36} {'falsified':22} {'rmse m':>8} {'ratio':>6} {'NEES':>5}  states"
    results = replays.table(options, head, cases, judge, printed)
    judged = [r["good"] for r in results if r["good"] is not None]
    missed = judged.count(False)
    if not options.json:
        print(f"{len(judged)} falsified replays, {missed} beyond {RATIO_MOST} times the undisturbed one")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
