// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/edge_mcl.hpp"

#include <cstring>

#include "filters/core/contract.hpp"
#include "filters/core/gate.hpp"
#include "filters/planar/set_pose.hpp"
#include "filters/registry.h"
#include "math/arc.hpp"
#include "sensors/points.hpp"
#include "waymark/internal/memory/layout.hpp"

namespace wm {
namespace {

constexpr double kMotionGap_s = 1.0;  // between two motion messages, beyond which the way is unknown; not swept
// Added to the published covariance: systematic errors of a drive, as of the camera's position.
constexpr double kSystematic_m = 0.01, kSystematic_rad = 0.0005;
constexpr double kUnknownSigma_m = 0.03;  // of a point without a sigma and a camera: a pixel at 4 m

const char *const kReads[] = {"!motion.noise.adapt", "!markers.stamp", "!markers.correlated", "motion.", "sightings.",
                              "positions.",          "markers.",       "localizer.",          nullptr};

bool has_landmarks(const wm_setup &setup) { return setup.landmark_count > 0 && setup.sensor_count > 0; }

int count_states(const wm_edge_mcl_params &params, const wm_setup &setup) {
  const int cameras = setup.rig ? static_cast<int>(setup.rig->camera_count) : 0;
  int each_camera = 0;
  for (int k = 0; k <= kCameraTime; k++) each_camera += params.sigma[k] > 0.0;
  return kPoseStates + planar_filter::count_motion_states(setup.motion->states, setup.motion->model) +
         (params.sigma[kEdgeOffset] > 0.0) + each_camera * cameras +
         (has_landmarks(setup) ? sighting_aid::count_states(setup) : 0) + position_aid::count_states(setup) +
         localizer_aid::count_states(setup) + (params.wall_sigma_m > 0.0) * wall_list::kCapacity;
}

}  // namespace

edge_mcl::arrays edge_mcl::place(memory_layout *layout, const wm_edge_mcl_params &params, const wm_setup &setup) {
  const int states = count_states(params, setup);
  arrays out{};
  out.filter = layout->take<double>(planar_filter::doubles(states));
  out.off = layout->take<double>(static_cast<size_t>(minima::kCapacity) * static_cast<size_t>(states));
  if (has_landmarks(setup)) {
    out.records = layout->take<landmark_record>(setup.landmark_count);
    out.landmarks = sighting_aid::place(layout, setup);
  }
  out.map = layout->take<uint8_t>(edge_map::bytes(*setup.map));
  out.search = layout->take<uint8_t>(place_search::bytes(*setup.map));
  return out;
}

size_t edge_mcl::bytes(const wm_edge_mcl_params &params, const wm_setup &setup, const char **why) {
  if (edge_map::bytes_or_reason(setup.map, why) == 0) return 0;
  if (setup.rig && setup.rig->camera_count > kCamerasMax) {
    *why = "edge_mcl takes at most 2 cameras";
    return 0;
  }
  if (has_landmarks(setup) && setup.sensor_count > kMaxSensors) {
    *why = "edge_mcl takes at most 16 sensors";
    return 0;
  }
  memory_layout layout(nullptr, sizeof(edge_mcl));
  place(&layout, params, setup);
  return layout.bytes();
}

void edge_mcl::init(const wm_edge_mcl_params &params, const wm_setup &setup) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  setup_ = &setup;
  params_ = params;
  const int cameras = setup.rig ? static_cast<int>(setup.rig->camera_count) : 0;
  memory_layout layout(this, sizeof *this);
  const arrays behind = place(&layout, params, setup);
  filter_.init(setup, setup.motion->states, count_states(params, setup), behind.filter);
  off_.set(behind.off);
  const auto add = [&](int row) { return params.sigma[row] > 0.0 ? filter_.add_state(0.0, params.sigma[row]) : -1; };
  edge_state_ = add(kEdgeOffset);
  camera_count_ = cameras;
  for (int c = 0; c < camera_count_; c++) camera_[c].init(setup.rig->cameras[c]);
  slots_.init(camera_count_, [&](int, int row) { return add(row); });
  map_.init(*setup.map, behind.map);
  search_.init(map_, behind.search);
  has_landmarks_ = has_landmarks(setup);
  if (has_landmarks_) {
    landmarks_.init(setup, behind.landmarks);
    landmarks_.add_calibration(&filter_);
    records_.set(behind.records);
    std::memset(behind.records, 0, setup.landmark_count * sizeof(landmark_record));
  }
  others_.init(map_);
  fit_.init(params);
  watched_ns_ = driven_ns_ = WM_TIME_NONE;
  life_ = lifecycle();
  calibration_states_ = filter_.states();
  rollback_.begin(filter_, kPoseStates, filter_.states());
  if (has_landmarks_) landmarks_.add_lent(&filter_);
  wall_state_ = params.wall_sigma_m > 0.0 ? filter_.states() : -1;
  for (int k = 0; wall_state_ >= 0 && k < wall_list::kCapacity; k++) filter_.add_state(0.0, params.wall_sigma_m);
  positions_.init(setup, &filter_, [this](double value, double) { return filter_.add_state(value, 0.0); });
  filter_.set_correlated_position(positions_.error_state());
  localizer_.init(setup, &filter_, [this](double value, double) { return filter_.add_state(value, 0.0); });
  start_again(start_is_known(setup.start));
}

