// SPDX-License-Identifier: Apache-2.0
#include "fusion/budget.h"

#include <math.h>
#include <string.h>

#define SMOOTH 0.2         // of a second's step
#define LEAST_STEP_M 0.05  // a rate per metre is not observable from less
#define FARTHEST_M 1e5     // beyond it the forecast is infinite
#define STANDING_MPS 0.01  // below it there is no time to a distance

void wm_budget_init(wm_budget *self, double limit_m) {
  memset(self, 0, sizeof *self);
  self->limit_m = limit_m;
}

static double position_variance(const wm_estimate *e) {
  const double *p = e->covariance;
  double a = p[wm_cov_index(0, 0)], b = p[wm_cov_index(0, 1)], c = p[wm_cov_index(1, 1)];
  double half = 0.5 * (a - c);
  return 0.5 * (a + c) + sqrt(half * half + b * b);
}

static void blend(double *value, double fresh) { *value = *value > 0 ? *value + SMOOTH * (fresh - *value) : fresh; }

static void learn_rates(wm_budget *self, const wm_odom_point *odom) {
  double dx = odom->pose_odom_base.x_m - self->last.pose_odom_base.x_m;
  double dy = odom->pose_odom_base.y_m - self->last.pose_odom_base.y_m, step_m = sqrt(dx * dx + dy * dy);
  double seconds = wm_seconds_between(self->last.t_ns, odom->t_ns);
  self->way_m += step_m;
  if (seconds > 0) blend(&self->speed_mps, step_m / seconds);
  if (step_m < LEAST_STEP_M) return;
  double grown_m2 = odom->along_var_m2 - self->last.along_var_m2 + odom->across_var_m2 - self->last.across_var_m2;
  blend(&self->position_rate_m2_per_m, fmax(grown_m2, 0) / step_m);
  blend(&self->heading_rate_rad2_per_m, fmax(odom->heading_var_rad2 - self->last.heading_var_rad2, 0) / step_m);
}

void wm_budget_take(wm_budget *self, const wm_estimate *now, const wm_odom_point *odom) {
  if (self->has_last && odom->t_ns > self->last.t_ns) learn_rates(self, odom);
  self->last = *odom;
  self->has_last = 1;
  int is_reckoning = now->state == WM_STATE_DEAD_RECKONING;
  if (is_reckoning && !self->is_reckoning) {
    self->reckoning_way_m = self->way_m;
    self->reckoning_variance_m2 = position_variance(now);
  }
  self->is_reckoning = is_reckoning;
}

// Variance of the position after `d` metres more: odometry noise, the present heading error over that distance, and the
// growth of the heading error.
static double forecast(const wm_budget *self, const wm_estimate *now, double rate, double d) {
  double heading = fmax(now->covariance[wm_cov_index(5, 5)], 0);
  return position_variance(now) + rate * d + heading * d * d + self->heading_rate_rad2_per_m * d * d * d / 3;
}

void wm_budget_left(const wm_budget *self, const wm_estimate *now, double *way_m, double *time_s) {
  double limit = self->limit_m * self->limit_m, rate = self->position_rate_m2_per_m;
  double reckoned_m = self->way_m - self->reckoning_way_m;
  if (self->is_reckoning && reckoned_m > 1)
    rate = fmax(rate, (position_variance(now) - self->reckoning_variance_m2) / reckoned_m);
  double low = 0, high = FARTHEST_M;
  if (!(position_variance(now) < limit)) high = 0;  // also for a NaN
  if (high > 0 && forecast(self, now, rate, high) < limit) low = high = (double)INFINITY;
  for (int i = 0; i < 60 && high - low > 0.01; i++) {
    double middle = 0.5 * (low + high);
    if (forecast(self, now, rate, middle) < limit) {
      low = middle;
    } else {
      high = middle;
    }
  }
  *way_m = low;
  *time_s = low == 0 ? 0 : self->speed_mps > STANDING_MPS ? low / self->speed_mps : (double)INFINITY;
}
