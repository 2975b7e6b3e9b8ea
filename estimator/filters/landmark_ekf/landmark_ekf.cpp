// SPDX-License-Identifier: Apache-2.0
#include "filters/landmark_ekf/landmark_ekf.hpp"

#include <cstring>

#include "filters/core/contract.hpp"
#include "filters/planar/set_pose.hpp"
#include "filters/registry.h"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr const char *kSensorStateNames[] = {"yaw_rad",     "x_m",           "y_m",          "roll_rad",   "pitch_rad",
                                             "angle_scale", "time_offset_s", "range_bias_m", "range_scale"};

constexpr double kStartWrong = -2.5;   // what somebody says of the pose is wrong in one of twelve cases, as log odds
constexpr double kDoubtedStart = 0.1;  // below, a stated start is published as it was stated
constexpr double kAround_m = 5.0;      // a lost robot is among the landmarks or so near to them

int lasting_states(const wm_landmark_ekf_params &p) {
  if (p.lasting_slots == 0) return 0;
  return (p.lasting_bearing_rad > 0.0 || p.lasting_lateral_m > 0.0) +
         (p.lasting_range_m > 0.0 || p.lasting_range_rel > 0.0);
}

int map_states(const wm_landmark_ekf_params &p) { return p.use_elevation ? 3 : 2; }

int count_states(const wm_landmark_ekf_params &p, const wm_setup &setup) {
  const int each_sensor = (p.sensor_yaw_sigma_rad > 0.0) + 2 * (p.sensor_xy_sigma_m > 0.0) +
                          2 * (p.sensor_tilt_sigma_rad > 0.0) + (p.sensor_angle_scale_sigma > 0.0) +
                          (p.sensor_time_offset_sigma_s > 0.0) + (p.range_bias_sigma_m > 0.0) +
                          (p.range_scale_sigma > 0.0);
  return kPoseStates + planar_filter::count_motion_states(p.motion) + each_sensor * (int)setup.sensor_count +
         (p.gnss_time_offset_sigma_s > 0.0) + 2 * (p.gnss_lasting_m > 0.0) + p.lasting_slots * lasting_states(p) +
         map_states(p) * p.map_slots + 2 * (p.use_elevation && p.tilt_sigma_rad > 0.0);
}

}  // namespace

size_t landmark_ekf::bytes(const wm_landmark_ekf_params &params, const wm_setup &setup, const char **why) {
  if (setup.sensor_count > kMaxSensors) {
    *why = "landmark_ekf takes at most 16 sensors";
    return 0;
  }
  if (count_states(params, setup) > kMaxStates) {
    *why =
        "landmark_ekf holds at most 64 states: pose 3, one for each states.*_sigma that is not 0 (those of sensors "
        "once for each sensor), one or two for each of lasting.slots, two for each of states.map_slots (three with "
        "use.elevation, and two for the tilt), two for lasting.gnss_m; lower lasting.slots or states.map_slots";
    return 0;
  }
  return sizeof(landmark_ekf) + setup.landmark_count * (sizeof(int) + sizeof(landmark_record));
}

