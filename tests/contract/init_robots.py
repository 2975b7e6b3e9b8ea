#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Three robots from nothing to a pose, by the commands of docs/init.md: `waymark init`, `check`, `replay`. A car by its DBC and a
log; a robot without CAN, described by a URDF and a Kalibr camchain, that maps markers from pixels; a robot whose tags are
placed by a WPILib layout, also from pixels. `check` must find nothing bad, and the poses must be near truth.

    init_robots.py BIN_DIR [--shared FOLDER] [--keep FOLDER]"""
import json
import math
import os
import pathlib
import sys
import tempfile
import time

from replays import Refused, command, rows

HERE = pathlib.Path(__file__).resolve().parent / "init"
RENDERED_S = 12  # seconds of pictures: three markers are in view at most, ten seconds bring all of them twice


def signals(log):
    """Stamps, counts and turn rates of a simulated robot's CAN log: WHEELS (288) and INERTIAL (304)."""
    ticks, rates = [], []
    unwrapped, last = [0, 0], None
    for line in log.read_text().splitlines():
        stamp, _, frame = line.split()[:3]
        t_ns = int(stamp.strip("()").replace(".", "")) * 1000
        number, data = frame.split("#")
        raw = bytes.fromhex(data)
        if int(number, 16) == 288:
            counts = [int.from_bytes(raw[i:i + 2], "little") for i in (0, 2)]
            if last:
                unwrapped = [u + (c - b + 32768) % 65536 - 32768 for u, c, b in zip(unwrapped, counts, last)]
            last = counts
            ticks.append((t_ns, *unwrapped))
        elif int(number, 16) == 304:
            rates.append((t_ns, math.radians(int.from_bytes(raw[0:2], "little", signed=True) * 0.002)))
    return sorted(ticks), sorted(rates)


def write(path, head, table):
    path.write_text("\n".join([head, *(",".join(str(v) for v in row) for row in table)]) + "\n")


def simulate(bin_dir, world, recording):
    command(bin_dir / "waymark-simulate", f"config/worlds/{world}.yaml", "--out", recording, "--duration", RENDERED_S)
    return signals(recording / "can.log")


def without_can(recording, names):
    """The recording as a robot without CAN would have made it: these streams, and no start."""
    (recording / "recording.yaml").write_text(
        "format: waymark-recording/1\nname: first-drive\nstreams: [" + ", ".join(names) + "]\n")
    for gone in ("can.log", "vehicle.dbc", "can-signals.yaml", "calibration.yaml", "landmarks.csv"):
        (recording / gone).unlink(missing_ok=True)


def localized(bin_dir, robot, recording, truth, align, most_m, lost_most):
    command(bin_dir / "waymark", "check", robot / "robot.yaml")
    command(bin_dir / "waymark", "check", robot / "robot.yaml", recording)
    command(bin_dir / "waymark", "replay", recording, "--config", robot / "robot.yaml", "--out", robot / "run")
    out = json.loads(command(bin_dir / "waymark-eval", robot / "run", truth, "--align", align, "--json"))
    print(f"  position {out['position_rmse_m']:.3f} m rms, heading {out['heading_rmse_deg']:.2f} deg, "
          f"a pose at {100 * out['coverage']:.1f} % of the stamps")
    assert out["position_rmse_m"] < most_m, (robot.name, out["position_rmse_m"], most_m)
    assert out["coverage"] > 1 - lost_most, (robot.name, out["coverage"])


def by_urdf_and_kalibr(bin_dir, folder):
    recording, robot = folder / "office", folder / "ceiling-robot"
    ticks, rates = simulate(bin_dir, "office-easy", recording)
    write(recording / "ticks.csv", "t_ns,left,right", ticks)
    # The URDF's IMU hangs upside down: its z axis points to the floor.
    write(recording / "imu.csv", "t_ns,wx_radps,wy_radps,wz_radps", [(t, 0, 0, f"{-w:.9f}") for t, w in rates])
    without_can(recording, ["ticks.csv", "imu.csv", "video/ceiling.avi", "video/ceiling.csv"])
    command(bin_dir / "waymark-init", robot, "--motion", "ticks", "--imu", "--urdf", HERE / "robot.urdf", "--calibration",
            HERE / "camchain-imucam.yaml", "--camera", "ceiling=/dev/video0", "--sees", "tags", "--tag-size", 0.198,
            "--ticks", 2048, "--yes")
    text = (robot / "calibration.yaml").read_text()
    for expected in ("radius_m: 0.1 ", "track_m: 0.4 ", "xyz_m: [0.06, 0, 0.34], rpy_deg: [0, -90, 0]"):
        assert expected in text, (expected, text)
    localized(bin_dir, robot, recording, recording, "se2", 0.05, 0.05)


