// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_PF_EDGES_PARAMS_H
#define WAYMARK_ESTIMATOR_PF_EDGES_PARAMS_H

#include <stdint.h>

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

enum pf_edges_weight { PF_EDGES_PRODUCT, PF_EDGES_SUM };

typedef struct wm_pf_edges_params {
  int32_t particles, weight;
  double exponent, sigma_m, false_points;
  double noise_way_rel, noise_way, noise_side, noise_turn;
  double range_max_m, dead_reckoning_after_s;
} wm_pf_edges_params;

extern const wm_param_table wm_pf_edges_params_table;

#ifdef __cplusplus
}
#endif

#endif
