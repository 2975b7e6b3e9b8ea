// SPDX-License-Identifier: Apache-2.0
// A robot in the plane with its estimator through the contract: what it is started with, what it sees from its
// true pose, and the output of the estimator. One for all tests of estimators in the plane; drives and faults are each
// test's.
#pragma once

#include <vector>

#include "common/suite.h"
#include "events.hpp"
#include "filters/landmark_ekf/params.h"
#include "math/arc.hpp"
#include "math/elementary.hpp"
#include "waymark/health.h"
#include "waymark/random.h"

namespace world {

inline constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();
inline constexpr int kLandmarksMax = 64;

inline const wm_estimator *estimator;
inline const void *chosen;  // the estimator's parameters
inline wm_motion_params motion;
inline wm_landmark_ekf_params ekf_params;
inline wm_sensor sensor;
inline wm_landmark landmarks[kLandmarksMax];
inline wm_setup setup;
// What the estimator remembers.
struct remembered {
  void *at = nullptr;
  ~remembered() { std::free(at); }
  void *get() const { return at; }
  explicit operator bool() const { return at != nullptr; }
  void reset(void *other = nullptr) {
    std::free(at);
    at = other;
  }
};
inline remembered state;
inline wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];  // of the newest event
inline size_t count;
inline wm_random noise;
inline wm_pose2 truth;
inline double now_s;

inline double gauss(double sigma) { return sigma * wm_random_next_normal(&noise); }

// ---- what it is started with ----

inline void start_at(const wm_pose2 &at, double sigma_m, double sigma_rad) {
  truth = at;
  setup.start = {WM_TIME_NONE, {at.x_m, at.y_m, 0}, {0, 0, 0, 1}, at.heading_rad, sigma_m, sigma_rad};
}
inline void without_a_start() { setup.start.p_m[0] = setup.start.p_m[1] = setup.start.heading_rad = kAbsent; }

// An estimator with these parameters of its own, which outlive it, and with one sensor. All else is exact, so that a
// test switches on what it is about.
template <class P>
void prepare(const char *name, P *params, const wm_sensor &with, uint64_t seed = 42) {
  estimator = wm_estimator_find(name);
  wm_params_defaults(&estimator->params, params);
  chosen = params;
  make::exact_sensors(&motion);
  sensor = with;
  setup = make::setup(motion, sensor);
  noise = {seed, 1, 0};
  now_s = 0.0;
  state.reset();
  start_at({}, 0.05, 0.05);
}
inline void prepare_ekf(const wm_sensor &with, uint64_t seed = 42) {
  prepare("landmark_ekf", &ekf_params, with, seed);
  make::exact_map(&ekf_params);
}
// As a configuration without any parameter.
inline void all_by_default() {
  wm_params_defaults(&wm_motion_params_table, &motion);
  wm_params_defaults(&wm_sighting_params_table, &make::sightings);
  wm_params_defaults(&wm_landmark_ekf_params_table, &ekf_params);
  make::positions = make::defaults_of<wm_position_params>(wm_position_params_table);
  make::markers = make::defaults_of<wm_marker_params>(wm_marker_params_table);
}
// Landmarks of the map: ids from `first` on by `by`.
struct place_of {
  double x_m, y_m, z_m = 0.0;
};
inline void put_on_map(std::initializer_list<place_of> places, int32_t first, int32_t by = 1, double sigma_m = 0.0) {
  setup.landmarks = landmarks;
  setup.landmark_count = 0;
  for (const place_of &p : places) {
    landmarks[setup.landmark_count++] = {first, {p.x_m, p.y_m, p.z_m}, sigma_m, kAbsent, {}, 0};
    first += by;
  }
}
inline void begin() {
  state.reset(make::begun(*estimator, chosen, setup));
  TEST_ASSERT_NOT_NULL(state.get());
}

// ---- its input ----

inline wm_status tell(const wm_event &e) {
  count = 0;
  if (wm_event_is_motion(&e)) return estimator->predict(state.get(), &e);
  return estimator->correct(state.get(), &e, records, WM_INNOVATIONS_PER_EVENT_MAX, &count);
}
inline void feed(const wm_event &e) { TEST_ASSERT_EQUAL(WM_OK, tell(e)); }
inline int verdict_of(const wm_event &e, wm_status wanted = WM_OK) {
  TEST_ASSERT_EQUAL(wanted, tell(e));
  TEST_ASSERT_GREATER_THAN(0, count);
  return records[0].verdict;
}
inline int fused() {
  int sum = 0;
  for (size_t i = 0; i < count; i++) sum += records[i].verdict == WM_FUSED;
  return sum;
}

