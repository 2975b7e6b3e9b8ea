// SPDX-License-Identifier: Apache-2.0
// Was the pose that somebody stated right, or is it a landmark that isn't where the map says? The first looks are
// explained as a whole by each of
//   right      start and all landmarks are as stated,
//   off        the start is off by metres, the landmarks are right,
//   moved k    the start is right, landmark k is off by metres,
// and weighed by Bayes. All are one model: bearings from the start, carried on by odometry, with what lasts (the pose's
// error, each landmark's on the map, each sensor's yaw) as unknowns of known variance, and a share of detections that
// are anything; a hypothesis is nothing but a larger variance of one of them. So each pays for what it leaves open
// (Occam's factor), and none is believed because it can bend. Marginal likelihoods by Laplace's method: Gauss-Newton to
// the most likely unknowns, then their determinant (D. MacKay, Information Theory, Inference and Learning Algorithms,
// 2003, chapters 27 and 28).
//
// A pose that was found is tried alike: it may be anywhere near, so that the hypotheses are "right" and "moved k", and
// "off" means that the pose is another because k, of which it was made, has moved.
#ifndef WAYMARK_ESTIMATOR_START_TRIAL_HPP
#define WAYMARK_ESTIMATOR_START_TRIAL_HPP

#include "filters/relocalize/pose_search.hpp"

namespace wm {

class start_trial {
 public:
  // What is stated: base_link in map, and where odometry was then.
  void begin(const wm_pose2 &pose, const double covariance[3][3], const wm_pose2 &odom, double travelled_m,
             double turned_rad);
  // What was found, from bearings not older than `since_ns`; odometry and covariance alike.
  void begin_found(const wm_pose2 &pose, const double covariance[3][3], const wm_pose2 &odom, double travelled_m,
                   double turned_rad, wm_time_ns since_ns);
  void close() { open_ = false; }
  // Odometry still says where the stated pose would be now.
  bool open() const { return open_; }
  // What else lasts, as sigmas: of each sensor's yaw, of each landmark's bearing and its place across the line of
  // sight.
  struct lasting {
    double yaw_rad, bearing_rad, lateral_m;
  };
  // Weighs all bearings since begin() or `since_ns`; `pose` is the filter's now. At most 14 hypotheses over 64 bearings
  // with 31 unknowns.
  void weigh(const pose_search &clues, const lasting &sigma, const wm_pose2 &pose, const wm_pose2 &odom,
             double travelled_m, double turned_rad, wm_time_ns t_ns);

  // Probability of "off"; 0 where nothing was weighed.
  double off() const { return open_ ? off_ : 0.0; }
  // It is "off", and where it is then is sure.
  bool surely_off() const { return open_ && surely_off_; }
  // base_link in map under "off", when last weighed.
  const wm_pose2 &pose() const { return pose_; }
  const double (&covariance() const)[3][3] { return covariance_; }

 private:
  wm_pose2 stated_, odom_, pose_;
  double factor_[3][3];  // of the stated covariance: lower triangle
  double stated_covariance_[3][3], covariance_[3][3];
  double travelled_m_, turned_rad_, off_;
  wm_time_ns begun_ns_, off_since_ns_, since_ns_;
  bool open_, surely_off_, found_;
};

}  // namespace wm

#endif