// `known`: the filter's pose is where the robot is.
void edge_mcl::start_again(bool known) {
  scan_odom_ = filter_.odom();
  search_.clear();
  odometry_.clear();
  life_.begin(known);
  life_.fused(WM_TIME_NONE);
  for (wm_time_ns &t_ns : aligned_ns_) t_ns = WM_TIME_NONE;
  forget_walls();
  watched_m_ = filter_.travelled_m() + filter_.turned_rad();
  fit_.reset(known);
  begin_landmarks();
  others_.clear(filter_.pose(), filter_.odom());
  aliases_m_ = filter_.travelled_m();
  nominal_ = map_searched_ = tentative_ = false;
  suspicious_ = !known;
  localizer_.release();
}

wm_status edge_mcl::predict(const wm_event &motion) {
  const wm_status status = filter_.check_motion(motion);
  if (status != WM_OK) return status;
  const double silent_s = driven_ns_ == WM_TIME_NONE ? 0.0 : wm_seconds_between(driven_ns_, motion.t_ns);
  driven_ns_ = motion.t_ns;
  if (watched_ns_ == WM_TIME_NONE) watched_ns_ = motion.t_ns;
  if (filter_.move(motion) && has_landmarks_) landmarks_.slots().begin_lag(*setup_, &filter_);
  if (silent_s > kMotionGap_s) on_motion_gap();
  return status;
}

