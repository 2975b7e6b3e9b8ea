// SPDX-License-Identifier: Apache-2.0
// Initial-pose hypothesis test: is a stated pose right, or is a landmark not where the map has it? The first
// observations are explained by each hypothesis and compared by their marginal likelihoods:
//   right      the start and all landmarks are as stated,
//   wrong      the start is off by metres, the landmarks are right,
//   moved k    the start is right, landmark k is off by metres.
// All are one model: bearings from the start, carried on by odometry. Its unknowns are errors that are constant in time
// (of the pose, of each landmark, of each sensor's yaw) with known variances, and a share of the detections is false. A
// hypothesis is a larger variance of one unknown, which costs likelihood by itself (Occam's factor). The marginal
// likelihood is Laplace's: Gauss-Newton to the most likely unknowns, then the determinant there [MacKay2003].
//
// A pose found by relocalization is tested alike. It may be anywhere near, so that the hypotheses are "right" and
// "moved k". "Wrong" then means: the pose is another one, because landmark k, by which it was found, has moved.
#ifndef WAYMARK_ESTIMATOR_START_HYPOTHESES_HPP
#define WAYMARK_ESTIMATOR_START_HYPOTHESES_HPP

#include "filters/relocalize/pose_search.hpp"

namespace wm {

struct start_problem;

class start_hypotheses {
 public:
  // A pose that was stated: base_link in map, its covariance, and odometry at that time.
  void begin(const wm_pose2 &pose, const double covariance[3][3], const travelled_pose2 &odometry);
  // A pose that was found by observations since `since_ns`.
  void begin_found(const wm_pose2 &pose, const double covariance[3][3], const travelled_pose2 &odometry,
                   wm_time_ns since_ns);
  void close() { open_ = false; }
  // Odometry still relates the start to the observations.
  bool open() const { return open_; }

  // Further sigmas of errors that are constant in time: of each sensor's yaw, of each landmark's bearing, and of its
  // place across the line of sight.
  struct constant_errors {
    double yaw_rad, bearing_rad, lateral_m;
  };
  // Tests by all bearings since begin() or `since_ns`; `pose` is the filter's, now. Cost: at most 14 hypotheses of 31
  // unknowns over 64 bearings.
  void test(const pose_search &observations, const constant_errors &sigma, const wm_pose2 &pose,
            const travelled_pose2 &odometry, wm_time_ns t_ns);

  // Probability of "wrong"; 0 before the first test and after the last.
  double wrong_probability() const { return open_ ? wrong_ : 0.0; }
  // "Wrong" is accepted, and so is pose().
  bool rejected() const { return open_ && rejected_; }
  // base_link in map under "wrong", at the last test.
  const wm_pose2 &pose() const { return pose_; }
  const double (&covariance() const)[3][3] { return covariance_; }

 private:
  struct posterior;
  bool explain_all(const start_problem &all, const wm_pose2 &filter_start, posterior *out) const;
  bool accepts_wrong(const start_problem &all, const posterior &p);

  wm_pose2 stated_, pose_;
  travelled_pose2 odometry_;  // at the start
  double factor_[3][3];       // of the stated covariance: lower triangle
  double stated_covariance_[3][3], covariance_[3][3];
  double wrong_;
  wm_time_ns begun_ns_, accepted_since_ns_, since_ns_;
  bool open_, rejected_, found_;
};

}  // namespace wm

#endif
