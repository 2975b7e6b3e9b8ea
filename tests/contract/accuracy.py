#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What the shipped configurations reach on the real recordings, and on the same recordings with their calibration, clocks
and scales disturbed: replayed by `waymark replay`, judged by `waymark eval`. Skips (77) where the recordings are not there.

    accuracy.py BIN_DIR SOURCE_DIR DATA_DIR [--only WORDS] [--out FOLDER] [--jobs N]"""
import concurrent.futures
import pathlib
import re
import subprocess
import sys
import tempfile

import bench
import covariances
import replays
from replays import each_row, of_lines, rows, scaled, shifted, turned

failures = []


def longest_beyond(run, recording, sigmas):
    """Longest time in s that the position's error stays beyond so many sigma of its covariance (Mahalanobis)."""
    longest = since = 0
    last = None
    for t_s, _, _, off in replays.errors(run, recording):
        since = since + t_s - last if off > sigmas and last is not None else 0
        longest, last = max(longest, since), t_s
    return longest


def config_path(config, folder):
    """A shipped configuration, or one with the estimator alone: "slam:"."""
    if not config.endswith(":"):
        return SOURCE / "config/datasets" / f"{config}.yaml"
    path = pathlib.Path(folder) / f"{config[:-1]}.yaml"
    path.write_text(f"format: waymark-config/1\nestimator: {config[:-1]}\n")
    return path


def run(recording, config, *eval_options, seed=1, replay=(), what=""):
    """Figures of eval for one replay. `what` names a disturbed copy in the table of results."""
    with tempfile.TemporaryDirectory() as scratch:
        title = ", ".join(filter(None, [recording.name, what, " ".join(eval_options)]))
        figures, folder = BENCH.judge(title, recording, config_path(config, scratch), eval_options, replay, seed)
    figures["run"] = folder
    return figures


def bar(what, value, most=None, least=None):
    good = (most is None or value <= most) and (least is None or value >= least)
    print(f"{'ok  ' if good else 'FAIL'} {what}: {value:.4f}" + (f" (at most {most:.4f})" if most is not None else "")
          + (f" (at least {least:.4f})" if least is not None else ""), flush=True)
    if not good:
        failures.append(what)


NAMES = {"position_rmse_m": "position RMSE", "position_mean_m": "mean position error", "position_max_m": "largest error",
         "heading_rmse_deg": "heading RMSE", "heading_mean_abs_deg": "mean heading error, degrees", "rotation_rmse_deg": "rotation RMSE",
         "nees_inside_95": "NEES inside 95 %", "lost_count": "lost", "landmarks_found": "landmarks found", "landmark_rmse_m": "landmark RMSE",
         "landmark_max_m": "worst landmark", "landmark_rmse_own_fit_m": "landmark RMSE, own fit", "recall": "share of lines found",
         "false_per_right": "false lines for each true one", "azimuth_rms_deg": "azimuth error, degrees RMS"}
SHARES = ("nees_inside_95", "landmarks_found", "recall")  # the larger the better


def bars(where, figures, **limits):
    """A bar of each of these figures of one replay."""
    for name, limit in limits.items():
        bar(f"{where}: {NAMES[name]}", figures[name], **{"least" if name in SHARES else "most": limit})


def bar_of_mean(where, results, name, most):
    bar(f"{where}: mean {NAMES[name]}", sum(r[name] for r in results) / len(results), most=most)


class disturbed:
    """A copy of a recording in which some files read differently: {name: function(text) -> text}."""

    def __init__(self, recording, changes):
        self.recording, self.changes = recording, changes

    def __enter__(self):
        self.folder = tempfile.TemporaryDirectory()
        here = pathlib.Path(self.folder.name) / self.recording.name
        replays.copy_changed(self.recording, here, self.changes)
        return here

    def __exit__(self, *_):
        self.folder.cleanup()


