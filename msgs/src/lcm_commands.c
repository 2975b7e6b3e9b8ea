// SPDX-License-Identifier: Apache-2.0
// Messages to the robot.
#include <math.h>
#include <string.h>

#include "lcm_bytes.h"
#include "waymark/lcm_messages.h"
#include "waymark_reset_t.h"
#include "waymark_set_floor_t.h"
#include "waymark_set_pose_t.h"

static void begin(wm_event *out, unsigned kind, wm_time_ns t_ns) {
  memset(out, 0, WM_EVENT_SMALL_BYTES);
  out->kind = (uint8_t)kind;
  out->t_ns = t_ns;
}

const char *wm_lcm_read_set_pose(const void *message, size_t length, wm_event *out) {
  waymark_set_pose_t m;
  if (waymark_set_pose_t_decode(message, 0, given(message, length), &m) < 0)
    return "is not a set_pose_t of this version";
  double norm = 0, farthest_m = 0;
  for (int i = 0; i < 4; i++) norm += m.orientation_xyzw[i] * m.orientation_xyzw[i];
  for (int i = 0; i < 3; i++)
    farthest_m = fmax(farthest_m, isfinite(m.position_m[i]) ? fabs(m.position_m[i]) : HUGE_VAL);
  const char *why = NULL;
  norm = sqrt(norm);
  if (farthest_m > 1e9)
    why = "position_m is not finite, or farther than 1e9 m";
  else if (!(fabs(norm - 1) < 0.01))
    why = "orientation_xyzw is not a unit quaternion";
  else if (!(m.sigma_xy_m > 0 && m.sigma_xy_m < 1e6 && m.sigma_heading_rad > 0 && m.sigma_heading_rad < 10))
    why = "sigma_xy_m and sigma_heading_rad have to be above 0";
  if (!why) {
    begin(out, WM_EVENT_SET_POSE, m.t_ns);
    wm_set_pose *pose = &out->as.set_pose;
    memcpy(pose->pose_map_base.p_m, m.position_m, sizeof m.position_m);
    for (int i = 0; i < 4; i++) pose->pose_map_base.q_xyzw[i] = m.orientation_xyzw[i] / norm;
    pose->sigma_xy_m = m.sigma_xy_m;
    pose->sigma_heading_rad = m.sigma_heading_rad;
  }
  return why;
}

const char *wm_lcm_read_reset(const void *message, size_t length, wm_event *out) {
  waymark_reset_t m;
  if (waymark_reset_t_decode(message, 0, given(message, length), &m) < 0) return "is not a reset_t of this version";
  begin(out, WM_EVENT_RESET, m.t_ns);
  return NULL;
}

const char *wm_lcm_read_set_floor(const void *message, size_t length, char name[WM_NAME_MAX], wm_event *out) {
  waymark_set_floor_t m;
  if (waymark_set_floor_t_decode(message, 0, given(message, length), &m) < 0)
    return "is not a set_floor_t of this version";
  take_name(name, WM_NAME_MAX, m.floor, sizeof m.floor);
  begin(out, WM_EVENT_SET_FLOOR, m.t_ns);
  out->as.set_floor.floor = -1;
  return NULL;
}

size_t wm_lcm_set_floor(const char *name, wm_time_ns t_ns, void *out, size_t capacity) {
  waymark_set_floor_t m = {.t_ns = t_ns};
  put_name(m.floor, sizeof m.floor, name);
  return written(waymark_set_floor_t_encode(out, 0, room(capacity), &m));
}

size_t wm_lcm_set_pose(const wm_set_pose *pose, wm_time_ns t_ns, void *out, size_t capacity) {
  waymark_set_pose_t m = {.t_ns = t_ns, .sigma_xy_m = pose->sigma_xy_m, .sigma_heading_rad = pose->sigma_heading_rad};
  memcpy(m.position_m, pose->pose_map_base.p_m, sizeof m.position_m);
  memcpy(m.orientation_xyzw, pose->pose_map_base.q_xyzw, sizeof m.orientation_xyzw);
  int bytes = waymark_set_pose_t_encode(out, 0, room(capacity), &m);
  return bytes > 0 ? (size_t)bytes : 0;
}