def by_tag_layout(bin_dir, folder):
    recording, robot = folder / "field", folder / "field-robot"
    ticks, rates = simulate(bin_dir, "office-walls", recording)
    per_m, track_m, twists = 2048 / (2 * math.pi * 0.1), 0.4, []
    for (t0, l0, r0), (t1, l1, r1) in zip(ticks, ticks[1:]):
        left_mps, right_mps = ((b - a) / per_m / ((t1 - t0) * 1e-9) for a, b in ((l0, l1), (r0, r1)))
        twists.append((t0, f"{(left_mps + right_mps) / 2:.6f}", f"{(right_mps - left_mps) / track_m:.6f}"))
    write(recording / "motion.csv", "t_ns,v_mps,w_radps", twists)
    write(recording / "imu.csv", "t_ns,wx_radps,wy_radps,wz_radps", [(t, 0, 0, f"{w:.9f}") for t, w in rates])
    tags = [{"ID": int(tag["id"]), "pose": {"translation": {axis: float(tag[f"{axis}_m"]) for axis in "xyz"},
                                            "rotation": {"quaternion": {"W": 1.0, "X": 0.0, "Y": 0.0, "Z": 0.0}}}}
            for tag in rows(recording / "truth-landmarks.csv")]
    (folder / "layout.json").write_text(json.dumps({"tags": tags, "field": {"length": 12, "width": 8}}))
    without_can(recording, ["motion.csv", "imu.csv", "video/front.avi", "video/front.csv"])
    command(bin_dir / "waymark-init", robot, "--motion", "twist", "--imu", "--tag-layout", folder / "layout.json", "--tag-size",
            0.198, "--calibration", HERE / "front.yaml", "--mounting", "front=0.16,0,0.5,0,-10,0", "--yes")
    localized(bin_dir, robot, recording, recording, "none", 0.15, 0.1)


def by_dbc_and_log(bin_dir, folder, shared):
    drive, robot = shared / "comma2k19-a", folder / "car"
    command(bin_dir / "waymark-init", robot, "--dbc", drive / "vehicle.dbc", "--can-log", drive / "can.log", "--wheelbase", 2.65,
            "--gnss", "--stream", drive / "gnss.csv", "--yes")
    bound = [line for line in (robot / "can-signals.yaml").read_text().splitlines() if line.startswith("- {")]
    for quantity, signal in {"vehicle_speed": "SPEED, signal: SPEED", "yaw_rate": "KINEMATICS, signal: YAW_RATE",
                             "wheel_speed_rear_left": "WHEEL_SPEEDS, signal: WHEEL_SPEED_RL",
                             "gear": "GEAR_PACKET, signal: GEAR"}.items():
        assert f"- {{quantity: {quantity}, message: {signal}}}" in bound, (quantity, bound)
    localized(bin_dir, robot, robot / "first-drive", drive, "none", 1.5, 0.1)


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    options = dict(zip(sys.argv[2::2], sys.argv[3::2]))
    shared = pathlib.Path(options.get("--shared", os.environ.get("WM_DATA_DIR", "/nowhere")))
    robots = []
    if (bin_dir / "waymark-simulate").exists():
        robots.append(("URDF and Kalibr", by_urdf_and_kalibr, ()))
        if not os.environ.get("WM_GATE"):  # half a minute of pictures: by ./dev test --all
            robots.append(("tag layout", by_tag_layout, ()))
    if (shared / "comma2k19-a").is_dir():
        robots.append(("DBC and log", by_dbc_and_log, (shared,)))
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(options.get("--keep", temporary))
        for name, robot, more in robots:
            begin = time.monotonic()
            print(name)
            try:
                robot(bin_dir, folder, *more)
            except Refused as problem:
                if "this build reads no URDF" not in str(problem):
                    raise
                print("  skipped: this build has no TinyXML-2")
                continue
            print(f"  {time.monotonic() - begin:.1f} s with the simulation")


if __name__ == "__main__":
    try:
        main()
    except (Refused, AssertionError) as problem:
        sys.exit(f"init_robots: {problem}")
