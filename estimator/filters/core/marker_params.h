// SPDX-License-Identifier: Apache-2.0
// Parameters of coded markers, the same for every filter that fuses them, and their rows of a table.
#ifndef WAYMARK_ESTIMATOR_CORE_MARKER_PARAMS_H
#define WAYMARK_ESTIMATOR_CORE_MARKER_PARAMS_H

#include "param_rows.h"

typedef struct wm_marker_params {
  double sigma_m, sigma_rel, bearing_sigma_rad, heading_sigma_rad, heading_most_rad;
} wm_marker_params;

// `member`: the field of that type.
#define MARKER_PLACE_ROWS(member)                                                                                  \
  F64("markers.sigma_m", member.sigma_m, 0.002, 1e-5, 10,                                                          \
      "Sigma of a marker's place, m; the sensor's sigmas, along and across, are added in squares."),               \
      F64("markers.sigma_rel", member.sigma_rel, 0, 0, 1, "The same as a part of the distance."),                  \
      F64("markers.bearing_sigma_rad", member.bearing_sigma_rad, 0.001, 1e-5, 3,                                   \
          "Sigma of a marker's direction where the sensor gives none, rad: half a pixel of a camera with a focal " \
          "length of 500 pixels.")
#define MARKER_ROWS(member)                                                                                           \
  MARKER_PLACE_ROWS(member),                                                                                          \
      F64("markers.heading_sigma_rad", member.heading_sigma_rad, 0.02, 1e-5, 3, "Sigma of a marker's heading, rad."), \
      F64("markers.heading_most_rad", member.heading_most_rad, 10, 1e-5, 10,                                          \
          "Largest sigma of a marker's heading that is fused, rad. Seen small and nearly face on, a marker's "        \
          "heading is biased by several degrees for as long as it is seen so.")

#endif
