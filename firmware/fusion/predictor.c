// SPDX-License-Identifier: Apache-2.0
#include "fusion/predictor.h"

#include <math.h>
#include <string.h>

#include "fusion/fuser.h"

void wm_predictor_init(wm_predictor *self, const wm_predictor_params *params, wm_odometry *odometry) {
  memset(self, 0, sizeof *self);
  self->params = *params;
  self->odometry = odometry;
  self->last_t_ns = self->fed_ns = WM_TIME_NONE;
  for (size_t i = 0; i < WM_SOURCES_MAX; i++) self->source_ns[i] = WM_TIME_NONE;
}

// Whether an event holds rates alone, which mean the same a moment later; counts and increments belong to their stamps.
static int has_rates_alone(const wm_event *event) {
  if (event->kind != WM_EVENT_QUANTITIES) return event->kind == WM_EVENT_TWIST2 || event->kind == WM_EVENT_TWIST6;
  for (uint8_t i = 0; i < event->as.quantities.count; i++)
    if (event->as.quantities.id[i] == WM_Q_WHEEL_TICKS_LEFT || event->as.quantities.id[i] == WM_Q_WHEEL_TICKS_RIGHT)
      return 0;
  return 1;
}

void wm_predictor_motion(wm_predictor *self, const wm_event *event) {
  wm_time_ns *newest_ns = event->source < WM_SOURCES_MAX ? &self->source_ns[event->source] : NULL;
  const int is_its_newest = newest_ns && (*newest_ns == WM_TIME_NONE || event->t_ns > *newest_ns);
  wm_status status = wm_odometry_feed(self->odometry, event);
  if (status == WM_TIME_RAN_BACK && is_its_newest && has_rates_alone(event)) {
    // Another sensor's data were quicker (a bus beside a gyro): the value holds from now on.
    wm_event now = *event;
    now.t_ns = self->fed_ns;
    status = wm_odometry_feed(self->odometry, &now);
  }
  if (status != WM_OK) {
    self->odometry_refused++;
    return;
  }
  if (is_its_newest) *newest_ns = event->t_ns;
  if (self->fed_ns == WM_TIME_NONE || event->t_ns > self->fed_ns) self->fed_ns = event->t_ns;
}

void wm_predictor_fused(wm_predictor *self, const wm_estimate *fused, const wm_motion_calibration *calibration) {
  self->fused = *fused;
  self->has_fused = wm_estimate_has_pose(fused);
  wm_odometry_calibrate(self->odometry, calibration);
}

// A jump is a move of map against odom between two messages, or a pose that was set.
static void announce_jump(wm_predictor *self, wm_published *out, const wm_pose2 *map_now) {
  if (self->has_published) {
    const wm_pose2 by = wm_odometry_jump(&self->map_base, &self->odom_base, map_now, &out->pose_odom_base);
    const double moved_m = sqrt(by.x_m * by.x_m + by.y_m * by.y_m), turned_rad = fabs(by.heading_rad);
    if (moved_m > self->params.jump_m || turned_rad > self->params.jump_rad || out->now.resets != self->resets) {
      self->jumps++;
      self->last_jump_m = moved_m;
      self->last_jump_rad = turned_rad;
      out->status_flags |= WM_PUB_JUMPED;
    }
  }
  self->has_published = 1;
  self->resets = out->now.resets;
  self->map_base = *map_now;
  self->odom_base = out->pose_odom_base;
  out->jumps = self->jumps;
  out->last_jump_m = self->last_jump_m;
  out->last_jump_rad = self->last_jump_rad;
}

int wm_predictor_publish(wm_predictor *self, wm_time_ns now_ns, wm_published *out) {
  if (!self->has_fused || (self->last_t_ns != WM_TIME_NONE && now_ns <= self->last_t_ns)) return 0;
  memset(out, 0, sizeof *out);
  wm_odom_point odom;
  if (wm_odometry_carry(self->odometry, &self->fused, now_ns, &out->now, &odom) != WM_OK) return 0;
  if (!wm_estimate_has_pose(&out->now)) return 0;
  out->fused_until_ns = self->fused.t_ns;
  out->pose_odom_base = odom.pose_odom_base;
  out->utc_uncertainty_ns = -1;
  out->status_flags = ((uint32_t)out->now.cause << WM_PUB_CAUSE_SHIFT) | self->floor_flags;
  wm_time_ns newest_ns = wm_odometry_newest_ns(self->odometry);
  if (newest_ns == WM_TIME_NONE || now_ns - newest_ns > self->params.motion_stale_ns)
    out->status_flags |= WM_PUB_MOTION_STALE;
  if (now_ns - self->fused.t_ns > self->params.fusion_stale_ns) out->status_flags |= WM_PUB_FUSION_STALE;
  wm_pose2 map_now = {out->now.pose_map_base.p_m[0], out->now.pose_map_base.p_m[1], out->now.heading_rad};
  announce_jump(self, out, &map_now);
  self->last_t_ns = now_ns;
  return 1;
}

int wm_predictor_expect(const wm_predictor *self, wm_time_ns now_ns, wm_estimate *out) {
  wm_odom_point odom;
  if (self->has_fused) return wm_odometry_carry(self->odometry, &self->fused, now_ns, out, &odom) == WM_OK;
  if (wm_odometry_at(self->odometry, now_ns, &odom) != WM_OK) return 0;
  memset(out, 0, sizeof *out);
  out->t_ns = now_ns;
  out->state = WM_STATE_SEARCHING;
  out->lost_probability = 1.0;
  out->v_mps[0] = odom.v_mps;
  out->w_radps[2] = odom.w_radps;
  return 1;
}
