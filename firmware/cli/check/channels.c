// SPDX-License-Identifier: Apache-2.0
#include "cli/check/channels.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HELD_MAX_S 1.0                // a value holds until the next one, and not longer
#define TICKS_MIN_S 0.05              // single ticks give no speed
#define BEFORE_S 60.0                 // a source that begins before the first datum
#define WINDOWS_MAX 1000000           // 70 hours
#define STAMP_MAX_NS (INT64_MAX / 4)  // beyond, differences overflow

void channels_init(channels *self, const wm_wheels *wheels) {
  memset(self, 0, sizeof *self);
  self->wheels = wheels;
  self->start_ns = WM_TIME_NONE;
  for (size_t s = 0; s < WM_SOURCES_MAX; s++) {
    self->wheel[s].ticks_ns = WM_TIME_NONE;
    for (unsigned q = 0; q < WM_Q_COUNT; q++) self->wheel[s].last[q] = (double)NAN;
  }
}

void channels_free(channels *self) {
  for (size_t i = 0; i < self->count; i++) {
    free(self->at[i].sum);
    free(self->at[i].cover);
  }
  self->count = 0;
}

static channel *channel_of(channels *self, channel_kind kind, uint16_t source) {
  for (size_t i = 0; i < self->count; i++)
    if (self->at[i].kind == kind && self->at[i].source == source) return &self->at[i];
  if (self->count == CHANNELS_MAX) return NULL;
  channel *new = &self->at[self->count++];
  *new = (channel){.kind = kind, .source = source, .has_scale = 1, .last_ns = WM_TIME_NONE};
  new->last = new->before = (double)NAN;
  return new;
}

static int make_room(channel *self, size_t window) {
  if (window < self->windows) return 1;
  const size_t more = window < 4096 ? 8192 : 2 * window;
  float *sum = realloc(self->sum, more * sizeof *sum);
  if (!sum) return 0;
  self->sum = sum;
  float *cover = realloc(self->cover, more * sizeof *cover);
  if (!cover) return 0;
  self->cover = cover;
  memset(sum + self->windows, 0, (more - self->windows) * sizeof *sum);
  memset(cover + self->windows, 0, (more - self->windows) * sizeof *cover);
  self->windows = more;
  return 1;
}

// An amount that came evenly from one time to another.
static void spread(const channels *all, channel *self, wm_time_ns from_ns, wm_time_ns to_ns, double amount) {
  const double from = wm_seconds_between(all->start_ns, from_ns) / WINDOW_S;
  const double to = wm_seconds_between(all->start_ns, to_ns) / WINDOW_S;
  if (!(from >= 0) || !(to > from) || to >= WINDOWS_MAX || !isfinite(amount)) return;
  for (size_t window = (size_t)from; (double)window < to; window++) {
    const double part = fmin(to, (double)window + 1) - fmax(from, (double)window);
    if (part <= 0 || !make_room(self, window)) continue;
    self->sum[window] += (float)(amount * part / (to - from));
    self->cover[window] += (float)(part * WINDOW_S);
  }
}

static void note_run(channel *self, double value, wm_time_ns t_ns) {
  const int goes_on = self->run > 0 && value == self->last;
  self->run = goes_on ? self->run + 1 : 1;
  if (!goes_on) self->run_ns = t_ns;
  const int is_longest = self->longest > 0 && self->run_ns == self->longest_ns[0];
  if (self->run > self->longest) {
    if (!is_longest) self->second = self->longest;
    self->longest = self->run;
    self->longest_ns[0] = self->run_ns;
    self->longest_ns[1] = t_ns;
    self->longest_value = value;
  } else if (!is_longest && self->run > self->second) {
    self->second = self->run;
  }
}

static void note_value(channel *self, double value, wm_time_ns t_ns) {
  note_run(self, value, t_ns);
  if (self->values++ == 0) self->least = self->most = value, self->first_ns = t_ns;
  self->least = fmin(self->least, value);
  self->most = fmax(self->most, value);
  self->zeros += value == 0;
  self->lone_zeros += value != 0 && self->last == 0 && self->before != 0 && !isnan(self->before);
  self->before = self->last;
  self->last = value;
}

