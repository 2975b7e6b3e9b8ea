// SPDX-License-Identifier: Apache-2.0
// The fields of `sightings:`; sighting_params.c has their meaning.
#ifndef WAYMARK_ESTIMATOR_SENSORS_SIGHTING_PARAMS_H
#define WAYMARK_ESTIMATOR_SENSORS_SIGHTING_PARAMS_H

#include "sensors/sensor_states.h"
#include "waymark/estimator.h"

#ifdef __cplusplus
extern "C" {
#endif

// Of sightings without an identity.
enum { WM_UNIDENTIFIED_OFF = 0, WM_UNIDENTIFIED_ON = 1, WM_UNIDENTIFIED_AUTO = 2 };

struct wm_sighting_params {
  int32_t use_bearing, use_range, use_elevation, use_unidentified;
  double bearing_sigma_default_rad, range_sigma_default_m;
  double bearing_sigma_factor, range_sigma_factor;
  double range_sigma_rel, lateral_sigma_m, map_sigma_min_m;
  wm_sensor_states states;
  double tilt_sigma_rad, tilt_tau_s;  // of the body, with elevations
  int32_t map_slots;
  int32_t correlated_slots;
  double correlated_bearing_rad, correlated_lateral_m, correlated_range_m, correlated_range_rel, correlated_tau_s;
  double gate_soft, gate_hard;
};

#ifdef __cplusplus
}
#endif

#endif
