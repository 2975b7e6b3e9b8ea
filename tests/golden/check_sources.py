#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark check` compares the sources of a recording with each other and looks at the clock of each: a drive whose way
is known, written with one fault at a time, and the finding that has to name it, with its size and the line to write.
Right drives, of other rates and noises, make no finding, but for what they don't show."""
import math
import pathlib
import random
import struct
import sys
import tempfile

from judged import checked

START_NS = 1_700_000_000 * 10**9
SECONDS = 20.0
CONFIG = "format: waymark-config/1\nestimator: odometry\n"
RECORDING = "format: waymark-recording/1\nname: drive\nstreams: [{}]\nvehicle:\n  initial_pose: {{x_m: 0, y_m: 0, heading_rad: 0}}\n"
DBC = 'VERSION ""\nNS_ :\nBS_:\nBU_: ECU\nBO_ 256 DRIVE: 8 ECU\n SG_ SPEED : 0|32@1{0} (1,0) [0|0] "m/s" ECU\n SG_ YAW : 32|32@1{0} (1,0) [0|0] "rad/s" ECU\n{1}'
VALTYPES = "SIG_VALTYPE_ 256 SPEED : 1;\nSIG_VALTYPE_ 256 YAW : 1;\n"
SIGNALS = "- {quantity: vehicle_speed, message: DRIVE, signal: SPEED}\n- {quantity: yaw_rate, message: DRIVE, signal: YAW}\n"


def turn(t):
    """rad/s: straight, a bend to the left, one to the right; again each 20 s."""
    t %= 20
    return 0.3 if 6 < t < 11 else -0.25 if 14 < t < 18 else 0.0


def weave(t):
    """rad/s: left and right in turn, 30 s each way."""
    return 0.2 * math.sin(2 * math.pi * t / 60)


def speed(t):
    return 1.0 + 0.2 * math.sin(0.7 * t)


def heading(t, step=0.01):
    return sum(turn(k * step) * step for k in range(round(t / step)))


def ns(t):
    return START_NS + round(t * 1e9)


def times(rate_hz, seconds=SECONDS):
    return [k / rate_hz for k in range(round(seconds * rate_hz))]


def noise(seed):
    source = random.Random(seed)
    return lambda sigma: source.gauss(0, sigma) if sigma else 0.0


def table(head, rows):
    return head + "\n" + "".join(",".join(str(c) for c in row) + "\n" for row in rows)


def motion(rate_hz=50, v=1.0, w=1.0, sigma=0.01, stamp=ns, repeat=1, arrival=None, exact=False, steady=False, seconds=SECONDS, turn=turn):
    """motion.csv: speed and turn rate times a factor each; each value `repeat` times."""
    n, rows, held = noise(1), [], None
    for k, t in enumerate(times(rate_hz, seconds)):
        if k % repeat == 0:
            s = 0 if exact else sigma
            held = (f"{v * (1.5 if steady else speed(t)) + n(s):.5f}", f"{w * turn(t) + n(s):.5f}") if not exact else (v, w * turn(t))
        rows.append([stamp(t), *held, *([arrival(t)] if arrival else [])])
    return table("t_ns,v_mps,w_radps" + (",arrival_ns" if arrival else ""), rows)


def commands():
    """motion.csv of commands: they hold for 1 to 12 rows."""
    source, rows, held, left = random.Random(4), [], None, 0
    for t in times(50):
        left -= 1
        if left <= 0:
            held, left = (f"{speed(t):.2f}", f"{turn(t) + source.gauss(0, 0.05):.2f}"), source.choice((1, 1, 1, 2, 2, 3, 5, 8, 12))
        rows.append([ns(t), *held])
    return table("t_ns,v_mps,w_radps", rows)


def imu(rate_hz=100, axes=(0, 0, 1), factor=1.0, up=(0, 0, 1), gravity=9.81, sigma=0.003, stamp=ns, zero=None, lag_s=0.0, bias=0.0, every=1, seconds=SECONDS, turn=turn):
    """imu.csv: the turn about an axis, gravity along another; `zero`: which samples are 0."""
    n, rows = noise(2), []
    for k, t in enumerate(times(rate_hz, seconds)):
        w = factor * turn(t - lag_s)
        rates = [a * w + n(sigma) + bias for a in axes]
        if zero and zero(k):
            rates = [0, 0, 0]
        rows.append([stamp(t), *(f"{r:.6f}" for r in rates), *(f"{gravity * u + n(0.02):.4f}" for u in up)])
    return table("t_ns,wx_radps,wy_radps,wz_radps,ax_mps2,ay_mps2,az_mps2", rows[::every])


def can(stamp=lambda t: f"{START_NS / 1e9 + t:.6f}", valtype=True, signed="-", v=1.0, w=1.0, endings=""):
    lines = [f"({stamp(t)}) can0 100#{struct.pack('<ff', v * speed(t), w * turn(t)).hex().upper()}" for t in times(100)]
    return {"can.log": "\n".join(lines) + "\n", "vehicle.dbc": DBC.format(signed, VALTYPES if valtype else ""), "can-signals.yaml": SIGNALS}


def headings():
    n = noise(5)
    return table("t_ns,heading_rad,sigma_rad", [[ns(t), f"{heading_at[round(100 * t)] + n(0.02):.5f}", 0.02] for t in times(5)])


