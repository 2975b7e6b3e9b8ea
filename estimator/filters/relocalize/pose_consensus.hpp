// SPDX-License-Identifier: Apache-2.0
// Relocalization in space: the pose on which most observations of known points agree, from their places on the map and
// their measured positions alone. Absolute orientation of three points each, counted by RANSAC.
#ifndef WAYMARK_ESTIMATOR_POSE_CONSENSUS_HPP
#define WAYMARK_ESTIMATOR_POSE_CONSENSUS_HPP

#include "waymark/internal/math/rotation.hpp"
#include "waymark/time.h"

namespace wm {

// Odometry: the pose in its own frame, and the distance and the angle travelled so far.
struct travelled_pose {
  pose3 pose;
  double travelled_m, turned_rad;
};

// A buffered observation of a known point. Odometry relates it to later ones; what it travelled since adds variance.
struct point_observation {
  wm_time_ns t_ns;
  int64_t id;  // 64 bits, so that the struct has no padding and copies of a state are equal byte for byte
  vec3 seen;   // in the odometry's frame
  vec3 place;  // on the map
  double sigma_m;
  double travelled_m, turned_rad;
};

// Points seen and on a map, matched: some of the matches are wrong.
struct matched_points {
  static constexpr int kCapacity = 256;
  vec3 from[kCapacity], to[kCapacity];
  double weight[kCapacity];  // 1 / variance
  int64_t id[kCapacity];
  int count = 0;
};

// The motion from `from` to `to`, and how many matches agree with it.
struct agreed_pose {
  pose3 at;
  double cost = 1e300;  // sum of chi2, each clipped at the limit of `agrees`
  int inliers = 0;
};

// The best of so many random triples, refined by those that agree with it. Sources: [Horn1987] [Fischler1981].
agreed_pose pose_of_most(const matched_points &all, int hypotheses, uint64_t seed);
// Whether match i agrees with a motion: its chi2 is below the 99 % quantile of three degrees of freedom.
bool agrees(const matched_points &all, int i, const pose3 &at);

struct pose_found {
  bool searched;  // false: too few observations, which cost nothing
  bool found;
  pose3 pose;  // of base_link on the map, now
  double covariance[6][6];
};

class pose_consensus {
 public:
  static constexpr int kCapacity = 64;  // observations: three pictures of 20 points. Not swept.

  void clear() { count_ = 0; }
  void add(const point_observation &observation);
  // The pose that most observations since `since_ns` agree on. Not found: they are too few, lie in a line, or leave it
  // less certain than the two sigmas. Random choices follow from `seed`. Sources: [Horn1987] [Fischler1981].
  // Cost: 100 hypotheses over at most 64 observations, about 50 us.
  pose_found find(wm_time_ns since_ns, const travelled_pose &now, double sigma_m, double sigma_rad,
                  uint64_t seed) const;

 private:
  point_observation observation_[kCapacity];
  int count_;  // ever added; the newest kCapacity are kept
};

}  // namespace wm

#endif
