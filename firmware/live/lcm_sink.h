// SPDX-License-Identifier: Apache-2.0
// Publishes over LCM, on a normal thread. Without a route, a network or a subscriber the run continues; the sink
// reports it once and tries again every two seconds.
#ifndef WAYMARK_LIVE_LCM_SINK_H
#define WAYMARK_LIVE_LCM_SINK_H

#include <lcm/lcm.h>

#include "findings/findings.h"
#include "fusion/assembly.h"
#include "waymark/health.h"
#include "waymark/lcm_messages.h"
#include "waymark/lcm_views.h"

typedef struct lcm_sink {
  int is_on;
  lcm_t *lcm;   // NULL: not connected
  lcm_t *lent;  // the caller's connection (a test's memq), never destroyed here
  char url[128], prefix[48];
  const wm_assembly *assembly;
  wm_line_fn say;
  void *say_context;
  int said_trouble;
  wm_time_ns next_try_ns;
  uint64_t sent, not_sent;
  // Sightings of one sensor at one stamp, until the next stamp arrives.
  wm_event group[WM_LCM_OBSERVATIONS_MAX];
  size_t group_count, group_total;
  uint8_t bytes[WM_LCM_MESSAGE_MAX];
} lcm_sink;

// `url` "" is LCM_DEFAULT_URL or LCM's own default. `lent` may be NULL.
void lcm_sink_open(lcm_sink *self, int is_on, const char *url, const char *prefix, const wm_assembly *assembly,
                   wm_line_fn say, void *say_context, lcm_t *lent);
void lcm_sink_pose(lcm_sink *self, const wm_published *published, wm_time_ns sent_ns);
void lcm_sink_bound(lcm_sink *self, const wm_bound *bound);
void lcm_sink_innovation(lcm_sink *self, const wm_innovation *innovation);
void lcm_sink_health(lcm_sink *self, const wm_health *health);
// One message a source whose data were refused.
void lcm_sink_refused(lcm_sink *self, const wm_health *health);
// Collects sightings and sends them at the next stamp or sensor; other events are not sent.
void lcm_sink_event(lcm_sink *self, const wm_event *event);
void lcm_sink_landmarks(lcm_sink *self, wm_time_ns t_ns);
// For viewers: places on the channel `what`, and the robot's own map.
void lcm_sink_places(lcm_sink *self, const char *what, const wm_place *places, size_t count, size_t total,
                     wm_time_ns t_ns);
void lcm_sink_map(lcm_sink *self, const wm_landmark *landmarks, const double (*covariance)[4], size_t count,
                  wm_time_ns t_ns);
// Tries to connect again where needed. Called often.
void lcm_sink_tick(lcm_sink *self, wm_time_ns monotonic_ns);
void lcm_sink_close(lcm_sink *self);

#endif
