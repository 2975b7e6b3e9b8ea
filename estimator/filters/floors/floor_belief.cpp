// SPDX-License-Identifier: Apache-2.0
#include "filters/floors/floor_belief.hpp"

#include <cstring>

#include "math/elementary.hpp"

namespace wm {
namespace {

// Of one observation, nats: no more than a landmark may count for a pose (landmark_evidence.cpp).
constexpr double kMostFor = 4.0, kMostAgainst = 1.7;
constexpr double kFullWeight_s = 0.3;  // observations of a landmark nearer in time share their errors
constexpr double kLeast = 1e-5;        // probability of an open floor: so that a change is noticed in seconds

}  // namespace

void floor_belief::begin(int count) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  count_ = count;
  open_ = count < 64 ? (UINT64_C(1) << count) - 1 : ~UINT64_C(0);
  for (int i = 0; i < count; i++) p_[i] = 1.0 / count;
}

void floor_belief::decide(int floor) {
  for (double &p : p_) p = 0.0;
  p_[floor] = 1.0;
  open_ = UINT64_C(1) << floor;
}

void floor_belief::open(int floor, double probability) {
  open_ |= UINT64_C(1) << floor;
  if (p_[floor] < probability) p_[floor] = probability;
  normalise();
}

void floor_belief::close(int floor) {
  open_ &= ~(UINT64_C(1) << floor);
  p_[floor] = 0.0;
  normalise();
}

int floor_belief::most_probable() const {
  int best = 0;
  for (int i = 1; i < count_; i++)
    if (p_[i] > p_[best]) best = i;
  return best;
}

void floor_belief::change(uint64_t among, double rate_per_s, double dt_s) {
  int others = -1;
  double all = 0.0;
  for (int i = 0; i < count_; i++)
    if (among >> i & 1u) {
      others++;
      all += p_[i];
    }
  if (others < 1) return;
  const double leaves = 1.0 - exp(-rate_per_s * dt_s);
  for (int i = 0; i < count_; i++)
    if (among >> i & 1u) p_[i] = (1.0 - leaves) * p_[i] + leaves * (all - p_[i]) / others;
  normalise();
}

// The source of this key; the one not seen for longest is replaced.
double floor_belief::weight_of(wm_time_ns t_ns, int64_t key) {
  int at = 0, oldest = 0;
  for (; at < sources_ && source_[at].key != key; at++)
    if (source_[at].t_ns < source_[oldest].t_ns) oldest = at;
  if (at == sources_) {
    if (sources_ < kSources)
      sources_++;
    else
      at = oldest;
    source_[at] = {key, t_ns, 1.0};
  }
  source &s = source_[at];
  const double dt = wm_seconds_between(s.t_ns, t_ns);
  if (dt > 0.0) s.weight = dt < kFullWeight_s ? dt / kFullWeight_s : 1.0;  // several of one stamp weigh alike
  s.t_ns = t_ns;
  return s.weight;
}

void floor_belief::weigh(wm_time_ns t_ns, int64_t key, const double *log_bayes) {
  const double weight = weight_of(t_ns, key);
  for (int i = 0; i < count_; i++) {
    if (!is_open(i)) continue;
    const double l = log_bayes[i] < -kMostFor ? -kMostFor : log_bayes[i] > kMostAgainst ? kMostAgainst : log_bayes[i];
    p_[i] *= exp(-weight * l);
  }
  normalise();
}

void floor_belief::normalise() {
  double sum = 0.0, kept = 0.0;
  for (int i = 0; i < count_; i++) sum += p_[i];
  for (int i = 0; i < count_; i++) {
    if (!is_open(i)) continue;
    p_[i] /= sum;
    if (!(p_[i] > kLeast)) p_[i] = kLeast;
    kept += p_[i];
  }
  for (int i = 0; i < count_; i++) p_[i] /= kept;
}

}  // namespace wm
