// SPDX-License-Identifier: Apache-2.0
// How far, and how long, the pose would still be useful if no observation came any more: until its sigma in the plane
// reaches a limit. From the covariance of now, grown as it grew of late: by the odometry's own noise, and by what it
// grew since observations stopped, whichever is more. A forecast for a straight way at the present speed. Pure.
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
  double reckoning_way_m, reckoning_variance_m2;  // where that began
} wm_budget;

void wm_budget_init(wm_budget *self, double limit_m);
// Once in a while (a second), with the pose and the odometry of the same time. Constant cost.
WM_REALTIME void wm_budget_take(wm_budget *self, const wm_estimate *now, const wm_odom_point *odom);
// Metres, and seconds at the present speed; infinite where nothing grows or the robot stands; 0 where the limit is
// passed.
WM_REALTIME void wm_budget_left(const wm_budget *self, const wm_estimate *now, double *way_m, double *time_s);

#endif
