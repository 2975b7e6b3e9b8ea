// SPDX-License-Identifier: Apache-2.0
// A sensor that gives one value again and again, to the last bit, while another one measures a motion: its cable or its
// driver, which sends the last value on.
#include <math.h>

#include "cli/check/comparisons.h"

#define TIMES_LONGEST 4    // runs of repeats: as the estimators' watch of a gyro (estimator/motion/spatial_source.cpp)
#define SAME_MIN_S 3.0     // as there (repeated_value.hpp)
#define APART_MIN_RAD 0.3  // as there
#define APART_MIN_M 1.0    // a robot's length
#define COVER_MIN 0.8      // share of a window that has data

// The largest amount by which the other one has moved further, or less far, in the time of the longest run.
static double apart(const channels *all, const channel *c, const channel *other) {
  const double first = wm_seconds_between(all->start_ns, c->longest_ns[0]) / WINDOW_S;
  const double last = wm_seconds_between(all->start_ns, c->longest_ns[1]) / WINDOW_S;
  double most = 0, sum = 0;
  for (size_t i = (size_t)fmax(0, ceil(first)); (double)i + 1 <= last && i < c->windows && i < other->windows; i++) {
    if ((double)c->cover[i] < COVER_MIN * WINDOW_S || (double)other->cover[i] < COVER_MIN * WINDOW_S) continue;
    const double mine = (double)c->sum[i], theirs = (double)other->sum[i];
    sum += channel_is_way(c->kind) ? fabs(theirs) - fabs(mine) : theirs - mine;
    most = fmax(most, fabs(sum));
  }
  return most;
}

static int repeats(const channels *all, const channel *c) {
  return c->longest_value != 0 && c->longest > TIMES_LONGEST * c->second && c->second > 0 &&
         wm_seconds_between(c->longest_ns[0], c->longest_ns[1]) > SAME_MIN_S && !channel_is_tilt(c->kind) &&
         !channels_are_commands(all, c);
}

void stuck_judge(channels *self, const wm_assembly *assembly, wm_findings *out) {
  for (size_t i = 0; i < self->count; i++) {
    channel *c = &self->at[i];
    const int is_way = channel_is_way(c->kind);
    for (size_t k = 0; k < self->count && repeats(self, c) && !c->is_stuck; k++) {
      const channel *other = &self->at[k];
      if (k == i || channel_is_way(other->kind) != is_way || channel_is_tilt(other->kind) || !other->has_scale ||
          other->is_stuck || channels_are_commands(self, other))
        continue;
      const double off = apart(self, c, other);
      if (off < (is_way ? APART_MIN_M : APART_MIN_RAD)) continue;
      char name[96], of[96];
      c->is_stuck = 1;
      wm_find(out, WM_FOUND_MOTION_SENSOR, WM_SEVERITY_BAD, wm_assembly_source_name(assembly, c->source),
              "look at the sensor, its cable and its driver: one that receives nothing must not send the last value on",
              "%s repeats %.10g from %.2f to %.2f s after its first value (at most %llu data in a row else), while %s "
              "moves by %.1f %s more or less",
              comparisons_name(c, assembly, name, sizeof name), c->longest_value,
              wm_seconds_between(c->first_ns, c->longest_ns[0]), wm_seconds_between(c->first_ns, c->longest_ns[1]),
              (unsigned long long)c->second, comparisons_name(other, assembly, of, sizeof of), off,
              is_way ? "m" : "rad")
          ->size = off;
    }
  }
}
