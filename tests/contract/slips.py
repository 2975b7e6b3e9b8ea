#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""SLAM after slips and with misread identities, injected into recordings whose landmarks have identities. A slip is a
turn that the odometry reports and the robot did not make, in a gap without sightings. A misread identity is another one
of the recording, in bursts. Each disturbed replay is compared with the undisturbed one. Skips (77) where the recordings
are not there. Those whose source gives covariances are replayed with them.

    slips.py BIN_DIR SOURCE_DIR DATA_DIR [--only WORD[,WORD]] [--seed N] [--set KEY=VALUE] [--json]"""
import math
import random
import sys

import bench
import covariances
import defaults
import replays

RECORDINGS = ("dlr-a", "mrclam-d6-r1", "mrclam-d6-r2", "mrclam-d6-r3", "mrclam-d6-r5", "mrclam-d6-t5")
MOTIONS = (("increments.csv", "dheading_rad"), ("motion6.csv", "wz_radps"), ("motion.csv", "w_radps"))
SLIPS_DEG = (40, 70)
SLIP_S = 1.0            # a slip takes so long
GAP_S = 2.0             # without sightings
BEGUN = 0.2             # of the drive: from then on there is a map
KNOWN_SEEN = 3          # sightings that make a landmark known
FOLLOW_S = 60           # the next two known landmarks come within this time
RIGHT_S = 20            # of these two: right again
RIGHT_M, RIGHT_RAD = 0.5, math.radians(15)   # from the undisturbed replay
RIGHT_SHARE = 0.95      # of the time after RIGHT_S
MISREAD_SHARE, BURST = 0.01, 5
MAP_RATIO = 1.2
LEAST_M = 0.02          # maps that are this good count as equal


def number(text):
    return float(text) if text else math.nan


class Recording:
    """Motion and sightings of a recording, to be written disturbed."""

    def __init__(self, folder):
        self.folder = folder
        self.motion_name, self.turn = next(m for m in MOTIONS if (folder / m[0]).exists())
        self.motion = replays.rows(folder / self.motion_name)
        self.sightings = replays.rows(folder / "sightings.csv")
        self.stamps = sorted({int(r["t_ns"]) for r in self.sightings})

    def known_before(self, t_ns):
        seen = {}
        for r in self.sightings:
            if int(r["t_ns"]) <= t_ns and int(r["id"]) >= 0:
                seen[r["id"]] = seen.get(r["id"], 0) + 1
        return {i for i, count in seen.items() if count >= KNOWN_SEEN}

    def second_known(self, t_ns):
        """When the second one of the landmarks that were known before t_ns is seen after it."""
        known, seen = self.known_before(t_ns), set()
        for r in self.sightings:
            if int(r["t_ns"]) > t_ns and r["id"] in known:
                seen.add(r["id"])
                if len(seen) == 2:
                    return int(r["t_ns"])
        return None

    def gaps(self):
        """Begin and end of each gap late enough, with two known landmarks after it."""
        first, last = self.stamps[0], self.stamps[-1]
        out = []
        for a, b in zip(self.stamps, self.stamps[1:]):
            if b - a < GAP_S * 1e9 or a < first + BEGUN * (last - first):
                continue
            second = self.second_known(a)
            if second is not None and second - b < FOLLOW_S * 1e9 and last - second > 2 * RIGHT_S * 1e9:
                out.append((a, b))
        return out

    def slipped(self, gap, angle_rad):
        """Motion rows with the slip in the middle of the gap."""
        begin_ns = (gap[0] + gap[1]) // 2 - int(SLIP_S * 0.5e9)
        within = [k for k, r in enumerate(self.motion[:-1]) if begin_ns <= int(r["t_ns"]) < begin_ns + SLIP_S * 1e9]
        whole_s = (int(self.motion[within[-1] + 1]["t_ns"]) - int(self.motion[within[0]]["t_ns"])) * 1e-9
        share = len(within) if self.turn == "dheading_rad" else whole_s   # a row is a turn, or a turn rate
        out = [dict(r) for r in self.motion]
        for k in within:
            out[k][self.turn] = f"{number(out[k][self.turn]) + angle_rad / share:.9f}"
        return out

    def misread(self, rng):
        """Sighting rows of which a share, in bursts of one landmark each, have another identity. None twice in a stamp."""
        out = [dict(r) for r in self.sightings]
        ids = sorted({r["id"] for r in out if int(r["id"]) >= 0})
        of_id, at = {i: [] for i in ids}, {}
        for k, r in enumerate(out):
            if int(r["id"]) >= 0:
                of_id[r["id"]].append(k)
            at.setdefault(r["t_ns"], set()).add(r["id"])
        changed = set()
        while len(changed) < MISREAD_SHARE * len(out):
            true, wrong = rng.choice(ids), rng.choice(ids)
            first = rng.randrange(len(of_id[true])) if of_id[true] else 0
            burst = of_id[true][first:first + BURST]
            if wrong == true or changed & set(burst) or any(wrong in at[out[k]["t_ns"]] for k in burst):
                continue
            for k in burst:
                out[k]["id"] = wrong
                changed.add(k)
        return out

    def write(self, folder, motion=None, sightings=None):
        tables = {self.motion_name: motion, "sightings.csv": sightings}
        replays.copy_changed(self.folder, folder, {})
        for name, table in tables.items():
            if table is not None:
                (folder / name).unlink()
                replays.write_rows(folder / name, table)


def poses(run):
    return {int(r["t_ns"]): (float(r["x_m"]), float(r["y_m"]), 2 * math.atan2(float(r["qz"]), float(r["qw"])))
            for r in replays.rows(run / "trajectory.csv")}


def is_right(a, b):
    return math.hypot(a[0] - b[0], a[1] - b[1]) < RIGHT_M and abs(math.remainder(a[2] - b[2], math.tau)) < RIGHT_RAD


def right_after(undisturbed, disturbed, second_ns):
    """Seconds from the second landmark to the first pose that is right, and the share of right poses after RIGHT_S."""
    after = [(t, is_right(undisturbed[t], p)) for t, p in sorted(disturbed.items()) if t in undisturbed and t >= second_ns]
    late = [right for t, right in after if t > second_ns + RIGHT_S * 1e9]
    first = next(((t - second_ns) * 1e-9 for t, right in after if right), None)
    return first, sum(late) / len(late) if late else 0.0


def replayed(options, recording, name, text, scratch, **tables):
    """A disturbed replay: its folder and its figures, against the original recording's truth."""
    folder = scratch / f"{name}-recording"
    recording.write(folder, **tables)
    config = scratch / f"{name}.yaml"
    config.write_text(text)
    case = defaults.Case(recording.folder.name, "slam", (), defaults.SE2)
    out = defaults.figures(options.runs, case, folder, config, name)
    return out["run"], out


