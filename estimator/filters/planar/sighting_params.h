// SPDX-License-Identifier: Apache-2.0
// Rows that planar filters share which take sightings: the sensors' own errors and how sightings err. Their structs of
// parameters have the fields that the rows name.
#ifndef WAYMARK_ESTIMATOR_PLANAR_SIGHTING_PARAMS_H
#define WAYMARK_ESTIMATOR_PLANAR_SIGHTING_PARAMS_H

#include "filters/core/param_rows.h"

// clang-format off
#define WM_SIGHTING_NOISE_PARAMS \
  F64("noise.bearing_default_rad", bearing_sigma_default_rad, 0.02, 1e-5, 3, \
      "Sigma of a bearing where neither the sighting nor the sensor gives one, rad."), \
  F64("noise.range_default_m", range_sigma_default_m, 0.1, 1e-4, 100, \
      "Sigma of a range where neither the sighting nor the sensor gives one, m."), \
  F64("noise.bearing_factor", bearing_sigma_factor, 1, 0.01, 100, \
      "Times the bearing's sigma. More than 1 where errors of following sightings are alike and not modelled."), \
  F64("noise.range_factor", range_sigma_factor, 1, 0.01, 100, "Times the range's sigma."), \
  F64("noise.range_rel", range_sigma_rel, 0, 0, 1, "Noise of a range in parts of it; squares are added."), \
  F64("noise.lateral_m", lateral_sigma_m, 0, 0, 10, \
      "Noise of a landmark's place across the line of sight, m: it is as broad as it is, and near by that is a large " \
      "angle. Added to the bearing's variance as (this / distance)^2.")

#define WM_LASTING_PARAMS \
  I32("lasting.slots", lasting_slots, 0, 0, 24, \
      "Pairs of sensor and landmark (the last seen ones) whose lasting error is carried as states (Gauss-Markov)."), \
  F64("lasting.bearing_rad", lasting_bearing_rad, 0, 0, 3, "Sigma of a bearing's lasting error, rad. 0: none."), \
  F64("lasting.lateral_m", lasting_lateral_m, 0, 0, 10, \
      "Sigma of the lasting error across the line of sight, m; squares are added to the bearing's."), \
  F64("lasting.range_m", lasting_range_m, 0, 0, 100, "Sigma of a range's lasting error, m."), \
  F64("lasting.range_rel", lasting_range_rel, 0, 0, 1, "The same in parts of the range; squares are added."), \
  F64("lasting.tau_s", lasting_tau_s, 2, 0.01, 1e6, "Time after which a lasting error has fallen to 1/e, s.")
// clang-format on

#endif
