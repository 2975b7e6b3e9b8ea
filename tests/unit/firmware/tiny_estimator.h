// SPDX-License-Identifier: Apache-2.0
// An estimator that can be understood at a glance, for tests of what stands around one: it integrates twists, adds half
// of a bearing to its y, rejects bearings above 1 and refuses time that runs back.
#pragma once

#include <math.h>
#include <string.h>

#include "waymark/estimator.h"

typedef struct tiny_state {
  wm_time_ns t_ns;
  double x_m, y_m, v_mps;
  uint32_t resets;
  uint8_t state;
} tiny_state;

static size_t tiny_bytes(const void *params, const wm_setup *setup, const char **why) {
  (void)params, (void)setup, (void)why;
  return sizeof(tiny_state);
}

static wm_status tiny_init(void *state, const void *params, const wm_setup *setup) {
  (void)params, (void)setup;
  *(tiny_state *)state = (tiny_state){.t_ns = WM_TIME_NONE, .state = WM_STATE_TRACKING};
  return WM_OK;
}

static wm_status tiny_go(tiny_state *s, wm_time_ns t_ns) {
  if (s->t_ns != WM_TIME_NONE && t_ns < s->t_ns) return WM_TIME_RAN_BACK;
  if (s->t_ns != WM_TIME_NONE) s->x_m += s->v_mps * wm_seconds_between(s->t_ns, t_ns);
  s->t_ns = t_ns;
  return WM_OK;
}

static wm_status tiny_predict(void *state, const wm_event *motion) {
  tiny_state *s = state;
  if (motion->kind != WM_EVENT_TWIST2) return WM_UNSUPPORTED;
  if (!isfinite(motion->as.twist2.v_mps)) return WM_NOT_FINITE;
  wm_status status = tiny_go(s, motion->t_ns);
  if (status == WM_OK) s->v_mps = motion->as.twist2.v_mps;
  return status;
}

static wm_status tiny_correct(void *state, const wm_event *e, wm_innovation *out, size_t capacity, size_t *count) {
  tiny_state *s = state;
  *count = 0;
  if (e->kind == WM_EVENT_SET_POSE) {
    s->resets++;
    s->x_m = e->as.set_pose.pose_map_base.p_m[0];
    return tiny_go(s, e->t_ns);
  }
  if (e->kind != WM_EVENT_SIGHTING || capacity < 1) return WM_UNSUPPORTED;
  wm_status status = tiny_go(s, e->t_ns);
  if (status != WM_OK) return status;
  double bearing = e->as.sighting.bearing_rad;
  out[0] = (wm_innovation){.t_ns = e->t_ns, .landmark_id = e->as.sighting.landmark_id, .observed = bearing};
  out[0].verdict = bearing > 1 ? WM_REJECTED_GATE : WM_FUSED;
  if (bearing <= 1) s->y_m += 0.5 * bearing;
  *count = 1;
  return WM_OK;
}

static void tiny_estimate(const void *state, wm_estimate *out) {
  const tiny_state *s = state;
  memset(out, 0, sizeof *out);
  out->t_ns = s->t_ns;
  out->pose_map_base.p_m[0] = s->x_m;
  out->pose_map_base.p_m[1] = s->y_m;
  out->pose_map_base.q_xyzw[3] = 1;
  out->v_mps[0] = s->v_mps;
  out->dof = 3;
  out->resets = s->resets;
  out->state = s->state;
}

static void tiny_motion(const void *state, wm_motion_calibration *out) {
  (void)state;
  *out = (wm_motion_calibration){{1, 1, 0, 1, 1, 1, 0, 0, 0}};
}

static const wm_estimator kTiny = {.name = "tiny",
                                   .about = "for tests",
                                   .takes = WM_EVENT_BIT(WM_EVENT_SIGHTING),
                                   .state_bytes = tiny_bytes,
                                   .init = tiny_init,
                                   .predict = tiny_predict,
                                   .correct = tiny_correct,
                                   .estimate = tiny_estimate,
                                   .motion = tiny_motion};
