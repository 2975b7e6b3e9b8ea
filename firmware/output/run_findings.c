// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "output/run_findings.h"
#include "waymark/motion.h"

typedef struct speaker {
  wm_finding_fn say;
  void *context;
  size_t lines;
} speaker;

static void say(speaker *to, const char *line) {
  to->lines++;
  if (to->say) to->say(to->context, line);
}

// The lateness_max_ms that covers this lateness, in whole 10 ms.
static double would_do_ms(wm_time_ns lateness_ns) { return ceil((double)lateness_ns * 1e-7) * 10; }

static void about_lateness(speaker *to, const wm_source_health *s) {
  if (s->late == 0 && s->lateness_p99_ns <= s->lateness_max_ns) return;
  char line[500], for_all[80] = "";
  if (s->lateness_worst_ns > s->lateness_max_ns)
    (void)snprintf(for_all, sizeof for_all, ". At worst it was %.0f ms: `lateness_max_ms: %.0f` would suffice for all",
                   (double)s->lateness_worst_ns * 1e-6, would_do_ms(s->lateness_worst_ns));
  if (s->lateness_p99_ns <= s->lateness_max_ns)
    (void)snprintf(line, sizeof line,
                   "%s: %" PRIu64 " of %" PRIu64
                   " arrived after newer data had been fused (out of the source's order, or later than its "
                   "lateness_max_ms of %.0f) and were dropped%s",
                   s->name, s->late, s->received, (double)s->lateness_max_ns * 1e-6, for_all);
  else
    (void)snprintf(line, sizeof line,
                   "%s: its lateness is %.0f ms (99 of 100 at most), lateness_max_ms is %.0f; %" PRIu64 " of %" PRIu64
                   " came too late and were dropped. `lateness_max_ms: %.0f` for this source would suffice%s",
                   s->name, (double)s->lateness_p99_ns * 1e-6, (double)s->lateness_max_ns * 1e-6, s->late, s->received,
                   would_do_ms(s->lateness_p99_ns), for_all);
  say(to, line);
}

static void about_losses(speaker *to, const wm_source_health *s) {
  const struct {
    uint64_t count;
    const char *what;
  } kinds[] = {{s->dropped, "dropped because a queue was full (merge.queue_events, realtime.ring_events)"},
               {s->lost, "missing by the sender's own count (pictures: by their stamps)"},
               {s->malformed, "could not be read"},
               {s->not_finite, "were no finite numbers"},
               {s->out_of_order, "were older than the one before"},
               {s->duplicates, "were sent twice and fused once"},
               {s->future, "had stamps from the future"},
               {s->frozen, "came with a counter that stands still"},
               {s->overflows, "were dropped by the kernel or the device because they were not read in time"},
               {s->bus_errors, "error frames on the bus"}};
  for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
    if (kinds[i].count == 0) continue;
    char line[240];
    (void)snprintf(line, sizeof line, "%s: %" PRIu64 " %s", s->name, kinds[i].count, kinds[i].what);
    say(to, line);
  }
}

static void about_silence(speaker *to, const wm_source_health *s) {
  if (!s->stale) return;
  char line[160];
  if (s->received == 0) {
    (void)snprintf(line, sizeof line, "%s: gave no data", s->name);
  } else {
    (void)snprintf(line, sizeof line, "%s: silent for the last %.1f s", s->name, (double)s->silent_ns * 1e-9);
  }
  say(to, line);
}

static void about_device(speaker *to, const wm_source_health *s) {
  if (s->device == WM_DEVICE_NONE || s->device == WM_DEVICE_WORKS) return;
  char line[120];
  (void)snprintf(line, sizeof line, "%s: its device is %s", s->name, wm_device_state_name(s->device));
  say(to, line);
}

static void about_motion(speaker *to, uint32_t bits) {
  static const char *const kLines[] = {
      "motion: the left encoder stood still while the robot moved (dead?)",
      "motion: the right encoder stood still while the robot moved (dead?)",
      "motion: a message's counter stood still: its sender is stuck; its values were not used",
      "motion: the yaw rate never changed (stuck sensor?)",
      "motion: samples of the last seconds exceeded the plausible acceleration and were refused (motion.limits)",
      "motion: the vehicle rose, rolled or pitched for seconds, which an estimator in the plane does not model"};
  for (unsigned i = 0; i < sizeof kLines / sizeof kLines[0]; i++)
    if ((bits >> i) & 1u) say(to, kLines[i]);
}

// Landmarks at other places than in the map, or without capacity in the map.
static void about_map(speaker *to, const wm_health *health) {
  static const struct {
    wm_counter_kind kind;
    const char *what;
  } kCounts[] = {
      {WM_COUNTER_LANDMARKS_MOVED, "times a landmark was elsewhere than before; `waymark map survey RUN` lists them"},
      {WM_COUNTER_IDENTITIES_AMBIGUOUS,
       "sightings whose identity (or, of a line, its track's number) stood for two landmarks; `waymark map "
       "survey RUN` lists them"},
      {WM_COUNTER_MAP_FULL, "times a new landmark found no room; raise slam.landmarks.capacity"}};
  for (size_t k = 0; k < sizeof kCounts / sizeof kCounts[0]; k++) {
    const wm_counter *counter = wm_health_counter(health, kCounts[k].kind);
    if (!counter || counter->count == 0) continue;
    char line[240];
    int n = snprintf(line, sizeof line, "map: %" PRIu64 " %s", counter->count, kCounts[k].what);
    if (counter->landmark_id >= 0 && n > 0 && (size_t)n < sizeof line)
      (void)snprintf(line + n, sizeof line - (size_t)n, "; the last one is %" PRId32, counter->landmark_id);
    say(to, line);
  }
}

size_t wm_findings(const wm_health *health, wm_finding_fn function, void *context) {
  speaker to = {function, context, 0};
  for (uint32_t i = 0; i < health->source_count; i++) {
    about_lateness(&to, &health->sources[i]);
    about_losses(&to, &health->sources[i]);
    about_silence(&to, &health->sources[i]);
    about_device(&to, &health->sources[i]);
  }
  about_motion(&to, health->motion_health);
  about_map(&to, health);
  if (health->other_runs_total > 0) {
    char line[200];
    (void)snprintf(line, sizeof line,
                   "messages: other runs published on the same channels meanwhile (%" PRIu32
                   "); give each its "
                   "publish.channel_prefix",
                   health->other_runs_total);
    say(&to, line);
  }
  if (health->outputs_lost > 0) {
    char line[160];
    (void)snprintf(line, sizeof line, "outputs: %" PRIu64 " records were lost because the disk or LCM was too slow",
                   health->outputs_lost);
    say(&to, line);
  }
  return to.lines;
}
