// SPDX-License-Identifier: Apache-2.0
#include "waymark/lcm_views.h"
#include "lcm_bytes.h"

#include <math.h>
#include <string.h>

#include "waymark/lcm_messages.h"
#include "waymark_landmarks_t.h"
#include "waymark_map_t.h"
#include "waymark_places_t.h"

size_t wm_lcm_places(const wm_place *places, size_t count, size_t total, wm_time_ns t_ns, void *out, size_t capacity) {
  static _Thread_local waymark_places_t m;  // large
  memset(&m, 0, sizeof m);
  if (count > WM_LCM_PLACES_MAX) count = WM_LCM_PLACES_MAX;
  m.t_ns = t_ns;
  m.total = (int32_t)total;
  m.count = (int32_t)count;
  for (size_t i = 0; i < count; i++) {
    m.x_m[i] = places[i].x_m;
    m.y_m[i] = places[i].y_m;
    m.heading_rad[i] = (float)places[i].heading_rad;
    m.weight[i] = (float)places[i].weight;
    for (int k = 0; k < 6; k++) m.covariance[i][k] = (float)places[i].covariance[k];
  }
  return written(waymark_places_t_encode(out, 0, room(capacity), &m));
}

const char *wm_lcm_read_places(const void *message, size_t length, wm_lcm_part *part, wm_place *out) {
  static _Thread_local waymark_places_t m;
  if (waymark_places_t_decode(message, 0, given(message, length), &m) < 0) return "is not a places_t of this version";
  if (m.count < 0 || m.count > WM_LCM_PLACES_MAX || m.total < m.count) return "has a count beyond its room";
  *part = (wm_lcm_part){.t_ns = m.t_ns, .total = (size_t)m.total, .count = (size_t)m.count};
  for (size_t i = 0; i < part->count; i++) {
    out[i] = (wm_place){m.x_m[i], m.y_m[i], (double)m.heading_rad[i], (double)m.weight[i], {0}};
    for (int k = 0; k < 6; k++) out[i].covariance[k] = (double)m.covariance[i][k];
  }
  return NULL;
}

size_t wm_lcm_map(const wm_landmark *landmarks, const double (*covariance)[4], size_t total, size_t first,
                  wm_time_ns t_ns, void *out, size_t capacity) {
  static _Thread_local waymark_map_t m;
  memset(&m, 0, sizeof m);
  size_t count = first < total ? total - first : 0;
  if (count > WM_LCM_LANDMARKS_MAX) count = WM_LCM_LANDMARKS_MAX;
  m.t_ns = t_ns;
  m.total = (int32_t)total;
  m.first = (int32_t)first;
  m.count = (int32_t)count;
  for (size_t i = 0; i < count; i++) {
    m.id[i] = landmarks[first + i].id;
    memcpy(m.position_m[i], landmarks[first + i].p_m, sizeof m.position_m[i]);
    memcpy(m.covariance[i], covariance[first + i], sizeof m.covariance[i]);
  }
  return written(waymark_map_t_encode(out, 0, room(capacity), &m));
}

// True where a message's part of a list can be.
static int is_part(int32_t total, int32_t first, int32_t count) {
  return count >= 0 && count <= WM_LCM_LANDMARKS_MAX && first >= 0 && total >= 0 && first <= total - count;
}

static wm_landmark landmark_at(int32_t id, const double p_m[3]) {
  const double none = (double)NAN;
  return (wm_landmark){id, {p_m[0], p_m[1], p_m[2]}, none, none, {none, none, none}, none};
}

const char *wm_lcm_read_map(const void *message, size_t length, wm_lcm_part *part, wm_landmark *out) {
  static _Thread_local waymark_map_t m;
  if (waymark_map_t_decode(message, 0, given(message, length), &m) < 0) return "is not a map_t of this version";
  if (!is_part(m.total, m.first, m.count)) return "has a count beyond its room";
  *part = (wm_lcm_part){m.t_ns, (size_t)m.total, (size_t)m.first, (size_t)m.count};
  for (size_t i = 0; i < part->count; i++) {
    out[i] = landmark_at(m.id[i], m.position_m[i]);
    memcpy(out[i].cov_m2, m.covariance[i], sizeof out[i].cov_m2);
    out[i].yaw_sigma_rad = sqrt(m.covariance[i][3]);
  }
  return NULL;
}

const char *wm_lcm_read_landmarks(const void *message, size_t length, wm_lcm_part *part, wm_landmark *out) {
  static _Thread_local waymark_landmarks_t m;
  if (waymark_landmarks_t_decode(message, 0, given(message, length), &m) < 0)
    return "is not a landmarks_t of this version";
  if (!is_part(m.total, m.first, m.count)) return "has a count beyond its room";
  *part = (wm_lcm_part){m.t_ns, (size_t)m.total, (size_t)m.first, (size_t)m.count};
  for (size_t i = 0; i < part->count; i++) {
    out[i] = landmark_at(m.id[i], m.position_m[i]);
    out[i].sigma_m = m.sigma_m[i];
  }
  return NULL;
}
