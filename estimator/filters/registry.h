// SPDX-License-Identifier: Apache-2.0
// A new estimator: one line here, one in registry.c, one folder beside them.
#ifndef WAYMARK_ESTIMATOR_REGISTRY_H
#define WAYMARK_ESTIMATOR_REGISTRY_H

#include "waymark/carrier.h"
#include "waymark/estimator.h"
#include "waymark/keeper.h"

#ifdef __cplusplus
extern "C" {
#endif

extern const wm_estimator wm_odometry_estimator;
extern const wm_estimator wm_landmark_ekf_estimator;
extern const wm_estimator wm_edge_mcl_estimator;
extern const wm_estimator wm_pf_edges_estimator;
extern const wm_estimator wm_stereo_ekf_estimator;
extern const wm_estimator wm_slam_estimator;
extern const wm_keeper wm_slam_keeper;
extern const wm_keeper wm_stereo_ekf_keeper;
extern const wm_carrier wm_landmark_ekf_carrier;

#ifdef __cplusplus
}
#endif

#endif