def yaw_rate_offset(radps):
    def change(text):
        return re.sub(r"(SG_ YAW_RATE : \S+ \()([^,]+),([^)]+)\)",
                      lambda m: f"{m[1]}{m[2]},{float(m[3]) + radps * 57.29577951308232})", text)
    return change


def starry():
    recording = DATA / "starry-night-plan-a"
    for config, most in (("starry-night-plan", 0.0165), ("starry-night-plan-bearings", 0.024)):
        plain = run(recording, config)
        bars(config, plain, position_rmse_m=most, heading_rmse_deg=0.6, nees_inside_95=0.85)
        settled = run(recording, config, "--from", "60")["position_rmse_m"]
        changes = {"laser turned by +10 deg": {"calibration.yaml": turned(10)},
                   "laser turned by -10 deg": {"calibration.yaml": turned(-10)},
                   "sightings 0.1 s later": {"sightings.csv": shifted(0.1)},
                   "sightings 0.1 s earlier": {"sightings.csv": shifted(-0.1)},
                   "range + 5 %": {"sightings.csv": scaled("range_m", 1.05)},
                   "range - 5 %": {"sightings.csv": scaled("range_m", 0.95)},
                   "speed + 5 %": {"motion.csv": scaled("v_mps", 1.05)},
                   "speed - 5 %": {"motion.csv": scaled("v_mps", 0.95)}}
        for what, change in changes.items():
            with disturbed(recording, change) as folder:
                bar(f"{config}, {what}: RMSE over the undisturbed one's, after 60 s",
                    run(folder, config, "--from", "60", what=what)["position_rmse_m"] / settled, most=1.15)


def mrclam():
    seen = []
    for config, most in (("mrclam", 0.11), ("mrclam-bearings", 0.155)):
        results = [run(DATA / f"mrclam-d6-r{i}", config) for i in range(1, 6)]
        bar_of_mean(config, results, "position_rmse_m", most)
        for i, r in enumerate(results, 1):
            bars(f"{config}, robot {i}", r, position_max_m=1.1, nees_inside_95=0.80)
            bar(f"{config}, robot {i}: longest time beyond 3.5 sigma, s", longest_beyond(r["run"], DATA / f"mrclam-d6-r{i}", 3.5), most=2.0)
        if config == "mrclam":
            seen = [r["position_rmse_landmark_seen_m"] for r in results]
    bar("mrclam: mean RMSE where a landmark was seen within 2 s", sum(seen) / 5, most=0.08)


def slam():
    """Tubes at unknown places: aligned (se2), because where the map lies nothing tells."""
    results = [run(DATA / f"mrclam-d6-r{i}", "mrclam-slam", "--align", "se2") for i in range(1, 6)]
    for name, most in (("position_rmse_m", 0.17), ("landmark_rmse_m", 0.14), ("landmark_rmse_own_fit_m", 0.05)):
        bar_of_mean("mrclam-slam, aligned", results, name, most)
    for i, r in enumerate(results, 1):
        bars(f"mrclam-slam, aligned, robot {i}", r, nees_inside_95=0.90, landmarks_found=14)
    plain = [run(DATA / f"mrclam-d6-r{i}", "mrclam-slam") for i in range(1, 6)]
    bar_of_mean("mrclam-slam, not aligned", plain, "position_rmse_m", 0.33)
    for i, r in enumerate(plain, 1):
        bars(f"mrclam-slam, not aligned, robot {i}", r, nees_inside_95=0.90)

    def misread(lines):
        """Every fiftieth code is read as another."""
        for k in range(7, len(lines), 50):
            t, sensor, _, bearing, distance = lines[k].split(",")
            lines[k] = f"{t},{sensor},{6 + k * 7 % 15},{bearing},{distance}"
        return lines

    results = []
    for i in range(1, 6):
        with disturbed(DATA / f"mrclam-d6-r{i}", {"sightings.csv": of_lines(misread)}) as folder:
            results.append(run(folder, "mrclam-slam", "--align", "se2", what="one code in fifty misread"))
            bars(f"mrclam-slam, one code in fifty misread, robot {i}", results[-1], nees_inside_95=0.90)
    bar_of_mean("mrclam-slam, one code in fifty misread, aligned", results, "position_rmse_m", 0.17)
    for i in range(1, 6):
        bars(f"mrclam-slam-bearings, aligned, robot {i}", run(DATA / f"mrclam-d6-r{i}", "mrclam-slam-bearings", "--align", "se2"),
             position_rmse_m=1.2, nees_inside_95=0.75)


