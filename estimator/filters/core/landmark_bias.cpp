// SPDX-License-Identifier: Apache-2.0
// With a right pose the mean innovation of a landmark is zero. Its sum over slots, squared over its variance, is
// chi-square distributed; so is the sum over landmarks [BarShalom2001, ch. 5.4]. The worst fifth of the landmarks, at
// least one, is left out: landmarks are moved. A refused innovation counts as one of three sigma, with its sign.
#include "filters/core/landmark_bias.hpp"

#include <cmath>

#include "filters/core/chi_square.hpp"
#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr double kMost_z = 3.0;  // of an innovation
constexpr double kSlot_s = 0.3;  // within it, errors are correlated (landmark_evidence.cpp)
constexpr double kMemory_s = 20.0, kForget_s = 2.0 * kMemory_s;
// Innovations' variance over the stated one, as in the monitor. With it, 45 good replays reach at most 0.4 of the
// limit, and a mirrored bearing 6 times the limit.
constexpr double kStated = 1.5;
constexpr double kLeftOut = 0.2;  // of the landmarks

using table = wm_monitor_landmarks;
using entry = wm_monitor_landmark;

// Of these landmarks together: sum of squares and number of means.
struct total {
  int32_t id;
  double squares, means;
};

void close_slot(entry *e) {
  if (e->slot_count <= 0.0) return;
  const double left = exp(-wm_seconds_between(e->at_ns, e->slot_ns) / kMemory_s);
  e->sum = e->sum * left + e->slot_sum / e->slot_count;
  e->variance = e->variance * square(left) + 1.0;
  e->at_ns = e->slot_ns;
  e->slot_sum = e->slot_count = 0.0;
}

// The entry of this landmark and residual; the one not seen for longest is replaced.
entry *entry_of(table *self, const wm_innovation &i) {
  uint32_t at = 0, oldest = 0;
  for (; at < self->count; at++) {
    const entry &e = self->entries[at];
    if (e.id == i.landmark_id && e.residual == i.residual && e.source == i.source) return &self->entries[at];
    if (e.slot_ns < self->entries[oldest].slot_ns) oldest = at;
  }
  if (self->count < WM_MONITOR_LANDMARKS)
    self->count++;
  else
    at = oldest;
  self->entries[at] = {i.landmark_id, i.source, i.residual, i.t_ns, i.t_ns, 0.0, 0.0, 0.0, 0.0};
  return &self->entries[at];
}

void add_to(total *totals, int *count, const entry &e) {
  int at = 0;
  while (at < *count && totals[at].id != e.id) at++;
  if (at == *count) totals[(*count)++] = {e.id, 0.0, 0.0};
  totals[at].squares += square(e.sum) / (e.variance * kStated);
  totals[at].means += 1.0;
}

void leave_out_worst(total *totals, int *count) {
  int worst = 0;
  for (int i = 1; i < *count; i++)
    if (totals[i].squares * totals[worst].means > totals[worst].squares * totals[i].means) worst = i;
  totals[worst] = totals[--*count];
}

}  // namespace

void landmark_bias_clear(table *self) { *self = {}; }

void landmark_bias_take(table *self, const wm_innovation &i) {
  if (i.landmark_id < 0 || !(i.variance > 0.0)) return;
  const double off = i.residual == WM_RESIDUAL_BEARING ? wrap(i.observed - i.expected) : i.observed - i.expected;
  const double z = off / std::sqrt(i.variance);
  if (!finite(z)) return;
  entry *e = entry_of(self, i);
  if (wm_seconds_between(e->slot_ns, i.t_ns) >= kSlot_s) {
    close_slot(e);
    e->slot_ns = i.t_ns;
  }
  e->slot_sum += z > kMost_z ? kMost_z : z < -kMost_z ? -kMost_z : z;
  e->slot_count += 1.0;
}

void landmark_bias_test(table *self, wm_time_ns t_ns) {
  total totals[WM_MONITOR_LANDMARKS];
  int count = 0;
  for (uint32_t i = 0; i < self->count; i++) {
    const entry &e = self->entries[i];
    if (e.variance > 0.0 && wm_seconds_between(e.slot_ns, t_ns) < kForget_s) add_to(totals, &count, e);
  }
  const int left_out = count > 0 ? 1 + static_cast<int>(kLeftOut * (count - 1)) : 0;
  for (int i = 0; i < left_out; i++) leave_out_worst(totals, &count);
  double squares = 0.0, means = 0.0;
  for (int i = 0; i < count; i++) {
    squares += totals[i].squares;
    means += totals[i].means;
  }
  self->contradicts = count > 0 && squares > chi_square_limit(means);
}

bool landmark_bias_contradicts(const table &self) { return self.contradicts != 0; }

}  // namespace wm
