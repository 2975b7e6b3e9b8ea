// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/hypotheses.hpp"

#include "math/arc.hpp"

namespace wm {
namespace {

// What a keyframe that is explained as a whole says against one that isn't at all: its 32 points err together, with one
// another and with the next keyframe's.
constexpr double kNats = 3.0;
constexpr double kByChance = 0.5;  // explained where nothing is known of the place: walls run alike
constexpr double kHopeless = 12.0;
constexpr double kSame_m = 0.4, kSame_rad = 0.2;

bool same(const wm_pose2 &a, const wm_pose2 &b) {
  return square(a.x_m - b.x_m) + square(a.y_m - b.y_m) < square(kSame_m) &&
         std::fabs(wrap(a.heading_rad - b.heading_rad)) < kSame_rad;
}

}  // namespace

void hypotheses::clear(const wm_pose2 &own, const wm_pose2 &odom) {
  count_ = 1;
  next_ = 0;
  of_[0] = {own, 0.0, 1.0, false, {}};
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

void hypotheses::offer(const wm_pose2 &pose, double explained, const double error[kSlackMost]) {
  if (count_ == kMost) return;
  for (int i = 0; i < count_; i++)
    if (same(of_[i].pose, pose)) return;
  log_weight_[count_] = 0.0;
  hypothesis &h = of_[count_++] = {pose, explained, 0.0, false, {}};
  for (int e = 0; e < kSlackMost; e++) h.error[e] = error[e];
}

void hypotheses::weigh(const edge_map &map, place_search *search, double own_prior, double own_least, double telling,
                       int some) {
  const double nats = kNats * telling;
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
  double best = nats * kByChance;
  for (int i = 0; i < count_; i++) {
    log_weight_[i] = of_[i].weighed ? nats * of_[i].explained + (i == 0 ? own_prior : 0.0) : -1e3;
    for (const double e : of_[i].error) log_weight_[i] -= 0.5 * e * e;
    if (log_weight_[i] > best) best = log_weight_[i];
  }
  double total = exp(nats * kByChance - best);
  for (int i = 0; i < count_; i++) total += of_[i].share = exp(log_weight_[i] - best);
  for (int i = 0; i < count_; i++) of_[i].share /= total;
  drop_the_hopeless(best);
}

void hypotheses::drop_the_hopeless(double best) {
  int kept = 1;
  for (int i = 1; i < count_; i++) {
    bool again = of_[i].weighed && log_weight_[i] < best - kHopeless;
    for (int k = 0; k < kept; k++) again |= same(of_[k].pose, of_[i].pose);
    if (again) continue;
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
  constexpr double kLeast = 1e-6;
  double sum = 0.0;
  for (int i = 1; i < count_; i++)
    if (of_[i].weighed) sum += of_[i].share;
  return sum / (of_[0].share > kLeast ? of_[0].share : kLeast);
}

int hypotheses::best() const {
  int best = 0;
  for (int i = 1; i < count_; i++)
    if (of_[i].share > of_[best].share) best = i;
  return best;
}

}  // namespace wm
