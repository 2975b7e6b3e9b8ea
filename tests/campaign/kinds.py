# SPDX-License-Identifier: Apache-2.0
"""What goes wrong in a drive of the campaign: kinds of faults, their ranges, and the worlds that have what each needs.

A kind draws its numbers from a random generator. It changes the scenario before the drive is simulated, or files of the recording
afterwards: sensors whose numbers are wrong, calibrations that are."""
import math
import pathlib
import sys
from dataclasses import dataclass, field

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "contract"))
import replays  # noqa: E402

PLAIN = "format: waymark-config/1\nestimator: {}\n"


@dataclass(frozen=True)
class World:
    """A scenario, the configuration that a new user has for it, and what is in its recording."""
    scenario: str
    config: str  # a file of config/, or the text of one
    seen: str = ""  # stream of observations
    has: tuple = ()  # can, wheels, imu, map, motion: what a kind may need
    edits: tuple = ()  # of the configuration's text
    seconds: float = 60
    share: float = 1  # of the drives, against other worlds


WORLDS = {
    "odometry": World("crossing", PLAIN.format("odometry"), has=("can", "wheels", "route")),
    "landmarks": World("crossing", "robot.yaml", "sightings.csv", ("can", "wheels", "map", "frames", "route")),
    "landmarks, laps": World("crossing-laps", "robot.yaml", "sightings.csv", ("can", "wheels", "map", "frames", "route"), seconds=120),
    "landmarks, holonomic": World("yard-holonomic", "robot.yaml", "sightings.csv", ("motion", "map", "route"),
                                  (("motion:\n", "motion:\n  drive: holonomic\n  twist: measured\n"),)),
    "landmarks, IMU": World("yard-imu", "robot.yaml", "sightings.csv", ("motion", "imu", "map", "route"),
                            (("motion:\n", "motion:\n  twist: measured\n"),)),
    "landmarks, skid": World("yard-skid", "robot.yaml", "sightings.csv", ("can", "map", "route"),
                             (("motion:\n", "motion:\n  drive: skid_steer\n"), ("    track_scale_sigma: 0.02\n", ""))),
    "landmarks, commands": World("loops-commands", "robot.yaml", "sightings.csv", ("map", "route")),
    "positions": World("car-gnss", "car.yaml", "gnss.csv", ("can", "wheels", "route"), seconds=120),
    "slam, markers": World("loops-markers", PLAIN.format("slam"), "markers.csv", ("can", "wheels", "route"), seconds=120),
    "slam, landmarks": World("loops-landmarks", PLAIN.format("slam"), "sightings.csv", ("can", "wheels", "route"), seconds=120),
    "slam, bearings": World("loops-lines", PLAIN.format("slam"), "sightings.csv", ("can", "wheels", "route"), seconds=120),
    "stereo, known points": World("seabed-points", PLAIN.format("stereo_ekf"), "stereo.csv", ("motion6", "map")),
    "stereo, acoustic": World("seabed-acoustic", PLAIN.format("stereo_ekf"), "sightings.csv", ("motion6", "map")),
    "edges, filter and scans": World("corridor-low", PLAIN.format("edge_mcl"), "points.csv", ("can", "wheels", "route"), seconds=45, share=0.5),
    "edges, particles": World("corridor-low", PLAIN.format("pf_edges"), "points.csv", ("can", "wheels", "route"), seconds=45, share=0.5),
}
RANGED = ("slam, landmarks", "stereo, acoustic", "landmarks, commands")  # sightings with ranges
MOTION = {"motion": "motion.csv", "motion6": "motion6.csv"}


@dataclass
class Drive:
    """What is drawn for one drive: keys of the scenario's `faults`, a factor on its `errors`, changes of files."""
    faults: dict = field(default_factory=dict)
    errors: float = 1
    files: dict = field(default_factory=dict)
    said: list = field(default_factory=list)

    def change(self, file, function, text):
        before = self.files.get(file)
        self.files[file] = function if before is None else lambda whole: function(before(whole))
        self.said.append(text)

    def fault(self, **keys):
        self.faults.update(keys)
        self.said.append(", ".join(f"{k} {v}" for k, v in keys.items()))


