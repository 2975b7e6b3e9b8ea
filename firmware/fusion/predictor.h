// SPDX-License-Identifier: Apache-2.0
// The present pose: the fused pose carried on by odometry from the fused time, with the continuous odom pose of the
// same instant. Motion is integrated when it arrives, long before it is fused. Fixed cost, no allocation. One thread.
#ifndef WAYMARK_FUSION_PREDICTOR_H
#define WAYMARK_FUSION_PREDICTOR_H

#include "rt/realtime.h"
#include "waymark/estimator.h"
#include "waymark/motion.h"
#include "waymark/pose.h"
#include "waymark/source.h"

typedef struct wm_predictor_params {
  double jump_m, jump_rad;  // map against odom: larger moves between two messages count as jumps
  wm_time_ns motion_stale_ns;
  wm_time_ns fusion_stale_ns;
} wm_predictor_params;

typedef struct wm_predictor {
  wm_predictor_params params;
  wm_odometry *odometry;
  wm_estimate fused;
  int has_fused, has_published;
  wm_pose2 map_base, odom_base;  // of the last message
  wm_time_ns last_t_ns;
  uint32_t resets, jumps;
  double last_jump_m, last_jump_rad;
  uint64_t odometry_refused;  // motion events that the odometry refused
  wm_time_ns fed_ns;          // newest motion, of all sources and of each; WM_TIME_NONE: none
  wm_time_ns source_ns[WM_SOURCES_MAX];
  uint32_t floor_flags;  // of the fused pose, as in wm_published
} wm_predictor;

// `odometry` is initialised and outlives the predictor.
void wm_predictor_init(wm_predictor *self, const wm_predictor_params *params, wm_odometry *odometry);
// A motion event arrived.
WM_REALTIME void wm_predictor_motion(wm_predictor *self, const wm_event *event);
// A new fused pose, and the calibration of the motion sensors.
WM_REALTIME void wm_predictor_fused(wm_predictor *self, const wm_estimate *fused,
                                    const wm_motion_calibration *calibration);
// The pose at `now_ns`. 0: searching, no motion yet, or now_ns not after the last one.
WM_REALTIME int wm_predictor_publish(wm_predictor *self, wm_time_ns now_ns, wm_published *out);
// The pose by which guided detectors search at `now_ns`; while searching, the motion alone. 0: no motion yet.
WM_REALTIME int wm_predictor_expect(const wm_predictor *self, wm_time_ns now_ns, wm_estimate *out);

#endif
