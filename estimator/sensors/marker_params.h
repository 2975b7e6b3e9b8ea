// SPDX-License-Identifier: Apache-2.0
// The fields of `markers:`; marker_params.c has their meaning.
#ifndef WAYMARK_ESTIMATOR_SENSORS_MARKER_PARAMS_H
#define WAYMARK_ESTIMATOR_SENSORS_MARKER_PARAMS_H

#include "waymark/estimator.h"

#ifdef __cplusplus
extern "C" {
#endif

struct wm_marker_params {
  double sigma_m, sigma_rel, bearing_sigma_rad, heading_sigma_rad, heading_most_rad;
  double stamp_sigma_s, correlated;
};

#ifdef __cplusplus
}
#endif

#endif
