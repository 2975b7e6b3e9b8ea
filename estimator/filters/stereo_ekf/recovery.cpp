// SPDX-License-Identifier: Apache-2.0
// Start, set_pose, lost and found.
#include "filters/stereo_ekf/stereo_ekf.hpp"

namespace wm {
namespace {

constexpr double kSearchEvery_s = 0.1;
constexpr double kSayLost_s = 0.1;  // lost is lost for at least so long: whoever listens must hear it
constexpr double kInflateAfter_s = 3.0;
constexpr double kInflateEvery_s = 1.0;
constexpr double kInflate_m = 0.5, kInflate_rad = 0.2;
constexpr double kInflateUpTo_m = 30.0;
constexpr double kDefaultSigma = 0.05;
// A found pose is taken when the consensus is at least so certain. Not swept.
constexpr double kFoundSigma_m = 0.5, kFoundSigma_rad = 0.25;
// A start less sure than this is no point to take derivatives about, where the map can tell better.
constexpr double kVague_m = 1.0, kVague_rad = 0.4;

double given(double sigma) { return finite(sigma) ? sigma : kDefaultSigma; }

}  // namespace

void stereo_ekf::set_pose(const pose3 &pose, double sigma_m, double sigma_rad) {
  double covariance[6][6] = {};
  for (int i = 0; i < 3; i++) {
    covariance[i][i] = square(sigma_m);
    covariance[3 + i][3 + i] = square(sigma_rad);
  }
  filter_.set_pose(pose, covariance);
}

// What isn't given of the height is 0, of roll and pitch level.
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
  const bool findable = params_.recover && rig_.there && setup_->landmark_count >= 3;
  const bool vague = findable && (sigma_m > kVague_m || sigma_rad > kVague_rad);
  set_pose(pose, place ? sigma_m : kUnknownPlace_m, turn ? sigma_rad : kUnknownTurn_rad);
  monitor_.clear();
  observations_.clear();
  resets_++;
  state_ = place && turn && !vague ? WM_STATE_TRACKING : WM_STATE_SEARCHING;
}

wm_status stereo_ekf::take_pose(const wm_event &event) {
  wm_status status = WM_OK;
  const wm_set_pose &s = event.as.set_pose;
  const double *p = s.pose_map_base.p_m, *q = s.pose_map_base.q_xyzw;
  if (event.kind == WM_EVENT_SET_POSE) {
    const double size = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const vec3 place = vec_of(p);
    if (!finite(place) || !finite(size) || !finite(s.sigma_xy_m) || !finite(s.sigma_heading_rad)) return WM_NOT_FINITE;
    if (std::fabs(p[0]) > 1e7 || std::fabs(p[1]) > 1e7 || std::fabs(p[2]) > 1e7 || std::fabs(size - 1.0) > 0.01 ||
        !(s.sigma_xy_m > 0.0 && s.sigma_xy_m <= 1e7) || !(s.sigma_heading_rad > 0.0 && s.sigma_heading_rad < 10.0))
      return WM_OUT_OF_RANGE;
  }
  status = check_time(event.t_ns);
  if (status != WM_OK) return status;
  move_to(event.t_ns);
  if (event.kind == WM_EVENT_RESET) {
    filter_.restart_head();
    start_pose();
    return WM_OK;
  }
  set_pose({vec_of(p), quat_of(q)}, s.sigma_xy_m, s.sigma_heading_rad);
  monitor_.clear();
  observations_.clear();
  resets_++;
  state_ = WM_STATE_TRACKING;
  return WM_OK;
}

void stereo_ekf::buffer_observation(const wm_stereo &seen, const wm_landmark &landmark, wm_time_ns t_ns) {
  const double px[4] = {seen.left_px[0], seen.left_px[1], seen.right_px[0], seen.right_px[1]};
  vec3 x;
  double by[3][4];
  if (!params_.recover || std::isnan(px[0]) || std::isnan(px[2])) return;
  if (!rig_.triangulate(px, params_.disparity_min_px, &x, by)) return;
  double variance = square(landmark.sigma_m) + square(params_.map_min_m) +
                    square(params_.camera_rotation_sigma * length(x)) + square(params_.camera_place_sigma);
  for (const auto &row : by)
    for (int k = 0; k < 4; k++) variance += square(row[k] * sigma_px_[k]);
  const vec3 in_body = rig_.place + rig_.R_base_optical * x;
  const pose3 &odom = odometry_.pose;
  observations_.add({t_ns, landmark.id, odom.p + matrix_of(odom.q) * in_body, vec_of(landmark.p_m), std::sqrt(variance),
                     odometry_.travelled_m, odometry_.turned_rad});
}

void stereo_ekf::note(wm_time_ns t_ns, int key, const row_verdict &result) {
  if (!params_.recover) return;
  const double misfit = !result.fused ? 1.0 : result.doubtful ? 0.8 : 0.0;
  monitor_.note(t_ns, key, misfit);
  if (state_ == WM_STATE_TRACKING && monitor_.contradicted(t_ns)) {
    state_ = WM_STATE_LOST;
    lost_ns_ = inflated_ns_ = t_ns;
  }
  if (state_ != WM_STATE_LOST) return;
  if (monitor_.fits()) {
    state_ = WM_STATE_TRACKING;
    return;
  }
  if (wm_seconds_between(lost_ns_, t_ns) < kSayLost_s) return;
  const wm_time_ns window = t_ns - wm_ns_from_seconds(kWindow_s);
  const wm_time_ns bad_since = monitor_.bad_since_ns();
  search(bad_since > window ? bad_since : window);
  if (state_ != WM_STATE_LOST || wm_seconds_between(lost_ns_, t_ns) < kInflateAfter_s) return;
  // Nothing found: the gates open step by step, so that nothing is refused for ever.
  if (wm_seconds_between(inflated_ns_, t_ns) >= kInflateEvery_s && filter_.variance(kPlace) < square(kInflateUpTo_m)) {
    filter_.inflate_pose(square(kInflate_m), square(kInflate_rad));
    inflated_ns_ = t_ns;
  }
}

void stereo_ekf::search(wm_time_ns since_ns) {
  if (!params_.recover) return;
  if (searched_ns_ != WM_TIME_NONE && wm_seconds_between(searched_ns_, now_ns_) < kSearchEvery_s) return;
  searched_ns_ = now_ns_;
  const pose_found found = observations_.find(since_ns, odometry_, kFoundSigma_m, kFoundSigma_rad, setup_->seed);
  if (!found.found) return;
  filter_.restart_head();
  filter_.set_pose(found.pose, found.covariance);
  monitor_.clear();
  resets_++;
  fused_ns_ = now_ns_;
  state_ = WM_STATE_TRACKING;
}

}  // namespace wm