def gnss(sigma=0.05, stated=0.05, rate_hz=5, scale=1.0, steady=False):
    n, x, y, rows = noise(3), 0.0, 0.0, []
    for k in range(round(SECONDS * 100)):
        t = k / 100
        if k % round(100 / rate_hz) == 0:
            rows.append([ns(t), f"{scale * x + n(sigma):.4f}", f"{scale * y + n(sigma):.4f}", 0, stated, 0.1])
        h = heading_at[k]
        v = 1.5 if steady else speed(t)
        x, y = x + 0.01 * v * math.cos(h), y + 0.01 * v * math.sin(h)
    return table("t_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m", rows)


def sighted(map_factor=1.0, most_m=""):
    """Ranges and bearings to posts beside the way, on a map whose lengths are times a factor; a sensor that states `most_m`."""
    n, x, y, rows = noise(6), 0.0, 0.0, []
    posts = [(3.0 * i, side) for i in range(-1, 8) for side in (-4.0, 3.0, 9.0)]
    for k in range(round(SECONDS * 100)):
        h = heading_at[k]
        for i, (px, py) in enumerate(posts) if k % 20 == 0 else ():
            away, bearing = math.hypot(px - x, py - y), math.remainder(math.atan2(py - y, px - x) - h, 2 * math.pi)
            if away < 7:
                rows.append([ns(k / 100), "eye", i, f"{bearing + n(0.01):.5f}", f"{away + n(0.02):.4f}"])
        x, y = x + 0.01 * speed(k / 100) * math.cos(h), y + 0.01 * speed(k / 100) * math.sin(h)
    return {"motion.csv": motion(), "sightings.csv": table("t_ns,sensor,id,bearing_rad,range_m", rows),
            "landmarks.csv": table("id,x_m,y_m,z_m,sigma_m", [[i, map_factor * px, map_factor * py, 0, 0.01] for i, (px, py) in enumerate(posts)]),
            "calibration.yaml": f"sensors: {{eye: {{mounting: {{xyz_m: [0, 0, 0]}}, bearing_sigma_rad: 0.01, range_sigma_m: 0.02{most_m}}}}}\n",
            "config.yaml": "format: waymark-config/1\nestimator: landmark_ekf\n"}


def mapped():
    """Bearings to posts that no map has."""
    files = {name: text for name, text in sighted().items() if name != "landmarks.csv"}
    files["sightings.csv"] = "\n".join(line.rpartition(",")[0] for line in files["sightings.csv"].splitlines()) + "\n"
    return files | {"config.yaml": "format: waymark-config/1\nestimator: slam\nmotion: {states: {speed_scale_sigma: 0.03}}\n"}


heading_at = [0.0]
for _k in range(round(SECONDS * 100)):
    heading_at.append(heading_at[-1] + 0.01 * turn(_k / 100))


def increments(scale_turn=1.0, scale_way=1.0):
    rows = [[ns(t + 0.1), ns(t), f"{0.1 * scale_way * speed(t):.5f}", 0, f"{scale_turn * (heading_at[round(100 * t) + 10] - heading_at[round(100 * t)]):.6f}"]
            for t in times(10, SECONDS - 0.2)]
    return table("t_ns,from_ns,dx_m,dy_m,dheading_rad", rows)


def ticks(track_m=0.5, radius_m=0.1, per_turn=2000, swap=False, raw_bits=None, wraps_at=None, rate_hz=50, begin=0, larger=1.0, restart_s=None):
    """`restart_s`: when the right counter starts at 0 again."""
    left = right = begin
    rows, before = [], 0
    for t in times(rate_hz):
        per_m = per_turn / (2 * math.pi * radius_m)
        left += (speed(t) - turn(t) * track_m / 2) / rate_hz * per_m / larger
        right += (speed(t) + turn(t) * track_m / 2) / rate_hz * per_m
        before = right if t == restart_s else before
        counts = [round(left), round(right - before)]
        if wraps_at:
            counts = [c % wraps_at for c in counts]
        rows.append([ns(t), *(counts[::-1] if swap else counts)])
    return table("t_ns,left,right", rows)


def speeds(factor):
    """speeds.csv of a track of 0.5 m, times a factor."""
    n = noise(7)
    return table("t_ns,left_mps,right_mps", [[ns(t), *(f"{factor * (speed(t) + side * turn(t) / 4) + n(0.005):.5f}" for side in (-1, 1))] for t in times(50)])


WHEELS = "wheels: {radius_m: 0.1, track_m: 0.5, ticks_per_turn: 2000}\n"


def jump(at_s, by_s):
    return lambda t: ns(t) + (round(by_s * 1e9) if t >= at_s else 0)


