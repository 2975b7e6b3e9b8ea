// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_PARAMS_H
#define WAYMARK_ESTIMATOR_EDGE_MCL_PARAMS_H

#include <stdint.h>

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

// Least work of a scan, so that a place can be aligned and another weighed.
enum { EDGE_MCL_SEARCH_POSES_LEAST = 12000 };

typedef struct wm_edge_mcl_params {
  double pitch_sigma_rad, roll_sigma_rad, yaw_sigma_rad, height_sigma_m, time_offset_sigma_s, edge_offset_sigma_m;

  double pixel_px, point_sigma_m, common_px, correlated, range_max_m, gate_m;
  double systematic_xy_m, systematic_heading_rad;

  double lost_explained, lost_below, lost_through, lost_per_s;
  int32_t search_poses;
  double dead_reckoning_after_s;
} wm_edge_mcl_params;

extern const wm_param_table wm_edge_mcl_params_table;

#ifdef __cplusplus
}
#endif

#endif
