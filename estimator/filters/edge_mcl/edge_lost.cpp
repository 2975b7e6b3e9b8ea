// SPDX-License-Identifier: Apache-2.0
// Is the robot where the filter says? And if not, where?
#include "filters/edge_mcl/edge_mcl.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kOddsMax = 7.0;
constexpr double kLostOdds = 1.0, kFoundOdds = -2.0, kTrustedOdds = -3.0, kMemory_s = 2.0, kUsual_s = 10.0;
constexpr double kApart_m = 0.3, kApart_rad = 0.15, kApart_s = 1.0;
constexpr double kFoundSigma_m = 0.1, kFoundSigma_rad = 0.03;
constexpr double kCluster_m = 0.6, kCluster_rad = 0.3, kProof_m = 1.5, kBetter = 0.15;

bool near(const wm_pose2 &a, const wm_pose2 &b) {
  const wm_pose2 way = between(a, b);
  return square(way.x_m) + square(way.y_m) < square(kApart_m) && std::fabs(way.heading_rad) < kApart_rad;
}

}  // namespace

// The odds of being lost: each scan speaks by the share of its points that the map explains from the pose, scans of one
// moment together no more than once; and out of the blue somebody lifts the robot.
void edge_mcl::watch(double explained, int seen, double dt_s) {
  if (seen < 8) return;
  const double fresh = dt_s > 0.5 ? 1.0 : dt_s / 0.5;
  explained_ += fresh * (explained - explained_);
  // Places differ in how much of them a map explains: what is usual here sets the bar.
  const double relative = params_.lost_relative * usual_;
  const double bar = relative > params_.lost_explained ? relative : params_.lost_explained;
  const double said = params_.lost_gain * (bar - explained) * fresh;
  lost_odds_ += said;
  // p := p + (1 - p) rate dt
  const double p = 1.0 / (1.0 + exp(-lost_odds_)), blue = p + (1.0 - p) * params_.lost_per_s * dt_s;
  lost_odds_ = log(blue / (1.0 - blue));
  if (!(lost_odds_ < kOddsMax)) lost_odds_ = kOddsMax;
  if (!(lost_odds_ > -kOddsMax)) lost_odds_ = -kOddsMax;
  if (state_ == WM_STATE_TRACKING && lost_odds_ > kLostOdds) {
    state_ = WM_STATE_LOST;
    restore_calibration();
    search_.clear();
    seeded_m_ = -1.0;
  } else if (on_trial_ && lost_odds_ > kLostOdds) {
    on_trial_ = false;
    search_.clear();
  } else if (state_ != WM_STATE_TRACKING && lost_odds_ < kFoundOdds) {
    state_ = WM_STATE_TRACKING;
    apart_s_ = 0.0;
  }
  if (state_ == WM_STATE_TRACKING && lost_odds_ < kTrustedOdds) {
    remember_calibration();
    usual_ += dt_s / kUsual_s * (explained - usual_);
  }
  if (state_ != WM_STATE_TRACKING) {
    const double grow = dt_s > 1.0 ? 1.0 : dt_s;
    if (filter_.variance(kX) < 1e4) filter_.inflate_pose(0.05 * grow, 0.002 * grow);
  }
}

void edge_mcl::remember_calibration() {
  const wm_time_ns now = filter_.now_ns();
  if (remembered_ns_ != WM_TIME_NONE && wm_seconds_between(remembered_ns_, now) < kMemory_s) return;
  remembered_ns_ = now;
  memory_[0] = memory_[1];
  for (int i = kPoseStates; i < filter_.states(); i++) {
    memory_[1].value[i] = filter_.value(i);
    memory_[1].variance[i] = filter_.variance(i);
  }
}

void edge_mcl::restore_calibration() {
  for (int i = kPoseStates; i < filter_.states(); i++) filter_.forget(i, memory_[0].value[i], memory_[0].variance[i]);
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

// Lost: sweeps over the map bring places, the cloud carries them on and weighs them until one is left.
void edge_mcl::search() {
  if (lost_odds_ <= kLostOdds) return;  // a place was taken, and is on trial
  if (search_.way_m() >= params_.search_way_m && search_.step(map_, params_.search_poses, filter_.odom())) seed_cloud();
  if (seeded_m_ < 0.0 || filter_.travelled_m() - seeded_m_ < kProof_m) return;
  const int best = cloud_.best();
  const cloud_moments m =
      cloud_.moments_near({cloud_.x(best), cloud_.y(best), cloud_.heading(best)}, kCluster_m, kCluster_rad);
  if (m.share < params_.search_share) return;
  // It must explain the scans of the last metres, and better than where the filter has stayed.
  wm_pose2 pose = m.mean, stayed = filter_.pose();
  const double here = search_.explained(map_, filter_.odom(), &stayed);
  const double there = search_.explained(map_, filter_.odom(), &pose);
  if (there < params_.search_explained || (there < here + kBetter && !near(stayed, pose))) return;
  take_place(pose);
}

// Half of the particles, those that weigh least, go to the places found.
void edge_mcl::seed_cloud() {
  int count;
  const place *places = search_.places(&count);
  if (count == 0) return;
  const wm_pose2 since = between(search_.odom_of_places(), filter_.odom());
  const double covariance[3][3] = {
      {square(kFoundSigma_m), 0, 0}, {0, square(kFoundSigma_m), 0}, {0, 0, square(kFoundSigma_rad)}};
  const bool first = seeded_m_ < 0.0;
  cloud_.resample();
  // Where the filter has stayed is one of them.
  const int from = first ? 0 : cloud_.count() / 2, each = (cloud_.count() - from + count) / (count + 1);
  for (int i = 0; i <= count; i++) {
    const int begin = from + i * each, end = begin + each < cloud_.count() ? begin + each : cloud_.count();
    const wm_pose2 pose = i < count ? compose(places[i].pose, since) : filter_.pose();
    if (begin < end) cloud_.spread_some(begin, end, pose, covariance);
  }
  if (first) seeded_m_ = filter_.travelled_m();
}

void edge_mcl::take_place(const wm_pose2 &pose) {
  const double covariance[3][3] = {
      {square(kFoundSigma_m), 0, 0}, {0, square(kFoundSigma_m), 0}, {0, 0, square(kFoundSigma_rad)}};
  seeded_m_ = -1.0;
  lost_odds_ = 0.0;
  on_trial_ = true;
  const bool same = near(filter_.pose(), pose);
  filter_.set_pose(pose, covariance);
  cloud_.spread(pose, covariance);
  if (!same) resets_++;
}

}  // namespace wm