def park():
    """No truth but GNSS, good to a few metres: aligned, both halves of the drive, begun anywhere, with worse sensors."""
    recording = DATA / "victoria-park-a"
    against = ["--against", "gnss", "--align", "se2"]
    for part, options in (("", []), (", first half", ["--to", "320"]), (", second half", ["--from", "320"])):
        bars(f"victoria-park against GNSS, aligned{part}", run(recording, "victoria-park", *against, *options), position_rmse_m=4.2)

    def from_s(seconds):
        change = of_lines(lambda lines: [line for line in lines if int(line.split(",")[0]) >= seconds * 1e9])
        return {name: change for name in ("motion.csv", "sightings.csv", "gnss.csv")}

    def thinned(lines):
        return [line for i, line in enumerate(lines) if i * 7 % 10 < 6]

    def cluttered(lines):
        """Every eighth detection is somewhere else."""
        for i in range(0, len(lines), 8):
            t, sensor, identity, _, _ = lines[i].split(",")
            lines[i] = f"{t},{sensor},{identity},{(i * 0.618) % 3 - 1.5:.4f},{2 + (i * 0.414) % 28:.3f}"
        return lines

    for what, changes in (("speed + 3 %", {"motion.csv": scaled("v_mps", 1.03)}), ("turns - 5 %", {"motion.csv": scaled("w_radps", 0.95)}),
                          ("40 % of the detections lost", {"sightings.csv": of_lines(thinned)}),
                          ("12 % of them false", {"sightings.csv": of_lines(cluttered)}),
                          ("begun at 90 s", from_s(90)), ("begun at 220 s", from_s(220))):
        with disturbed(recording, changes) as folder:
            bars(f"victoria-park, {what}", run(folder, "victoria-park", *against, what=what), position_rmse_m=4.2)


def lost_on_a_map():
    """Lap one makes a map; the rest is driven on it, frozen, begun without a pose: right within 3 s."""
    recording, begin_s = DATA / "office-a", 41
    lap = run(recording, "office", replay=["--until", begin_s], what="lap one")["run"]
    on_map = ["--landmarks", lap / "map-estimate.csv", "--from", begin_s, "--lost"]
    whole, settled = (run(recording, "office-frozen", "--from", begin, replay=on_map, what="lost on the map of lap one") for begin in ("0", "3"))
    tracked = [r for r in rows(whole["run"] / "trajectory.csv") if r["state"] == "tracking"]
    seen = rows(whole["run"] / "innovations.csv")
    bar("office-frozen: time until it knows where it is, s", (int(tracked[0]["t_ns"]) - int(seen[0]["t_ns"])) * 1e-9, most=3.0)
    bars("office-frozen, all that is given out", whole, position_max_m=0.1)
    bars("office-frozen, after 3 s", settled, position_max_m=0.03, position_rmse_m=0.02, heading_rmse_deg=0.4)
    surveyed = subprocess.run([str(BIN / "waymark-map"), "survey", str(lap)], capture_output=True, text=True)
    bar("office: findings of the survey of lap one (0: none)", surveyed.returncode, most=0)


