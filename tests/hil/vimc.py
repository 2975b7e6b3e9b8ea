# SPDX-License-Identifier: Apache-2.0
"""The part of hil.py that captures by libcamera: the robot's files, and what is to be said of the guest's recordings."""
import statistics

import drives
import edges

# libcamera's driver of vimc gives multiples of six alone, three times the sensor's: smaller ones have no room for the running
# clock that the kernel draws, and without that all pictures are the same.
WIDTH, HEIGHT = 342, 246
CALIBRATION = ("cameras:\n  front:\n    model: equidistant\n    size: [{width}, 246]\n"
               "    intrinsics: [140, 140, 170.5, 122.5]\n    distortion: [0, 0, 0, 0]\n"
               "    mounting: {{xyz_m: [1, 0, 0.4], rpy_deg: [0, 22, 0]}}\n")


def prepare(work):
    scenario = work / "share/libcamera"
    scenario.mkdir(parents=True)
    (scenario / "calibration.yaml").write_text(CALIBRATION.format(width=WIDTH))
    (scenario / "another-size.yaml").write_text(CALIBRATION.format(width=WIDTH + 2))
    for name, calibration, more in (("robot", "calibration", ""), ("format", "calibration", ", format: YUYV"),
                                    ("bright", "calibration", ", controls: {Brightness: 5, Nonsense: 1}"),
                                    ("size", "another-size", "")):
        (scenario / f"{name}.yaml").write_text(
            f"format: waymark-config/1\nestimator: odometry\ncalibration: {calibration}.yaml\n"
            f"devices: {{cameras: [{{name: front, libcamera: platform/vimc.0 Sensor B{more}}}]}}\n")


def judge(work):
    """Stamps in order, none later than its arrival, and pictures that show something: bars, brighter where it was asked for."""
    failures, mean = [], {}
    for name in ("plain", "bright"):
        folder = work / f"share/out/libcamera-{name}/video"
        whole = [p for p in edges.pictures(folder / "front.avi") if len(p) == WIDTH * HEIGHT]
        rows = [(int(r["t_ns"]), int(r["arrival_ns"])) for r in drives.rows(folder / "front.csv")]
        late_ms = [(a - t) / 1e6 for t, a in rows]
        period_ms = statistics.median((b[0] - a[0]) / 1e6 for a, b in zip(rows, rows[1:]))
        mean[name] = statistics.fmean(whole[-1])
        distinct = sum(a != b for a, b in zip(whole, whole[1:])) + 1
        print(f"libcamera {name}: {len(whole)} pictures of {WIDTH}x{HEIGHT}, {distinct} of them new, one in {period_ms:.1f} ms, {min(late_ms):.1f} to "
              f"{max(late_ms):.1f} ms old when they arrive; grey {mean[name]:.1f} +- {statistics.pstdev(whole[-1]):.1f}")
        if len(whole) != len(rows):
            failures.append(f"libcamera {name}: {len(rows)} stamps, but {len(whole)} whole pictures")
        if distinct < len(whole):
            failures.append(f"libcamera {name}: the same picture again")
        if any(b[0] <= a[0] for a, b in zip(rows, rows[1:])) or min(late_ms) < 0 or max(late_ms) > 1000:
            failures.append(f"libcamera {name}: stamps that can't be")
        if name == "plain" and statistics.pstdev(whole[-1]) < 20:
            failures.append("libcamera: pictures that show nothing")
    if mean["bright"] < mean["plain"] + 20:
        failures.append("libcamera: the control for brightness changes nothing")
    return failures