// A rate or a speed, which holds until the next one.
static void take_rate(channels *all, channel_kind kind, const wm_event *event, double value, int has_scale) {
  channel *self = isfinite(value) ? channel_of(all, kind, event->source) : NULL;
  if (!self) return;
  const double dt_s = self->last_ns == WM_TIME_NONE ? 0 : wm_seconds_between(self->last_ns, event->t_ns);
  if (dt_s < 0) return;  // a row in disorder, or of a clock that was set back
  if (dt_s > 0 && dt_s <= HELD_MAX_S) spread(all, self, self->last_ns, event->t_ns, self->last * dt_s);
  self->has_scale = (uint8_t)has_scale;
  note_value(self, value, event->t_ns);
  self->last_ns = event->t_ns;
}

static void take_amount(channels *all, channel_kind kind, uint16_t source, wm_time_ns from_ns, wm_time_ns to_ns,
                        double amount, int has_scale) {
  channel *self = isfinite(amount) ? channel_of(all, kind, source) : NULL;
  if (!self) return;
  self->has_scale = (uint8_t)has_scale;
  note_value(self, amount, to_ns);
  spread(all, self, from_ns, to_ns, amount);
}

// Of a base that moves sideways, too: its length, below 0 where it is mostly backwards.
static double way_of(double ahead, double left) {
  const double length = hypot(ahead, left);
  return ahead < 0 && -ahead > fabs(left) ? -length : length;
}

// ── wheels ──────────────────────────────────────────────────────────────────────────────────────────────────────────

static void take_ticks(channels *all, const wm_event *event) {
  struct wheel_state *w = &all->wheel[event->source];
  const double left = w->last[WM_Q_WHEEL_TICKS_LEFT], right = w->last[WM_Q_WHEEL_TICKS_RIGHT];
  if (isnan(left) || isnan(right)) return;
  const double dt_s = w->ticks_ns == WM_TIME_NONE ? -1 : wm_seconds_between(w->ticks_ns, event->t_ns);
  if (dt_s >= 0 && dt_s < TICKS_MIN_S) return;
  if (dt_s > 0 && dt_s <= HELD_MAX_S) {
    const double m = 2 * M_PI * all->wheels->radius_m / all->wheels->ticks_per_turn;
    const int has_way = isfinite(m), has_turn = has_way && all->wheels->track_m > 0;
    const double l = (left - w->ticks[0]) * (has_way ? m : 1), r = (right - w->ticks[1]) * (has_way ? m : 1);
    const double track_m = has_turn ? all->wheels->track_m : 1;
    take_amount(all, CHANNEL_TICKS_TURN, event->source, w->ticks_ns, event->t_ns, (r - l) / track_m, has_turn);
    take_amount(all, CHANNEL_TICKS_WAY, event->source, w->ticks_ns, event->t_ns, (l + r) / 2, has_way);
  }
  w->ticks_ns = event->t_ns;
  w->ticks[0] = left;
  w->ticks[1] = right;
}

static double wheel_speed(const double last[WM_Q_COUNT], int is_right) {
  const double rear = last[is_right ? WM_Q_WHEEL_SPEED_REAR_RIGHT : WM_Q_WHEEL_SPEED_REAR_LEFT];
  return isnan(rear) ? last[is_right ? WM_Q_WHEEL_SPEED_FRONT_RIGHT : WM_Q_WHEEL_SPEED_FRONT_LEFT] : rear;
}

static void take_wheels(channels *all, const wm_event *event, int has_wheels, int has_steering) {
  const double *last = all->wheel[event->source].last;
  const double left = wheel_speed(last, 0), right = wheel_speed(last, 1);
  const double speed = isnan(left) || isnan(right) ? last[WM_Q_VEHICLE_SPEED] : (left + right) / 2;
  // The sign by the gear, where there is one: wheel speeds may have none.
  const double sign = !(speed < 0) && last[WM_Q_GEAR] < 0 ? -1 : 1;
  const double track_m = all->wheels->track_m > 0 ? all->wheels->track_m : 1;
  if (has_wheels && !isnan(left) && !isnan(right)) {
    take_rate(all, CHANNEL_WHEELS_TURN, event, sign * (right - left) / track_m, all->wheels->track_m > 0);
    take_rate(all, CHANNEL_WHEELS_WAY, event, fabs(speed), 1);
  }
  const double steering = isnan(last[WM_Q_ROAD_WHEEL]) ? last[WM_Q_STEERING_WHEEL] : last[WM_Q_ROAD_WHEEL];
  if (has_steering) take_rate(all, CHANNEL_STEERING_TURN, event, sign * speed * steering, 0);
}

// Of a velocity log without rates 0.
static double turn_of(const wm_twist6 *twist) { return isnan(twist->w_radps[2]) ? 0 : twist->w_radps[2]; }

