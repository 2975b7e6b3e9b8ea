// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/edge_mcl.hpp"

#include <cstring>

#include "filters/core/contract.hpp"
#include "filters/planar/set_pose.hpp"
#include "filters/registry.h"
#include "math/arc.hpp"
#include "sensors/points.hpp"

namespace wm {
namespace {

constexpr double kShortfall = 0.1, kThrough = 0.05;  // where nothing is known of them yet
constexpr double kSilent_s = 1.0;  // between two messages of the motion sensors, after which the way is unknown
constexpr double kFoundCovariance[6] = {0.02, 0.0, 0.02, 0.0, 0.0, 0.0018};  // of a place that the search found
constexpr size_t kAlign = 64;

constexpr size_t aligned(size_t bytes) { return (bytes + kAlign - 1) & ~(kAlign - 1); }

}  // namespace

size_t edge_mcl::bytes(const wm_edge_mcl_params &, const wm_setup &setup, const char **why) {
  const size_t map = edge_map::bytes_or_reason(setup.map, why);
  if (map == 0) return 0;
  if (setup.rig && setup.rig->camera_count > kCamerasMax) {
    *why = "edge_mcl takes at most 2 cameras";
    return 0;
  }
  return aligned(sizeof(edge_mcl)) + aligned(map) + place_search::bytes(*setup.map) + kAlign;
}

void edge_mcl::init(const wm_edge_mcl_params &params, const wm_setup &setup) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  setup_ = &setup;
  params_ = params;
  const int cameras = setup.rig ? static_cast<int>(setup.rig->camera_count) : 0;
  const int each_camera = (params.pitch_sigma_rad > 0.0) + (params.roll_sigma_rad > 0.0) +
                          (params.yaw_sigma_rad > 0.0) + (params.height_sigma_m > 0.0) +
                          (params.time_offset_sigma_s > 0.0);
  filter_.init(setup, params.motion,
               kPoseStates + planar_filter::count_motion_states(params.motion) + (params.edge_offset_sigma_m > 0.0) +
                   each_camera * cameras);
  const auto add = [this](double sigma) { return sigma > 0.0 ? filter_.add_state(0.0, sigma) : -1; };
  edge_state_ = add(params.edge_offset_sigma_m);
  camera_count_ = setup.rig ? (int)setup.rig->camera_count : 0;
  for (int c = 0; c < camera_count_; c++) {
    camera_[c].init(setup.rig->cameras[c]);
    camera_state_[c][kPitch] = add(params.pitch_sigma_rad);
    camera_state_[c][kRoll] = add(params.roll_sigma_rad);
    camera_state_[c][kCameraYaw] = add(params.yaw_sigma_rad);
    camera_state_[c][kHeight] = add(params.height_sigma_m);
    camera_state_[c][kCameraErrors] = add(params.time_offset_sigma_s);
  }
  uint8_t *behind = reinterpret_cast<uint8_t *>(this) + aligned(sizeof *this);
  map_.init(*setup.map, behind);
  search_.init(map_, behind + aligned(edge_map::bytes(*setup.map)));
  alike_.init(map_);
  usual_ = expected_ = params.lost_explained;
  expected_s_ = 0.0;
  shortfall_ = kShortfall;
  usual_through_ = kThrough;
  fused_ns_ = watched_ns_ = remembered_ns_ = driven_ns_ = WM_TIME_NONE;
  remember_calibration();
  remembered_ns_ = WM_TIME_NONE;
  remember_calibration();
  start_again(start_is_known(setup.start));
}

// `known`: the filter's pose is where the robot is.
void edge_mcl::start_again(bool known) {
  scan_odom_ = filter_.odom();
  search_.clear();
  fused_ns_ = WM_TIME_NONE;
  for (wm_time_ns &t_ns : aligned_ns_) t_ns = WM_TIME_NONE;
  watched_m_ = filter_.travelled_m() + filter_.turned_rad();
  explained_ = params_.lost_explained;
  others_.clear(filter_.pose(), filter_.odom());
  alike_.clear(filter_.odom());
  alike_m_ = filter_.travelled_m();
  at_ease_ = false;
  in_doubt_ = !known;
  swept_ = false;
  on_trial_ = false;
  lost_odds_ = known ? -4.0 : 6.0;
  state_ = known ? WM_STATE_TRACKING : WM_STATE_SEARCHING;
  resets_++;
}

wm_status edge_mcl::predict(const wm_event &motion) {
  const wm_status status = filter_.check_motion(motion);
  if (status != WM_OK) return status;
  const double silent_s = driven_ns_ == WM_TIME_NONE ? 0.0 : wm_seconds_between(driven_ns_, motion.t_ns);
  driven_ns_ = motion.t_ns;
  if (watched_ns_ == WM_TIME_NONE) watched_ns_ = motion.t_ns;
  filter_.move(motion);
  if (silent_s > kSilent_s) doubt_motion();
  return status;
}

