# SPDX-License-Identifier: Apache-2.0
"""Graphs of poses: axes of noises, steps, files."""

import tempfile
from pathlib import Path

import gtsam
import numpy as np
import sym

GTSAM, SYM = "gtsam 4.3.0", "symforce 0.12.0"


def prior():
    graph, values, pose = gtsam.NonlinearFactorGraph(), gtsam.Values(), gtsam.Pose2(0, 0, np.pi / 2)
    values.insert(0, pose)
    graph.add(gtsam.PriorFactorPose2(0, pose, gtsam.noiseModel.Diagonal.Sigmas(np.array([1.0, 0.1, 0.01]))))
    return graph, values


def rows():
    ours = "planar poses: x and y of the map; poses in space: position of the map, rotation of the body, also in files ([recordings](recording-format.md))"
    graph, values = prior()
    covariance = gtsam.Marginals(graph, values).marginalCovariance(0)
    yield "GTSAM marginalCovariance of a Pose2 that looks along y, 1 m known badly along its view", f"first sigma {covariance[0, 0] ** 0.5:.1f}: along the robot's x", GTSAM, ours
    step = np.array([0, 0, 0, 1.0, 0, 0])
    g = gtsam.Pose3(gtsam.Rot3.Yaw(np.pi / 2), np.zeros(3)).retract(step).translation()
    yield "GTSAM Pose3.retract of 1 m in x at a yaw of 90 degrees", f"moves to {g[0]:.0f}, {g[1]:.0f}: the body's x", GTSAM, ours
    s = sym.Pose3(R=sym.Rot3.from_yaw_pitch_roll(np.pi / 2, 0, 0), t=np.zeros(3)).retract(step).t
    yield "symforce Pose3.retract of the same", f"moves to {s[0]:.0f}, {s[1]:.0f}: the map's x", SYM, ours
    angles = gtsam.Rot3.RzRyRx(0.1, 0.2, 0.3).rpy()
    yield "GTSAM Rot3.RzRyRx(0.1, 0.2, 0.3): roll, pitch, yaw", ", ".join(f"{v:.1f}" for v in angles), GTSAM, "roll, pitch, yaw in this order"
    yield "GTSAM Rot3.Ypr(0.1, 0.2, 0.3): roll, pitch, yaw", ", ".join(f"{v:.1f}" for v in gtsam.Rot3.Ypr(0.1, 0.2, 0.3).rpy()), GTSAM, "as above"
    file = Path(tempfile.mkdtemp()) / "map.g2o"
    given = gtsam.Values()
    given.insert(0, gtsam.Pose2(691607.87, 5333444.56, 0.1))
    gtsam.writeG2o(gtsam.NonlinearFactorGraph(), given, str(file))
    yield "GTSAM writeG2o of a northing of 5333444.56 m", file.read_text().split()[3], GTSAM, "writes numbers that read back as the same bits"
    file.write_text("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0 100 10 0 200 0 300\n")
    model = gtsam.readG2o(str(file), False)[0].at(0).noiseModel()
    yield "GTSAM readG2o: information 100, 10, 200 of x and y", f"kept, with its correlation {(model.R().T @ model.R())[0, 1]:.0f}", GTSAM, "covariances with correlations: `increments.csv`"
    try:
        gtsam.load2D(str(file))
        said = "reads it"
    except (RuntimeError, ValueError):
        said = "raises"
    yield "GTSAM load2D of the same file", said, GTSAM, "-"
