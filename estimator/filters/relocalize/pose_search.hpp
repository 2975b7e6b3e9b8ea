// SPDX-License-Identifier: Apache-2.0
// Relocalization in the plane: recent observations, related by odometry, against the map. For each of many headings the
// position is a linear problem; triples of bearings give further candidates by resection. The best are refined by
// Gauss-Newton with bounded influence. A pose is accepted when most observations agree with it and no other pose
// explains them as well. The cost is fixed.
#ifndef WAYMARK_ESTIMATOR_SEARCH_HPP
#define WAYMARK_ESTIMATOR_SEARCH_HPP

#include <cstdint>

#include "sensors/sensor_model.hpp"
#include "waymark/frames.h"
#include "waymark/time.h"

namespace wm {

// Odometry: base_link in its own frame, and the distance and the angle travelled so far, with which its error grows.
struct travelled_pose2 {
  wm_pose2 pose;
  double travelled_m, turned_rad;
};

// A buffered observation of the map, or a position or heading in it.
struct observation {
  wm_time_ns t_ns;
  uint32_t kind;             // bits of observation_kind
  int32_t key;               // index of the landmark * kMaxSensors + sensor; negative: a position or a heading
  wm_pose2 sensor;           // in the odometry's frame, when it observed; base_link for a position or a heading
  double place_m[2];         // of the landmark, or the position itself, in map
  double bearing_rad;        // or the heading in map
  double range_m;            // on the floor
  double tangent, height_m;  // with an elevation: its tangent, and the landmark's height above the sensor
  double sigma_tangent, sigma_height_m;
  double sigma_angle_rad, sigma_length_m;
  double sigma_place_m;            // of a bearing, across it: errors of landmark and mounting, constant in time
  double travelled_m, turned_rad;  // odometry's, at the observation
};

// Sigma of the odometry's error per metre travelled and per radian turned, before calibration. Between the errors of
// the recordings' uncalibrated wheels (2 to 10 %); not swept.
inline constexpr double kTravelSigma = 0.05, kTurnSigma = 0.07;

enum observation_kind : uint32_t {
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
  int used, agreeing;  // observations
  int landmarks;       // of which at least half of the observations agree
};

struct search_limits {
  double sigma_xy_m, sigma_heading_rad;  // a less certain pose is not accepted
  int numbers;                           // that must agree: one a bearing, range or heading, two a position
};

// out += J P J', the covariance of the pose `to` that is rigidly attached to `from`, whose covariance is P.
void add_attached_covariance(const wm_pose2 &from, const wm_pose2 &to, const double p[3][3], double out[3][3]);

class pose_search {
 public:
  static constexpr int kCapacity = 64;  // observations: one landmark's of 19 s, or of ten in view 2 s. Not swept.

  void clear() { count_ = 0; }
  // Keeps an observation; of one key at most one in 0.3 s, so that a fast sensor does not displace older ones.
  void add(const observation &seen);
  // Those still buffered, the oldest first.
  int kept() const { return count_ < kCapacity ? count_ : kCapacity; }
  const observation &at(int i) const { return ring_[(count_ - kept() + i) % kCapacity]; }
  int count_since(wm_time_ns since_ns) const;
  // Whether a place of a landmark (bearing and range) contradicts most of those since `since_ns` that the same sensor
  // observed of the same landmark and that fit the pose now, as odometry relates them: the errors of pose and map
  // cancel.
  bool contradicts(const observation &seen, wm_time_ns since_ns, const wm_pose2 &pose_now,
                   const travelled_pose2 &odometry) const;
  // How many observations since `since_ns` agree with the pose now. `mounting`: the correction of each sensor's
  // mounting since its observations were buffered.
  int agreeing(wm_time_ns since_ns, const wm_pose2 &pose_now, const travelled_pose2 &odometry,
               const wm_pose2 mounting[kMaxSensors]) const;
  // The pose now, from the observations since `since_ns`. `prior` (may be null): observations that do not expire.
  search_result find(wm_time_ns since_ns, const travelled_pose2 &odometry, const observation *prior, int prior_count,
                     const search_limits &limits) const;

 private:
  observation ring_[kCapacity];
  int count_;
};

}  // namespace wm

#endif
