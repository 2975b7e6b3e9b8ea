// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/edge_mcl.hpp"

#include <cstring>

#include "filters/core/contract.hpp"
#include "filters/planar/set_pose.hpp"
#include "filters/registry.h"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr double kClassSigma_m[kSigmaClasses] = {0.01, 0.03, 0.06, 0.12};  // of a point; the last: and above
constexpr double kNewView_m = 0.4;
constexpr double kFarthest_m = 1000.0;
constexpr double kShortfall = 0.1, kThrough = 0.05;  // where nothing is known of them yet
constexpr double kSilent_s = 1.0;  // between two messages of the motion sensors, after which the way is unknown
constexpr double kCluster_m = 0.5, kCluster_rad = 0.35;
constexpr double kFoundCovariance[6] = {0.02, 0.0, 0.02, 0.0, 0.0, 0.0018};  // of a place that the search found
constexpr size_t kAlign = 64;

constexpr size_t aligned(size_t bytes) { return (bytes + kAlign - 1) & ~(kAlign - 1); }

}  // namespace

size_t edge_mcl::bytes(const wm_edge_mcl_params &params, const wm_setup &setup, const char **why) {
  if (!setup.map) {
    *why = "there is no map: put map/map.yaml into the recording's folder, or name one by `map:`";
    return 0;
  }
  if (!setup.map->edges) {
    *why = "the map has no layer `edges`; `waymark map make` makes one of a floor plan";
    return 0;
  }
  const size_t map = edge_map::bytes(*setup.map);
  if (map == 0) {
    *why = "the map is too large: at most 32768 pixels along an edge, and 2 gigapixels within 0.6 m of edges";
    return 0;
  }
  if (setup.rig && setup.rig->camera_count > kCamerasMax) {
    *why = "edge_mcl takes at most 2 cameras";
    return 0;
  }
  return aligned(sizeof(edge_mcl)) + aligned(cloud::bytes(params.particles)) + aligned(map) +
         aligned(score_field::bytes(*setup.map)) + place_search::bytes(*setup.map) + kAlign;
}

void edge_mcl::init(const wm_edge_mcl_params &params, const wm_setup &setup) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  setup_ = &setup;
  params_ = params;
  filter_.init(setup, params.motion);
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
  cloud_.init(params.particles, setup.seed, behind);
  behind += aligned(cloud::bytes(params.particles));
  map_.init(*setup.map, behind);
  double sigma[kSigmaClasses];
  for (int k = 0; k < kSigmaClasses; k++) sigma[k] = std::sqrt(square(params.sigma_m) + square(kClassSigma_m[k]));
  make_score_table(map_, sigma, params.floor, params.weight == EDGE_MCL_SUM, &table_);
  behind += aligned(edge_map::bytes(*setup.map));
  field_.init(map_, table_, behind);
  search_.init(map_, behind + aligned(score_field::bytes(*setup.map)));
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

// The cloud about the filter's pose; `known`: that is where the robot is.
void edge_mcl::start_again(bool known) {
  double covariance[3][3];
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) covariance[r][c] = filter_.covariance(r, c);
  cloud_.spread(filter_.pose(), covariance);
  cloud_odom_ = filter_.odom();
  cloud_travelled_m_ = filter_.travelled_m();
  cloud_turned_rad_ = filter_.turned_rad();
  cloud_ns_ = filter_.now_ns();
  search_.clear();
  fused_ns_ = WM_TIME_NONE;
  for (wm_time_ns &t_ns : aligned_ns_) t_ns = WM_TIME_NONE;
  watched_m_ = filter_.travelled_m() + filter_.turned_rad();
  explained_ = params_.lost_explained;
  apart_s_ = 0.0;
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
  if (status != WM_OK) return status;
  if (points.count > WM_POINTS_MAX) return WM_OUT_OF_RANGE;
  for (uint32_t i = 0; i < points.count; i++)
    if (!finite((double)points.x_m[i]) || !finite((double)points.y_m[i])) return WM_NOT_FINITE;
  for (uint32_t i = 0; i < points.count; i++)
    if (std::fabs((double)points.x_m[i]) > kFarthest_m || std::fabs((double)points.y_m[i]) > kFarthest_m)
      return WM_OUT_OF_RANGE;
  filter_.move_to(event.t_ns);
  // Of the first scan: since the motion began; 0 where nothing came before it.
  const double dt = watched_ns_ == WM_TIME_NONE ? 0.0 : wm_seconds_between(watched_ns_, event.t_ns);
  watched_ns_ = event.t_ns;

  const int camera = camera_of(points);
  prepare(points, camera);
  weigh_cloud(move_cloud());
  wm_innovation record{};
  record.t_ns = event.t_ns;
  record.source = event.source;
  record.landmark_id = -1;
  record.residual = WM_RESIDUAL_RANGE;
  normal_equations scan{};
  if (align(points, camera, &scan, &record)) fused_ns_ = event.t_ns;
  watch(scan, dt);
  const bool new_keyframe = search_.see(lined_, filter_.odom());
  if (state_ == WM_STATE_TRACKING) heed_cloud();
  ponder(new_keyframe);
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

