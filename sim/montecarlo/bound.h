// SPDX-License-Identifier: Apache-2.0
// The posterior Cramér-Rao bound of a simulated drive: the error that no estimator can go below, given what the sensors
// say and the scenario's standard deviations of their errors. docs/consistency.md derives it.
#pragma once

#include <functional>
#include <vector>

#include "simulate/route.h"
#include "simulate/scenario.h"

namespace wm::montecarlo {

struct Bound {
  double x_var_m2, y_var_m2, heading_var_rad2;
};

// The bound at each of `times_s` (rising, seconds from the start), with the scenario's first `landmarks` landmarks.
// Recursion of the information of (x, y, heading, yaw-rate bias, two wheel radii, track, each landmark's two map
// errors) along the true drive with the true noise (Tichavsky, Muravchik, Nehorai, "Posterior Cramer-Rao bounds for
// discrete-time nonlinear filtering", IEEE TSP 46(5), 1998, equation 21, with the Jacobians at the truth).
// Outliers carry no information: a sighting counts by the share of the inliers.
std::vector<Bound> bound(const sim::Scenario &scenario, const sim::Drive &drive, size_t landmarks,
                         const std::vector<double> &times_s);

// The robot as it was at a time, seconds from the start.
using Truth = std::function<sim::State(double t_s)>;

// A bearing that was measured: by which camera (mounted in base_link), of which landmark (true place).
struct SeenBearing {
  double t_s;
  size_t camera, landmark;  // from 0
  double camera_m[2], landmark_m[2];
  double sigma_rad;
};

// The same for bearings that a detector found in rendered pictures, each with its own sigma. Beside those above the
// cameras' mounting (yaw, x, y) and their clock are unknown, as in the scenario; roll, pitch and intrinsics are taken
// as known, which lowers the bound a little.
std::vector<Bound> bound(const sim::Scenario &scenario, const Truth &truth, const std::vector<SeenBearing> &seen,
                         size_t landmarks, size_t cameras, const std::vector<double> &times_s);

}  // namespace wm::montecarlo
