// SPDX-License-Identifier: Apache-2.0
// How far, and how long, dead reckoning would stay useful: until the sigma of the position reaches a limit. The
// forecast grows the present covariance by the larger of two measured rates: the odometry's noise, and the growth since
// observations stopped. It assumes a straight path at the present speed. A pure function of its input.
#ifndef WAYMARK_FUSION_BUDGET_H
#define WAYMARK_FUSION_BUDGET_H

#include "rt/realtime.h"
#include "waymark/motion.h"
#include "waymark/pose.h"

typedef struct wm_budget {
  double limit_m;  // one sigma of position
  int has_last;
  wm_odom_point last;
  double way_m;                   // driven since the beginning
  double position_rate_m2_per_m;  // of the odometry's noise, over the last metres
  double heading_rate_rad2_per_m;
  double speed_mps;                               // smoothed
  int is_reckoning;                               // no observation is being fused
  double reckoning_way_m, reckoning_variance_m2;  // where dead reckoning began
} wm_budget;

void wm_budget_init(wm_budget *self, double limit_m);
// About once a second, with the pose and the odometry of the same time. Constant cost.
WM_REALTIME void wm_budget_take(wm_budget *self, const wm_estimate *now, const wm_odom_point *odom);
// Metres, and seconds at the present speed; infinite where nothing grows or the robot stands; 0 beyond the limit.
WM_REALTIME void wm_budget_left(const wm_budget *self, const wm_estimate *now, double *way_m, double *time_s);

#endif