def office():
    """Markers on a ceiling, from pixels and CAN; nothing of the map is given."""
    recording = DATA / "office-a"
    plain = run(recording, "office")
    bars("office", plain, position_rmse_m=0.02, heading_rmse_deg=0.4, nees_inside_95=0.85, landmarks_found=plain["landmarks_total"], landmark_rmse_m=0.015)
    # A landmark is 0.0047 m off where the scale of the map wanders with the rounds.
    bars("office, aligned with scale", run(recording, "office", "--align", "sim2"), position_rmse_m=0.01, landmark_max_m=0.004)


def stamps_off(seconds):
    """A camera's stamps so much later; what arrives does so after its stamp."""
    def change(f):
        f["t_ns"] = str(int(f["t_ns"]) + round(seconds * 1e9))
        f["arrival_ns"] = str(max(int(f["arrival_ns"]), int(f["t_ns"]) + 1_000_000))
    return each_row(change)


def hall():
    """Upright lines from pixels, and CAN; azimuths don't see scale. Then with the camera's stamps falsified."""
    recording = DATA / "hall-a"
    plain = run(recording, "hall")
    bars("hall", plain, position_rmse_m=0.085, heading_rmse_deg=0.25, nees_inside_95=0.85)
    bar("hall: lines of the map for each one labelled: lost ones are joined", plain["landmarks_estimated"] / plain["landmarks_total"], most=1.3)
    bars("hall, aligned with scale", run(recording, "hall", "--align", "sim2"), position_rmse_m=0.007, heading_rmse_deg=0.25)
    lines = run(recording, "hall", "--detector", "lines")
    bars(f"hall, {lines['with_contrast']} lines with contrast (of {lines['labelled']} labelled)", lines, recall=0.80, false_per_right=0.2,
         azimuth_rms_deg=0.15)
    for seconds in (0.03, -0.03):
        with disturbed(recording, {"video/omni.csv": stamps_off(seconds)}) as folder:
            bars(f"hall, camera's stamps {seconds} s off, aligned with scale, after 20 s",
                 run(folder, "hall", "--align", "sim2", "--from", "20", what=f"stamps {seconds} s off"), position_rmse_m=0.02)


def mounted(pitch_deg, height_m):
    """Another pitch and height of the camera than the file says."""
    def change(text):
        text = re.sub(r"rpy_deg: \[([^,]+), ([^,]+), ([^\]]+)\]",
                      lambda m: f"rpy_deg: [{m[1]}, {float(m[2]) + pitch_deg}, {m[3]}]", text)
        return re.sub(r"xyz_m: \[([^,]+), ([^,]+), ([^\]]+)\]",
                      lambda m: f"xyz_m: [{m[1]}, {m[2]}, {float(m[3]) + height_m}]", text)
    return change


def bytes_swapped(begin_s, seconds=1.0):
    """Change of a candump: pairs of data bytes swapped from so many seconds after the first frame on."""
    def change(text):
        lines = text.splitlines(keepends=True)
        stamps = [float(line[1:line.index(")")]) for line in lines]
        for i, stamp in enumerate(stamps):
            if begin_s <= stamp - stamps[0] < begin_s + seconds:
                head, data = lines[i].rstrip().rsplit("#", 1)
                lines[i] = f"{head}#{''.join(data[k + 2:k + 4] + data[k:k + 2] for k in range(0, len(data), 4))}\n"
        return "".join(lines)
    return change