wm_status edge_mcl::correct(const wm_event &event, record_list records) {
  switch (event.kind) {
    case WM_EVENT_POINTS: return take_points(event, records);
    case WM_EVENT_SET_POSE:
    case WM_EVENT_RESET: return take_pose(event);
    case WM_EVENT_LOOKED: {
      const wm_status status = filter_.check_time(event.t_ns);
      if (status == WM_OK) filter_.move_to(event.t_ns);
      return status;
    }
    default: return WM_UNSUPPORTED;
  }
}

wm_status edge_mcl::take_pose(const wm_event &event) {
  const bool reset = event.kind == WM_EVENT_RESET;
  const wm_status status = reset ? reset_pose(filter_, setup_->start, event.t_ns) : set_pose(filter_, event);
  if (status == WM_OK) start_again(!reset || start_is_known(setup_->start));
  return status;
}

wm_status edge_mcl::take_points(const wm_event &event, record_list records) {
  const wm_points &points = event.as.points;
  wm_status status = filter_.check_time(event.t_ns);
  if (status == WM_OK) status = check_points(points);
  if (status != WM_OK) return status;
  filter_.move_to(event.t_ns);
  // Of the first scan: since the motion began; 0 where nothing came before it.
  const double dt = watched_ns_ == WM_TIME_NONE ? 0.0 : wm_seconds_between(watched_ns_, event.t_ns);
  watched_ns_ = event.t_ns;

  const int camera = camera_of(points);
  prepare(points, camera);
  scan_odom_ = filter_.odom();
  wm_innovation record{};
  record.t_ns = event.t_ns;
  record.source = event.source;
  record.landmark_id = -1;
  record.residual = WM_RESIDUAL_RANGE;
  normal_equations scan{};
  if (align(points, camera, &scan, &record)) fused_ns_ = event.t_ns;
  watch(scan, dt);
  search_.see(lined_, filter_.odom());
  ponder();
  look_for_lookalikes(dt);
  records.add(record);
  return WM_OK;
}

// Of a recording's points nobody knows the camera; where there is one only, it was that.
int edge_mcl::camera_of(const wm_points &points) const {
  if (points.camera >= 0 && points.camera < camera_count_) return points.camera;
  return points.camera < 0 && camera_count_ == 1 ? 0 : -1;
}

double edge_mcl::point_sigma(const wm_points &points, uint32_t i, int camera) const {
  double own = 0.03;
  if (finite((double)points.sigma_m[i]) && points.sigma_m[i] > 0.0f)
    own = (double)points.sigma_m[i];
  else if (camera >= 0)
    own = camera_[camera].sigma(camera_[camera].range((double)points.x_m[i], (double)points.y_m[i]), params_.pixel_px);
  return own;
}

// The scan as the hypotheses take it: corrected by the camera's calibration, as seen from now's base_link.
void edge_mcl::prepare(const wm_points &points, int camera) {
  const alignment a = alignment_of(camera);
  const taken_from then = look_back(a);
  const sin_cos h = sincos(then.from_now.heading_rad);
  lined_.count = 0;
  const float image = (float)image_counts((int)points.count);
  for (uint32_t i = 0; i < points.count; i++) {
    floor_point p{(double)points.x_m[i], (double)points.y_m[i], {}, {}};
    if (!on_a_line(points, i)) continue;
    if (camera >= 0 && (camera_[camera].range(p.x, p.y) > params_.range_max_m ||
                        !camera_[camera].correct(p.x, p.y, a.value + kAlignCamera, &p)))
      continue;
    const int to = lined_.count++;
    lined_.x_m[to] = (float)(then.from_now.x_m + h.cos * p.x - h.sin * p.y);
    lined_.y_m[to] = (float)(then.from_now.y_m + h.sin * p.x + h.cos * p.y);
    lined_.camera[to] = camera > 0 ? camera : 0;
    lined_.image[to] = image;
    const double ray_x = p.x - (camera >= 0 ? camera_[camera].x_m : 0.0);
    const double ray_y = p.y - (camera >= 0 ? camera_[camera].y_m : 0.0);
    lined_.ray_x_m[to] = (float)(h.cos * ray_x - h.sin * ray_y);
    lined_.ray_y_m[to] = (float)(h.sin * ray_x + h.cos * ray_y);
    for (int k = 0; k < kSlackErrors; k++) {
      const int state = camera >= 0 ? camera_state_[camera][kSlackError[k]] : -1;
      const double sigma = state >= 0 ? std::sqrt(filter_.variance(state)) : 0.0;
      lined_.x_by[k][to] = (float)(sigma * (h.cos * p.x_by[kSlackError[k]] - h.sin * p.y_by[kSlackError[k]]));
      lined_.y_by[k][to] = (float)(sigma * (h.sin * p.x_by[kSlackError[k]] + h.cos * p.y_by[kSlackError[k]]));
    }
  }
}

