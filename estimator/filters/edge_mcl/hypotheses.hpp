// SPDX-License-Identifier: Apache-2.0
// Hypotheses of the robot's pose: the tracked one and those that searches found. They are carried on by odometry,
// aligned with the keyframes of the last metres, and weighed by the fraction of these that the map explains.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_HYPOTHESES_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_HYPOTHESES_HPP

#include "filters/edge_mcl/place_search.hpp"

namespace wm {

// Log likelihood difference, in nats, between a keyframe (0.4 m) of usual information that is explained completely and
// one that is not at all. Its points' errors are correlated with each other and with the next keyframe's. Chosen on 20
// corridor-easy and 20 corridor-hard drives: 5 is right again earlier than 3 (starts 8.7 m instead of 11.6 in 90 of
// 100); more makes adopted poses overconfident.
inline constexpr double kNatsAKeyframe = 5.0;

struct hypothesis {
  wm_pose2 pose;     // base_link in map now
  double explained;  // fraction of the keyframes' points
  double probability;
  int64_t weighed;             // 0: not yet. 64 bits: no padding
  double error[kMountingAll];  // of the cameras' mountings if it is there, in sigmas
};

class hypotheses {
 public:
  static constexpr int kCapacity = place_search::kPlaces + 1;

  // Number 0 is the tracked pose, `own`.
  void clear(const wm_pose2 &own, const wm_pose2 &odom);
  void carry(const wm_pose2 &own, const wm_pose2 &odom);
  void offer(const place_search &search);
  // Base_link in map now, and the fraction of points that it explains.
  void offer(const wm_pose2 &pose, double explained, const double error[kMountingAll]);
  // Aligns and weighs `some` of them, in turn. `own_prior`: log prior odds of the tracked pose against another one;
  // `own_least`: fraction that it explains at least; `information`: of the keyframes.
  void weigh(const edge_map &map, place_search *search, double own_prior, double own_least, double information,
             int some);
  // Number `i` becomes the tracked pose, and that one of the others.
  void adopt(int i);

  int count() const { return count_; }
  const hypothesis &operator[](int i) const { return of_[i]; }
  int best() const;
  // Odds of the others that were weighed against the tracked pose.
  double odds_elsewhere() const;

 private:
  void drop_unlikely(double best);

  hypothesis of_[kCapacity];
  double log_weight_[kCapacity];
  int count_, next_;
  wm_pose2 odom_;
};

}  // namespace wm

#endif