def grid(step_s):
    return lambda t: START_NS + int(t // step_s * step_s * 1e9)


def drifts(share, later_s=0.0):
    return lambda t: ns(t * (1 + share) + later_s)


def apart(stamp, seconds=80, sigma=0.003, of_motion=ns, turn=turn, lag_s=0.0):
    """Twist and gyro of a longer drive, of a gyro with another clock."""
    return {"motion.csv": motion(seconds=seconds, stamp=of_motion, turn=turn), "imu.csv": imu(seconds=seconds, stamp=stamp, sigma=sigma, turn=turn, lag_s=lag_s)}


def counters(bits, stated, rate_hz=200):
    """Ticks on CAN by counters of `bits`, whose DBC states another length, beside a gyro."""
    rows = [[int(c) for c in line.split(",")[1:]] for line in ticks(rate_hz=rate_hz, begin=50000).splitlines()[1:]]
    lines = [f"({START_NS / 1e9 + t:.6f}) can0 101#{(left % 2**bits | right % 2**bits << stated).to_bytes(8, 'little').hex().upper()}" for t, (left, right) in zip(times(rate_hz), rows)]
    return {"can.log": "\n".join(lines) + "\n", "imu.csv": imu(), "calibration.yaml": WHEELS,
            "vehicle.dbc": DBC.split("BO_ ")[0] + f'BO_ 257 WHEELS: 8 ECU\n SG_ LEFT : 0|{stated}@1+ (1,0) [0|0] "" ECU\n SG_ RIGHT : {stated}|{stated}@1+ (1,0) [0|0] "" ECU\n',
            "can-signals.yaml": "- {quantity: wheel_ticks_left, message: WHEELS, signal: LEFT}\n- {quantity: wheel_ticks_right, message: WHEELS, signal: RIGHT}\n"}


def stuck(table, since_s):
    """A table whose rows repeat the values of one time from then on."""
    head, *rows = [row.split(",") for row in table.splitlines()]
    last = max(k for k, row in enumerate(rows) if int(row[0]) <= ns(since_s))
    return "\n".join(",".join(row) for row in [head, *rows[:last], *([row[0], *rows[last][1:]] for row in rows[last:])]) + "\n"


def cut_off(table, at_s):
    """A table without its first seconds; below 0: without its last ones."""
    head, *rows = table.splitlines()
    first, last = (ns(at_s), ns(SECONDS)) if at_s > 0 else (0, ns(SECONDS + at_s))
    return "\n".join([head, *(row for row in rows if first <= int(row.partition(",")[0]) <= last)]) + "\n"


def shifted(table, by_s):
    """A table whose stamps are later by so much."""
    head, *rows = table.splitlines()
    return "\n".join([head, *(f"{int(stamp) + round(by_s * 1e9)},{rest}" for stamp, _, rest in (row.partition(",") for row in rows))]) + "\n"


def cut(table, share=(0.3, 0.6)):
    """A table whose parts change places: the first one stands between the others."""
    head, *rows = table.splitlines()
    a, b = (round(part * len(rows)) for part in share)
    return "\n".join([head, *rows[a:b], *rows[:a], *rows[b:]]) + "\n"


def limited(table, most, columns=(1, 2, 3)):
    """A table whose values end at a limit."""
    head, *rows = (row.split(",") for row in table.splitlines())
    return "\n".join(",".join(row) for row in [head, *([f"{max(-most, min(most, float(c)))}" if k in columns else c for k, c in enumerate(row)] for row in rows)]) + "\n"


def backwards(left, right):
    """Ticks of which one wheel's count falls where it drives forwards."""
    return table("t_ns,left,right", [[t, left * int(a), right * int(b)] for t, a, b in (row.split(",") for row in ticks().splitlines()[1:])])


def both(**files):
    """motion.csv and imu.csv, and what replaces or joins them."""
    return {"motion.csv": motion(), "imu.csv": imu(), **{k.replace("_csv", ".csv").replace("_yaml", ".yaml"): v for k, v in files.items()}}


def spoilt(text, change):
    """A table or a log of which each 30th line is changed, 3 %."""
    return "".join(change(line) if k % 30 == 17 else line for k, line in enumerate(text.splitlines(keepends=True)))


def field(at, value):
    return lambda line: ",".join(value if k == at else part for k, part in enumerate(line.rstrip("\n").split(","))) + "\n"


EKF = {"config.yaml": "format: waymark-config/1\nestimator: landmark_ekf\n"}


def addressed(later):
    """The drive of can() as a J1939 message; its unit has another address from the middle on."""
    lines = can()["can.log"].splitlines(keepends=True)
    ids = [f" 18FEF1{later if k > len(lines) / 2 else 0:02X}#" for k in range(len(lines))]
    return {"can.log": "".join(line.replace(" 100#", sent) for line, sent in zip(lines, ids)), "vehicle.dbc": can()["vehicle.dbc"].replace("256", str(0x98FEF1FE))}


def spoilt_rows():
    """3 % of a stream's rows that are dropped, in each way: never good, and the fix is of that way."""
    columns, unit, stamp = "its columns differ", "unit of the column's name", "its stamp is damaged"
    ways = (("no number", field(1, "nan"), columns), ("text", field(1, "x"), columns), ("a field less", lambda line: line.rpartition(",")[0] + "\n", columns),
            ("beyond what can be", field(1, "1e12"), unit), ("a stamp of 0", field(0, "0"), stamp), ("a stamp an hour ahead", field(0, str(ns(3600))), stamp))
    for name, change, fix in ways:
        for stream, make in (("motion", motion), ("imu", imu)):
            files = both(**{f"{stream}_csv": spoilt(make(), change)})
            yield f"3 % of {stream}: {name}", files, ("bad", "rows-skipped", stream), f"{stream}.csv:18: ", fix
    log = can()
    absent = {**log, "vehicle.dbc": log["vehicle.dbc"] + 'VAL_ 256 YAW 2143289344 "SNA";\n'}
    for name, change, kind, words, fix in (
            ("a signal without a value", lambda line: line[:-9] + "0000C07F\n", "rows-unused", "no finite numbers", "mend the file or the sender"),
            ("cut frames", lambda line: line[:-9] + "\n", "rows-skipped", "shorter than the signals", "the DBC and what is on the bus"),
            ("no frames", lambda line: "line\n", "rows-skipped", "begins with its time", "the DBC and what is on the bus")):
        yield f"3 % of can.log: {name}", {**absent, "can.log": spoilt(absent["can.log"], change)}, ("bad", kind, "can"), words, fix
    yield ("3 % of can.log: a stamp of 0", {**log, "can.log": spoilt(log["can.log"], lambda line: "(0.000000)" + line[line.index(")") + 1:])},
           ("bad", "rows-skipped", "can"), "before the next line's", stamp)


def weaving(bias=0.0, **changes):
    """Twist and gyro of a drive that turns to both sides, and what changes their tables."""
    files = {"motion.csv": motion(seconds=80, turn=weave), "imu.csv": imu(seconds=80, turn=weave, bias=bias)}
    return {name: changes.get(name.replace(".", "_"), str)(text) for name, text in files.items()}


DISAGREE, STAMPS = "sensors-disagree", "clock-jumped"
BROKEN = ("counter-restarts", "rows-disordered", "motion-sensor", "clock-drifts", "clock-coarse", STAMPS)
# name, files, finding (severity, identifier, about), words of its text, words of its fix
def by_post(sightings, most):
    """The rows of the first posts, one post after the other."""
    head, *rows = sightings.splitlines()
    ids = {int(row.split(",")[2]) for row in rows}
    return "\n".join([head, *(row for i in sorted(ids)[:most] for row in rows if row.split(",")[2] == str(i))]) + "\n"


FAULTS = [
    ("gyro of the other sign", both(imu_csv=imu(factor=-1)), ("bad", DISAGREE, "imu"), "-1.00 times", "wz_radps times -1"),
    ("gyro that hangs upside down", both(imu_csv=imu(factor=-1, up=(0, 0, -1))), ("bad", DISAGREE, "imu"), "-1.00 times", "rpy_deg: [180, 0, 0]"),
    ("gyro of the other sign at 20 Hz, twice the noise", both(imu_csv=imu(20, factor=-1, sigma=0.02)), ("bad", DISAGREE, "imu"), "-1.0", "times -1"),
    ("twist of the other sign, increments decide", {**both(motion_csv=motion(w=-1)), "increments.csv": increments()}, ("bad", DISAGREE, "motion"), "-1.0", "motion.csv: w_radps times -1"),
    ("gyro of the other sign on CAN", {**can(w=-1), "increments.csv": increments()}, ("bad", DISAGREE, "can"), "-1.0", "scale: -1"),
    ("gyro in degrees", both(imu_csv=imu(factor=180 / math.pi)), ("bad", DISAGREE, "imu"), "57.", "deg/s. imu.csv: wz_radps times 0.01745"),
    ("gyro in degrees, 200 Hz", both(imu_csv=imu(200, factor=180 / math.pi, bias=0.3)), ("bad", DISAGREE, "imu"), "57.", "imu.csv: wz_radps times 0.017"),
    ("twist in degrees", {**both(motion_csv=motion(w=180 / math.pi)), "increments.csv": increments()}, ("bad", DISAGREE, "motion"), "57.", "motion.csv: w_radps times 0.017"),
    ("gyro of twice the rate", both(imu_csv=imu(factor=2)), ("bad", DISAGREE, "imu"), "2.0", "wz_radps times 0.5"),
    ("gyro of half the rate", both(imu_csv=imu(factor=0.5)), ("bad", DISAGREE, "imu"), "0.50 times", "wz_radps times 2"),
    ("gyro of twice the rate and a lag", both(imu_csv=imu(factor=2, lag_s=0.5)), ("bad", DISAGREE, "imu"), "2.0", "wz_radps times 0.5"),
    ("gyro of which every other value is 0", both(imu_csv=imu(zero=lambda k: k % 2)), ("bad", DISAGREE, "imu"), "0.50 times", "50 of 100 of its values are 0"),
    ("gyro of which two of three values are 0", both(imu_csv=imu(zero=lambda k: k % 3)), ("bad", DISAGREE, "imu"), "0.33 times", "wz_radps"),
    ("gyro of zeros", both(imu_csv=imu(zero=lambda k: True)), ("bad", "motion-sensor", "imu"), "is 0 in all of its 2000 data", "use: false"),
    ("gyro that shows no turn", both(imu_csv=imu(axes=(0, 0, 0))), ("bad", DISAGREE, "imu"), "shows 0.0", "mounting"),
    ("gyro about y, y up", both(imu_csv=imu(axes=(0, 1, 0), up=(0, 1, 0))), ("bad", DISAGREE, "imu"), "its y axis is up", "rpy_deg: [90, 0, 0]"),
    ("gyro about x, x up", both(imu_csv=imu(axes=(1, 0, 0), up=(1, 0, 0))), ("bad", DISAGREE, "imu"), "its x axis is up", "rpy_deg: [0, -90, 0]"),
    ("gyro about x, x down", both(imu_csv=imu(axes=(-1, 0, 0), up=(-1, 0, 0))), ("bad", DISAGREE, "imu"), "its x axis is up", "rpy_deg: [0, 90, 0]"),
    ("y up, straight on", {"motion.csv": motion(w=0), "imu.csv": imu(axes=(0, 0, 0), up=(0, 1, 0))}, ("bad", DISAGREE, "imu"), "gravity on y", "rpy_deg: [90, 0, 0]"),
    ("gyro whose zero is off", both(imu_csv=imu(bias=0.1)), ("bad", DISAGREE, "imu"), "shows 0.1", "wz_radps less 0.0"),
    ("gyro whose zero is off, straight on", {"motion.csv": motion(w=0), "imu.csv": imu(axes=(0, 0, 0), bias=-0.2)}, ("bad", DISAGREE, "imu"), "shows -0.2", "wz_radps less -0.2"),
    ("gyro whose zero is off beside ticks", {"ticks.csv": ticks(), "imu.csv": imu(bias=0.1), "calibration.yaml": WHEELS}, ("bad", DISAGREE, "imu"), "shows 0.09", "wz_radps less 0.09"),
    ("gyro about y, a mounting of the other side", both(imu_csv=imu(axes=(0, 1, 0), up=(0, 1, 0)), calibration_yaml="imu: {mounting: {rpy_deg: [-90, 0, 0]}}\n"), ("bad", DISAGREE, "imu"), "-1.00 times", "rpy_deg: [90, 0, 0]"),
    ("gyro about x, a mounting about y", both(imu_csv=imu(axes=(1, 0, 0), up=(1, 0, 0)), calibration_yaml="imu: {mounting: {rpy_deg: [0, 0, 90]}}\n"), ("bad", DISAGREE, "imu"), "axis is up", "rpy_deg: [0, -90, 90]"),
    ("accelerations in thousandths of g", both(imu_csv=imu(gravity=1000)), ("bad", "value-implausible", "imu"), "1000.00 m/s2", "thousandths of g: times 0.00980665"),
    ("accelerations in cm/s2", both(imu_csv=imu(gravity=981)), ("bad", "value-implausible", "imu"), "981.0", "in cm/s2"),
    ("accelerations in counts", both(imu_csv=imu(gravity=2048)), ("bad", "value-implausible", "imu"), "2048.0", "another unit: times 0.0047"),
    ("accelerations in g", both(imu_csv=imu(gravity=1.0)), ("bad", "value-implausible", "imu"), "1.00 m/s2", "in g"),
    ("steps of twice the way", {"motion.csv": motion(), "increments.csv": increments(scale_way=2)}, ("bad", DISAGREE, "*"), "times", "times"),
    ("speed in km/h", {"motion.csv": motion(v=3.6), "increments.csv": increments()}, ("bad", DISAGREE, "motion"), "3.6", "km/h. motion.csv: v_mps times 0.27"),
    ("twist backwards, ticks and increments decide", {"motion.csv": motion(v=-1), "increments.csv": increments()}, ("bad", DISAGREE, "motion"), "goes forwards where", "motion.csv: v_mps times -1: positive is forwards"),
    ("steps backwards, twist and gyro", {**both(), "increments.csv": increments(scale_way=-1)}, ("bad", DISAGREE, "*"), "-1.0", "times -1: positive is forwards"),
    ("speed backwards on CAN", {**can(v=-1), "increments.csv": increments()}, ("bad", DISAGREE, "can"), "goes forwards where", "`scale: -1` at the one that is not positive forwards"),
    ("values in threes, turn too small", {"motion.csv": motion(100, w=0.6, repeat=3), "imu.csv": imu()}, ("bad", DISAGREE, "*"), "times", "times"),
    ("ticks of swapped wheels", {"ticks.csv": ticks(swap=True), "imu.csv": imu(), "calibration.yaml": WHEELS}, ("bad", DISAGREE, "*"), "turns left where", ""),
    ("left wheel's ticks backwards", {"ticks.csv": backwards(-1, 1), "imu.csv": imu(), "calibration.yaml": WHEELS}, ("bad", DISAGREE, "ticks"), "the left wheel's counter runs backwards", "left times -1"),
    ("right wheel's ticks backwards", {"ticks.csv": backwards(1, -1), "imu.csv": imu(), "calibration.yaml": WHEELS}, ("bad", DISAGREE, "ticks"), "the right wheel's counter runs backwards", "right times -1"),
    ("left wheel is not counted", {"ticks.csv": backwards(0, 1), "imu.csv": imu(), "calibration.yaml": WHEELS}, ("bad", "motion-sensor", "ticks"), "left is 0 in all", "encoder"),
    ("gyro that repeats its last value", both(imu_csv=stuck(imu(), 10)), ("bad", "motion-sensor", "imu"), "repeats 0.29", "must not send the last value"),
    ("gyro that repeats its last value for 4 s", both(imu_csv=(lambda s: "\n".join(s.splitlines()[:1401] + imu().splitlines()[1401:]) + "\n")(stuck(imu(), 10))), ("bad", "motion-sensor", "imu"), "from 10.00 to 13.99 s", "last value"),
    ("twist that repeats its last value", both(motion_csv=stuck(motion(), 10)), ("bad", "motion-sensor", "motion"), "w_radps of motion repeats", "last value"),
    ("gyro that saturates", weaving(imu_csv=lambda t: limited(t, 0.15)), ("bad", "motion-sensor", "imu"), "stays at its largest value, 0.15 rad/s, for 3", "larger range"),
    ("gyro that saturates, a zero that is off", weaving(0.02, imu_csv=lambda t: limited(t, 0.15)), ("bad", "motion-sensor", "imu"), "stays at its largest value, 0.15 rad/s, for", "larger range"),
    ("twist that saturates", weaving(motion_csv=lambda t: limited(t, 0.1, (2,))), ("bad", "motion-sensor", "motion"), "w_radps of motion stays at its largest value, 0.1 rad/s", "larger range"),
    ("track of half the length", {"ticks.csv": ticks(track_m=1.0), "imu.csv": imu(), "calibration.yaml": WHEELS}, ("bad", DISAGREE, "*"), "times", "track_m: 1"),
    ("counter that starts anew at 3000", {"ticks.csv": ticks(wraps_at=3000), "imu.csv": imu(), "calibration.yaml": WHEELS}, ("bad", "counter-restarts", "ticks"), "anew at about 30", "ticks.csv"),
    *[(f"counter of {bits} bits in a table", {"ticks.csv": ticks(wraps_at=2**bits, rate_hz=200, begin=50000), "imu.csv": imu(), "calibration.yaml": WHEELS}, ("bad", "counter-restarts", "ticks"), f"anew after {2**bits} counts", f"plus {2**bits} from") for bits in (8, 12, 16)],
    ("counter that restarts", {"ticks.csv": ticks(restart_s=10), "imu.csv": imu(), "calibration.yaml": WHEELS}, ("note", "counter-restarts", "ticks"), "right: the counter restarts at 0, 10.000 s after its first count", "goes on"),
    ("counter of 12 bits in a signal of 16", counters(12, 16), ("bad", "counter-restarts", "can"), "a counter of 12 bits", "|12@1+"),
    ("counter of 8 bits in a signal of 16", counters(8, 16), ("bad", "counter-restarts", "can"), "a counter of 8 bits", "|8@1+"),
    ("gyro whose clock is 2 % fast", apart(drifts(0.02)), ("bad", "clock-drifts", "imu"), "runs 2 % fast", "less 0.019"),
    ("gyro whose clock is 1.2 % slow, noise", apart(drifts(-0.012), sigma=0.05), ("bad", "clock-drifts", "imu"), "1.2 % slow", "less -0.01"),
    ("gyro that is stamped 1.5 s late", apart(drifts(0, 1.5)), ("bad", "clock-drifts", "imu"), "s late against that of motion", "t_ns of imu less 1."),
    ("gyro whose clock is 5 % fast beside CAN and increments", {**can(), "increments.csv": increments(), "imu.csv": imu(stamp=drifts(0.05))}, ("bad", "clock-drifts", "imu"), "% fast", "t_ns of imu"),
    ("gyro whose clock is 2 % fast, slow turns", apart(drifts(0.02), turn=weave), ("bad", "clock-drifts", "imu"), "runs 2 % fast", "less 0.019"),
    ("gyro whose clock is 0.5 % slow, slow turns, noise", apart(drifts(-0.005), 300, 0.05, turn=weave), ("bad", "clock-drifts", "imu"), "runs 0.5", "less -0.005"),
    ("clock set back by 8 s", both(motion_csv=motion(stamp=jump(9, -8))), ("bad", STAMPS, "motion"), "back by 7.98 s, 8.980 s after", "add 7.98 s"),
    ("clock set back by 2 s, arrivals go on", both(motion_csv=motion(stamp=jump(9, -2), arrival=lambda t: ns(t) + 2_000_000)), ("bad", STAMPS, "motion"), "back by 1.98 s", "add 1.98 s"),
    ("gyro's clock set back by 3 s", both(imu_csv=imu(stamp=jump(12, -3))), ("bad", STAMPS, "imu"), "back by 2.99 s", "add 2.99 s"),
    ("clock set back by 1 s on CAN", can(lambda t: f"{START_NS / 1e9 + t - (t > 10):.6f}"), ("bad", STAMPS, "can"), "back by 0.99 s", "add 0.99 s"),
    ("clock set forwards by an hour", {"motion.csv": motion(stamp=jump(9, 3600))}, ("bad", STAMPS, "motion"), "forwards by 3600.02 s, 8.980 s after", "subtract 3600.02 s"),
    ("clock set forwards by 20 s while data arrive", both(motion_csv=motion(stamp=jump(9, 20), arrival=lambda t: ns(t) + (21 * 10**9 if t >= 9 else 20 * 10**9 + 1))), ("bad", STAMPS, "motion"), "forwards by 20.02 s", "subtract 20.02 s"),
    ("from 1970 to now on CAN", can(lambda t: f"{t + (START_NS / 1e9 if t > 5 else 0):.6f}"), ("bad", STAMPS, "can"), "1970", "leave the first 501 rows out"),
    ("first stamps of 0", {"motion.csv": motion(stamp=lambda t: ns(t) if t > 2 else round(t * 1e6))}, ("bad", STAMPS, "motion"), "1970", "leave the first 101 rows out"),
    ("rows of two halves, the second first", both(motion_csv=cut(motion(), (0.5, 1.0))), ("bad", "rows-disordered", "motion"), "500 of 1000 are older", "sort the rows by t_ns"),
    ("rows of three parts", both(motion_csv=cut(motion())), ("bad", "rows-disordered", "motion"), "300 of 1000 are older", "sort the rows by t_ns"),
    ("gyro's rows from the last to the first", both(imu_csv="\n".join([imu().splitlines()[0], *imu().splitlines()[:0:-1]]) + "\n"), ("bad", "rows-disordered", "imu"), "older", "sort the rows by t_ns"),
    ("rows in the order of another column", both(imu_csv="\n".join([imu().splitlines()[0], *sorted(imu().splitlines()[1:], key=lambda row: row.split(",")[3])]) + "\n"), ("bad", "rows-disordered", "imu"), "older", "sort the rows by t_ns"),
    ("gyro of another clock", both(imu_csv=imu(stamp=lambda t: ns(t) + 3600 * 10**9)), ("bad", "clocks-apart", "imu"), "3600.000 s after", "difference"),
    ("gyro of the time since boot", both(imu_csv=imu(stamp=lambda t: round((t + 85) * 1e9))), ("bad", "clocks-apart", "imu"), "don't overlap", "one clock"),
    *[(f"positions {abs(by)} s too {word}", {"motion.csv": motion(), "gnss.csv": shifted(gnss(sigma=1, stated=1), by), **EKF}, ("bad", "clocks-apart", "gnss"), f"it begins {abs(by):.2f} s", "one clock") for by, word in ((2.5, "late"), (-4.0, "early"))],
    ("stamps of whole seconds", both(motion_csv=motion(stamp=grid(1.0))), ("bad", "clock-coarse", "motion"), "have the stamp of the one before", "grid of about 1 s"),
    ("stamps of whole seconds, equal rows", both(motion_csv=motion(stamp=grid(1.0), exact=True, v=0, w=0)), ("bad", "clock-coarse", "motion"), "have the stamp of the one before", "grid of about 1 s"),
    ("stamps in microseconds at 20 Hz", {"motion.csv": motion(20, stamp=lambda t: ns(t) // 1000)}, ("bad", "rate-implausible", "motion"), "data a second: are its stamps in us", "nanoseconds"),
    *[(f"wheels' speeds, {k:.3g} times", {"speeds.csv": speeds(k), "imu.csv": imu(), "calibration.yaml": WHEELS}, ("bad", DISAGREE, "*"), "times", f"speeds in {unit}, or m/s that are read as that? Their `unit:`, or columns, times {by}") for k, unit, by in ((3.6, "km/h", 0.27), (1 / 3.6, "km/h", 3.6), (2.237, "mph", 0.44))],
    ("stamps of 16 ms at 200 Hz", both(imu_csv=imu(200, stamp=grid(0.016))), ("bad", "clock-coarse", "imu"), "have the stamp", "0.016 s"),
    ("stamps of 10 ms at 200 Hz", both(imu_csv=imu(200, stamp=grid(0.01))), ("note", "clock-coarse", "imu"), "have the stamp", "0.01 s"),
    ("rows of one post after the other", sighted() | {"sightings.csv": by_post(sighted()["sightings.csv"], 4)}, ("bad", "rows-disordered", "sightings:eye"), "are older", "sort the rows by t_ns"),
    ("rows that come twice", both(motion_csv="\n".join(line for row in motion().splitlines() for line in ([row, row] if row[0] == "1" else [row])) + "\n"), ("bad", "rows-disordered", "motion"), "come twice", "two programs"),
    *spoilt_rows(),
    ("error frames among the others", {**can(), "can.log": "".join(line + (f"{line.split(' ')[0]} can0 20000004#0001000000000000\n" if k % 30 == 17 else "") for k, line in enumerate(can()["can.log"].splitlines(keepends=True)))}, ("note", "device-trouble", "can"), "error frames", "termination"),
    ("a unit that claims another address", {**can(), **addressed(0x25)}, ("note", "sender-changed", "can"), "is taken from 18FEF125 on can0 since", "same unit"),
    ("stamps with too few digits", {"motion.csv": motion(stamp=lambda t: f"{ns(t):.6e}")}, ("bad", "clock-coarse", "motion"), "have the stamp", "too few digits"),
    ("sigmas of 0", {"motion.csv": motion(), "heading.csv": table("t_ns,heading_rad,sigma_rad", [[ns(t), 0, 0] for t in times(10)]), **EKF}, ("bad", "no-data", "heading"), "sigma_rad: '0'", "the unit of the column's name"),
    ("positions in degrees", {"motion.csv": motion(), "gnss.csv": table("t_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m", [[ns(t), 13.4 + 1e-5 * t, 52.5, 0, 0.1, 0.2] for t in times(5)]), **EKF}, ("bad", "sensors-disagree", "positions"), "while the robot drives", "degrees"),
    ("rows in disorder, 1 of 20 is half a second late", both(motion_csv=(lambda rows: "\n".join(rows[:1] + [r for k in range(1, len(rows) - 25) for r in ([rows[k]] if k % 20 else []) + ([rows[k - 25]] if k > 25 and (k - 25) % 20 == 0 else [])]) + "\n")(motion().splitlines())), ("bad", "rows-unused", "motion"), "rows are not used", ""),
    ("floats without their type", can(valtype=False), ("bad", "value-implausible", "can"), "as a float", "SIG_VALTYPE_ ID SIGNAL : 1;"),
    ("floats without their type, unsigned", can(valtype=False, signed="+"), ("bad", "value-implausible", "can"), "as a float", "SIG_VALTYPE_"),
    ("floats without their type, backwards", can(valtype=False, v=-1), ("bad", "value-implausible", "can"), "as a float", "SIG_VALTYPE_"),
    ("floats without their type, slow", can(valtype=False, v=0.01, w=0.1), ("bad", "value-implausible", "can"), "as a float", "SIG_VALTYPE_"),
    ("what candump shows on the screen", {**can(), "can.log": "  can0  100   [2]  11 22\n" * 600}, ("bad", "refused-input", "setup"), "on the screen", ""),
    ("commands beside a gyro", {"motion.csv": commands(), "imu.csv": imu()}, ("note", "data-unused", "imu"), "the gyro is not used", "twist: measured"),
    ("nobody takes the edge points", {**both(), "points.csv": "t_ns,x_m,y_m\n" + "".join(f"{ns(k / 10)},2.0,0.1\n" for k in range(600)), "config.yaml": "format: waymark-config/1\nestimator: slam\n"}, ("bad", "data-unused", "points"), "these do: edge_mcl", "use: false"),
    ("a map that is 6 % too large", sighted(1.06), ("bad", "map-implausible", "map"), "% too large", "x_m, y_m and z_m times 0.9"),
    ("an antenna that is elsewhere", {"motion.csv": motion(), "gnss.csv": gnss(sigma=0.01, stated=0.02), "heading.csv": headings(), "calibration.yaml": "gnss: {mounting: {xyz_m: [0, 0.6, 1]}}\n", "config.yaml": "format: waymark-config/1\nestimator: landmark_ekf\n"}, ("note", "calibration-off", "calibration"), "0.6 was expected", "gnss.mounting"),
    ("no sighting is fused", sighted(1, ", max_range_m: 0.5"), ("bad", "value-implausible", "sightings:eye"), "not used", "max_range_m"),
    ("positions of ten times their sigma", {"motion.csv": motion(), "gnss.csv": gnss(sigma=0.01, stated=2.0), "config.yaml": "format: waymark-config/1\nestimator: landmark_ekf\n"}, ("bad", "noise-too-large", "gnss"), "of what is stated", "real sigma"),
]
# name, files, and the notes of what the drive doesn't show
RIGHT = [
    ("motion and gyro", both()),
    ("a gyro with a bias", both(imu_csv=imu(bias=0.01))),
    ("a slow gyro with much noise", both(imu_csv=imu(20, sigma=0.05))),
    ("a base that turns a fifth less than its wheels", both(motion_csv=motion(w=1.2))),
    ("a robot that is turned by hand while its wheels stand", both(motion_csv=table("t_ns,v_mps,w_radps", [[row[0], *(["0", "0"] if 4 < k / 50 < 12 else row[1:])] for k, row in enumerate(r.split(",") for r in motion().splitlines()[1:])]))),
    ("values in threes beside a gyro", {"motion.csv": motion(100, repeat=3), "imu.csv": imu()}),
    ("sightings of posts on the map", sighted()),
    ("positions at one speed, the antenna's place unknown", {"motion.csv": motion(steady=True), "gnss.csv": gnss(sigma=0.03, steady=True), "heading.csv": headings(), "recording.yaml": RECORDING.format("motion.csv, gnss.csv, heading.csv").split("vehicle:")[0], "config.yaml": "format: waymark-config/1\nestimator: landmark_ekf\n"}, "not-observable"),
    ("bearings alone in a map of its own", mapped(), "not-observable"),
    ("positions from 4 s on, and 1.5 s longer than the motion", {"motion.csv": cut_off(motion(), -1.5), "gnss.csv": cut_off(gnss(), 4), **EKF}, "not-observable"),
    ("a compass as a landmark far in the north", sighted() | {"landmarks.csv": "id,x_m,y_m,z_m,sigma_m\n1000000,0,1e7,0,1\n", "sightings.csv": "t_ns,sensor,id,bearing_rad\n" + "".join(
        f"{ns(k / 5)},eye,1000000,{math.pi / 2 - heading_at[20 * k]:.5f}\n" for k in range(99))}),
    ("bearings in a map that is given", mapped() | {"landmarks.csv": sighted()["landmarks.csv"]}),
    ("a gyro that lags by 0.3 s", both(imu_csv=imu(lag_s=0.3))),
    ("a gyro on CAN", can()),
    ("CAN, unsigned turn to the left alone", can(w=0.5)),
    ("ticks and a gyro", {"ticks.csv": ticks(), "imu.csv": imu(), "calibration.yaml": WHEELS}),
    *[(f"counters of {bits} bits on CAN", counters(bits, bits)) for bits in (8, 12, 16)],
    ("a long drive, a gyro of much noise", apart(ns, sigma=0.08)),
    ("a clock that is 0.1 % fast", apart(drifts(0.001))),
    ("slow turns, a gyro of much noise that lags by 0.3 s", apart(ns, 300, 0.08, turn=weave, lag_s=0.3)),
    ("a left wheel that is 4 % larger, and a gyro", {"ticks.csv": ticks(larger=1.04), "imu.csv": imu(), "calibration.yaml": WHEELS}),
    ("straight on, a gyro of noise", {"motion.csv": motion(w=0), "imu.csv": imu(axes=(0, 0, 0))}, "not-observable"),
    ("an accelerometer without gravity", both(imu_csv=imu(gravity=0))),
    ("exact values", {"motion.csv": motion(exact=True), "imu.csv": imu()}),
    ("stamps of 16 ms at 50 Hz", both(motion_csv=motion(stamp=grid(0.016)))),
]


def drive(folder, files):
    for old in folder.iterdir():
        old.unlink()
    streams = [f for f in files if f.endswith((".csv", ".log"))]
    for name, content in {"config.yaml": CONFIG, "recording.yaml": RECORDING.format(", ".join(streams)), **files}.items():
        (folder / name).write_text(content)
    return checked(folder / "config.yaml", folder)


def main():
    failures = []
    only = sys.argv[1] if len(sys.argv) > 1 else ""
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        for name, files, *notes in RIGHT:
            if only not in name:
                continue
            said = drive(folder, files)
            failures += [f"{name}: {f['severity']} {f['about']}: {f['text']} [{f['id']}]" for f in said["findings"] if (f["severity"], f["id"]) not in [("note", n) for n in notes]]
            failures += [f"{name}: not said: {n}" for n in notes if n not in [f["id"] for f in said["findings"]]]
        for name, files, (severity, identifier, about), words, fix in FAULTS:
            if only not in name:
                continue
            said = drive(folder, files)
            mine = [f for f in said["findings"] if (f["severity"], f["id"]) == (severity, identifier) and about in ("*", f["about"])
                    and words in f["text"] and fix in f["fix"]]
            print(f"{'found' if mine else 'BAD  '}  {name}")
            for f in said["findings"]:
                print(f"       {f['severity']} {f['about']}: {f['text']}; fix: {f['fix']} [{f['id']}]")
            if not mine:
                failures.append(f"{name}: not found")
            if identifier in BROKEN:  # a stream that is known to be broken blames no other one
                failures += [f"{name}: {f['about']}: {f['text']}" for f in said["findings"] if f["id"] == DISAGREE]
            if identifier == DISAGREE:  # nor has one that disagrees a clock that drifts
                failures += [f"{name}: {f['about']}: {f['text']}" for f in said["findings"] if f["id"] == "clock-drifts"]
            if said["good"] != (severity != "bad"):
                failures.append(f"{name}: good is {said['good']}")
    print(f"{len(FAULTS)} faults planted, {len(RIGHT)} right drives")
    print("\n".join(failures) or "good")
    sys.exit(bool(failures))


main()