double edge_mcl::image_counts(int seen) const {
  return seen > 0 ? params_.lost_false_points / (seen + params_.lost_false_points) : 0.0;
}

double edge_mcl::can_be_edges(int seen) const { return seen > 0 ? seen / (seen + params_.lost_false_points) : 0.0; }

void edge_mcl::estimate(wm_estimate *out) const {
  filter_.estimate(out);
  out->resets = resets_;
  const bool fresh =
      fused_ns_ != WM_TIME_NONE && wm_seconds_between(fused_ns_, filter_.now_ns()) <= params_.dead_reckoning_after_s;
  out->state = state_ == WM_STATE_TRACKING && !fresh ? (uint8_t)WM_STATE_DEAD_RECKONING : state_;
  out->lost_probability = state_ == WM_STATE_SEARCHING ? 1.0 : 1.0 / (1.0 + exp(-odds_lost()));
  if (state_ != WM_STATE_SEARCHING) spread_over_hypotheses(out);
  if (fused_ns_ == WM_TIME_NONE) return;  // the pose is what was said, as sure as it was said
  out->covariance[wm_cov_index(0, 0)] += square(params_.lasting_xy_m);
  out->covariance[wm_cov_index(1, 1)] += square(params_.lasting_xy_m);
  out->covariance[wm_cov_index(5, 5)] += square(params_.lasting_heading_rad);
}

size_t edge_mcl::list_calibration(wm_calibration_value *out, size_t capacity) const {
  static constexpr const char *kNames[kCameraErrors + 1] = {"pitch_rad", "roll_rad", "yaw_rad", "height_m",
                                                            "time_offset_s"};
  calibration_list list(out, capacity);
  filter_.list_motion_states(&list);
  for (int c = 0; c < camera_count_; c++)
    for (int k = 0; k <= kCameraErrors; k++) {
      const int state = camera_state_[c][k];
      if (state >= 0)
        list.add(setup_->rig->cameras[c].name, kNames[k], filter_.value(state), std::sqrt(filter_.variance(state)));
    }
  if (edge_state_ >= 0)
    list.add("edges", "offset_m", filter_.value(edge_state_), std::sqrt(filter_.variance(edge_state_)));
  return list.count();
}

size_t edge_mcl::list_counters(wm_counter *out, size_t capacity) const {
  counter_list list(out, capacity);
  list.add(WM_COUNTER_MOTION_OUTLIERS, filter_.motion_outliers());
  list.add(WM_COUNTER_RELOCALIZATIONS, relocalizations_);
  list.add(WM_COUNTER_ALIASED_POSES, (uint64_t)alike_.count());
  list.add(WM_COUNTER_EXPLAINED_PERMILLE, (uint64_t)(1000.0 * explained_ + 0.5));
  return list.count();
}

// Of what speaks for the filter's own place, those that look the same have their part.
size_t edge_mcl::list_hypotheses(wm_hypothesis *out, size_t capacity) const {
  const wm_pose2 since = between(scan_odom_, filter_.odom());
  size_t count = 0;
  const auto list = [&](const wm_pose2 &at, const double(&covariance)[6], double weight) {
    if (count++ >= capacity) return;
    const wm_pose2 pose = compose(at, since);
    out[count - 1] = {pose.x_m, pose.y_m, pose.heading_rad, {}, weight};
    for (int k = 0; k < 6; k++) out[count - 1].covariance[k] = covariance[k];
  };
  for (int i = 1; i < others_.count(); i++)
    if (others_[i].weighed) list(others_[i].pose, kFoundCovariance, others_[i].share);
  const double each = others_[0].share / (1.0 + alike_.odds());
  for (int i = 0; i < alike_.count(); i++) list(alike_[i].pose, alike_[i].covariance, each * alike_[i].weight);
  return count;
}

}  // namespace wm

const wm_estimator wm_edge_mcl_estimator = wm::estimator_of<wm::edge_mcl, wm_edge_mcl_params>(
    "edge_mcl",
    "Kalman filter that aligns edges on the floor with a raster map's lines, calibrates cameras and motion sensors, "
    "and "
    "finds the pose when lost.",
    WM_EVENT_BIT(WM_EVENT_POINTS) | WM_EVENT_BIT(WM_EVENT_LOOKED) | WM_EVENT_BIT(WM_EVENT_SET_POSE) |
        WM_EVENT_BIT(WM_EVENT_RESET),
    wm_edge_mcl_params_table);
