// SPDX-License-Identifier: Apache-2.0
// The dead reckoning of a window is laid over the positions by the best turn and shift [Horn1987], as it is, and with
// the turn's sign changed. What remains is a bias of the turn rate, and the receiver's error, a first-order
// autoregression. With an unknown variance the log likelihood ratio of both is half the number of coordinates times the
// logarithm of the ratio of the sums of squared innovations. The stated variances are added to both sums: below them a
// difference has no meaning. Neither the pose nor its heading are needed, so that a start that is wrong does not
// matter.
#include "filters/core/course_test.hpp"

#include <cmath>

#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr double kSlot_s = 5.0;          // as the monitor's for positions: multipath passes
constexpr int kWindows[] = {6, 16, 33};  // slots: 30, 80 and 165 s
constexpr int kSlotsLeast = 3;           // a mirror image of fewer places fits as well
constexpr double kSparse = 3.0;          // a window reaches back at most so many times its length
constexpr double kAlarm_log = 9.21;      // -log(1e-4)
constexpr double kBias_radps = 0.02;     // of a cheap gyro, before it is learnt (motion.states.yaw_rate_bias)
// Prior log odds of a mistaken sign of a turn or an axis in a configuration: one in 55.
constexpr double kMirrored = -4.0;
constexpr double kGap_s = 1.5;  // without motion for longer, dead reckoning begins anew
// Tyres reach 10 m/s2. Beyond this for 2 s more than not, turn rate or speed has another unit.
constexpr double kMostAcross_mps2 = 15.0, kImpossible_s = 2.0, kRemembered_s = 10.0;

using course = wm_monitor_course;
using slot = wm_monitor_course_slot;

// The slot `age` before the newest one.
const slot &slot_at(const course &self, int age) {
  return self.slots[(self.opened - 1 - static_cast<uint64_t>(age)) % WM_MONITOR_COURSE_SLOTS];
}

struct plane {
  double x, y;
};
plane operator+(plane a, plane b) { return {a.x + b.x, a.y + b.y}; }
plane operator-(plane a, plane b) { return {a.x - b.x, a.y - b.y}; }
plane operator*(double by, plane a) { return {by * a.x, by * a.y}; }
double dot(plane a, plane b) { return a.x * b.x + a.y * b.y; }
plane left_of(plane a) { return {-a.y, a.x}; }
plane turned(sin_cos by, plane a) { return by.cos * a + by.sin * left_of(a); }

// Slots of a window, from the newest one on: about their middles.
struct track {
  plane at[WM_MONITOR_COURSE_SLOTS], middle;
};

template <class Place>
track track_of(int n, Place place) {
  track out;
  out.middle = {};
  for (int i = 0; i < n; i++) out.middle = out.middle + (1.0 / n) * (out.at[i] = place(i));
  for (int i = 0; i < n; i++) out.at[i] = out.at[i] - out.middle;
  return out;
}

double sum_of_products(const track &a, const track &b, int n) {
  double sum = 0.0;
  for (int i = 0; i < n; i++) sum += dot(a.at[i], b.at[i]);
  return sum;
}

// How a bias of the turn rate bends the way, 1 rad/s of it, but for a turn and a shift.
track bend_of(const course &self, const track &way, int n) {
  const wm_time_ns newest_ns = slot_at(self, 0).begin_ns;
  const double middle_s = 0.5 * wm_seconds_between(newest_ns, slot_at(self, n - 1).begin_ns);
  plane bent{};
  track out = track_of(n, [&](int i) {
    if (i == 0) return bent;
    const double at_s = 0.5 * (wm_seconds_between(newest_ns, slot_at(self, i).begin_ns) +
                               wm_seconds_between(newest_ns, slot_at(self, i - 1).begin_ns));
    return bent = bent + (at_s - middle_s) * left_of(way.at[i] - way.at[i - 1]);
  });
  double across = 0.0;
  for (int i = 0; i < n; i++) across += dot(out.at[i], left_of(way.at[i]));
  const double turn = across / sum_of_products(way, way, n);
  for (int i = 0; i < n; i++) out.at[i] = out.at[i] - turn * left_of(way.at[i]);
  return out;
}

