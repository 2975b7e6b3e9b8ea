#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A copy of a recording with the covariances that its source gives beside it: steps-covariance.csv becomes increments.csv
in place of motion6.csv, sightings-covariance.csv the covariance columns of sightings.csv.

    covariances.py RECORDING COPY"""
import math
import pathlib
import sys

from replays import rows

STEP = ("dx_m", "dy_m", "dheading_rad", "cov_xx", "cov_xy", "cov_yy", "cov_xt", "cov_yt", "cov_tt")
PLACE = ("cov_xx_m2", "cov_xy_m2", "cov_yy_m2")


def write(path, heads, lines):
    path.write_text("\n".join(",".join(line) for line in (heads, *lines)) + "\n")


def sighting(row):
    x, y = float(row["x_m"]), float(row["y_m"])
    return (row["t_ns"], "camera", row["id"], f"{math.atan2(y, x):.7f}", f"{math.hypot(x, y):.6f}", *(row[k] for k in PLACE))


def copy(recording, out):
    out.mkdir(parents=True, exist_ok=True)
    for name in ("calibration.yaml", "truth.csv", "truth-landmarks.csv"):
        (out / name).write_text((recording / name).read_text())
    (out / "recording.yaml").write_text((recording / "recording.yaml").read_text().replace("- motion6.csv", "- increments.csv"))
    write(out / "increments.csv", ("t_ns", "from_ns", *STEP),
          [(r["to_ns"], r["from_ns"], *(r[k] for k in STEP)) for r in rows(recording / "steps-covariance.csv")])
    write(out / "sightings.csv", ("t_ns", "sensor", "id", "bearing_rad", "range_m", *PLACE),
          [sighting(r) for r in rows(recording / "sightings-covariance.csv")])


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    copy(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
