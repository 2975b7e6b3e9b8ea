// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_PARAMS_H
#define WAYMARK_ESTIMATOR_EDGE_MCL_PARAMS_H

#include <stdint.h>

#include "waymark/internal/filters/edge_mcl/camera_states.h"
#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

// Least work of a scan, so that a place can be aligned and another weighed.
enum { EDGE_MCL_SEARCH_POSES_LEAST = 12000 };

typedef struct wm_edge_mcl_params {
  double sigma[WM_CAMERA_ROWS];  // at the start, of each state; 0: not a state
  double wall_sigma_m;           // the same of each wall's offset

  double pixel_px, point_sigma_m, common_px, range_max_m;

  double lost_explained, lost_margin, lost_beyond_weight;
  int32_t search_poses, unused;
  double dead_reckoning_after_s;
} wm_edge_mcl_params;

extern const wm_param_table wm_edge_mcl_params_table;

#ifdef __cplusplus
}
#endif

#endif
