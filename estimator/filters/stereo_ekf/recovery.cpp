// SPDX-License-Identifier: Apache-2.0
// Start, set_pose, evidence about the pose, and relocalization.
#include <limits>

#include "filters/core/recovery.hpp"
#include "filters/stereo_ekf/stereo_ekf.hpp"
#include "sensors/validation.hpp"

namespace wm {
namespace {

constexpr double kDefaultSigma = 0.05;  // m and rad, of a start without sigmas
// A found pose is taken when the consensus is at least so certain. Not swept.
constexpr double kFoundSigma_m = 0.5, kFoundSigma_rad = 0.25;
// A start less certain than this is no point of linearisation; it is found by the map. Not swept.
constexpr double kVague_m = 1.0, kVague_rad = 0.4;

double given(double sigma) { return finite(sigma) ? sigma : kDefaultSigma; }

}  // namespace

void stereo_ekf::set_pose(const pose3 &pose, double sigma_m, double sigma_rad) {
  forget_points();
  double covariance[6][6] = {};
  for (int i = 0; i < 3; i++) {
    covariance[i][i] = square(sigma_m);
    covariance[3 + i][3 + i] = square(sigma_rad);
  }
  filter_.set_pose(pose, covariance);
}

// Start, reset, or a pose from outside.
void stereo_ekf::begin_pose(bool known, double log_odds_wrong) {
  life_.begin(known);
  evidence_.begin(log_odds_wrong);
  observations_.clear();
  remembered_.begin(filter_, filter_.calibration_begin(), filter_.calibration_end());
}

// An unknown height is 0; unknown roll and pitch are level.
void stereo_ekf::start_pose() {
  const wm_start &start = setup_->start;
  const bool place = finite(start.p_m[0]) && finite(start.p_m[1]);
  const bool quaternion =
      finite(start.q_xyzw[0]) && finite(start.q_xyzw[1]) && finite(start.q_xyzw[2]) && finite(start.q_xyzw[3]);
  const bool turn = quaternion || finite(start.heading_rad);
  pose3 pose = {{0, 0, 0}, kNoTurn};
  if (place) pose.p = {start.p_m[0], start.p_m[1], finite(start.p_m[2]) ? start.p_m[2] : 0.0};
  if (quaternion)
    pose.q = quat_of(start.q_xyzw);
  else if (turn)
    pose.q = turn_by({0, 0, start.heading_rad});
  const double sigma_m = given(start.sigma_xy_m), sigma_rad = given(start.sigma_heading_rad);
  const bool findable = params_.recover && rig_.there && (setup_->landmark_count >= 3 || map_.frames() > 0);
  const bool vague = findable && (sigma_m > kVague_m || sigma_rad > kVague_rad);
  set_pose(pose, place ? sigma_m : kUnknownPlace_m, turn ? sigma_rad : kUnknownTurn_rad);
  begin_pose(place && turn && !vague, kStartWrong);
}

wm_status stereo_ekf::take_pose(const wm_event &event) {
  const wm_set_pose &s = event.as.set_pose;
  const wm_status status = event.kind == WM_EVENT_SET_POSE ? check_set_pose(s, 3) : WM_OK;
  if (status != WM_OK) return status;
  if (const wm_status bad = check_time(event.t_ns); bad != WM_OK) return bad;
  move_to(event.t_ns);
  if (event.kind == WM_EVENT_RESET) {
    forget_map();
    filter_.restart_head();
    start_pose();
    return WM_OK;
  }
  set_pose({vec_of(s.pose_map_base.p_m), quat_of(s.pose_map_base.q_xyzw)}, s.sigma_xy_m, s.sigma_heading_rad);
  begin_pose(true, kStartWrong);
  return WM_OK;
}

void stereo_ekf::buffer_observation(const wm_stereo &seen, const wm_landmark &landmark, wm_time_ns t_ns) {
  const double px[4] = {seen.left_px[0], seen.left_px[1], seen.right_px[0], seen.right_px[1]};
  vec3 x;
  double by[3][4];
  if (!params_.recover || std::isnan(px[0]) || std::isnan(px[2])) return;
  if (!rig().triangulate(px, kDisparityLeast_px, &x, by)) return;
  double variance = square(finite(landmark.sigma_m) ? landmark.sigma_m : 0.0) +
                    square(setup_->sightings->map_sigma_min_m) + square(params_.camera_rotation_sigma * length(x)) +
                    square(params_.camera_place_sigma);
  for (const auto &row : by)
    for (int k = 0; k < 4; k++) variance += square(row[k] * sigma_px_[k]);
  const vec3 in_body = rig_.place + rig_.R_base_optical * x;
  const pose3 &odom = odometry_.pose;
  observations_.add({t_ns, landmark.id, odom.p + matrix_of(odom.q) * in_body, vec_of(landmark.p_m), std::sqrt(variance),
                     odometry_.travelled_m, odometry_.turned_rad});
}

// Evidence about the pose from one observation: its joint density, by the rows' innovations one after the other.
void stereo_ekf::note(wm_time_ns t_ns, int key, const row_verdict &result, double clutter_volume,
                      landmark_record *record) {
  if (!params_.recover || result.verdict == WM_REJECTED_NUMERIC) return;
  double nis = 0.0, determinant = 1.0;
  for (int k = 0; k < result.rows; k++) {
    nis += result.nis[k];
    determinant *= kTwoPi * result.variance[k];
  }
  const double log_bayes =
      result.fused ? landmark_evidence::log_bayes_factor(exp(-0.5 * nis) / std::sqrt(determinant), clutter_volume)
                   : landmark_evidence::max_log_bayes_factor();
  const double no_angle = std::numeric_limits<double>::quiet_NaN();
  evidence_.note(t_ns, key, log_bayes, no_angle, 0.0, record);
  if (life_.tracking() && evidence_.contradicted()) life_.lose(t_ns);
  if (life_.tracking() && evidence_.fits()) remembered_.remember(filter_, t_ns);
  if (life_.lost())
    recover_pose(&life_, evidence_, &filter_, t_ns, kWindow_s, [this](wm_time_ns since_ns) { search(since_ns); });
}

void stereo_ekf::search(wm_time_ns since_ns) {
  if (!params_.recover || !life_.search_due(now_ns_)) return;
  const pose_found found = observations_.find(since_ns, odometry_, kFoundSigma_m, kFoundSigma_rad, setup_->seed);
  if (found.searched) life_.searched(now_ns_);
  if (!found.found) return;
  forget_points();
  filter_.set_pose(found.pose, found.covariance);
  remembered_.restore(&filter_);
  filter_.restart_transient();
  evidence_.begin(kFoundWrong);
  life_.relocalized(now_ns_);
}

}  // namespace wm
