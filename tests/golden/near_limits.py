#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tests/golden/near.py: what passes as rounding, and that each kind of change does not."""
import json
import pathlib
import sys
import tempfile

import near

TABLES = {
    "trajectory.csv": ("t_ns,x_m,y_m,z_m,qx,qy,qz,qw,cov_xx,cov_xy,cov_yy,cov_xt,cov_yt,cov_tt,state",
                       ["1000,1.5,-2,0,0,0,0.6,0.8,0.0004,0,0.0009,0,0,0.0001,tracking",
                        "2000,1.6,-2,0,0,0,0.6,0.8,0.0004,0,0.0009,0,0,0.0001,tracking"]),
    "published.csv": ("t_ns,made_ns,fused_until_ns,x_m,y_m,z_m,qx,qy,qz,qw,cov_xx,cov_yy,cov_tt,state,odom_x_m,resets,"
                      "lost_probability,cause",
                      ["2000,2100,2000,1.6,-2,0,0,0,0.6,0.8,0.0004,0.0009,0.0001,tracking,0,1,0.02,none"]),
    "innovations.csv": ("t_ns,source,sensor,landmark,residual,observed,expected,variance,nis,gate,verdict",
                        ["1000,tags,front,7,bearing,0.1,0.11,0.0001,1,9,fused",
                         "2000,tags,front,8,bearing,0.1,0.11,0.0001,12,9,rejected_gate"]),
    "map-estimate.csv": ("id,x_m,y_m,z_m,sigma_m,cov_xx,cov_xy,cov_yy,yaw_rad,cov_tt",
                         ["7,3,4,0,0.02,0.0004,0,0.0004,3.141592653589793,0.0001", "8,3,5,0,0.02,0.0004,0,0.0004,,"]),
}
HEALTH = {"resets": 1, "state": "tracking", "sources": {"tags": {"fused": 2, "late": 0}},
          "calibration": {"front.yaw_rad": {"value": 0.01, "sigma": 0.002}, "front.range_scale": {"value": 0.0, "sigma": 0.01}}}
# What changes, from, to, and what the fault has to say; None: near.
CASES = [
    ("trajectory.csv", "1000,1.5,", "1000,1.5000000009,", None),
    ("trajectory.csv", "1000,1.5,", "1000,1.5000000011,", "trajectory.csv, row 1: position, m: differs by 1.1e-09"),
    ("trajectory.csv", "2000,1.6,", "2000,,", "row 2: position, m: differs by inf"),
    ("trajectory.csv", "0.6,0.8,", "-0.6,-0.8,", None),  # the same rotation
    ("trajectory.csv", "0.6,0.8,", "0.5999999997,0.800000000225,", None),  # 7.5e-10 rad
    ("trajectory.csv", "0.6,0.8,", "0.599999999,0.80000000075,", "orientation, rad: differs by 2.5e-09"),
    ("trajectory.csv", "0.0004,0,0.0009", "0.0004000000000007,0,0.0009", None),
    ("trajectory.csv", "0.0004,0,0.0009", "0.0004,0,0.0009000000020", "cov_yy: sigma, relative: differs by 1.11e-09"),
    ("trajectory.csv", "0.0001,tracking", "0.0001,lost", "row 1: was 1000 tracking, is 1000 lost"),
    ("trajectory.csv", "2000,", "2001,", "row 2: was 2000 tracking, is 2001 tracking"),
    ("published.csv", ",1.6,", ",1.60000001,", "published.csv, row 1: position"),
    ("published.csv", "1,0.02,none", "2,0.02,none", "published.csv, row 1: was"),
    ("published.csv", "0.02,none", "0.0200000009,none", None),
    ("published.csv", "0.02,none", "0.021,none", "lost_probability: differs by 0.001"),
    ("innovations.csv", "0.0001,1,9,fused", "0.0002,1.1,9,fused", None),  # its numbers follow from those that are compared
    ("innovations.csv", "rejected_gate", "fused", "innovations.csv, row 2: was 2000 tags front 8 bearing rejected_gate"),
    ("innovations.csv", "tags,front,8", "tags,front,9", "is 2000 tags front 9 bearing rejected_gate"),
    ("map-estimate.csv", "3.141592653589793", "-3.141592653589793", None),
    ("map-estimate.csv", "3.141592653589793", "3.1415926", "orientation, rad: differs by 5.36e-08"),
    ("map-estimate.csv", "0,0.02,0.0004,0,0.0004,,", "0,0.03,0.0004,0,0.0004,,", "row 2, sigma_m: sigma, relative"),
    ("health.json", '"late": 0', '"late": 3', "health.json: sources.tags.late was 0, is 3"),
    ("health.json", '"value": 0.01', '"value": 0.0100000001', None),
    ("health.json", '"value": 0.01', '"value": 0.010001', "calibration.front.yaw_rad"),
    ("health.json", '"value": 0.0,', '"value": 1e-12,', None),
    ("health.json", "front.yaw_rad", "front.pitch_rad", "calibration.front.pitch_rad is only in this build"),
]


def write(folder):
    folder.mkdir()
    for name, (head, lines) in TABLES.items():
        (folder / name).write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    (folder / "health.json").write_text(json.dumps(HEALTH), encoding="utf-8")


def faults_of(folder, name, old, new):
    was, now = folder / "was", folder / "now"
    for side in (was, now):
        write(side)
    text = (now / name).read_text(encoding="utf-8")
    assert old in text, f"{name} has no {old}"
    (now / name).write_text(text.replace(old, new, 1), encoding="utf-8")
    return near.compare(was, now).faults


def main():
    failed = 0
    for name, old, new, wanted in CASES:
        with tempfile.TemporaryDirectory() as folder:
            faults = faults_of(pathlib.Path(folder), name, old, new)
        fits = not faults if wanted is None else len(faults) >= 1 and wanted in faults[0]
        if not fits:
            print(f"{name}: {old} -> {new}: wanted {wanted or 'no fault'}, got {faults}")
            failed += 1
    for name in ("map-estimate.csv", "innovations.csv"):
        with tempfile.TemporaryDirectory() as folder:
            was, now = pathlib.Path(folder) / "was", pathlib.Path(folder) / "now"
            write(was)
            write(now)
            lines = (now / name).read_text(encoding="utf-8").splitlines()
            (now / name).write_text("\n".join(lines[:-1]) + "\n", encoding="utf-8")
            fewer = near.compare(was, now).faults
            (now / name).unlink()
            gone = near.compare(was, now).faults
        if fewer != [f"{name}: had 2 rows, has 1"] or gone != [f"{name}: only the reference writes it"]:
            print(f"{name}: a row or the file is gone: got {fewer}, {gone}")
            failed += 1
    print(f"{len(CASES) + 2 - failed} of {len(CASES) + 2} as they should be")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
