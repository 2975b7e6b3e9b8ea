// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/odometry_check.hpp"

#include "math/arc.hpp"
#include "math/elementary.hpp"

namespace wm {
namespace {

// Sigma of calibrated odometry's position, per way and axis, besides what the heading at its beginning leaves open. Of
// corridor-a and flats, 1 % is three times what was seen; 1.5 % detects the same.
constexpr double kOdometryError = 0.01;
// Sigma of a position that scans or odometry put wrong, and the prior probability of that: furniture along walls is
// 0.1 m to 0.6 m deep, and one drive of three passes some. 0.1 misses errors of the map of 0.1 m more often.
constexpr double kWrong_m = 0.1, kWrongProbability = 0.3;
constexpr double kHalf = 0.5;  // probability that the scans are wrong, given that scans or odometry are

}  // namespace

void odometry_check::clear() {
  seen_ = 0;
  for (double &c : covariance_) c = 0.0;
}

// The difference d of both displacements is N(0, s2) where they agree and N(0, s2 + kWrong^2) where one is wrong. The
// error is then the share g = kWrong^2 / (s2 + kWrong^2) of d in the mean: a pose that was open before, and is
// corrected by as much, is not wrong by it. With the latter's probability p the pose's second moment grows by
// p / 2 g^2 d d'. Odometry has the scale of `then`: a wrong wall draws the scale after the pose, and by the later one
// they agree.
void odometry_check::compare(const odometry_anchor &then, const odometry_anchor &now) {
  wm_pose2 way = between(then.odom, now.odom);
  const double stretch = 2.0 * then.scale / (then.scale + now.scale);  // from the mean scale of the way
  way.x_m *= stretch;
  way.y_m *= stretch;
  const wm_pose2 by_odometry = compose(then.pose, way);
  double dx = now.pose.x_m - by_odometry.x_m, dy = now.pose.y_m - by_odometry.y_m;
  const double d2 = square(dx) + square(dy), way2 = square(now.way_m - then.way_m);
  const double agreed =
      then.position_m2 + now.position_m2 + (square(kOdometryError) + then.heading_rad2 + then.scale_variance) * way2;
  const double wrong = agreed + square(kWrong_m);
  // Two dimensions: the ratio of the densities' heights is that of the variances.
  const double log_odds = log(kWrongProbability / (1.0 - kWrongProbability)) - log(wrong / agreed) +
                          0.5 * d2 * (1.0 / agreed - 1.0 / wrong);
  const double share = kHalf / (1.0 + exp(-log_odds));
  const double gain = square(kWrong_m) / wrong;
  if (!(share * square(gain) * d2 > largest_m2_)) return;
  largest_m2_ = share * square(gain) * d2;
  dx *= gain;
  dy *= gain;
  covariance_[0] = share * dx * dx;
  covariance_[1] = share * dx * dy;
  covariance_[2] = share * dy * dy;
}

void odometry_check::add(const odometry_anchor &now) {
  for (double &c : covariance_) c = 0.0;
  largest_m2_ = 0.0;
  for (uint64_t back = 2; back <= seen_ && back <= kAnchors; back *= 2)
    compare(anchors_[(seen_ - back) % kAnchors], now);
  if (seen_ == 0 || now.way_m - anchors_[(seen_ - 1) % kAnchors].way_m >= kStep_m) anchors_[seen_++ % kAnchors] = now;
}

}  // namespace wm