wm_status edge_mcl::correct(const wm_event &event, record_list records) {
  switch (event.kind) {
    case WM_EVENT_POINTS: return take_points(event, records);
    case WM_EVENT_SIGHTING:
    case WM_EVENT_MARKER: return take_landmark(event, records);
    case WM_EVENT_POSITION: return take_position(event, records);
    case WM_EVENT_HEADING: return take_heading(event, records);
    case WM_EVENT_LOCALIZED: return take_localized(event, records);
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
  if (has_landmarks_ || positions_.is_awake() || localizer_.is_used()) landmark_fit_.forget(event.t_ns);

  const int camera = camera_of(points);
  place_scan(points, camera);
  scan_odom_ = filter_.odom();
  wm_innovation record = record_of(event, WM_RESIDUAL_RANGE);
  normal_equations scan;
  if (align(points, camera, &scan, &record)) life_.fused(event.t_ns);
  update_lost(scan, dt);
  search_.add_keyframe(scan_, filter_.odom());
  relocalize();
  update_aliases(dt);
  check_odometry();
  records.add(record);
  return WM_OK;
}

// While lost there is no pose that odometry could contradict.
void edge_mcl::check_odometry() {
  if (!life_.tracking()) {
    odometry_.clear();
    return;
  }
  const double position_m2 = 0.5 * (filter_.variance(kX) + filter_.variance(kY)) + square(kSystematic_m);
  const double heading_rad2 = filter_.variance(kHeading) + square(kSystematic_rad);
  const int scale = filter_.motion_state(kSpeedScale);
  odometry_.add({filter_.pose(), filter_.odom(), position_m2, heading_rad2, filter_.travelled_m(),
                 filter_.calibration().value[kSpeedScale], scale >= 0 ? filter_.variance(scale) : 0.0});
}

// Recorded points name no camera; where there is one only, it was that.
int edge_mcl::camera_of(const wm_points &points) const {
  if (points.camera >= 0 && points.camera < camera_count_) return points.camera;
  return points.camera < 0 && camera_count_ == 1 ? 0 : -1;
}

double edge_mcl::point_sigma(const wm_points &points, uint32_t i, int camera) const {
  if (finite((double)points.sigma_m[i]) && points.sigma_m[i] > 0.0f) return (double)points.sigma_m[i];
  if (camera < 0) return kUnknownSigma_m;
  return camera_[camera].sigma(camera_[camera].range((double)points.x_m[i], (double)points.y_m[i]), params_.pixel_px);
}

// The scan as the hypotheses take it: points on lines, corrected by the camera's calibration, in now's base_link.
void edge_mcl::place_scan(const wm_points &points, int camera) {
  const alignment a = alignment_of(camera);
  const wm_pose2 from = capture_of(a).from_now;
  const sin_cos h = sincos(from.heading_rad);
  const auto turn = [&h](double x, double y, float *to_x, float *to_y) {
    *to_x = (float)(h.cos * x - h.sin * y);
    *to_y = (float)(h.sin * x + h.cos * y);
  };
  double sigma[kMountingErrors];
  for (int k = 0; k < kMountingErrors; k++) {
    const int state = camera >= 0 ? slots_.at(camera, kMountingError[k]) : -1;
    sigma[k] = state >= 0 ? std::sqrt(filter_.variance(state)) : 0.0;
  }
  scan_.count = 0;
  for (uint32_t i = 0; i < points.count; i++) {
    floor_point p{(double)points.x_m[i], (double)points.y_m[i], {}, {}};
    if (!on_a_line(points, i)) continue;
    if (camera >= 0 && (camera_[camera].range(p.x, p.y) > params_.range_max_m ||
                        !camera_[camera].correct(p.x, p.y, a.value + kAlignCamera, &p)))
      continue;
    floor_edge &to = scan_.of[scan_.count++];
    to.x_m = (float)(from.x_m + h.cos * p.x - h.sin * p.y);
    to.y_m = (float)(from.y_m + h.sin * p.x + h.cos * p.y);
    to.camera = camera > 0 ? camera : 0;
    to.reflection = (float)reflection_weight((int)points.count);
    turn(p.x - (camera >= 0 ? camera_[camera].x_m : 0.0), p.y - (camera >= 0 ? camera_[camera].y_m : 0.0), &to.ray_x_m,
         &to.ray_y_m);
    for (int k = 0; k < kMountingErrors; k++)
      turn(sigma[k] * p.x_by[kMountingError[k]], sigma[k] * p.y_by[kMountingError[k]], &to.x_by[k], &to.y_by[k]);
  }
}

void edge_mcl::estimate(wm_estimate *out) const {
  filter_.estimate(out);
  out->resets = life_.resets();
  out->lost_probability = life_.searching() ? 1.0 : probability_of(lost_log_odds());
  out->state = life_.state(filter_.now_ns(), params_.dead_reckoning_after_s);
  if (!life_.searching()) add_hypotheses_spread(out);
  if (life_.fused_ns() == WM_TIME_NONE) return;  // still the given pose with the given covariance
  out->covariance[wm_cov_index(0, 0)] += square(kSystematic_m);
  out->covariance[wm_cov_index(1, 1)] += square(kSystematic_m);
  out->covariance[wm_cov_index(5, 5)] += square(kSystematic_rad);
  const double *disagreement = odometry_.covariance();
  out->covariance[wm_cov_index(0, 0)] += disagreement[0];
  out->covariance[wm_cov_index(0, 1)] += disagreement[1];
  out->covariance[wm_cov_index(1, 0)] += disagreement[1];
  out->covariance[wm_cov_index(1, 1)] += disagreement[2];
}

void edge_mcl::list_calibration(calibration_list *list) const {
#define WM_CAMERA_NAME(state, key, unit, name, ...) name,
  static constexpr const char *kNames[] = {WM_CAMERA_STATES(WM_CAMERA_NAME)};
  filter_.list_motion_states(list);
  for (int c = 0; c < camera_count_; c++)
    slots_.list(
        c, setup_->rig->cameras[c].name, filter_, [](int k) { return kNames[k]; }, list);
  if (edge_state_ >= 0)
    list->add("edges", kNames[kEdgeOffset], filter_.value(edge_state_), std::sqrt(filter_.variance(edge_state_)));
  if (positions_.is_awake()) positions_.list(filter_, list);
  localizer_.list(list);
  if (has_landmarks_) landmarks_.slots().list(*setup_, filter_, list);
}

size_t edge_mcl::list_counters(wm_counter *out, size_t capacity) const {
  counter_list list(out, capacity);
  list.add(WM_COUNTER_MOTION_OUTLIERS, filter_.motion_outliers());
  list.add(WM_COUNTER_RELOCALIZATIONS, life_.relocalizations());
  list.add(WM_COUNTER_ALIASED_POSES, (uint64_t)others_.aliased());
  list.add(WM_COUNTER_EXPLAINED_PERMILLE, (uint64_t)(1000.0 * fit_.explained() + 0.5));
  return list.count();
}

// Aliased poses share the tracked pose's probability mass.
size_t edge_mcl::list_hypotheses(wm_hypothesis *out, size_t capacity) const {
  const wm_pose2 since = between(scan_odom_, filter_.odom());
  const double each = others_[0].probability / (1.0 + others_.aliased_odds());
  size_t count = 0;
  for (int i = 1; i < others_.count(); i++) {
    const hypothesis &h = others_[i];
    if ((h.origin == kSearched && !h.weighed) || count++ >= capacity) continue;
    const wm_pose2 pose = compose(h.pose, since);
    wm_hypothesis &to = out[count - 1];
    to = {pose.x_m, pose.y_m, pose.heading_rad, {}, h.origin == kSearched ? h.probability : each * h.odds};
    for (int k = 0; k < 6; k++) to.covariance[k] = h.covariance[k];
  }
  return count;
}

}  // namespace wm

const wm_estimator wm_edge_mcl_estimator = wm::estimator_of<wm::edge_mcl, wm_edge_mcl_params>(
    "edge_mcl",
    "Kalman filter that aligns edges on the floor with a raster map's lines, calibrates cameras and motion "
    "sensors, and finds the pose when lost. Sightings and coded markers of known landmarks, positions and headings "
    "beside.",
    WM_EVENT_BIT(WM_EVENT_POINTS) | WM_EVENT_BIT(WM_EVENT_SIGHTING) | WM_EVENT_BIT(WM_EVENT_MARKER) |
        WM_EVENT_BIT(WM_EVENT_POSITION) | WM_EVENT_BIT(WM_EVENT_HEADING) | WM_EVENT_BIT(WM_EVENT_LOCALIZED) |
        WM_EVENT_BIT(WM_EVENT_LOOKED) | WM_EVENT_BIT(WM_EVENT_SET_POSE) | WM_EVENT_BIT(WM_EVENT_RESET),
    wm_edge_mcl_params_table, wm::kReads);