void landmark_ekf::init(const wm_landmark_ekf_params &params, const wm_setup &setup) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  setup_ = &setup;
  params_ = params;
  filter_.init(setup, params.motion);
  const auto add = [this](double value, double sigma) { return sigma > 0.0 ? filter_.add_state(value, sigma) : -1; };
  for (size_t i = 0; i < setup.sensor_count; i++) {
    sensor_[i].init(setup.sensors[i]);
    sensor_state_[i][kYaw] = add(0.0, params.sensor_yaw_sigma_rad);
    sensor_state_[i][kMountX] = add(0.0, params.sensor_xy_sigma_m);
    sensor_state_[i][kMountY] = add(0.0, params.sensor_xy_sigma_m);
    sensor_state_[i][kRoll] = add(0.0, params.sensor_tilt_sigma_rad);
    sensor_state_[i][kPitch] = add(0.0, params.sensor_tilt_sigma_rad);
    sensor_state_[i][kAngleScale] = add(0.0, params.sensor_angle_scale_sigma);
    sensor_state_[i][kTimeOffset] = add(0.0, params.sensor_time_offset_sigma_s);
    sensor_state_[i][kRangeBias] = add(0.0, params.range_bias_sigma_m);
    sensor_state_[i][kRangeScale] = add(1.0, params.range_scale_sigma);
  }
  gnss_time_state_ = add(0.0, params.gnss_time_offset_sigma_s);
  gnss_lasting_state_ = add(0.0, params.gnss_lasting_m);
  if (gnss_lasting_state_ >= 0) add(0.0, params.gnss_lasting_m);
  gnss_lasting_ns_ = WM_TIME_NONE;
  calibration_states_ = filter_.states();
  lasting_bearing_offset_ = params.lasting_bearing_rad > 0.0 || params.lasting_lateral_m > 0.0 ? 0 : -1;
  lasting_range_offset_ =
      params.lasting_range_m > 0.0 || params.lasting_range_rel > 0.0 ? (lasting_bearing_offset_ >= 0 ? 1 : 0) : -1;
  for (int i = 0; i < params.lasting_slots && lasting_states(params) > 0; i++) {
    lasting_.add(filter_.states());
    for (int k = 0; k < lasting_states(params); k++) filter_.add_state(0.0, 1.0);
  }
  for (int i = 0; i < params.map_slots; i++) {
    map_.add(filter_.states());
    for (int k = 0; k < map_states(params); k++) filter_.add_state(0.0, 0.0);
  }
  tilt_state_ = params.use_elevation ? add(0.0, params.tilt_sigma_rad) : -1;
  if (tilt_state_ >= 0) add(0.0, params.tilt_sigma_rad);
  tilt_ns_ = WM_TIME_NONE;
  // Landmarks by rising id, for the search by halves. Insertion: once, at the start.
  int *order = landmark_order();
  for (int i = 0; i < (int)setup.landmark_count; i++) {
    int at = i;
    for (; at > 0 && setup.landmarks[order[at - 1]].id > setup.landmarks[i].id; at--) order[at] = order[at - 1];
    order[at] = i;
  }
  std::memset(landmark_records(), 0, setup.landmark_count * sizeof(landmark_record));
  double low[2] = {0, 0}, high[2] = {0, 0};
  for (size_t i = 0; i < setup.landmark_count; i++)
    for (int k = 0; k < 2; k++) {
      const double p = setup.landmarks[i].p_m[k];
      if (i == 0 || p < low[k]) low[k] = p;
      if (i == 0 || p > high[k]) high[k] = p;
    }
  map_variance_m2_ = square(kAround_m) + (square(high[0] - low[0]) + square(high[1] - low[1])) / 12.0;
  moved_id_ = -1;
  remembered_ns_ = WM_TIME_NONE;
  remember_calibration(WM_TIME_NONE);
  fused_ns_ = lost_ns_ = searched_ns_ = weighed_ns_ = inflated_ns_ = loosened_ns_ = found_ns_ = vague_ns_ =
      WM_TIME_NONE;
  start_again();
}

// Known start: track from it. Unknown: what is known of it becomes a seen for the search.
void landmark_ekf::start_again() {
  const wm_start &start = setup_->start;
  evidence_.begin(kStartWrong);
  observations_.clear();
  prior_count_ = 0;
  resets_++;
  state_ = start_is_known(start) ? WM_STATE_TRACKING : WM_STATE_SEARCHING;
  start_trial_.close();
  if (state_ == WM_STATE_TRACKING) {
    try_start();
    return;
  }
  observation seen{};
  seen.t_ns = filter_.now_ns();
  seen.key = -1;
  seen.sensor = filter_.odom();
  seen.travelled_m = filter_.travelled_m();
  seen.turned_rad = filter_.turned_rad();
  const bool place = finite(start.p_m[0]) && finite(start.p_m[1]), heading = finite(start.heading_rad);
  const double sigma_xy = finite(start.sigma_xy_m) ? start.sigma_xy_m : 0.05;
  const double sigma_heading = finite(start.sigma_heading_rad) ? start.sigma_heading_rad : 0.05;
  if (place) {
    seen.kind = kObservedPosition;
    seen.place_m[0] = start.p_m[0];
    seen.place_m[1] = start.p_m[1];
    seen.sigma_length_m = sigma_xy;
    prior_[prior_count_++] = seen;
  }
  if (heading) {
    seen.kind = kObservedHeading;
    seen.bearing_rad = start.heading_rad;
    seen.sigma_angle_rad = sigma_heading;
    prior_[prior_count_++] = seen;
  }
  const double xy = square(place ? sigma_xy : kUnknownPosition_m);
  const double covariance[3][3] = {
      {xy, 0, 0}, {0, xy, 0}, {0, 0, square(heading ? sigma_heading : kUnknownHeading_rad)}};
  filter_.set_pose(filter_.pose(), covariance);
}

wm_status landmark_ekf::predict(const wm_event &motion) {
  const wm_status status = filter_.check_motion(motion);
  if (status == WM_OK) filter_.move(motion);
  return status;
}