def corridor():
    """From raw pixels and CAN; with pitch, height and stamps of the camera falsified; with a second of wrong speeds."""
    recording = DATA / "corridor-a"
    for seed in (1, 2, 3):
        bars(f"corridor, seed {seed}", run(recording, "corridor", seed=seed), position_mean_m=0.010, position_max_m=0.05, heading_mean_abs_deg=0.08,
             nees_inside_95=0.90, lost_count=0)
    settled = run(recording, "corridor", "--from", "30")["position_mean_m"]
    for sign in (1, -1):
        with disturbed(recording, {"calibration.yaml": mounted(0.5 * sign, 0.01 * sign), "video/front.csv": stamps_off(0.03 * sign)}) as folder:
            bar(f"corridor, {0.5 * sign} deg, {sign} cm, {30 * sign} ms: mean error over the undisturbed one's, after 30 s",
                run(folder, "corridor", "--from", "30", what=f"{0.5 * sign} deg, {sign} cm, {30 * sign} ms")["position_mean_m"] / settled, most=1.25)
    for begin_s in (87.5, 88.0):  # a look-alike of the place is 36 m away
        what = f"bytes of CAN swapped at {begin_s} s"
        with disturbed(recording, {"can.log": bytes_swapped(begin_s)}) as folder:
            r = run(folder, "corridor", what=what)
        bar(f"corridor, {what}: share of the time confidently wrong", replays.confidently_wrong(r["run"], recording), most=0.02)
        bars(f"corridor, {what}", r, position_max_m=5.0)


def comma():
    recording = DATA / "comma2k19-a"
    bars("comma2k19", run(recording, "comma2k19"), position_rmse_m=0.75, position_max_m=2.5)
    bar("comma2k19-tunnel: end error in % of the way without GNSS",
        run(recording, "comma2k19-tunnel", "--from", "25")["position_end_percent"], most=1.5)
    settled = run(recording, "comma2k19", "--from", "20")["position_rmse_m"]
    changes = {"GNSS 0.1 s later": {"gnss.csv": shifted(0.1)}, "GNSS 0.1 s earlier": {"gnss.csv": shifted(-0.1)},
               "yaw rate + 0.01 rad/s": {"vehicle.dbc": yaw_rate_offset(0.01)},
               "yaw rate - 0.01 rad/s": {"vehicle.dbc": yaw_rate_offset(-0.01)}}
    for what, change in changes.items():
        with disturbed(recording, change) as folder:
            bar(f"comma2k19, {what}: RMSE over the undisturbed one's, after 20 s",
                run(folder, "comma2k19", "--from", "20", what=what)["position_rmse_m"] / settled, most=1.15)


def stereo():
    bars("starry-night-stereo", run(DATA / "starry-night-stereo-a", "starry-night-stereo"), position_rmse_m=0.031, rotation_rmse_deg=3.8,
         nees_inside_95=0.85)


def without_frames(*frames):
    return of_lines(lambda lines: [line for line in lines if int(line.split(",")[0]) not in frames])