// The sum of squared innovations of an autoregression from slot to slot. A receiver's error lasts for minutes, so that
// consecutive slots carry little new information.
double innovations_m2(const track &left, int n) {
  double newer = 0.0, older = 0.0, products = 0.0;
  for (int i = 0; i + 1 < n; i++) {
    newer += dot(left.at[i], left.at[i]);
    older += dot(left.at[i + 1], left.at[i + 1]);
    products += dot(left.at[i], left.at[i + 1]);
  }
  const double stays = !(products > 0.0) ? 0.0 : products < older ? products / older : 1.0;
  const double oldest = (1.0 - square(stays)) * dot(left.at[n - 1], left.at[n - 1]);
  return newer - 2.0 * stays * products + square(stays) * older + oldest;
}

// The way, or its mirror image (side -1), laid over the positions: by this turn about its middle, then the shift from
// there to the positions' middle. `nats`: the log likelihood, but for a constant.
struct overlay {
  double nats, turn_rad;
  plane way, place;
};

overlay lay_over(const course &self, int n, double side, double stated_m2) {
  const track place = track_of(n, [&](int i) {
    const slot &s = slot_at(self, i);
    return (1.0 / s.count) * plane{s.place_m[0], s.place_m[1]};
  });
  const track way = track_of(n, [&](int i) {
    const slot &s = slot_at(self, i);
    return (1.0 / s.count) * plane{s.way_m[0], side * s.way_m[1]};
  });
  plane turn{};
  for (int i = 0; i < n; i++) turn = turn + plane{dot(way.at[i], place.at[i]), dot(left_of(way.at[i]), place.at[i])};
  overlay out{0.0, atan2(turn.y, turn.x), {way.middle.x, side * way.middle.y}, place.middle};
  const sin_cos by = sincos(out.turn_rad);
  track left = place, bend = bend_of(self, way, n);
  for (int i = 0; i < n; i++) {
    left.at[i] = left.at[i] - turned(by, way.at[i]);
    bend.at[i] = turned(by, bend.at[i]);
  }
  // The bias by its prior, with the variance of what remains.
  const double noise_m2 = (sum_of_products(left, left, n) + stated_m2) / (2.0 * n);
  const double bias =
      sum_of_products(bend, left, n) / (sum_of_products(bend, bend, n) + noise_m2 / square(kBias_radps));
  for (int i = 0; i < n; i++) left.at[i] = left.at[i] - bias * bend.at[i];
  out.nats = -n * log(innovations_m2(left, n) + stated_m2) - 0.5 * square(bias / kBias_radps);
  return out;
}

// How many of the newest slots a window of `slots` has.
int slots_of(const course &self, int slots) {
  const double reach_s = kSparse * slots * kSlot_s;
  int n = 0;
  while (n < slots && static_cast<uint64_t>(n) < self.opened &&
         wm_seconds_between(slot_at(self, n).begin_ns, slot_at(self, 0).begin_ns) < reach_s)
    n++;
  return n;
}

// Tests the last windows, and keeps the likelihood ratio of the longest one with its mirror image.
void test_mirror(course *self) {
  self->is_mirrored = 0;
  for (const int slots : kWindows) {
    const int n = slots_of(*self, slots);
    if (n < kSlotsLeast) return;
    double stated = 0.0;
    for (int i = 0; i < n; i++) {
      const slot &s = slot_at(*self, i);
      stated += s.variance / s.count;
    }
    const overlay mirror = lay_over(*self, n, -1.0, stated);
    const double nats = mirror.nats - lay_over(*self, n, 1.0, stated).nats;
    if (!finite(nats)) continue;
    self->nats = nats;
    if (self->nats < self->least_nats) self->least_nats = self->nats;
    self->mirror_turn_rad = mirror.turn_rad;
    const double middle[4] = {mirror.way.x, mirror.way.y, mirror.place.x, mirror.place.y};
    for (int k = 0; k < 2; k++) {
      self->mirror_way_m[k] = middle[k];
      self->mirror_place_m[k] = middle[k + 2];
    }
    // A sign does not change during a drive. After it was proven right, slip on a nearly straight way may contradict
    // it.
    if (n >= kWindows[0] && self->nats > kAlarm_log && self->least_nats > -kAlarm_log) self->is_mirrored = 1;
  }
}

