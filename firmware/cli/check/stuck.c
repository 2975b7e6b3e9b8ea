// SPDX-License-Identifier: Apache-2.0
// A sensor that gives one value again and again, to the last bit, while another one measures a motion: its cable or its
// driver, which sends the last value on. And one that stays at its largest value while another one moves faster.
#include <math.h>

#include "cli/check/comparisons.h"

#define TIMES_LONGEST 4    // runs of repeats: as the estimators' watch of a gyro (estimator/motion/spatial_source.cpp)
#define SAME_MIN_S 3.0     // as there (repeated_value.hpp)
#define APART_MIN_RAD 0.3  // as there
#define APART_MIN_M 1.0    // a robot's length
#define COVER_MIN 0.8      // share of a window that has data
#define LIMIT_WITHIN 1e-3  // of the largest value: a window that is at it throughout, which noise does not make
#define LIMIT_WINDOWS_MIN 4
#define LIMIT_FACTOR 1.15  // by which the other one is faster there, in the scale of the other windows
#define FITS_MIN 0.8       // correlation of the other windows

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

// A channel at its largest value, of rates or speeds.
typedef struct limit {
  double rate, seconds, others;  // others: mean rate of the other one there, in this one's scale
} limit;

static int is_rate(const channel *c) {
  return c->kind == CHANNEL_YAW_RATE || c->kind == CHANNEL_TWIST_TURN || c->kind == CHANNEL_VEHICLE_WAY ||
         c->kind == CHANNEL_WHEELS_WAY || c->kind == CHANNEL_TWIST_WAY;
}

static int has_window(const channel *c, size_t i) {
  return i < c->windows && (double)c->cover[i] >= COVER_MIN * WINDOW_S;
}

static int has_limit(const channel *c, const channel *other, double apart_min, limit *out) {
  double aa = 0, bb = 0, ab = 0, way = 0, mine = 0, theirs = 0;
  size_t at = 0;
  out->rate = 0;
  for (size_t i = 0; i < c->windows; i++)
    if (has_window(c, i)) out->rate = fmax(out->rate, fabs((double)c->sum[i] / (double)c->cover[i]));
  for (size_t i = 0; i < c->windows; i++) {
    if (!has_window(c, i) || !has_window(other, i)) continue;
    const double a = (double)c->sum[i] / (double)c->cover[i], b = (double)other->sum[i] / (double)other->cover[i];
    if (fabs(a) >= (1 - LIMIT_WITHIN) * out->rate) {
      mine += fabs(a) * WINDOW_S;
      theirs += fabs(b) * WINDOW_S;
      at++;
    } else {
      aa += a * a;
      bb += b * b;
      ab += a * b;
      way += fabs(a) * WINDOW_S;
    }
  }
  if (at < LIMIT_WINDOWS_MIN || way < apart_min || fabs(ab) < FITS_MIN * sqrt(aa * bb)) return 0;
  out->seconds = (double)at * WINDOW_S;
  theirs *= sqrt(aa / bb);
  out->others = theirs / out->seconds;
  return theirs > LIMIT_FACTOR * mine && theirs - mine > apart_min;
}

static int repeats(const channel *c) {
  return c->longest_value != 0 && c->longest > TIMES_LONGEST * c->second && c->second > 0 &&
         wm_seconds_between(c->longest_ns[0], c->longest_ns[1]) > SAME_MIN_S;
}

static const char *const kDriver =
    "look at the sensor, its cable and its driver: one that receives nothing must not send the last value on";

// Of a channel beside another one that moves. Whether it makes a finding.
static int judge(const channels *self, const channel *c, const channel *other, const wm_assembly *assembly,
                 wm_findings *out) {
  const int is_way = channel_is_way(c->kind);
  const double apart_min = is_way ? APART_MIN_M : APART_MIN_RAD;
  const char *source = wm_assembly_source_name(assembly, c->source);
  char name[96], of[96];
  limit most;
  (void)comparisons_name(c, assembly, name, sizeof name);
  (void)comparisons_name(other, assembly, of, sizeof of);
  const double off = repeats(c) ? apart(self, c, other) : 0;
  if (off >= apart_min) {
    wm_find(out, WM_FOUND_MOTION_SENSOR, WM_SEVERITY_BAD, source, kDriver,
            "%s repeats %.10g from %.2f to %.2f s after its first value (at most %llu data in a row else), while %s "
            "moves by %.1f %s more or less",
            name, c->longest_value, wm_seconds_between(c->first_ns, c->longest_ns[0]),
            wm_seconds_between(c->first_ns, c->longest_ns[1]), (unsigned long long)c->second, of, off,
            is_way ? "m" : "rad")
        ->size = off;
    return 1;
  }
  if (!is_rate(c) || !has_limit(c, other, apart_min, &most)) return 0;
  wm_find(out, WM_FOUND_MOTION_SENSOR, WM_SEVERITY_BAD, source,
          "give the sensor a larger range, or its signal: what is beyond is lost",
          "%s stays at its largest value, %.4g %s, for %.1f s in which %s would be %.4g in the mean: it saturates",
          name, most.rate, is_way ? "m/s" : "rad/s", most.seconds, of, most.others)
      ->size = most.others / most.rate;
  return 1;
}

void stuck_judge(channels *self, const wm_assembly *assembly, wm_findings *out) {
  for (size_t i = 0; i < self->count; i++) {
    channel *c = &self->at[i];
    const int is_judged = !channel_is_tilt(c->kind) && !channels_are_commands(self, c);
    for (size_t k = 0; k < self->count && is_judged && !c->is_stuck; k++) {
      const channel *other = &self->at[k];
      if (k == i || channel_is_way(other->kind) != channel_is_way(c->kind) || channel_is_tilt(other->kind) ||
          !other->has_scale || other->is_stuck || channels_are_commands(self, other))
        continue;
      c->is_stuck = (uint8_t)judge(self, c, other, assembly, out);
    }
  }
}
