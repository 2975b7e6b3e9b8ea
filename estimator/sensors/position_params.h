// SPDX-License-Identifier: Apache-2.0
// The fields of `positions:`; position_params.c has their meaning.
#ifndef WAYMARK_ESTIMATOR_SENSORS_POSITION_PARAMS_H
#define WAYMARK_ESTIMATOR_SENSORS_POSITION_PARAMS_H

#include "waymark/estimator.h"

#ifdef __cplusplus
extern "C" {
#endif

struct wm_position_params {
  int32_t use_position, use_heading;
  double sigma_factor, sigma_min_m;
  double time_offset_sigma_s, antenna_sigma_m, heading_bias_sigma_rad;
  double correlated_m, correlated_tau_s;
};

// Keys of the same in a section of an estimator up to version 0.2.
#define POSITION_KEYS_OF_OLD                                                                                          \
  {"states.gnss_time_offset_sigma_s", "/positions.states.time_offset_sigma_s", NULL},                                 \
      {"states.gnss_antenna_sigma_m", "/positions.states.antenna_sigma_m", NULL},                                     \
      {"states.heading_bias_sigma_rad", "/positions.states.heading_bias_sigma_rad", NULL},                            \
      {"noise.gnss_factor", "/positions.noise.factor", NULL}, {"noise.gnss_min_m", "/positions.noise.min_m", NULL},   \
      {"correlated.gnss_m", "/positions.correlated.sigma_m", NULL},                                                   \
      {"correlated.gnss_tau_s", "/positions.correlated.tau_s", NULL},                                                 \
      {"lasting.gnss_m", "/positions.correlated.sigma_m", NULL},                                                      \
      {"lasting.gnss_tau_s", "/positions.correlated.tau_s", NULL}, {"use.position", "/positions.use.position", NULL}, \
  {                                                                                                                   \
    "use.heading", "/positions.use.heading", NULL                                                                     \
  }

#ifdef __cplusplus
}
#endif

#endif
