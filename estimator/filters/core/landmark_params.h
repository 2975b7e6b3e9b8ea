// SPDX-License-Identifier: Apache-2.0
// Parameters of the states that observations of a given map's landmarks bring, the same for every filter that fuses
// them, and their rows of a table.
#ifndef WAYMARK_ESTIMATOR_CORE_LANDMARK_PARAMS_H
#define WAYMARK_ESTIMATOR_CORE_LANDMARK_PARAMS_H

#include "param_rows.h"

typedef struct wm_landmark_params {
  double tilt_sigma_rad, tilt_tau_s;  // with elevations only
  int32_t map_slots, unused;
} wm_landmark_params;

// `member`: the field of that type.
#define LANDMARK_TILT_ROWS(member)                                                                                     \
  F64("states.tilt_sigma_rad", member.tilt_sigma_rad, 0.007, 0, 1,                                                     \
      "Sigma of the robot's roll and pitch on its springs and on the ground, rad: 0.4 degrees for a car that brakes, " \
      "bends or is loaded on one side. States with sightings.use.elevation, else unused."),                            \
      F64("states.tilt_tau_s", member.tilt_tau_s, 2, 0.01, 1e6, "Time after which such a tilt has fallen to 1/e, s.")
#define LANDMARK_SLOTS_ROW(member)                                                                                \
  I32("states.map_slots", member.map_slots, 16, 0, 24,                                                            \
      "Landmarks (the last seen ones) whose error on the map, by their sigma_m, is carried as states. That of a " \
      "landmark beyond them counts as noise, the larger the more often it is seen.")

#endif
