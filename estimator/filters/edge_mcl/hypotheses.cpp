// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/hypotheses.hpp"

namespace wm {
namespace {

constexpr double kUnknownExplained = 0.5;  // by a place that is not in the list: walls are parallel
constexpr double kDropNats = 12.0;         // below the best, from which on a hypothesis is dropped; not swept
constexpr double kUnweighed = -1e3;        // log weight
// Hypotheses nearer than this are one. Less than a sweep's places: an error of half a metre along a corridor must
// remain another hypothesis (0.6 m let one of 20 corridor-hard drives stay off).
constexpr double kSame_m = 0.4, kSame_rad = 0.2;
constexpr double kLeastProbability = 1e-6;  // of the tracked pose, for its odds

bool same(const wm_pose2 &a, const wm_pose2 &b) { return same_pose(a, b, kSame_m, kSame_rad); }

}  // namespace

void hypotheses::clear(const wm_pose2 &own, const wm_pose2 &odom) {
  count_ = 1;
  next_ = 0;
  of_[0] = {own, 0.0, 1.0, 0, {}};
  log_weight_[0] = 0.0;
  odom_ = odom;
}

void hypotheses::carry(const wm_pose2 &own, const wm_pose2 &odom) {
  const wm_pose2 way = between(odom_, odom);
  odom_ = odom;
  of_[0].pose = own;
  for (int i = 1; i < count_; i++) of_[i].pose = compose(of_[i].pose, way);
}

void hypotheses::offer(const place_search &search) {
  int found;
  const place *places = search.places(&found);
  const wm_pose2 since = between(search.odom_of_places(), odom_);
  for (int k = 0; k < found; k++) offer(compose(places[k].pose, since), places[k].explained, places[k].error);
}

void hypotheses::offer(const wm_pose2 &pose, double explained, const double error[kMountingAll]) {
  if (count_ == kCapacity) return;
  for (int i = 0; i < count_; i++)
    if (same(of_[i].pose, pose)) return;
  log_weight_[count_] = 0.0;
  hypothesis &h = of_[count_++] = {pose, explained, 0.0, 0, {}};
  for (int e = 0; e < kMountingAll; e++) h.error[e] = error[e];
}

// log w = n explained + prior - error^2 / 2, n: kNatsAKeyframe times the information; beside them stands a place that
// is not in the list.
void hypotheses::weigh(const edge_map &map, place_search *search, double own_prior, double own_least,
                       double information, int some) {
  const double nats = kNatsAKeyframe * information;
  for (int n = 0; n < some && n < count_; n++, next_++) {
    if (next_ >= count_) next_ = 0;
    hypothesis &h = of_[next_];
    wm_pose2 aligned = h.pose;
    h.explained = search->explained(map, odom_, &aligned, h.error, next_ == 0);
    if (next_ == 0) {
      if (h.explained < own_least) h.explained = own_least;
    } else {
      h.pose = aligned;
      if (!map.drivable(aligned.x_m, aligned.y_m)) h.explained = 0.0;
    }
    h.weighed = 1;
  }
  double best = nats * kUnknownExplained;
  for (int i = 0; i < count_; i++) {
    log_weight_[i] = of_[i].weighed ? nats * of_[i].explained + (i == 0 ? own_prior : 0.0) : kUnweighed;
    for (const double e : of_[i].error) log_weight_[i] -= 0.5 * e * e;
    if (log_weight_[i] > best) best = log_weight_[i];
  }
  double total = exp(nats * kUnknownExplained - best);
  for (int i = 0; i < count_; i++) total += of_[i].probability = exp(log_weight_[i] - best);
  for (int i = 0; i < count_; i++) of_[i].probability /= total;
  drop_unlikely(best);
}

void hypotheses::drop_unlikely(double best) {
  int kept = 1;
  for (int i = 1; i < count_; i++) {
    bool drop = of_[i].weighed && log_weight_[i] < best - kDropNats;
    for (int k = 0; k < kept; k++) drop |= same(of_[k].pose, of_[i].pose);
    if (drop) continue;
    log_weight_[kept] = log_weight_[i];
    of_[kept++] = of_[i];
  }
  count_ = kept;
}

void hypotheses::adopt(int i) {
  const hypothesis own = of_[0];
  of_[0] = of_[i];
  of_[i] = own;
}

double hypotheses::odds_elsewhere() const {
  double sum = 0.0;
  for (int i = 1; i < count_; i++)
    if (of_[i].weighed) sum += of_[i].probability;
  return sum / (of_[0].probability > kLeastProbability ? of_[0].probability : kLeastProbability);
}

int hypotheses::best() const {
  int best = 0;
  for (int i = 1; i < count_; i++)
    if (of_[i].probability > of_[best].probability) best = i;
  return best;
}

}  // namespace wm
