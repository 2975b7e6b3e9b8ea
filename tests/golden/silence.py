# SPDX-License-Identifier: Apache-2.0
"""The bus falls silent for seconds while the robot drives, turns or sets off, with and without landmarks in view: until
and after it is back the pose is no further from the truth than its sigma says, and soon it is right again. One bearing
in a hundred is false: where the pose is vague, one of them may fit. The same for a minute without bus and camera, in
which a wheel's counter of 16 bits may have wrapped: how far the robot drove is then unknown, and `slam` finds it in its map."""
import bisect
import math
import pathlib
import shutil
import sys
import tempfile

from judged import ROOT, check, failures, rows, run

CONFIG = ROOT / "config/datasets/crossing-points.yaml"
WORLD = ROOT / "config/worlds/crossing-laps.yaml"
SILENCES_S = (3, 6, 20)
BEGINS_S = (12, 25, 38, 50, 62, 75)  # turns, straights and a stop
LONG_S, LONG_BEGINS_S = 40, (12, 25, 38)  # 100 m are a cycle of the counters, up to 120 m are driven
SIGMAS, BEYOND = 5.0, 0.01
RIGHT_M, RIGHT_RAD, RIGHT_AFTER_S = 0.3, 0.1, 5.0
FOUND_AFTER_S = 10.0  # by three landmarks, where it may be anywhere
OFFICE = ROOT / "config/worlds/office-walls.yaml"
OFFICE_S, OFFICE_BEGINS_S = 60, (40, 64, 88)
# The simulated markers' sigmas in place of the detectors'.
OFFICE_CHANGES = (("vision:\n  apriltag: {}\n  mr: {size_m: 0.27}\n", ""),
                  ("{bearing_sigma_rad: 0.0003, sigma_m: 0.001, ", "{bearing_sigma_rad: 0.005, sigma_m: 0.005, "),
                  ("heading_sigma_rad: 0.003,", "heading_sigma_rad: 0.009,"))


def yaw(row):
    return 2.0 * math.atan2(float(row["qz"]), float(row["qw"]))


class Truth:
    def __init__(self, folder):
        self.rows = rows(folder / "truth.csv")
        self.t_ns = [int(row["t_ns"]) for row in self.rows]

    def at(self, t_ns):
        i = min(max(bisect.bisect_left(self.t_ns, t_ns), 1), len(self.rows) - 1)
        a, b = self.rows[i - 1], self.rows[i]
        share = (t_ns - self.t_ns[i - 1]) / (self.t_ns[i] - self.t_ns[i - 1])
        turn = math.remainder(yaw(b) - yaw(a), math.tau)
        return [float(a[k]) + share * (float(b[k]) - float(a[k])) for k in ("x_m", "y_m")] + [yaw(a) + share * turn]


def silence(recording, to, begin_ns, end_ns, blind):
    """A copy in which the bus says nothing meanwhile, and blind: the cameras neither."""
    shutil.rmtree(to, ignore_errors=True)
    shutil.copytree(recording, to)
    with open(recording / "can.log") as log, open(to / "can.log", "w") as out:
        out.writelines(line for line in log if not begin_ns <= float(line[1:line.index(")")]) * 1e9 < end_ns)
    if not blind:
        return
    for table in filter(lambda table: (recording / table).exists(), ("sightings.csv", "markers.csv")):
        with open(recording / table) as seen, open(to / table, "w") as out:
            out.write(seen.readline())
            out.writelines(line for line in seen if not begin_ns <= int(line.split(",")[0]) < end_ns)


def judge(trajectory, truth, begin_ns, end_ns):
    """(errors in sigmas from the silence on, s after its end when the pose was last not right)"""
    sigmas, late_s = [], 0.0
    for row in rows(trajectory):
        t_ns = int(row["t_ns"])
        if not begin_ns <= t_ns <= end_ns + 30_000_000_000:
            continue
        x, y, heading = truth.at(t_ns)
        dx, dy = float(row["x_m"]) - x, float(row["y_m"]) - y
        turned = abs(math.remainder(yaw(row) - heading, math.tau))
        xx, xy, yy = (float(row[k]) for k in ("cov_xx", "cov_xy", "cov_yy"))
        place = math.sqrt((yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy))
        sigmas.append(max(place, turned / math.sqrt(float(row["cov_tt"]))))
        if t_ns >= end_ns and (math.hypot(dx, dy) > RIGHT_M or turned > RIGHT_RAD):
            late_s = (t_ns - end_ns) * 1e-9
    return sigmas, late_s


def office_config(to):
    text = (ROOT / "config/datasets/office-walls.yaml").read_text()
    for old, new in OFFICE_CHANGES:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    to.write_text(text)
    return to


def try_silences(work, recording, truth, seconds, begins_s, blind, right_after_s=RIGHT_AFTER_S, config=CONFIG):
    sigmas, late = [], []
    for begin_s in begins_s:
        begin_ns = truth.t_ns[0] + begin_s * 1_000_000_000
        end_ns = begin_ns + seconds * 1_000_000_000
        silence(recording, work / "silent", begin_ns, end_ns, blind)
        run("waymark", "replay", work / "silent", "--config", config, "--out", work / "run", "--until", begin_s + seconds + 31)
        errors, late_s = judge(work / "run/trajectory.csv", truth, begin_ns, end_ns)
        sigmas += errors
        late.append(late_s)
    what = f"{seconds} s without the bus{' and the cameras' if blind else ''}"
    beyond = sum(e > SIGMAS for e in sigmas) / len(sigmas)
    check(beyond < BEYOND, f"{what}: {100 * beyond:.2f} % of the poses beyond {SIGMAS:.0f} sigma, at most {max(sigmas):.1f}")
    check(max(late) < right_after_s, f"{what}: right again after {max(late):.1f} s at most")


with tempfile.TemporaryDirectory() as temporary:
    work = pathlib.Path(temporary)
    office = work / "office"
    run("waymark", "simulate", OFFICE, "--out", office, "--no-video")
    print("slam past markers:")
    try_silences(work, office, Truth(office), OFFICE_S, OFFICE_BEGINS_S, True, config=office_config(work / "office.yaml"))
    print("landmark_ekf:")
    recording = work / "recording"
    run("waymark", "simulate", WORLD, "--out", recording, "--seed", 3)
    truth = Truth(recording)
    try_silences(work, recording, truth, LONG_S, LONG_BEGINS_S, True, FOUND_AFTER_S)
    for seconds in SILENCES_S:
        for blind in (False, True):
            try_silences(work, recording, truth, seconds, BEGINS_S, blind)
    # The bus stays silent for ever, the cameras are back after 12 s: what they see is used.
    begin_ns, back_ns = truth.t_ns[0] + 38_000_000_000, truth.t_ns[0] + 50_000_000_000
    silence(recording, work / "silent", begin_ns, back_ns, True)
    silence(work / "silent", work / "dead", begin_ns, 1 << 62, False)
    run("waymark", "replay", work / "dead", "--config", CONFIG, "--out", work / "run", "--until", 75)
    verdicts = [row["verdict"] for row in rows(work / "run/innovations.csv") if int(row["t_ns"]) >= back_ns]
    check(verdicts.count("fused") > 0.8 * len(verdicts), f"no bus any more: {verdicts.count('fused')} of {len(verdicts)} sightings are fused")
sys.exit(bool(failures))
