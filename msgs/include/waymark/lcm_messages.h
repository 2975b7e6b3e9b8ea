// SPDX-License-Identifier: Apache-2.0
// Structs of msgs/ as LCM messages of the package `waymark` (msgs/lcm/*.lcm): bytes ready to be published. No
// allocation, no liblcm. One thread at a time: the first call for a type computes its fingerprint. Each writer returns
// the bytes written, 0 where `capacity` is too small. Each reader answers with a text where a message is not of its
// type, cut, NULL, or of more than 2 GiB (a length that was negative).
#ifndef WAYMARK_LCM_MESSAGES_H
#define WAYMARK_LCM_MESSAGES_H

#include <stddef.h>

#include "waymark/bound.h"
#include "waymark/event.h"
#include "waymark/health.h"
#include "waymark/pose.h"
#include "waymark/setup.h"

#ifdef __cplusplus
extern "C" {
#endif

// Enough for any of them: one datagram.
#define WM_LCM_MESSAGE_MAX 32000
#define WM_LCM_OBSERVATIONS_MAX 64
#define WM_LCM_LANDMARKS_MAX 256

// `sent_ns`: now, on the clock of published->made_ns, which is when the pose was made.
size_t wm_lcm_pose(const wm_published *published, wm_time_ns sent_ns, void *out, size_t capacity);
size_t wm_lcm_bound(const wm_bound *bound, void *out, size_t capacity);
// Name of the last calibration value of a message that has no room for all: how many are left out.
#define WM_LCM_CALIBRATION_LEFT "calibration.left_out"
size_t wm_lcm_health(const wm_health *health, void *out, size_t capacity);
// Why data of the source `index` were refused: health->refused_because.
size_t wm_lcm_refused(const wm_health *health, uint32_t index, void *out, size_t capacity);
// Messages to the robot: NULL and *out (t_ns 0: now; arrival unset), or a text with the fault. Constant cost.
const char *wm_lcm_read_set_pose(const void *message, size_t length, wm_event *out);
const char *wm_lcm_read_reset(const void *message, size_t length, wm_event *out);
// The floor's name; its index is left to the caller.
const char *wm_lcm_read_set_floor(const void *message, size_t length, char name[WM_NAME_MAX], wm_event *out);
// `sensor` has room for WM_NAME_MAX bytes, `out` for WM_LCM_OBSERVATIONS_MAX; the caller sets their `sensor`. Bearings
// are wrapped, sigmas are NaN: the sensor's own. A sighting without bearing and range, or with a number out of its
// limits, refuses the whole message.
const char *wm_lcm_read_sightings(const void *message, size_t length, char *sensor, wm_time_ns *t_ns, wm_sighting *out,
                                  size_t *count);
// Messages of a run, for viewers: NULL, or a text with the fault.
const char *wm_lcm_read_pose(const void *message, size_t length, wm_published *out);
const char *wm_lcm_read_bound(const void *message, size_t length, wm_bound *out);
const char *wm_lcm_read_health(const void *message, size_t length, wm_health *out);
// A refused_t: the source's name and the reason, each terminated.
const char *wm_lcm_read_refused(const void *message, size_t length, char source[WM_HEALTH_NAME_MAX],
                                char reason[WM_HEALTH_REASON_MAX]);
const char *wm_lcm_read_innovation(const void *message, size_t length, wm_innovation *out);
// A message to the robot (`t_ns` 0: now).
size_t wm_lcm_set_pose(const wm_set_pose *pose, wm_time_ns t_ns, void *out, size_t capacity);
size_t wm_lcm_set_floor(const char *name, wm_time_ns t_ns, void *out, size_t capacity);

size_t wm_lcm_innovation(const wm_innovation *innovation, void *out, size_t capacity);

// `count` sightings of one sensor at one stamp: the first WM_LCM_OBSERVATIONS_MAX are sent, the others are counted.
size_t wm_lcm_observations(const char *sensor_name, const wm_event *sightings, size_t count, void *out,
                           size_t capacity);

// Landmarks from `first` on, at most WM_LCM_LANDMARKS_MAX; `total` is the number in the map.
size_t wm_lcm_landmarks(const wm_landmark *landmarks, size_t total, size_t first, wm_time_ns t_ns, void *out,
                        size_t capacity);

#ifdef __cplusplus
}
#endif

#endif
