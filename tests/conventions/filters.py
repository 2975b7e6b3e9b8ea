# SPDX-License-Identifier: Apache-2.0
"""Filters, resampling, least squares, evaluation."""

import tempfile
from pathlib import Path

import numpy as np
import pykalman
import scipy
from evo.core import sync, trajectory
from evo.tools import file_interface
from filterpy import common, monte_carlo
from filterpy.kalman import KalmanFilter
from scipy.optimize import curve_fit
from scipy.stats import circmean

PY, PYK, SCIPY, EVO = "filterpy 2.0.0", "pykalman 0.11.2", f"scipy {scipy.__version__}", "evo 1.38.1"


def sigma(noise, rate):
    P, F, Q = np.zeros((2, 2)), np.array([[1, 1 / rate], [0, 1]]), noise(2, 1 / rate, 1.0)
    for _ in range(10 * rate):
        P = F @ P @ F.T + Q
    return P[0, 0] ** 0.5


def share(name):
    np.random.seed(1)
    drawn = np.concatenate([getattr(monte_carlo, name)(np.array([0.1, 0.2, 0.3, 0.4])) for _ in range(5000)])
    return np.mean(drawn == 0)


def path(times):
    times = np.asarray(times, float)
    return trajectory.PoseTrajectory3D(np.c_[times, times * 0, times * 0], np.tile([1.0, 0, 0, 0], (len(times), 1)), times)


def rows():
    for name in ("Q_discrete_white_noise", "Q_continuous_white_noise"):
        yield f"filterpy {name}: sigma after 10 s at 10 Hz and at 1000 Hz", f"{sigma(getattr(common, name), 10):.1f} m, {sigma(getattr(common, name), 1000):.1f} m", PY, "densities, so that the rate plays no role"
    for name in ("systematic_resample", "residual_resample"):
        yield f"filterpy {name}: share of a particle of weight 0.1", f"{share(name):.1f}", PY, "systematic resampling"
    f = KalmanFilter(2, 1)
    yield "filterpy KalmanFilter: P, Q and R that nobody sets", f"{f.P[0, 0]:.0f}, {f.Q[0, 0]:.0f}, {f.R[0, 0]:.0f}", PY, "defaults with units and reasons ([config.md](config.md))"
    k = pykalman.KalmanFilter(transition_matrices=[[1]], observation_matrices=[[1]])
    z = np.array([1.0, 2.0, np.nan, 4.0])
    yield "pykalman: a NaN among the observations", f"{int(np.isnan(k.filter(z)[0]).sum())} of 2 states from there on are NaN; masked {int(np.isnan(k.filter(np.ma.masked_invalid(z))[0]).sum())}", PYK, "refused, and counted; the pose goes on"
    x = np.linspace(0, 1, 50)
    y = 2 * x + np.random.RandomState(1).randn(50) * 0.01
    deviations = [curve_fit(lambda x, a: a * x, x, y, sigma=np.full(50, s))[1][0, 0] ** 0.5 for s in (0.01, 100.0)]
    yield "scipy curve_fit: sigma of the result for sigmas of 0.01 and of 100", f"{deviations[0]:.4f} and {deviations[1]:.4f}", SCIPY, "sigmas are absolute"
    yield "scipy circmean of -0.1 and -0.3", f"{circmean([-0.1, -0.3]):.2f}: from 0 to 2 pi", SCIPY, "(-pi, pi]"
    yield "numpy unwrap of 3.0, -3.0, NaN, 3.0", ", ".join(f"{v:.2f}" for v in np.unwrap([3.0, -3.0, np.nan, 3.0])), f"numpy {np.__version__}", "a NaN is refused; the next value counts"
    yield "numpy interp beyond the last stamp", f"{np.interp(2.0, [0.0, 1.0], [0.0, 1.0]):.0f}: the last value", f"numpy {np.__version__}", "a pose is predicted by the odometry, with its sigma"
    folder = Path(tempfile.mkdtemp())
    folder.joinpath("long.tum").write_text("".join(f"{k * 0.1} {k} 0 0 0 0 {2 * np.sin(0.1 * k)} {2 * np.cos(0.1 * k)}\n" for k in range(5)))
    read = file_interface.read_tum_trajectory_file(str(folder / "long.tum"))
    yield "evo: quaternions of length 2 in a TUM file", f"read; check() returns {read.check()[0]}; rotations are {'normalised' if abs(np.linalg.det(read.poses_se3[3][:3, :3]) - 1) < 1e-9 else 'stretched'}", EVO, "writes length 1"
    folder.joinpath("back.tum").write_text("0 0 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n")
    read = file_interface.read_tum_trajectory_file(str(folder / "back.tum"))
    yield "evo: stamps that go back", f"read, its way is {read.path_length:.0f} m of 2 m; check() returns {read.check()[0]}", EVO, "writes stamps in order"
    a, b = sync.associate_trajectories(path([0, 0.1, 0.2]), path([0.0, 0.015, 0.1]))
    yield "evo associate_trajectories: partner of a stamp without one within 0.01 s", "none: the pose is left out" if len(a.timestamps) == 2 else f"{len(a.timestamps)} pairs", EVO, "`waymark eval` interpolates the run up to 0.5 s ([eval.md](eval.md))"