// The scan as the particles take it: by what is known of the camera now, as seen from now's base_link, in classes.
void edge_mcl::prepare(const wm_points &points, int camera) {
  const alignment a = alignment_of(camera);
  const taken_from then = look_back(a);
  const sin_cos h = sincos(then.from_now.heading_rad);
  int next = 0;
  double reach = 0.0;
  for (int k = 0; k < kSigmaClasses; k++) {
    for (uint32_t i = 0; i < points.count; i++) {
      const double sigma = point_sigma(points, i, camera);
      int own = 0;
      while (own + 1 < kSigmaClasses && sigma > 1.5 * kClassSigma_m[own]) own++;
      if (own != k) continue;
      floor_point p{(double)points.x_m[i], (double)points.y_m[i], {}, {}};
      if (camera >= 0) {
        if (camera_[camera].range(p.x, p.y) > params_.range_max_m) continue;
        if (!camera_[camera].correct(p.x, p.y, a.value + kAlignCamera, &p)) continue;
      }
      const double x = then.from_now.x_m + h.cos * p.x - h.sin * p.y;
      const double y = then.from_now.y_m + h.sin * p.x + h.cos * p.y;
      scan_.x_m[next] = (float)x;
      scan_.y_m[next++] = (float)y;
      const double r = std::sqrt(x * x + y * y);
      if (r > reach) reach = r;
    }
    scan_.class_end[k] = next;
  }
  scan_.count = next;
  scan_.reach_m = (float)reach;
  for (int i = next; i < next + kScanLanes; i++) scan_.x_m[i] = scan_.y_m[i] = 0.0f;

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

double edge_mcl::move_cloud() {
  const wm_pose2 increment = between(cloud_odom_, filter_.odom());
  const double way = filter_.travelled_m() - cloud_travelled_m_, turn = filter_.turned_rad() - cloud_turned_rad_;
  const double dt = cloud_ns_ == WM_TIME_NONE ? 0.0 : wm_seconds_between(cloud_ns_, filter_.now_ns());
  cloud_odom_ = filter_.odom();
  cloud_travelled_m_ = filter_.travelled_m();
  cloud_turned_rad_ = filter_.turned_rad();
  cloud_ns_ = filter_.now_ns();
  if (way <= 0.0 && turn <= 0.0) return 0.0;  // a robot at rest stays where it is
  step_noise noise;
  noise.along_m = params_.noise_way * std::sqrt(way);
  noise.across_m = params_.noise_side * std::sqrt(way);
  noise.turn_rad = std::sqrt(square(params_.noise_turn) * way + square(params_.noise_turn_rest) * dt +
                             square(params_.noise_turn_rel) * turn);
  cloud_.move(increment, noise);
  return way + 0.5 * turn;
}

// Lost, many places are compared over many scans: what is seen from nearly the same place says nearly the same.
void edge_mcl::weigh_cloud(double way_m) {
  if (scan_.count == 0) return;
  const double share = state_ == WM_STATE_TRACKING || way_m > kNewView_m ? 1.0 : way_m / kNewView_m;
  if (!cloud_.weigh(map_, field_, scan_, table_, share * params_.exponent, params_.weight == EDGE_MCL_SUM)) return;
  if (cloud_.effective() < params_.resample_below * cloud_.count()) cloud_.resample();
}

void edge_mcl::estimate(wm_estimate *out) const {
  filter_.estimate(out);
  out->resets = resets_;
  const bool fresh =
      fused_ns_ != WM_TIME_NONE && wm_seconds_between(fused_ns_, filter_.now_ns()) <= params_.dead_reckoning_after_s;
  out->state = state_ == WM_STATE_TRACKING && !fresh ? (uint8_t)WM_STATE_DEAD_RECKONING : state_;
  if (params_.pose == EDGE_MCL_CLOUD && state_ == WM_STATE_TRACKING) {
    // The cloud stands at the last scan; the filter's motion since then carries its mean on.
    const cloud_moments m = cloud_.moments_near(
        {cloud_.x(cloud_.best()), cloud_.y(cloud_.best()), cloud_.heading(cloud_.best())}, kCluster_m, kCluster_rad);
    const wm_pose2 pose = compose(m.mean, between(cloud_odom_, filter_.odom()));
    put_planar_estimate(
        pose, [&m](int r, int c) { return m.covariance[r][c]; }, out);
  }
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
  list.add("edges", "explained", explained_, 0.0);
  list.add("edges", "lost_probability", 1.0 / (1.0 + exp(-odds_lost())), 0.0);
  list.add("edges", "alike", (double)alike_.count(), 0.0);
  return list.count();
}

size_t edge_mcl::list_particles(wm_particle *out, size_t capacity) const {
  const size_t count = (size_t)cloud_.count();
  for (size_t i = 0; i < count && i < capacity; i++)
    out[i] = {cloud_.x((int)i), cloud_.y((int)i), cloud_.heading((int)i), cloud_.weight((int)i)};
  return count;
}

// Of what speaks for the filter's own place, those that look the same have their part.
size_t edge_mcl::list_hypotheses(wm_hypothesis *out, size_t capacity) const {
  const wm_pose2 since = between(cloud_odom_, filter_.odom());
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
    "Particles over a raster map of edges on the floor, and an aligned scan's "
    "Kalman filter about their main cluster. Finds the pose when lost.",
    WM_EVENT_BIT(WM_EVENT_POINTS) | WM_EVENT_BIT(WM_EVENT_LOOKED) | WM_EVENT_BIT(WM_EVENT_SET_POSE) |
        WM_EVENT_BIT(WM_EVENT_RESET),
    wm_edge_mcl_params_table);