def log_uniform(r, low, high):
    return low * (high / low) ** r.random()


def sign(r):
    return r.choice((-1, 1))


def bus(r, w, d):
    d.fault(can_lost_percent=round(log_uniform(r, 1, 30), 1), can_duplicated_percent=round(r.uniform(0, 10), 1),
            can_late_percent=round(r.uniform(0, 10), 1), can_late_ms=round(r.uniform(10, 200)))


def outliers(r, w, d):
    d.fault(sightings_lost_percent=round(r.uniform(0, 50)), sightings_misread_percent=round(log_uniform(r, 1, 20), 1),
            sightings_false_percent=round(log_uniform(r, 1, 20), 1))


def wrong_map(r, w, d):
    d.fault(landmarks_moved={"count": r.randint(1, 3), "by_m": round(log_uniform(r, 0.1, 3), 2)})


def dead_encoder(r, w, d):
    d.fault(dead_encoder={"wheel": r.choice(("left", "right")), "from_s": round(r.uniform(5, 30), 1)})


def slip(r, w, d):
    begin = round(r.uniform(5, 25), 1)
    d.fault(wheel_slip={"wheel": r.choice(("left", "right")), "percent": round(log_uniform(r, 5, 100)), "from_s": begin,
                        "to_s": round(begin + log_uniform(r, 0.5, 10), 1)})


def stuck_gyro(r, w, d):
    begin = round(r.uniform(5, 25), 1)
    d.fault(gyro_stuck={"from_s": begin, "to_s": round(begin + log_uniform(r, 2, 30), 1)})


def kidnap(r, w, d):
    d.fault(kidnap={"at_s": round(r.uniform(8, 25), 1), "forward_s": round(log_uniform(r, 2, 12), 1)})


def wrong_start(r, w, d):
    d.fault(start_offset={"x_m": round(sign(r) * log_uniform(r, 0.1, 3), 2), "y_m": round(sign(r) * log_uniform(r, 0.1, 3), 2),
                          "heading_deg": round(sign(r) * log_uniform(r, 2, 45), 1)})


def large_errors(r, w, d):
    d.errors = round(log_uniform(r, 1.5, 5), 2)
    d.said.append(f"errors x {d.errors}")


def wheel_size(r, w, d):
    factor = log_uniform(r, 1.02, 1.3) ** sign(r)
    d.change("calibration.yaml", lambda t: replays.replaced(r"radius_m: ([0-9.]+)", lambda v: v * factor, t), f"wheel radius x {factor:.3f}")


def track(r, w, d):
    factor = log_uniform(r, 1.02, 1.3) ** sign(r)
    d.change("calibration.yaml", lambda t: replays.replaced(r"track_m: ([0-9.]+)", lambda v: v * factor, t), f"track x {factor:.3f}")


def mounting(r, w, d):
    degrees = sign(r) * log_uniform(r, 1, 90)
    if w.seen in ("points.csv",):  # points are in base_link already: they are turned themselves
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))

        def turn(f):
            x, y = float(f["x_m"]), float(f["y_m"])
            f["x_m"], f["y_m"] = f"{c * x - s * y:.4f}", f"{s * x + c * y:.4f}"
        d.change(w.seen, replays.each_row(turn), f"points turned by {degrees:.1f} deg")
        return
    d.change("calibration.yaml", replays.turned(degrees), f"sensors turned by {degrees:.1f} deg")


def ranges(r, w, d):
    factor = log_uniform(r, 1.02, 1.5) ** sign(r)
    columns = ("x_m", "y_m", "z_m") if w.seen in ("markers.csv", "points.csv") else ("range_m",)
    d.change(w.seen, replays.scaled(columns, factor), f"ranges x {factor:.3f}")


def clock(r, w, d):
    seconds = sign(r) * log_uniform(r, 0.02, 1)
    d.change(w.seen, replays.shifted(seconds), f"stamps of {w.seen} {seconds:+.3f} s")


