#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a configuration with `estimator:` alone reaches, beside the best configuration and beside dead reckoning: on the
recordings and on simulated worlds, most without pictures. A table, not a gate: rows that miss a bar name it. Skips (77)
where the recordings are not there.

    defaults.py BIN_DIR SOURCE_DIR DATA_DIR [--only WORD[,WORD]] [--rendered] [--set KEY=VALUE] [--json] [--out FOLDER]

--set changes a key of the plain configurations, as `sightings.gate.hard=1000`: a trial of another default on all of them."""
import json
import pathlib
import sys
import tempfile

import bench
import covariances
import replays
from replays import Refused, command, confidently_wrong, find, printed, rows

RATIO_MOST = 1.3
NEES_LEAST = 0.85
LOST_MOST = 0.01         # of the poses; none of these drives has a lost robot
COVERAGE_LEAST = 0.95   # of the best one's share of stamps with a pose: silence is no accuracy
OUTAGES_S = (240, 330, 420)   # since the first stamp

# Chosen by hand with sight of the truth, where no shipped configuration fits.
RANGES_BY_HAND = """
motion: {states: {yaw_rate_bias_sigma_radps: 0.02, speed_scale_sigma: 0.03}}
sightings:
  states: {range_bias_sigma_m: 1, range_scale_sigma: 0.1}
  correlated: {slots: 4, range_m: 0.5, tau_s: 5}
