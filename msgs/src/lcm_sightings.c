// SPDX-License-Identifier: Apache-2.0
// Sightings of one sensor at one time, from and to observations_t.
#include <math.h>
#include <string.h>

#include "lcm_bytes.h"
#include "waymark/event_fields.h"
#include "waymark/lcm_messages.h"
#include "waymark_observations_t.h"

// A number of each sighting: where it is, and what it may be. NaN: absent.
typedef struct number {
  size_t in_message, in_sighting;  // of the first
  double least, most;
  const char *problem;
  int zero_is_absent;  // from senders before NaN meant absent
} number;

#define IN_MESSAGE(member, least, most, limits, zero_until) \
  {offsetof(waymark_observations_t, member),                \
   offsetof(wm_sighting, member),                           \
   least,                                                   \
   most,                                                    \
   #member " has to be " limits,                            \
   (zero_until) > 0},
#define NOT_IN_MESSAGE(member, least, most, limits, zero_until)
#define NUMBER(member, need, least, most, limits, since, zero_until, message) \
  message(member, least, most, limits, zero_until)

static const number kNumbers[] = {WM_SIGHTING_NUMBERS(NUMBER)};
#define NUMBERS (sizeof kNumbers / sizeof kNumbers[0])

// NULL, or what is wrong with it.
static const char *read_sighting(const waymark_observations_t *m, int i, wm_sighting *out) {
  if (isnan(m->bearing_rad[i]) && isnan(m->range_m[i])) return "one of bearing_rad and range_m is needed";
  if (m->landmark_id[i] < -1) return "landmark_id is below -1";
  *out = wm_sighting_without_numbers();
  out->landmark_id = m->landmark_id[i];
  for (const number *n = kNumbers; n < kNumbers + NUMBERS; n++) {
    double value;
    memcpy(&value, (const char *)m + n->in_message + (size_t)i * sizeof value, sizeof value);
    if (n->zero_is_absent && value == 0.0) value = (double)NAN;
    if (!isnan(value) && !(value >= n->least && value <= n->most)) return n->problem;
    memcpy((char *)out + n->in_sighting, &value, sizeof value);
  }
  if (!isnan(out->bearing_rad)) out->bearing_rad = remainder(out->bearing_rad, 2 * M_PI);
  return NULL;
}

const char *wm_lcm_read_sightings(const void *message, size_t length, char *sensor, wm_time_ns *t_ns, wm_sighting *out,
                                  size_t *count) {
  waymark_observations_t m;
  *count = 0;
  if (waymark_observations_t_decode(message, 0, given(message, length), &m) < 0) {
    static const waymark_observations_t kNone;
    uint8_t right[sizeof m + sizeof(int64_t)];
    const int bytes = waymark_observations_t_encode(right, 0, sizeof right, &kNone);
    return bytes > 0 && is_beginning(message, length, right) ? "is shorter than observations_t of this version: the "
                                                               "name has 32 bytes, padded with zeros, and each list "
                                                               "64 numbers"
                                                             : "is not an observations_t of this version";
  }
  if (m.t_ns <= 0) return "t_ns is not above 0: when was it seen, on the robot's monotonic clock?";
  if (m.count < 0 || m.count > WM_LCM_OBSERVATIONS_MAX) return "count is not in 0 to 64";
  _Static_assert(sizeof m.sensor >= WM_NAME_MAX, "a name fits");
  take_name(sensor, WM_NAME_MAX, m.sensor, sizeof m.sensor);
  *t_ns = m.t_ns;
  for (int i = 0; i < m.count; i++) {
    const char *why = read_sighting(&m, i, &out[i]);
    if (why) return why;
  }
  *count = (size_t)m.count;
  return NULL;
}

size_t wm_lcm_observations(const char *sensor_name, const wm_event *sightings, size_t count, void *out,
                           size_t capacity) {
  if (count == 0) return 0;
  waymark_observations_t m = {.t_ns = sightings[0].t_ns, .arrival_ns = sightings[0].arrival_ns};
  put_name(m.sensor, sizeof m.sensor, sensor_name);
  m.count = (int32_t)(count < WM_LCM_OBSERVATIONS_MAX ? count : WM_LCM_OBSERVATIONS_MAX);
  m.dropped = (int32_t)(count - (size_t)m.count);
  for (int32_t i = 0; i < m.count; i++) {
    const wm_sighting *s = &sightings[i].as.sighting;
    m.landmark_id[i] = s->landmark_id;
    for (const number *n = kNumbers; n < kNumbers + NUMBERS; n++)
      memcpy((char *)&m + n->in_message + (size_t)i * sizeof(double), (const char *)s + n->in_sighting, sizeof(double));
  }
  return written(waymark_observations_t_encode(out, 0, room(capacity), &m));
}