def row_of(name, out, **more):
    keys = ("position_rmse_m", "nees_inside_95", "landmark_rmse_own_fit_m", "landmarks_moved", "confidently_wrong")
    return {"case": name, **{k: out[k] for k in keys}, **more}


def judge(options, name, scratch):
    folder = options.data_dir / name
    if (folder / "steps-covariance.csv").exists():   # the source's covariances, which are beside the recording
        covariances.copy(folder, scratch / name)
        folder = scratch / name
    recording = Recording(folder)
    case = defaults.Case(name, "slam", ())
    text = defaults.plain(case, options.set)
    rng = random.Random(f"{name} {options.seed}")
    plain_run, plain = replayed(options, recording, "plain", text, scratch)
    undisturbed = poses(plain_run)
    rows = [row_of(f"{name} undisturbed", plain)]
    gaps = recording.gaps()
    for degrees, gap in zip(SLIPS_DEG, rng.sample(gaps, min(len(SLIPS_DEG), len(gaps)))):
        turn = math.radians(degrees) * rng.choice((-1, 1))
        run, out = replayed(options, recording, f"slip{degrees}", text, scratch, motion=recording.slipped(gap, turn))
        first, share = right_after(undisturbed, poses(run), recording.second_known(gap[0]))
        rows.append(row_of(f"{name} slip {degrees} deg at {(gap[0] - recording.stamps[0]) * 1e-9:.0f} s", out, first_s=first, right=share,
                           good=share >= RIGHT_SHARE))
    run, out = replayed(options, recording, "misread", text, scratch, sightings=recording.misread(rng))
    bar = MAP_RATIO * max(plain["landmark_rmse_own_fit_m"], LEAST_M)
    ratio = out["landmark_rmse_own_fit_m"] / max(plain["landmark_rmse_own_fit_m"], LEAST_M)
    rows.append(row_of(f"{name} misread", out, ratio=ratio, good=out["landmark_rmse_own_fit_m"] <= bar))
    return rows


def printed(row):
    def value(key, digits):
        return replays.printed(row.get(key), digits)
    verdict = "" if "good" not in row else "good" if row["good"] else "MISSED"
    return (f"{row['case']:38} {value('position_rmse_m', 3):>8} {value('nees_inside_95', 2):>5} {value('landmark_rmse_own_fit_m', 3):>8} "
            f"{row['landmarks_moved']:>5} {value('confidently_wrong', 3):>6} {value('first_s', 1):>8} {value('right', 2):>6} {value('ratio', 2):>6}  {verdict}")


def main():
    parser = replays.parser(__doc__, "recordings whose name contains one of these words")
    parser.add_argument("--seed", type=int, default=1, help="of the gaps, the slips' directions and the misread identities")
    bench.out_option(parser)
    options = parser.parse_args()
    options.runs = bench.Bench(options.bin_dir, options.out)
    if not options.data_dir.is_dir():
        print(f"{options.data_dir}: no recordings here")
        return 77
    names = [n for n in RECORDINGS if (options.data_dir / n).is_dir() and replays.is_chosen(options, n)]
    head = f"{'recording and disturbance':38} {'se2 m':>8} {'NEES':>5} {'map m':>8} {'moved':>5} {'wrong':>6} {'found s':>8} {'right':>6} {'map x':>6}"
    results = replays.table(options, head, names, judge, printed)
    options.runs.write_results("slips.py")
    if not options.json:
        for what in ("slip", "misread"):
            judged = [r["good"] for r in results if what in r["case"]]
            print(f"{what}: {sum(judged)} of {len(judged)} good")
    return 0


if __name__ == "__main__":
    sys.exit(main())