"""
CIRCLES_BY_HAND = """
motion: {states: {speed_scale_sigma: 0.03, yaw_rate_bias_sigma_radps: 0.02}}
sightings: {states: {sensor_yaw_sigma_rad: 0.05}, gate: {hard: 1000}}
slam: {landmarks: {capacity: 700}}
"""
# landmark_ekf by its defaults before calibration states were among them (docs/reports/archive-motion.md).
DEFAULTS_BEFORE_M = {"r1": 0.17, "r2": 0.24, "r3": 0.145, "r4": 0.31, "r5": 0.128,
                     "t1": 0.102, "t2": 0.26, "t3": 0.133, "t4": 0.194, "t5": 0.144}
SE2 = ("--align", "se2")
SIM2 = ("--align", "sim2")
GNSS = ("--against", "gnss")
SPACE = ("seabed-points", "starry-night-stereo")


class Case:
    """A recording or world, an estimator, the configurations that compete with its defaults, and its own bars. `drive`:
    motion.drive, where it is not differential. `rendered`: its pictures take minutes."""

    def __init__(self, name, estimator, best, options=(), detector=None, by_hand=None, world=False, covariances=False,
                 drive=None, rendered=False, **bars):
        self.name, self.estimator, self.best, self.options, self.detector = name, estimator, best, options, detector
        self.by_hand, self.world, self.covariances, self.bars = by_hand, world or rendered, covariances, bars
        self.drive, self.rendered = drive, rendered

    def title(self):
        return f"{self.name} {self.estimator}" + (" covariances" if self.covariances else "")


CASES = [
    Case("plaza-1", "landmark_ekf", ("robot", "labyrinth-uwb"), by_hand=RANGES_BY_HAND, position_rmse_m=0.40),
    Case("plaza-1", "slam", ("victoria-park", "loops-landmarks"), SE2, position_rmse_m=1.0),
    # Without the source's covariances: at most 1.3 times the bar with them.
    Case("dlr-a", "slam", ("loops-landmarks", "mrclam-slam"), by_hand=CIRCLES_BY_HAND, position_rmse_m=0.975,
         landmark_rmse_own_fit_m=0.39, landmarks_moved=0),
    Case("dlr-a", "slam", ("loops-landmarks",), covariances=True, position_rmse_m=0.75, landmark_rmse_own_fit_m=0.30, landmarks_moved=0),
    Case("mecanum-1", "odometry", ("comma2k19-odometry", "crossing-odometry", *SPACE), position_rmse_m=0.23),
    Case("canedge-1", "landmark_ekf", ("comma2k19", "robot"), GNSS, found_s=10, gap_percent=1.5),
    *(Case(f"mrclam-d6-{i}", "landmark_ekf", ("mrclam", "robot"), position_rmse_m=most) for i, most in DEFAULTS_BEFORE_M.items()),
    *(Case(f"mrclam-d6-{i}", "slam", ("mrclam-slam",), SE2, position_rmse_m=0.30, nees_least=0.90)
      for i in ("r1", "r2", "r3", "r4", "r5", "t1", "t2", "t3", "t4", "t5")),
    Case("kitti-0926-0001", "stereo_ekf", SPACE, position_rmse_m=0.35, dead_reckoning=1, nees_least=0.8, scale_sigmas=2),
    Case("kitti-0926-0095", "stereo_ekf", SPACE, position_rmse_m=1.5, dead_reckoning=1, nees_least=0.8, scale_sigmas=2),
    Case("kitti-0930-0020", "stereo_ekf", SPACE, dead_reckoning=1, nees_least=0.8, scale_sigmas=2),
    Case("comma2k19-a", "landmark_ekf", ("comma2k19", "robot")),
    Case("comma2k19-a", "odometry", ("comma2k19-odometry",)),
    Case("smartloc-potsdamer-a", "landmark_ekf", ("smartloc", "robot")),
    Case("labyrinth-uwb", "landmark_ekf", ("labyrinth-uwb", "robot")),
    Case("uwb-tags-fast", "landmark_ekf", ("robot",), position_rmse_m=0.055, nees_least=0.90),
    *(Case(name, "landmark_ekf", ("robot",)) for name in ("uwb-rtk-los-1", "uwb-rtk-nlos-4")),
    Case("mrpt-uwb", "landmark_ekf", ("robot",), position_rmse_m=0.145),
    *(Case(f"esp32-tags-{i}", "landmark_ekf", ("robot",), position_rmse_m=0.045) for i in "ab"),
    Case("starry-night-plan-a", "landmark_ekf", ("starry-night-plan", "robot")),
    Case("starry-night-plan-a", "slam", ("victoria-park", "mrclam-slam"), SE2),
    Case("starry-night-stereo-a", "stereo_ekf", ("starry-night-stereo",)),
    Case("victoria-park-a", "slam", ("victoria-park",), (*GNSS, *SE2)),
    Case("office-a", "slam", ("office",), detector="apriltag"),
    Case("hall-a", "slam", ("hall",), SIM2, detector="lines"),
    Case("corridor-a", "edge_mcl", ("corridor",), detector="edges"),
    Case("corridor-a", "pf_edges", ("corridor-particles",), detector="edges"),
    Case("seabed-a", "stereo_ekf", ("seabed",), detector="stereo"),
    Case("crossing", "landmark_ekf", ("crossing-points", "robot"), world=True),
    Case("crossing", "odometry", ("crossing-odometry",), world=True),
    Case("crossing-easy", "landmark_ekf", ("crossing",), detector="landmarks", world=True),
    Case("crossing-laps", "landmark_ekf", ("crossing-points", "robot"), world=True),
    Case("loops-landmarks", "slam", ("loops-landmarks",), SE2, world=True),
    Case("loops-lines", "slam", ("loops-lines",), SIM2, world=True),
    Case("loops-markers", "slam", ("loops-markers",), SE2, world=True),
    Case("seabed-points", "stereo_ekf", SPACE, world=True),
    Case("seabed-acoustic", "stereo_ekf", SPACE, world=True),
    Case("seabed-slam", "stereo_ekf", SPACE, world=True),
    Case("seabed-imu", "stereo_ekf", ("seabed-imu",), world=True),
    Case("seabed-rounds", "stereo_ekf", ("seabed-rounds",), world=True),
    Case("loops-commands", "slam", ("loops-landmarks",), SE2, world=True),
    Case("car-gnss", "landmark_ekf", ("car", "robot"), world=True),
    Case("yard-rtk", "landmark_ekf", ("robot",), world=True),
    Case("yard-imu", "landmark_ekf", ("yard-imu",), world=True),
    Case("yard-holonomic", "landmark_ekf", ("yard-holonomic",), world=True, drive="holonomic"),
    Case("yard-skid", "landmark_ekf", ("yard-skid",), world=True, drive="skid_steer"),
    *(Case(f"corridor-{i}", "edge_mcl", ("corridor",), detector="edges", rendered=True) for i in ("easy", "hard")),
    *(Case(f"office-{i}", "slam", ("office",), SE2, detector="apriltag", rendered=True) for i in ("easy", "hard")),
    *(Case(f"hall-{i}", "slam", ("hall",), SIM2, detector="lines", rendered=True) for i in ("easy", "hard")),
    *(Case(f"seabed-{i}", "stereo_ekf", ("seabed",), detector="stereo", rendered=True) for i in ("easy", "hard")),
    Case("crossing-hard", "landmark_ekf", ("crossing",), detector="landmarks", rendered=True),
]


def first_stamp_ns(recording):
    stamps = [int(r["t_ns"]) for name in ("motion", "sightings", "gnss") if (recording / f"{name}.csv").exists() for r in rows(recording / f"{name}.csv")[:1]]
    if (recording / "can.log").exists():
        with open(recording / "can.log") as log:
            stamps.append(round(float(log.readline().split()[0].strip("()")) * 1e9))
    return min(stamps)


def outages(runs, case, recording, text, folder):
    """Largest error in % of the way after 60 s without GNSS, of three outages; None where there is no pose."""
    worst = 0
    for begin_s in OUTAGES_S:
        config = folder / f"outage-{begin_s}.yaml"
        config.write_text(f"{text}\nsources: [{{name: gnss, until_s: {begin_s}}}]\n")
        try:
            _, run = runs.judge(f"{case.title()}, whole", recording, config, GNSS)
            first_pose_s = (int(rows(run / "trajectory.csv")[0]["t_ns"]) - first_stamp_ns(recording)) * 1e-9
            begin = max(begin_s - first_pose_s, 0)
            judged, _ = runs.judge(f"{case.title()}, without GNSS", recording, config, (*GNSS, "--from", begin, "--to", begin + 60))
        except (Refused, IndexError):
            return None
        worst = max(worst, judged["position_end_percent"])
    return worst


def found_after_s(trajectory, recording):
    """Time from the first position with a sigma of 10 m or less to the first pose."""
    usable = [int(r["t_ns"]) for r in rows(recording / "gnss.csv") if float(r["sigma_xy_m"]) <= 10]
    begun = [int(r["t_ns"]) for r in trajectory if r["state"] == "tracking"]
    return max(begun[0] - usable[0], 0) * 1e-9 if begun and usable else None


def figures(runs, case, recording, config, what=""):
    """One replay and its judgement; `run` is its folder. `what` names a disturbed copy in the results."""
    out, folder = runs.judge(", ".join(filter(None, [case.title(), what])), recording, config, case.options)
    out["run"] = folder
    # The covariances are those of the frame of the start. An alignment leaves it: of an exact filter 0.82 to 0.90 are inside then
    # (docs/reports/archive-slam.md).
    if case.options == SE2 and "initial_pose" in (recording / "recording.yaml").read_text():
        at_start, _ = runs.judge(", ".join(filter(None, [case.title(), what, "unaligned"])), recording, config)
        out["nees_inside_95"] = at_start["nees_inside_95"]
    health = json.loads((folder / "health.json").read_text())
    out["landmarks_moved"] = (find(health, "landmarks_moved") or {"count": 0})["count"]
    out["velocity_scale"] = find(health, "motion.velocity_scale")
    against_gnss = "gnss" in case.options
    out["nees_inside_95"] = None if against_gnss else out["nees_inside_95"]
    out["confidently_wrong"] = None if against_gnss else confidently_wrong(folder, recording)
    states = [r["state"] for r in rows(folder / "trajectory.csv")]
    out["lost"] = states.count("lost") / max(len(states), 1)
    if "found_s" in case.bars:
        out["found_s"] = found_after_s(rows(folder / "trajectory.csv"), recording)
    return out


def plain(case, settings=()):
    """The configuration with `estimator:` alone; pictures need the name of a detector, too."""
    lines = ["format: waymark-config/1", f"estimator: {case.estimator}"]
    if case.detector:
        lines.append(f"vision: {{{case.detector}: {{}}}}")
    if case.drive:
        settings = (f"motion.drive={case.drive}", *settings)
    tree = {}
    for setting in settings:
        key, value = setting.split("=", 1)
        if key.split(".")[0] in (case.estimator, "motion", "sightings", "merge"):
            branch = tree
            *path, leaf = key.split(".")
            for name in path:
                branch = branch.setdefault(name, {})
            branch[leaf] = value
    def flow(branch):
        return branch if isinstance(branch, str) else "{" + ", ".join(f"{k}: {flow(v)}" for k, v in branch.items()) + "}"
    return "\n".join([*lines, *(f"{k}: {flow(v)}" for k, v in tree.items())]) + "\n"


def dead_reckoning(case):
    """Motion alone, with the defaults; None where the estimator is dead reckoning."""
    if case.estimator == "odometry":
        return None
    if case.estimator != "stereo_ekf":
        return "format: waymark-config/1\nestimator: odometry\n"
    unused = ", ".join(f"{{name: {name}, use: false}}" for name in ("stereo", "sightings", "gnss"))
    return f"format: waymark-config/1\nestimator: stereo_ekf\nsources: [{unused}]\n"


def misses(case, row, out):
    found = []
    def most(what, value, bar):
        if value is None or value > bar:
            found.append(f"{what} {'none' if value is None else f'{value:.3g}'} > {bar:g}")
    most("ratio", row["ratio"], case.bars.get("ratio", RATIO_MOST))
    if (row["coverage"] or 0) < COVERAGE_LEAST * (row["best_coverage"] or 0):
        found.append(f"coverage {row['coverage'] or 0:.2f} of {row['best_coverage']:.2f}")
    nees = row["nees_inside_95"]
    if "gnss" not in case.options and (nees is None or nees < case.bars.get("nees_least", NEES_LEAST)):
        found.append(f"NEES {'none' if nees is None else f'{nees:.2f}'} < {case.bars.get('nees_least', NEES_LEAST):g}")
    most("wrong", row["confidently_wrong"] or 0, 0)
    most("lost", row["lost"] or 0, LOST_MOST)
    for key in ("position_rmse_m", "landmark_rmse_own_fit_m", "landmarks_moved", "found_s"):
        if key in case.bars:
            most(key.removesuffix("_m").removesuffix("_s"), out.get(key), case.bars[key])
    if "gap_percent" in case.bars:
        most("gap %", out["gap_percent"], case.bars["gap_percent"])
    if "dead_reckoning" in case.bars:
        most("of dead reckoning", row["position_rmse_m"] / row["dead_reckoning_m"], case.bars["dead_reckoning"])
    scale = out["velocity_scale"]
    if "scale_sigmas" in case.bars and isinstance(scale, dict):
        most("velocity scale, sigmas from 1", abs(scale["value"] - 1) / max(scale["sigma"], 1e-9), case.bars["scale_sigmas"])
    return found


def judge(runs, bin_dir, source, data, case, settings, scratch):
    """The row of a case: its defaults, its best rival and dead reckoning. What a program refuses has no figures."""
    folder = scratch / case.name
    folder.mkdir(exist_ok=True)
    recording = folder / "world" if case.world else data / case.name
    if case.world and not recording.exists():
        pictures = [] if case.detector else ["--no-video"]
        command(bin_dir / "waymark-simulate", source / "config/worlds" / f"{case.name}.yaml", *pictures, "--out", recording)
    if case.covariances:
        covariances.copy(recording, folder / "covariances")
        recording = folder / "covariances"
    refused = {}

    def run(name, text=None):
        config = source / "config" / (f"{name}.yaml" if name in ("robot", "car") else f"datasets/{name}.yaml")
        if text is not None:
            config = folder / f"{name}.yaml"
            config.write_text(text)
        try:
            return figures(runs, case, recording, config)
        except Refused as why:
            refused[name] = str(why)
            return {}

    text = plain(case, settings)
    out = run("plain", text)
    if "gap_percent" in case.bars:
        out["gap_percent"] = outages(runs, case, recording, text, folder)
    rivals = {name: run(name) for name in case.best}
    if case.by_hand:
        rivals["(by hand)"] = run("(by hand)", plain(case) + case.by_hand)
    rivals = {name: rival for name, rival in rivals.items() if rival.get("position_rmse_m") is not None}
    best = min(rivals, key=lambda name: rivals[name]["position_rmse_m"], default="none")
    reckoned = dead_reckoning(case)
    row = {"case": case.title(), "best": best, "dead_reckoning_m": run("reckoned", reckoned).get("position_rmse_m") if reckoned else None}
    for figure in ("position_rmse_m", "heading_rmse_deg", "nees_inside_95", "confidently_wrong", "lost", "coverage", "landmark_rmse_own_fit_m",
                   "landmarks_moved"):
        row[figure], row["best_" + figure] = out.get(figure), rivals.get(best, {}).get(figure)
    error, least = row["position_rmse_m"], row["best_position_rmse_m"]
    row["ratio"] = error / least if error is not None and least is not None else None
    row["misses"] = [f"refused: {refused['plain'].splitlines()[0]}"] if "plain" in refused else misses(case, row, out)
    return row


HEADINGS = ("plain m", "best m", "ratio", "reckon m", "head deg", "best", "NEES", "best", "wrong", "best", "lost", "best")
COLUMNS = (("position_rmse_m", 4, 8), ("best_position_rmse_m", 4, 8), ("ratio", 2, 6), ("dead_reckoning_m", 3, 8), ("heading_rmse_deg", 2, 8),
           ("best_heading_rmse_deg", 2, 6), ("nees_inside_95", 2, 5), ("best_nees_inside_95", 2, 5), ("confidently_wrong", 3, 6),
           ("best_confidently_wrong", 3, 6), ("lost", 2, 5), ("best_lost", 2, 5))


def main():
    parser = replays.parser(__doc__, "cases whose title contains one of these words")
    bench.out_option(parser)
    parser.add_argument("--rendered", action="store_true", help="also worlds whose pictures take minutes")
    options = parser.parse_args()
    if not options.data_dir.is_dir():
        print(f"{options.data_dir}: no recordings here")
        return 77
    cases = [c for c in CASES if replays.is_chosen(options, c.title()) and (options.rendered or not c.rendered)]
    if not options.json:
        print(f"{'recording or world, estimator':34} " + " ".join(f"{name:>{width}}" for name, (_, _, width) in zip(HEADINGS, COLUMNS))
              + "  best configuration; bars missed")
    missed, results, runs = 0, [], bench.Bench(options.bin_dir, options.out)
    with tempfile.TemporaryDirectory() as scratch:
        for case in cases:
            if not case.world and not (options.data_dir / case.name).is_dir():
                print(f"{case.title():34} no such recording", file=sys.stderr)
                continue
            row = judge(runs, options.bin_dir, options.source_dir, options.data_dir, case, options.set, pathlib.Path(scratch))
            missed += bool(row["misses"])
            results.append(row)
            if not options.json:
                print(f"{row['case']:34} " + " ".join(f"{printed(row[key], digits):>{width}}" for key, digits, width in COLUMNS)
                      + f"  {row['best']}; {', '.join(row['misses']) or 'none'}", flush=True)
    runs.write_results("defaults.py")
    if options.json:
        print(json.dumps(results, indent=1))
    else:
        print(f"{len(cases)} rows, {missed} miss a bar")
    return 0


if __name__ == "__main__":
    sys.exit(main())
