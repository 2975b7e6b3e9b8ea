// SPDX-License-Identifier: Apache-2.0
// Was the pose that somebody stated right? A filter that is told a wrong pose with a small sigma bends what it can (the
// heading, the mountings, the map) until what it sees fits, one bearing after the other. So the stated pose, carried on
// by odometry, is compared as a whole with the pose that the observations have by themselves (search.hpp), under two
// hypotheses: it is as right as it said, or it was off by some metres:
//   log odds = prior + log N(d; 0, P_seen + P_stated + B) - log N(d; 0, P_seen + P_stated)
// with d the difference of both poses and B the variance of a wrong one. Where the observations say little of some
// direction, P_seen is large there and nothing is concluded from it.
#ifndef WAYMARK_ESTIMATOR_START_TRIAL_HPP
#define WAYMARK_ESTIMATOR_START_TRIAL_HPP

#include "filters/landmark_ekf/search.hpp"

namespace wm {

class start_trial {
 public:
  // What is stated: base_link in map, and where odometry was then.
  void begin(const wm_pose2 &pose, const double covariance[3][3], const wm_pose2 &odom, double travelled_m,
             double turned_rad);
  void close() { open_ = false; }
  // Undecided; odometry still says where the stated pose would be now.
  bool open() const { return open_; }
  // Weighs it against a pose that the observations since then have by themselves.
  void weigh(const search_result &seen, const wm_pose2 &odom, double travelled_m, double turned_rad, wm_time_ns t_ns);

  bool wrong() const { return open_ && wrong_; }
  double probability() const;  // of having been wrong; 0 where it isn't open
  // Where it is now if the stated pose was wrong, by the last weighing.
  const wm_pose2 &pose() const { return pose_; }
  const double (*covariance() const)[3] { return covariance_; }

 private:
  static constexpr double kWrong = 1.0;

  wm_pose2 stated_, odom_, pose_;
  double stated_covariance_[3][3], covariance_[3][3];
  double travelled_m_, turned_rad_, log_odds_;
  wm_time_ns wrong_since_ns_;
  bool open_, wrong_;
};

}  // namespace wm

#endif
