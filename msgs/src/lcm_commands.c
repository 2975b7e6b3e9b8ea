// SPDX-License-Identifier: Apache-2.0
// Messages to the robot.
#include <math.h>
#include <string.h>

#include "waymark/lcm_messages.h"
#include "waymark_observations_t.h"
#include "waymark_reset_t.h"
#include "waymark_set_pose_t.h"

static int room(size_t length) { return length > INT32_MAX ? INT32_MAX : (int)length; }

static void begin(wm_event *out, unsigned kind, wm_time_ns t_ns) {
  memset(out, 0, WM_EVENT_SMALL_BYTES);
  out->kind = (uint8_t)kind;
  out->t_ns = t_ns;
}

const char *wm_lcm_read_set_pose(const void *message, size_t length, wm_event *out) {
  waymark_set_pose_t m;
  if (waymark_set_pose_t_decode(message, 0, room(length), &m) < 0) return "is no set_pose_t of this version";
  double norm = 0, sum = 0;
  for (int i = 0; i < 4; i++) norm += m.orientation_xyzw[i] * m.orientation_xyzw[i];
  for (int i = 0; i < 3; i++) sum += m.position_m[i];
  const char *why = NULL;
  norm = sqrt(norm);
  if (!isfinite(sum) || fabs(sum) > 1e9)
    why = "position_m is not finite";
  else if (!(fabs(norm - 1) < 0.01))
    why = "orientation_xyzw is no unit quaternion";
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
  if (waymark_reset_t_decode(message, 0, room(length), &m) < 0) return "is no reset_t of this version";
  begin(out, WM_EVENT_RESET, m.t_ns);
  return NULL;
}

// NULL, or what is wrong with it.
static const char *read_sighting(const waymark_observations_t *m, int i, wm_sighting *out) {
  double bearing_rad = m->bearing_rad[i], range_m = m->range_m[i];
  if (isnan(bearing_rad) && isnan(range_m)) return "one of bearing_rad and range_m is needed";
  if (!isnan(bearing_rad) && !(fabs(bearing_rad) <= 2 * M_PI)) return "bearing_rad is more than a turn";
  if (!isnan(range_m) && !(range_m > 0 && range_m <= 1e5)) return "range_m has to be above 0, and not above 100000";
  if (m->landmark_id[i] < -1) return "landmark_id is below -1";
  double elevation_rad = m->elevation_rad[i], elevation_sigma_rad = m->elevation_sigma_rad[i];
  if (!isnan(elevation_rad) && !(fabs(elevation_rad) <= 0.5 * M_PI)) return "elevation_rad is beyond the vertical";
  if (!isnan(elevation_sigma_rad) && !(elevation_sigma_rad >= 0 && elevation_sigma_rad < 10))
    return "elevation_sigma_rad is below 0 or not below 10";  // 0: senders before NaN meant absent
  *out = (wm_sighting){.landmark_id = m->landmark_id[i],
                       .bearing_rad = isnan(bearing_rad) ? bearing_rad : remainder(bearing_rad, 2 * M_PI),
                       .range_m = range_m,
                       .bearing_sigma_rad = (double)NAN,
                       .range_sigma_m = (double)NAN,
                       .elevation_rad = elevation_rad,
                       .elevation_sigma_rad = elevation_sigma_rad != 0 ? elevation_sigma_rad : (double)NAN};
  return NULL;
}

const char *wm_lcm_read_sightings(const void *message, size_t length, char *sensor, wm_time_ns *t_ns, wm_sighting *out,
                                  size_t *count) {
  waymark_observations_t m;
  *count = 0;
  if (waymark_observations_t_decode(message, 0, room(length), &m) < 0) return "is no observations_t of this version";
  if (m.t_ns <= 0) return "t_ns is not above 0: when was it seen, on the robot's monotonic clock?";
  if (m.count < 0 || m.count > WM_LCM_OBSERVATIONS_MAX) return "count is not in 0 to 64";
  _Static_assert(sizeof m.sensor >= WM_NAME_MAX, "a name fits");
  memcpy(sensor, m.sensor, WM_NAME_MAX);
  sensor[WM_NAME_MAX - 1] = '\0';
  *t_ns = m.t_ns;
  for (int i = 0; i < m.count; i++) {
    const char *why = read_sighting(&m, i, &out[i]);
    if (why) return why;
  }
  *count = (size_t)m.count;
  return NULL;
}

size_t wm_lcm_set_pose(const wm_set_pose *pose, wm_time_ns t_ns, void *out, size_t capacity) {
  waymark_set_pose_t m = {.t_ns = t_ns, .sigma_xy_m = pose->sigma_xy_m, .sigma_heading_rad = pose->sigma_heading_rad};
  memcpy(m.position_m, pose->pose_map_base.p_m, sizeof m.position_m);
  memcpy(m.orientation_xyzw, pose->pose_map_base.q_xyzw, sizeof m.orientation_xyzw);
  int bytes = waymark_set_pose_t_encode(out, 0, room(capacity), &m);
  return bytes > 0 ? (size_t)bytes : 0;
}