// ---- what is true ----

// The robot moves on, and so does the time.
inline void go_on(double v_mps, double w_radps, double dt_s) {
  const wm::arc a = wm::make_arc(v_mps * dt_s, w_radps * dt_s);
  truth = wm::compose(truth, {a.x_m, a.y_m, a.turn_rad});
  now_s += dt_s;
}
struct view {
  double bearing_rad, range_m;
};
inline view view_of(double x_m, double y_m, const wm_pose2 &eye) {
  const double dx = x_m - eye.x_m, dy = y_m - eye.y_m;
  return {wm::wrap(wm::atan2(dy, dx) - eye.heading_rad), std::sqrt(dx * dx + dy * dy)};
}
inline view view_of(double x_m, double y_m) { return view_of(x_m, y_m, truth); }

// ---- its output ----

inline wm_estimate estimate() {
  wm_estimate e;
  std::memset(static_cast<void *>(&e), 0, sizeof e);
  estimator->estimate(state.get(), &e);
  return e;
}
inline wm_state published_state() { return static_cast<wm_state>(estimate().state); }
inline double off_from(const wm_pose2 &at) {
  const wm_estimate e = estimate();
  return std::hypot(e.pose_map_base.p_m[0] - at.x_m, e.pose_map_base.p_m[1] - at.y_m);
}
inline double off() { return off_from(truth); }
inline double turned_from(const wm_pose2 &at) { return std::fabs(wm::wrap(estimate().heading_rad - at.heading_rad)); }
inline double heading_off() { return turned_from(truth); }
// Of the place: sigma, and the error squared over the covariance, of two numbers.
inline double sigma() {
  const wm_estimate e = estimate();
  return std::sqrt(e.covariance[0] + e.covariance[wm_cov_index(1, 1)]);
}
inline double nees_from(const wm_pose2 &at) {
  const wm_estimate e = estimate();
  const double dx = e.pose_map_base.p_m[0] - at.x_m, dy = e.pose_map_base.p_m[1] - at.y_m;
  const double xx = e.covariance[0], xy = e.covariance[wm_cov_index(0, 1)], yy = e.covariance[wm_cov_index(1, 1)];
  return (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
}
inline std::vector<wm_calibration_value> calibration() {
  std::vector<wm_calibration_value> out(256);
  out.resize(estimator->calibration(state.get(), out.data(), out.size()));
  return out;
}
// NaN: not listed.
inline wm_calibration_value calibrated(const char *name) {
  for (const wm_calibration_value &v : calibration())
    if (std::strcmp(name, v.name) == 0) return v;
  wm_calibration_value none{};
  none.value = none.sigma = kAbsent;
  return none;
}
inline double value_of(const char *name) { return calibrated(name).value; }
inline double sigma_of(const char *name) { return calibrated(name).sigma; }
// Count -1: not listed.
inline wm_counter counter(wm_counter_kind kind) {
  wm_counter counters[WM_HEALTH_COUNTERS_MAX];
  const size_t n = estimator->counters(state.get(), counters, WM_HEALTH_COUNTERS_MAX);
  for (size_t i = 0; i < n; i++)
    if (counters[i].kind == static_cast<uint32_t>(kind)) return counters[i];
  return {};
}
inline double counted(wm_counter_kind kind) {
  const wm_counter c = counter(kind);
  return c.kind == static_cast<uint32_t>(kind) ? static_cast<double>(c.count) : -1.0;
}
struct mapped {
  wm_landmark landmark;
  double covariance[4];
};
inline std::vector<mapped> map() {
  wm_landmark l[256];
  double covariance[256][4];
  std::vector<mapped> out(estimator->landmarks(state.get(), l, covariance, 256));
  for (size_t i = 0; i < out.size(); i++) {
    out[i].landmark = l[i];
    std::memcpy(out[i].covariance, covariance[i], sizeof covariance[i]);
  }
  return out;
}

}  // namespace world