wm_status landmark_ekf::correct(const wm_event &event, record_list records) {
  switch (event.kind) {
    case WM_EVENT_SIGHTING: return fuse_sighting(event, records);
    case WM_EVENT_POSITION: return fuse_position(event, records);
    case WM_EVENT_HEADING: return fuse_heading(event, records);
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

wm_status landmark_ekf::take_pose(const wm_event &event) {
  if (event.kind == WM_EVENT_RESET) {
    const wm_status status = reset_pose(filter_, setup_->start, event.t_ns);
    if (status == WM_OK) start_again();
    return status;
  }
  const wm_status status = set_pose(filter_, event);
  if (status != WM_OK) return status;
  evidence_.begin(kStartWrong);
  observations_.clear();
  prior_count_ = 0;
  resets_++;
  state_ = WM_STATE_TRACKING;
  try_start();
  return WM_OK;
}

void landmark_ekf::estimate(wm_estimate *out) const {
  filter_.estimate(out);
  out->resets = resets_;
  const bool fresh =
      fused_ns_ != WM_TIME_NONE && wm_seconds_between(fused_ns_, filter_.now_ns()) <= params_.dead_reckoning_after_s;
  out->state = state_ == WM_STATE_TRACKING && !fresh ? (uint8_t)WM_STATE_DEAD_RECKONING : state_;
  out->lost_probability = lost_probability();
  if (state_ == WM_STATE_LOST) widen(out);
  if (state_ == WM_STATE_TRACKING) mix_start(out);
}

// Lost, the pose may be anywhere with the probability of being lost.
void landmark_ekf::widen(wm_estimate *out) const {
  const double p = evidence_.probability();
  out->covariance[wm_cov_index(0, 0)] += p * map_variance_m2_;
  out->covariance[wm_cov_index(1, 1)] += p * map_variance_m2_;
  out->covariance[wm_cov_index(5, 5)] += p * square(kPi) / 3.0;
}

// Not sure of the start, it is here or there: the covariance of both together about what is published. Gates keep the
// filter's own.
void landmark_ekf::mix_start(wm_estimate *out) const {
  const double p = start_trial_.off();
  if (p < kDoubtedStart) return;
  const wm_pose2 &there = start_trial_.pose();
  const wm_pose2 here = filter_.pose();
  const double off[3] = {there.x_m - here.x_m, there.y_m - here.y_m, wrap(there.heading_rad - here.heading_rad)};
  constexpr int kOf[3] = {0, 1, 5};
  for (int r = 0; r < 3; r++)
    for (int c = r; c < 3; c++) {
      double &both = out->covariance[wm_cov_index(kOf[r], kOf[c])];
      both = (1.0 - p) * both + p * (start_trial_.covariance()[r][c] + off[r] * off[c]);
      out->covariance[wm_cov_index(kOf[c], kOf[r])] = both;
    }
}

size_t landmark_ekf::list_calibration(wm_calibration_value *out, size_t capacity) const {
  calibration_list list(out, capacity);
  filter_.list_motion_states(&list);
  const auto add = [&](const char *whose, const char *what, int state) {
    if (state >= 0) list.add(whose, what, filter_.value(state), std::sqrt(filter_.variance(state)));
  };
  for (size_t i = 0; i < setup_->sensor_count; i++)
    for (int k = 0; k < kSensorStates; k++) add(setup_->sensors[i].name, kSensorStateNames[k], sensor_state_[i][k]);
  add("gnss", "time_offset_s", gnss_time_state_);
  return list.count();
}

size_t landmark_ekf::list_counters(wm_counter *out, size_t capacity) const {
  counter_list list(out, capacity);
  list.add(WM_COUNTER_LANDMARKS_MOVED, (uint64_t)moved_, moved_id_);
  list.add(WM_COUNTER_MOTION_OUTLIERS, filter_.motion_outliers());
  return list.count();
}

}  // namespace wm

const wm_estimator wm_landmark_ekf_estimator = wm::estimator_of<wm::landmark_ekf, wm_landmark_ekf_params>(
    "landmark_ekf",
    "Extended Kalman filter over the pose and the sensors' own errors: "
    "bearings and ranges to known landmarks, positions, "
    "headings. Finds the pose when lost.",
    WM_EVENT_BIT(WM_EVENT_SIGHTING) | WM_EVENT_BIT(WM_EVENT_POSITION) | WM_EVENT_BIT(WM_EVENT_HEADING) |
        WM_EVENT_BIT(WM_EVENT_LOOKED) | WM_EVENT_BIT(WM_EVENT_SET_POSE) | WM_EVENT_BIT(WM_EVENT_RESET),
    wm_landmark_ekf_params_table);
