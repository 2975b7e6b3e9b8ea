// SPDX-License-Identifier: Apache-2.0
// Is the robot where the filter says? And if not, where?
#include "filters/edge_mcl/edge_mcl.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kOddsMax = 7.0;
constexpr double kLostOdds = 1.0, kFoundOdds = -2.0;
constexpr double kApart_m = 0.3, kApart_rad = 0.15, kApart_s = 1.0;
constexpr double kFoundSigma_m = 0.1, kFoundSigma_rad = 0.03;

}  // namespace

// The odds of being lost: each scan speaks by the share of its points that the map explains from the pose, scans of one
// moment together no more than once; and out of the blue somebody lifts the robot.
void edge_mcl::watch(double explained, int seen, double dt_s) {
  if (seen < 8) return;
  const double fresh = dt_s > 0.5 ? 1.0 : dt_s / 0.5;
  explained_ += fresh * (explained - explained_);
  double said = params_.lost_gain * (params_.lost_explained - explained) * fresh;
  lost_odds_ += said;
  // p := p + (1 - p) rate dt
  const double p = 1.0 / (1.0 + exp(-lost_odds_)), blue = p + (1.0 - p) * params_.lost_per_s * dt_s;
  lost_odds_ = log(blue / (1.0 - blue));
  if (!(lost_odds_ < kOddsMax)) lost_odds_ = kOddsMax;
  if (!(lost_odds_ > -kOddsMax)) lost_odds_ = -kOddsMax;
  if (state_ == WM_STATE_TRACKING && lost_odds_ > kLostOdds) {
    state_ = WM_STATE_LOST;
    search_.clear();
  } else if (state_ != WM_STATE_TRACKING && lost_odds_ < kFoundOdds) {
    state_ = WM_STATE_TRACKING;
    apart_s_ = 0.0;
  }
  if (state_ != WM_STATE_TRACKING) {
    const double grow = dt_s > 1.0 ? 1.0 : dt_s;
    if (filter_.variance(kX) < 1e4) filter_.inflate_pose(0.05 * grow, 0.002 * grow);
  }
}

// The cloud's main cluster is elsewhere, and has been for a while: it has the better reasons.
void edge_mcl::heed_cloud() {
  const int best = cloud_.best();
  const wm_pose2 centre = {cloud_.x(best), cloud_.y(best), cloud_.heading(best)};
  const cloud_moments m = cloud_.moments_near(centre, kApart_m, kApart_rad);
  const wm_pose2 pose = filter_.pose(), way = between(pose, m.mean);
  const bool apart = square(way.x_m) + square(way.y_m) > square(kApart_m) || std::fabs(way.heading_rad) > kApart_rad;
  const sin_cos h = sincos(pose.heading_rad), hm = sincos(m.mean.heading_rad);
  if (!apart || m.share < 0.7 ||
      score(map_, scan_, table_, m.mean.x_m, m.mean.y_m, hm.cos, hm.sin) <=
          score(map_, scan_, table_, pose.x_m, pose.y_m, h.cos, h.sin)) {
    apart_s_ = 0.0;
    if (apart && cloud_.effective() < cloud_.count()) {
      // It went astray and the filter explains the scan better: a tenth of it comes back each time.
      double covariance[3][3];
      for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) covariance[r][c] = filter_.covariance(r, c);
      cloud_.spread_some(0, cloud_.count() / 10, pose, covariance);
    }
    return;
  }
  apart_s_ += 0.1;
  if (apart_s_ < kApart_s) return;
  filter_.set_pose(m.mean, m.covariance);
  apart_s_ = 0.0;
  resets_++;
}

void edge_mcl::search() {
  if (!search_.step(map_, params_.search_poses, filter_.odom())) return;
  int count;
  const place *places = search_.places(&count);
  if (count == 0 || search_.way_m() < params_.search_way_m) return;
  const double second = count > 1 ? places[1].explained : 0.0;
  if (places[0].explained < params_.search_explained || places[0].explained - second < params_.search_margin) return;
  take_place(places[0]);
}

void edge_mcl::take_place(const place &p) {
  const wm_pose2 pose = compose(p.pose, between(search_.odom_of_places(), filter_.odom()));
  const double covariance[3][3] = {
      {square(kFoundSigma_m), 0, 0}, {0, square(kFoundSigma_m), 0}, {0, 0, square(kFoundSigma_rad)}};
  const wm_pose2 here = filter_.pose();
  const wm_pose2 way = between(here, pose);
  // Where it was all along: the scan speaks for itself.
  if (square(way.x_m) + square(way.y_m) < square(kApart_m) && std::fabs(way.heading_rad) < kApart_rad) return;
  filter_.set_pose(pose, covariance);
  cloud_.spread(pose, covariance);
  lost_odds_ = 0.0;
  resets_++;
}

}  // namespace wm
