// SPDX-License-Identifier: Apache-2.0
// Finding the pose anew: recent observations, carried together by odometry, against the map. For each of many headings
// the position is a linear problem; the best ones are refined by Gauss-Newton with bounded influence, and one is taken
// only when most observations agree with it and no other place explains them as well. Fixed cost.
#ifndef WAYMARK_ESTIMATOR_SEARCH_HPP
#define WAYMARK_ESTIMATOR_SEARCH_HPP

#include <cstdint>

#include "sensors/sensor_model.hpp"
#include "waymark/frames.h"
#include "waymark/time.h"

namespace wm {

// One observation, in the odometry's frame.
struct observation {
  wm_time_ns t_ns;
  uint32_t kind;       // bits of search_kind
  int32_t key;         // what was seen: index of the landmark * kMaxSensors + sensor; negative: a position, a heading
  wm_pose2 sensor;     // the sensor (base_link for a position or a heading) in the odometry's frame, at the observation
  double place_m[2];   // of the landmark, or the position itself, in map
  double bearing_rad;  // or the heading in map
  double range_m;      // on the floor
  double tangent,
      height_m;  // with kObservedElevation: of the elevation above the level, and of the landmark above the sensor
  double sigma_tangent, sigma_height_m;
  double sigma_angle_rad, sigma_length_m;
  double sigma_place_m;  // of a bearing: what of the landmark and the mounting is wrong each time alike, across it
  double travelled_m, turned_rad;  // so far, at the observation: odometry's own error grows with them
};
// Odometry's error in parts of the way and of the turn, before calibration.
inline constexpr double kWayError = 0.05, kTurnError = 0.07;

enum search_kind : uint32_t {
  kObservedBearing = 1,
  kObservedRange = 2,
  kObservedPosition = 4,
  kObservedHeading = 8,
  kObservedElevation = 16
};

struct search_result {
  bool found;
  wm_pose2 pose;  // base_link in map, now
  double covariance[3][3];
  int used, agreeing;
};

struct search_limits {
  double sigma_xy_m, sigma_heading_rad;  // a pose less sure is not taken
  int numbers;                           // that must agree, of the prior's too
};

class pose_search {
 public:
  static constexpr int kCapacity = 64;

  void clear() { count_ = 0; }
  // Keeps the seen; of one key at most one in 0.3 s, so that a fast sensor does not crowd out time.
  void add(const observation &seen);
  int count() const { return count_; }
  const observation &newest() const { return ring_[(count_ - 1) % kCapacity]; }
  // Those still there, the oldest first.
  int kept() const { return count_ < kCapacity ? count_ : kCapacity; }
  const observation &at(int i) const { return ring_[(count_ - kept() + i) % kCapacity]; }
  int count_since(wm_time_ns since_ns) const;
  // How many clues not older than `since_ns` agree with a pose now. `mounting`: of each sensor, where it is known to be
  // now from where the clues were told that it is.
  int agreeing(wm_time_ns since_ns, const wm_pose2 &pose_now, const wm_pose2 &odom_now, double travelled_m,
               double turned_rad, const wm_pose2 mounting[kMaxSensors]) const;
  // The pose now, from clues not older than `since_ns`. `prior` (may be null) is a seen that does not age.
  search_result find(wm_time_ns since_ns, const wm_pose2 &odom_now, double travelled_m, double turned_rad,
                     const observation *prior, int prior_count, const search_limits &limits) const;

 private:
  observation ring_[kCapacity];
  int count_;
};

}  // namespace wm

#endif