def failing_pictures(stuck, damaged):
    """The smallest of the pictures `stuck` in place of each of them; a quarter of each of `damaged` wiped out."""
    def change(video):
        out, pictures = bytearray(video), []
        at = video.index(b"movi") + 4
        while video[at + 2:at + 4] == b"dc":
            size = int.from_bytes(video[at + 4:at + 8], "little")
            pictures.append((at + 8, size))
            at += 8 + size + size % 2
        begin, least = min((pictures[i] for i in stuck), key=lambda one: one[1])
        for i in stuck:
            to, size = pictures[i]
            out[to:to + size] = video[begin:begin + least] + bytes(size - least)
        for i in damaged:
            to, size = pictures[i]
            out[to + size // 2:to + 3 * size // 4] = bytes(3 * size // 4 - size // 2)
        return bytes(out)
    return change


def seabed():
    """Points found in a stereo pair's pictures, and a noisy twist; nothing of the map is given."""
    recording = DATA / "seabed-a"
    bars("seabed", run(recording, "seabed"), position_rmse_m=0.04, rotation_rmse_deg=0.5, nees_inside_95=0.85)
    for what, changes in (
            ("mounting 0.4 degrees and 1 cm off", {"calibration.yaml": mounted(0.4, 0.01)}),
            ("stamps 15 ms late", {f"video/{side}.csv": shifted(0.015) for side in ("left", "right")}),
            ("2.5 s without pictures, 0.6 s with the same one, 4 damaged, the left camera missing two", {
                **{f"video/{side}.csv": without_frames(*range(160, 180), *((300, 301) if side == "left" else ()))
                   for side in ("left", "right")},
                **{f"video/{side}.avi": failing_pictures(range(240, 245), (90, 120, 340, 400)) for side in ("left", "right")}}),
            ("turn rates 0.3 degrees/s off", {"motion6.csv": each_row(
                lambda f: f.update(wz_radps=repr(float(f["wz_radps"]) + 0.005)))})):
        with disturbed(recording, changes) as folder:
            bars(f"seabed, {what}", run(folder, "seabed", what=what), position_rmse_m=0.06, rotation_rmse_deg=0.75, nees_inside_95=0.85)


def ranges_and_fixes():
    bars("labyrinth-uwb, ranges only, heading unknown", run(DATA / "labyrinth-uwb", "labyrinth-uwb"), position_rmse_m=0.15, nees_inside_95=0.80)
    recording = DATA / "smartloc-potsdamer-a"
    bars("smartloc", run(recording, "smartloc"), position_rmse_m=11.5, nees_inside_95=0.85)
    for begin, east, north in ((60, 20, 0), (60, -20, 0), (100, 0, 20), (30, 20, 20)):
        def pulled(f, begin=begin, east=east, north=north):
            if begin <= int(f["t_ns"]) * 1e-9 <= begin + 7:
                f["x_m"], f["y_m"] = repr(float(f["x_m"]) + east), repr(float(f["y_m"]) + north)
        with disturbed(recording, {"gnss.csv": each_row(pulled)}) as folder:
            bars(f"smartloc, positions {east} m east and {north} m north off for 7 s from {begin} s on",
                 run(folder, "smartloc", what=f"{east} m east, {north} m north from {begin} s on"), position_rmse_m=11.5)


def plane():
    bars("mecanum-1, odometry by its defaults", run(DATA / "mecanum-1", "odometry:"), position_rmse_m=0.23)
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / "dlr-a"
        covariances.copy(DATA / "dlr-a", copy)
        bars("dlr-a with its source's covariances, slam by its defaults", run(copy, "slam:", what="with covariances"), position_rmse_m=0.75,
             landmark_rmse_own_fit_m=0.30, nees_inside_95=0.90)


PARTS = (starry, mrclam, slam, park, office, lost_on_a_map, hall, corridor, comma, stereo, seabed, ranges_and_fixes, plane)


def options():
    parser = replays.parser(__doc__, "parts with one of these names: " + ", ".join(part.__name__ for part in PARTS))
    bench.out_option(parser)
    parser.add_argument("--jobs", metavar="N", type=int, default=1, help="parts at once")
    return parser.parse_args()


def main():
    names = ["starry-night-plan-a", "starry-night-stereo-a", "comma2k19-a", "victoria-park-a", "office-a", "hall-a", "corridor-a",
             "seabed-a", "labyrinth-uwb", "smartloc-potsdamer-a", "mecanum-1", "dlr-a", *(f"mrclam-d6-r{i}" for i in range(1, 6))]
    missing = [n for n in names if not (DATA / n).is_dir()]
    if missing:
        print(f"skipped: no recording {missing[0]} in {DATA}")
        return 77
    with concurrent.futures.ThreadPoolExecutor(OPTIONS.jobs) as pool:
        for part in [pool.submit(part) for part in PARTS if replays.is_chosen(OPTIONS, part.__name__)]:
            part.result()
    BENCH.write_results("accuracy.py")
    print(f"{len(failures)} bars missed")
    return 1 if failures else 0


if __name__ == "__main__":
    OPTIONS = options()
    BIN, SOURCE, DATA = OPTIONS.bin_dir, OPTIONS.source_dir, OPTIONS.data_dir
    BENCH = bench.Bench(BIN, OPTIONS.out)
    sys.exit(main())
