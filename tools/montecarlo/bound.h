// SPDX-License-Identifier: Apache-2.0
// The posterior Cramér-Rao bound of a simulated drive: the error that no estimator can go below, given what the sensors
// say and how large the scenario says their errors are. docs/consistency.md derives it.
#pragma once

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

}  // namespace wm::montecarlo
