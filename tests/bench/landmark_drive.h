// SPDX-License-Identifier: Apache-2.0
// landmark_ekf on a circle of 3 m about the origin, for benchmarks: one of four landmarks is seen after each twist.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

#include "waymark/estimator.h"

namespace bench {

struct setting {
  const char *key;
  double value;
};

// What a shipped configuration has beside the pose.
inline const std::vector<setting> kCalibrationStates = {
    {"states.speed_scale_sigma", 0.05},         {"states.yaw_rate_scale_sigma", 0.05},
    {"states.yaw_rate_bias_sigma_radps", 0.01}, {"states.lag_sigma_s", 0.05},
    {"states.sensor_yaw_sigma_rad", 0.05},      {"states.sensor_time_offset_sigma_s", 0.05},
};

// What switches off all that is estimated beside the pose: calibration, slots of errors in time and of the map, factors
// of noise.
inline std::vector<setting> pose_alone() {
  std::vector<setting> out = {{"correlated.slots", 0}, {"states.map_slots", 0}, {"correlated.sigma_m", 0}};
  for (const wm_param_table *table : {&wm_motion_params_table, &wm_sighting_params_table, &wm_position_params_table})
    for (size_t i = 0; i < table->count; i++) {
      const char *key = table->params[i].key;
      const bool is_state = std::strncmp(key, "states.", 7) == 0 && std::strstr(key, "_sigma");
      if (is_state || std::strcmp(key, "noise.adapt_log_sigma") == 0) out.push_back({key, 0});
    }
  return out;
}

class landmark_drive {
 public:
  landmark_drive(const std::vector<setting> &settings, bool range)
      : range_(range),
        motion_(wm_motion_params_table.bytes),
        sightings_(wm_sighting_params_table.bytes),
        positions_(wm_position_params_table.bytes),
        params_(ekf_->params.bytes) {
    fill(wm_motion_params_table, settings, &motion_);
    fill(wm_sighting_params_table, settings, &sightings_);
    fill(wm_position_params_table, settings, &positions_);
    fill(ekf_->params, settings, &params_);
    std::strcpy(sensor_.name, "eye");
    sensor_.bearing_sigma_rad = 0.02;
    sensor_.range_sigma_m = 0.1;
    sensor_.max_range_m = 100;
    for (int i = 0; i < 4; i++)
      landmarks_[i] = {i, {6 * std::cos(1.57 * i), 6 * std::sin(1.57 * i), 0}, 0.01, kAbsent, {}, 0};
    setup_.motion = reinterpret_cast<const wm_motion_params *>(motion_.data());
    setup_.sightings = reinterpret_cast<const wm_sighting_params *>(sightings_.data());
    setup_.positions = reinterpret_cast<const wm_position_params *>(positions_.data());
    setup_.wheels = {kAbsent, kAbsent, kAbsent, kAbsent, kAbsent, kAbsent, 0, {}, {}};
    setup_.sensors = &sensor_;
    setup_.sensor_count = 1;
    setup_.landmarks = landmarks_;
    setup_.landmark_count = 4;
    setup_.start = {WM_TIME_NONE, {3, 0, 0}, {0, 0, 0, 1}, 1.5707963, 0.05, 0.05};
    const char *why = "";
    const size_t bytes = ekf_->state_bytes(params_.data(), &setup_, &why);
    if (bytes == 0) {
      std::printf("landmark_ekf: %s\n", why);
      std::exit(1);
    }
    state_ = std::aligned_alloc(16, (bytes + 15) / 16 * 16);
    ekf_->init(state_, params_.data(), &setup_);
  }
  ~landmark_drive() { std::free(state_); }
  landmark_drive(const landmark_drive &) = delete;
  landmark_drive &operator=(const landmark_drive &) = delete;

  // What is measured and seen 20 ms after the step before.
  struct step {
    wm_event twist, seen;
  };
  step at(int i) const {
    wm_event twist{}, seen{};
    const double t = 0.02 * i, turn = 1.5707963 + 0.3 * t;
    twist.t_ns = seen.t_ns = wm_ns_from_seconds(t);
    twist.kind = WM_EVENT_TWIST2;
    twist.as.twist2 = {0.9, 0.3};
    const double x = 3 * std::sin(turn), y = -3 * std::cos(turn);
    const wm_landmark &l = landmarks_[i % 4];
    const double dx = l.p_m[0] - x, dy = l.p_m[1] - y;
    seen.kind = WM_EVENT_SIGHTING;
    seen.as.sighting = wm_sighting_without_numbers();
    seen.as.sighting.landmark_id = l.id;
    seen.as.sighting.bearing_rad = std::remainder(std::atan2(dy, dx) - turn, 6.283185307179586);
    if (range_) seen.as.sighting.range_m = std::hypot(dx, dy);
    return {twist, seen};
  }
  const wm_landmark &landmark(int id) const { return landmarks_[id]; }
  // How many values the filter lists beside the pose.
  size_t listed() const {
    wm_calibration_value values[64];
    return ekf_->calibration(state_, values, 64);
  }
  void predict(const step &now) { ekf_->predict(state_, &now.twist); }
  // True if the sighting was fused.
  bool correct(const step &now) {
    size_t count = 0;
    ekf_->correct(state_, &now.seen, records_, 8, &count);
    return count > 0 && records_[0].verdict == WM_FUSED;
  }

 private:
  // Defaults, and those settings whose keys the table has.
  static void fill(const wm_param_table &table, const std::vector<setting> &settings, std::vector<char> *out) {
    wm_params_defaults(&table, out->data());
    for (const setting &s : settings)
      for (size_t i = 0; i < table.count; i++) {
        const wm_param &p = table.params[i];
        if (std::strcmp(p.key, s.key) != 0) continue;
        const int32_t whole = (int32_t)s.value;
        if (p.type == WM_PARAM_F64)
          std::memcpy(&(*out)[p.offset], &s.value, sizeof s.value);
        else
          std::memcpy(&(*out)[p.offset], &whole, sizeof whole);
      }
  }

  static constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();
  const wm_estimator *ekf_ = wm_estimator_find("landmark_ekf");
  bool range_;
  std::vector<char> motion_, sightings_, positions_, params_;
  wm_sensor sensor_{};
  wm_landmark landmarks_[4];
  wm_setup setup_{};  // the estimator reads it as long as it lives
  wm_innovation records_[8];
  void *state_;
};

}  // namespace bench
