// SPDX-License-Identifier: Apache-2.0
// Messages that viewers draw beside the pose: places where the robot may be, the map that it makes, landmarks. As
// lcm_messages.h: no allocation, no liblcm, one thread at a time for the first call of a type. Writers return the bytes
// written, 0 where `capacity` is too small; readers return NULL, or a text with the fault.
#ifndef WAYMARK_LCM_VIEWS_H
#define WAYMARK_LCM_VIEWS_H

#include <stddef.h>

#include "waymark/setup.h"
#include "waymark/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_LCM_PLACES_MAX 240

// A pose that may be the robot's.
typedef struct wm_place {
  double x_m, y_m, heading_rad;  // base_link in map
  double weight;                 // its probability
  double covariance[6];          // xx, xy, yy, x heading, y heading, heading heading; NaN: none
} wm_place;

typedef struct wm_lcm_part {
  wm_time_ns t_ns;
  size_t total, first, count;  // of all; index of the first in this message; in this message
} wm_lcm_part;

// At most WM_LCM_PLACES_MAX of them; `total` is the number of all.
size_t wm_lcm_places(const wm_place *places, size_t count, size_t total, wm_time_ns t_ns, void *out, size_t capacity);
// `out` has room for WM_LCM_PLACES_MAX.
const char *wm_lcm_read_places(const void *message, size_t length, wm_lcm_part *part, wm_place *out);

// Landmarks of the robot's own map with their covariances (xx, xy, yy, heading) from `first` on, at most
// WM_LCM_LANDMARKS_MAX.
size_t wm_lcm_map(const wm_landmark *landmarks, const double (*covariance)[4], size_t total, size_t first,
                  wm_time_ns t_ns, void *out, size_t capacity);
// `out` has room for WM_LCM_LANDMARKS_MAX. Of a map_t their cov_m2 and yaw_sigma_rad are filled, of a landmarks_t their
// sigma_m.
const char *wm_lcm_read_map(const void *message, size_t length, wm_lcm_part *part, wm_landmark *out);
const char *wm_lcm_read_landmarks(const void *message, size_t length, wm_lcm_part *part, wm_landmark *out);

#ifdef __cplusplus
}
#endif

#endif