static void take_quantities(channels *all, const wm_event *event) {
  static const struct {
    wm_quantity quantity;
    channel_kind kind;
  } kRates[] = {{WM_Q_YAW_RATE, CHANNEL_YAW_RATE},
                {WM_Q_ROLL_RATE, CHANNEL_ROLL_RATE},
                {WM_Q_PITCH_RATE, CHANNEL_PITCH_RATE},
                {WM_Q_VEHICLE_SPEED, CHANNEL_VEHICLE_WAY}};
  const wm_quantities *q = &event->as.quantities;
  double *last = all->wheel[event->source].last;
  uint32_t has = 0;
  for (uint8_t i = 0; i < q->count; i++) {
    if (q->id[i] >= WM_Q_COUNT) continue;
    last[q->id[i]] = q->value[i];
    has |= UINT32_C(1) << q->id[i];
  }
  for (size_t i = 0; i < sizeof kRates / sizeof kRates[0]; i++)
    if ((has >> kRates[i].quantity) & 1u) take_rate(all, kRates[i].kind, event, last[kRates[i].quantity], 1);
  if ((has >> WM_Q_WHEEL_TICKS_LEFT) & 3u) take_ticks(all, event);
  const int has_wheels = (has >> WM_Q_WHEEL_SPEED_FRONT_LEFT & 15u) != 0;
  const int has_steering = (has >> WM_Q_STEERING_WHEEL & 3u) != 0;
  if (has_wheels || has_steering) take_wheels(all, event, has_wheels, has_steering);
  const double *a = &last[WM_Q_ACCELERATION_X];
  if (!((has >> WM_Q_ACCELERATION_Z) & 1u) || !isfinite(a[0] + a[1] + a[2])) return;
  for (int k = 0; k < 3; k++) all->acceleration[event->source][k] += a[k];
  all->accelerations[event->source]++;
}

// ── other sources ───────────────────────────────────────────────────────────────────────────────────────────────────

static void take_heading(channels *all, const wm_event *event) {
  channel *self = channel_of(all, CHANNEL_HEADING_TURN, event->source);
  const double heading_rad = event->as.heading.heading_rad;
  if (!self || !isfinite(heading_rad)) return;
  const double dt_s = self->last_ns == WM_TIME_NONE ? 0 : wm_seconds_between(self->last_ns, event->t_ns);
  if (dt_s > 0 && dt_s <= HELD_MAX_S)
    spread(all, self, self->last_ns, event->t_ns, remainder(heading_rad - self->last, 2 * M_PI));
  note_value(self, heading_rad, event->t_ns);
  self->last_ns = event->t_ns;
}

void channels_take(channels *self, const wm_event *event) {
  if (event->source >= WM_SOURCES_MAX || llabs(event->t_ns) > STAMP_MAX_NS) return;
  if (self->start_ns == WM_TIME_NONE) self->start_ns = event->t_ns - wm_ns_from_seconds(BEFORE_S);
  switch (event->kind) {
    case WM_EVENT_QUANTITIES: take_quantities(self, event); break;
    case WM_EVENT_TWIST2:
      wm_rows_note(&self->twists[event->source], event->as.twist2.v_mps, event->as.twist2.w_radps,
                   event->as.twist2.v_mps != 0 || event->as.twist2.w_radps != 0);
      take_rate(self, CHANNEL_TWIST_TURN, event, event->as.twist2.w_radps, 1);
      take_rate(self, CHANNEL_TWIST_WAY, event, event->as.twist2.v_mps, 1);
      break;
    case WM_EVENT_TWIST6:
      wm_rows_note(&self->twists[event->source], event->as.twist6.v_mps[0], turn_of(&event->as.twist6),
                   event->as.twist6.v_mps[0] != 0 || turn_of(&event->as.twist6) != 0);
      take_rate(self, CHANNEL_TWIST_TURN, event, event->as.twist6.w_radps[2], 1);
      take_rate(self, CHANNEL_TWIST_WAY, event, way_of(event->as.twist6.v_mps[0], event->as.twist6.v_mps[1]), 1);
      break;
    case WM_EVENT_INCREMENT: {
      const wm_increment *i = &event->as.increment;
      take_amount(self, CHANNEL_INCREMENT_TURN, event->source, i->from_ns, event->t_ns, i->dheading_rad, 1);
      take_amount(self, CHANNEL_INCREMENT_WAY, event->source, i->from_ns, event->t_ns, way_of(i->dx_m, i->dy_m), 1);
      break;
    }
    case WM_EVENT_HEADING: take_heading(self, event); break;
    default: break;
  }
}