// The dead reckoning after `dt_s` more.
plane way_after(const course &self, double dt_s) {
  const sin_cos middle = sincos(self.heading_rad + 0.5 * self.w_radps * dt_s);
  const double x_m = self.v_mps[0] * dt_s, y_m = self.v_mps[1] * dt_s;
  return {self.way_m[0] + middle.cos * x_m - middle.sin * y_m, self.way_m[1] + middle.sin * x_m + middle.cos * y_m};
}

void note_turn(course *self, double across_mps2, double dt_s) {
  const double more_s = std::fabs(across_mps2) > kMostAcross_mps2 ? dt_s : -dt_s;
  const double sum = self->impossible_s + more_s;
  self->impossible_s = sum < 0.0 ? 0.0 : sum > kRemembered_s ? kRemembered_s : sum;
  self->is_impossible = self->impossible_s > kImpossible_s;
}

}  // namespace

void course_begin(course *self) {
  *self = {};
  self->until_ns = WM_TIME_NONE;
  self->nats = NAN;
}

void course_move(course *self, const wm_estimate &e) {
  if (e.t_ns == WM_TIME_NONE) return;
  const double dt_s = self->until_ns == WM_TIME_NONE ? -1.0 : wm_seconds_between(self->until_ns, e.t_ns);
  if (dt_s == 0.0) return;
  if (dt_s > 0.0 && dt_s < kGap_s) {
    const plane to = way_after(*self, dt_s);
    self->way_m[0] = to.x;
    self->way_m[1] = to.y;
    self->heading_rad = wrap(self->heading_rad + self->w_radps * dt_s);
    note_turn(self, self->v_mps[0] * self->w_radps, dt_s);
  } else {
    self->opened = 0;
    self->is_mirrored = 0;
    self->nats = NAN;
  }
  self->until_ns = e.t_ns;
  self->v_mps[0] = finite(e.v_mps[0]) ? e.v_mps[0] : 0.0;
  self->v_mps[1] = finite(e.v_mps[1]) ? e.v_mps[1] : 0.0;
  self->w_radps = finite(e.w_radps[2]) ? e.w_radps[2] : 0.0;
}

void course_take(course *self, wm_time_ns t_ns, const wm_position &position) {
  const double ahead_s = self->until_ns == WM_TIME_NONE ? kGap_s : wm_seconds_between(self->until_ns, t_ns);
  const double sigma_m = position.sigma_xy_m;
  if (!(std::fabs(ahead_s) < kGap_s) || !finite(position.p_m[0]) || !finite(position.p_m[1]) || !finite(sigma_m))
    return;
  if (self->opened == 0 || wm_seconds_between(slot_at(*self, 0).begin_ns, t_ns) >= kSlot_s) {
    if (self->opened > 0) test_mirror(self);
    slot *next = &self->slots[self->opened++ % WM_MONITOR_COURSE_SLOTS];
    *next = {};
    next->begin_ns = t_ns;
  }
  slot *now = &self->slots[(self->opened - 1) % WM_MONITOR_COURSE_SLOTS];
  now->count += 1.0;
  now->variance += 2.0 * square(sigma_m);
  const plane way = way_after(*self, ahead_s);
  now->way_m[0] += way.x;
  now->way_m[1] += way.y;
  for (int k = 0; k < 2; k++) now->place_m[k] += position.p_m[k];
}

// A sum of likelihood ratios of windows that overlap: what once spoke against the mirror image still does.
double course_mirrored(const course &self) {
  if (!finite(self.nats)) return 0.0;
  return 1.0 / (1.0 + exp(-(kMirrored + self.least_nats + larger(self.nats, 0.0))));
}

wm_pose2 course_mirror_image(const course &self) {
  const sin_cos turn = sincos(self.mirror_turn_rad);
  const double x = self.way_m[0] - self.mirror_way_m[0], y = -(self.way_m[1] - self.mirror_way_m[1]);
  return {self.mirror_place_m[0] + turn.cos * x - turn.sin * y, self.mirror_place_m[1] + turn.sin * x + turn.cos * y,
          wrap(self.mirror_turn_rad - self.heading_rad)};
}

bool course_contradicts(const course &self) { return self.is_mirrored || self.is_impossible; }

}  // namespace wm