def late(r, w, d):
    seconds = log_uniform(r, 0.1, 2)

    def change(f):
        f["arrival_ns"] = str(int(f.get("arrival_ns") or f["t_ns"]) + round(seconds * 1e9))

    def whole(text):
        head, *lines = text.splitlines()
        if "arrival_ns" not in head.split(","):
            text = "\n".join([head + ",arrival_ns", *(line + "," for line in lines)]) + "\n"
        return replays.each_row(change)(text)
    d.change(w.seen, whole, f"{w.seen} arrives {seconds:.2f} s later")


def silent(r, w, d):
    begin, length = r.uniform(5, 20), log_uniform(r, 3, 60)

    def kept(lines):
        first = int(lines[0].split(",")[0])
        return [line for line in lines if not begin <= (int(line.split(",")[0]) - first) * 1e-9 < begin + length]
    d.change(w.seen, replays.of_lines(kept), f"{w.seen} silent from {begin:.1f} s for {length:.1f} s")


def frozen(r, w, d):
    """Values of the last observation before it again and again, with stamps that go on."""
    begin, length = r.uniform(5, 20), log_uniform(r, 2, 30)
    first, kept = [], {}

    def change(f):
        first.append(int(f["t_ns"]))
        if begin <= (int(f["t_ns"]) - first[0]) * 1e-9 < begin + length:
            kept.update({} if kept else f)
            f.update((name, value) for name, value in kept.items() if name not in ("t_ns", "arrival_ns"))
    d.change(w.seen, replays.each_row(change), f"{w.seen} frozen from {begin:.1f} s for {length:.1f} s")


def motion_file(w):
    return next(MOTION[h] for h in w.has if h in MOTION)


def speed(r, w, d):
    factor = log_uniform(r, 1.02, 1.5) ** sign(r)
    d.change(motion_file(w), replays.scaled(("v_mps", "vx_mps", "vy_mps", "vz_mps"), factor), f"measured speed x {factor:.3f}")


def turn_sign(r, w, d):
    d.change(motion_file(w), replays.scaled(("w_radps", "wz_radps"), -1), "measured turn rate times -1")


# Kind: what the world has to have (suits() has the words), the function.
KINDS = {
    "bus": (("can",), bus),
    "outliers and misread identities": (("seen", "features"), outliers),
    "landmarks moved": (("map",), wrong_map),
    "encoder dead": (("wheels",), dead_encoder),
    "wheel slips": (("wheels",), slip),
    "gyro stuck": (("imu",), stuck_gyro),
    "carried off": (("route",), kidnap),
    "start pose wrong": (("anchored",), wrong_start),
    "errors larger than stated": ((), large_errors),
    "wheel radius wrong": (("wheels",), wheel_size),
    "track wrong": (("wheels",), track),
    "sensor turned": (("turnable",), mounting),
    "ranges wrong": (("ranges",), ranges),
    "clock of sensor off": (("seen",), clock),
    "observations late": (("seen",), late),
    "sensor silent": (("seen",), silent),
    "sensor frozen": (("seen",), frozen),
    "measured speed wrong": (("twist",), speed),
    "measured turn rate mirrored": (("twist",), turn_sign),
}


def suits(kind, name, world):
    """Whether the world has what the kind changes."""
    has = set(world.has)
    if world.seen:
        has |= {"seen"}
    if world.seen in ("sightings.csv", "markers.csv", "stereo.csv", "gnss.csv"):
        has |= {"features"}
    if world.seen in ("markers.csv", "points.csv") or name in RANGED:
        has |= {"ranges"}
    if world.seen and world.seen != "gnss.csv":
        has |= {"turnable"}
    if "map" in has or world.seen in ("gnss.csv", "points.csv"):
        has |= {"anchored"}  # a map is made from the start pose: nothing contradicts a wrong one
    if has & set(MOTION):
        has |= {"twist"}
    return set(KINDS[kind][0]) <= has
