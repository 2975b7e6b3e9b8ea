// SPDX-License-Identifier: Apache-2.0
// Where is the vehicle, nothing being known but places of points on the map and where stereo saw them: closed-form
// absolute orientation with a robust consensus.
#ifndef WAYMARK_ESTIMATOR_POSE_CONSENSUS_HPP
#define WAYMARK_ESTIMATOR_POSE_CONSENSUS_HPP

#include "math/rotation.hpp"
#include "waymark/time.h"

namespace wm {

// A known point as it was seen, carried along by motion.
struct point_clue {
  wm_time_ns t_ns;
  int64_t id;  // as wide as the rest: a copy has no bytes that nobody wrote
  vec3 seen;   // in the odometry's frame
  vec3 place;  // on the map
  double sigma_m;
  double way_m, turn_rad;  // how far motion had come then: what came since adds to the error
};

struct pose_found {
  bool found;
  pose3 pose;  // of base_link on the map, now
  double covariance[6][6];
};

class pose_consensus {
 public:
  static constexpr int kCapacity = 64;

  void clear() { count_ = 0; }
  void add(const point_clue &clue);
  // The pose that most of the clues since `since_ns` agree about; none where they are too few, lie in a line, or leave
  // it less sure than the two sigmas. `odom`, `way_m`, `turn_rad`: motion until now. Random choices come from `seed`.
  // Source: closed form by B. K. P. Horn, "Closed-form solution of absolute orientation using unit quaternions", 1987;
  // consensus by M. A. Fischler, R. C. Bolles, 1981. Cost: 100 hypotheses over at most 64 clues, about 50 us.
  pose_found find(wm_time_ns since_ns, const pose3 &odom, double way_m, double turn_rad, double sigma_m,
                  double sigma_rad, uint64_t seed) const;

 private:
  point_clue clue_[kCapacity];
  int count_;  // ever added; the newest kCapacity are kept
};

}  // namespace wm

#endif
