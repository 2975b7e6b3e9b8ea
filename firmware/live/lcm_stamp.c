// SPDX-License-Identifier: Apache-2.0
#include "live/lcm_stamp.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "rt/clock.h"

// A stamp on this computer's clock is never later than its arrival; a sender that stamps the end of an interval rounds.
#define AHEAD_MAX_NS (10 * WM_NS_PER_MS)
// An older stamp is of another clock: no queue of a sender holds so much.
#define BEHIND_MAX_NS (10 * WM_NS_PER_S)

const char *lcm_stamp_fault(wm_time_ns t_ns, wm_time_ns arrival_ns, char *text, size_t capacity) {
  if (t_ns <= 0) return "t_ns is not above 0: when was it true?";
  const double ahead_s = wm_seconds_between(arrival_ns, t_ns);
  if (t_ns - arrival_ns <= AHEAD_MAX_NS && arrival_ns - t_ns <= BEHIND_MAX_NS) return NULL;
  (void)snprintf(text, capacity, "t_ns is %.3g s %s this computer's CLOCK_MONOTONIC", fabs(ahead_s),
                 ahead_s > 0 ? "ahead of" : "behind");
  return text;
}

const char *lcm_stamp_command(wm_event *event, char *text, size_t capacity) {
  event->arrival_ns = wm_monotonic_ns();
  if (event->t_ns == 0) event->t_ns = event->arrival_ns;
  return lcm_stamp_fault(event->t_ns, event->arrival_ns, text, capacity);
}

const char *lcm_floor_of(const wm_floors *floors, const char *name, wm_event *event) {
  for (int i = 0; floors && i < floors->floor_count; i++)
    if (strcmp(floors->floors[i].name, name) == 0) {
      event->as.set_floor.floor = i;
      return NULL;
    }
  return floors ? "is of a floor that site.yaml does not have" : "sets a floor; the configuration has no `site`";
}
