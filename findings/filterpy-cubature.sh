#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# filterpy's cubature Kalman filter leaves the last step's process noise out of its gain.
# filterpy 2.0.0. With linear motion and measurement each of its filters is the Kalman filter. Expected: a gain of 9 / (9 + 1) for a variance of 1, a noise
# of 8 and a measurement of 1. Seen: KalmanFilter, SquareRoot and Unscented have that; CubatureKalmanFilter measures with the points that it had before the
# noise was added, and has 0.5 and a variance of 8.5. It follows a robot that brakes or slips too slowly.
. "$(dirname "$0")/common.sh"
pip_packages filterpy==2.0.0 numpy==1.26.4 scipy==1.14.1
seen='KalmanFilter: gain 0.900, variance after it 0.900
SquareRootKalmanFilter: gain 0.900, variance after it 0.900
UnscentedKalmanFilter: gain 0.900, variance after it 0.900
CubatureKalmanFilter: gain 0.500, variance after it 8.500'
"$python" - 2>/dev/null <<'EOF' | as_seen
import numpy as np
from filterpy import kalman
F = H = np.eye(1)
def same(x, dt=None): return x
points = kalman.JulierSigmaPoints(1, kappa=1)
for make in (lambda: kalman.KalmanFilter(1, 1), lambda: kalman.SquareRootKalmanFilter(1, 1),
             lambda: kalman.UnscentedKalmanFilter(1, 1, 1.0, hx=same, fx=same, points=points),
             lambda: kalman.CubatureKalmanFilter(1, 1, 1.0, hx=same, fx=same)):
    f = make()
    name = type(f).__name__
    f.x = np.zeros(1) if name.startswith("Un") else np.zeros((1, 1))
    f.F, f.H = F, H
    f.P, f.Q, f.R = np.eye(1), 8 * np.eye(1), np.eye(1)  # 1 + 8 against 1: nine tenths of what is measured
    f.predict()
    f.update(np.ones(1) if name.startswith("Un") else np.ones((1, 1)))
    print(f"{name}: gain {float(np.ravel(f.x)[0]):.3f}, variance after it {float(np.ravel(f.P)[0]):.3f}")
EOF
