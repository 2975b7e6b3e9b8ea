// SPDX-License-Identifier: Apache-2.0
// Places where the robot may be, the filter's own and those that the search found: carried on by odometry, aligned and
// weighed by how much of the last metres the map explains there.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_HYPOTHESES_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_HYPOTHESES_HPP

#include "filters/edge_mcl/place_search.hpp"

namespace wm {

struct hypothesis {
  wm_pose2 pose;             // base_link in map now
  double explained;          // share of the last metres' points
  double share;              // of the probability
  int64_t weighed;           // 0: not yet. As wide as the rest: a copy has no bytes that nobody wrote
  double error[kSlackMost];  // of the cameras if it is there, in sigmas of what is known of them
};

class hypotheses {
 public:
  static constexpr int kMost = place_search::kPlaces + 1;

  // The filter's own place is number 0.
  void clear(const wm_pose2 &own, const wm_pose2 &odom);
  void carry(const wm_pose2 &own, const wm_pose2 &odom);
  void offer(const place_search &search);
  // Base_link in map now, of the share of the points that it is said to explain.
  void offer(const wm_pose2 &pose, double explained, const double error[kSlackMost]);
  // Aligns and weighs `some` of them, in turn. `own_prior`: logarithm of how much likelier one's own place is than
  // another before anything is seen; `own_least`: what it explains at least.
  void weigh(const edge_map &map, place_search *search, double own_prior, double own_least, double telling, int some);
  // Number `i` is the filter's own from now on, and what was is one of the others.
  void adopt(int i);

  int count() const { return count_; }
  const hypothesis &operator[](int i) const { return of_[i]; }
  int best() const;
  // Odds of being at one of the others that were weighed.
  double odds_elsewhere() const;

 private:
  void drop_the_hopeless(double best);

  hypothesis of_[kMost];
  double log_weight_[kMost];
  int count_, next_;
  wm_pose2 odom_;
};

}  // namespace wm

#endif
