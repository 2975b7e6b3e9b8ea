// SPDX-License-Identifier: Apache-2.0
// Short ways to say an event in the estimator's tests.
#pragma once

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <utility>

#include "filters/landmark_ekf/params.h"
#include "motion/motion_params.h"
#include "sensors/localizer_params.h"
#include "sensors/marker_params.h"
#include "sensors/position_params.h"
#include "sensors/sighting_params.h"
#include "waymark/estimator.h"
#include "waymark/event.h"
#include "waymark/setup.h"

namespace make {

inline wm_time_ns at(double seconds) { return wm_ns_from_seconds(seconds); }

inline wm_event empty(double t_s, wm_event_kind kind) {
  wm_event e{};
  e.t_ns = e.arrival_ns = at(t_s);
  e.kind = (uint8_t)kind;
  return e;
}

inline wm_event twist(double t_s, double v, double w) {
  wm_event e = empty(t_s, WM_EVENT_TWIST2);
  e.as.twist2 = {v, w};
  return e;
}

inline wm_event twist6(double t_s, double vx, double vy, double wz) {
  wm_event e = empty(t_s, WM_EVENT_TWIST6);
  e.as.twist6 = {{vx, vy, 0.0}, {0.0, 0.0, wz}, NAN, {}};
  return e;
}

inline wm_event increment(double from_s, double to_s, const wm_pose2 &step, const double covariance[6]) {
  wm_event e = empty(to_s, WM_EVENT_INCREMENT);
  e.as.increment = {at(from_s), step.x_m, step.y_m, step.heading_rad, {}};
  std::memcpy(e.as.increment.covariance, covariance, sizeof e.as.increment.covariance);
  return e;
}

inline wm_event quantities(double t_s, std::initializer_list<std::pair<wm_quantity, double>> list) {
  wm_event e = empty(t_s, WM_EVENT_QUANTITIES);
  for (const auto &[id, value] : list) {
    e.as.quantities.id[e.as.quantities.count] = (uint8_t)id;
    e.as.quantities.value[e.as.quantities.count++] = value;
  }
  return e;
}

inline wm_event sighting(double t_s, int32_t id, double bearing, double range, uint16_t sensor = 0) {
  wm_event e = empty(t_s, WM_EVENT_SIGHTING);
  e.as.sighting = wm_sighting_without_numbers();
  e.as.sighting.sensor = sensor;
  e.as.sighting.landmark_id = id;
  e.as.sighting.bearing_rad = bearing;
  e.as.sighting.range_m = range;
  return e;
}

inline wm_event position(double t_s, double x, double y, double sigma) {
  wm_event e = empty(t_s, WM_EVENT_POSITION);
  e.as.position = {{x, y, NAN}, sigma, NAN};
  return e;
}

inline wm_event heading(double t_s, double heading, double sigma) {
  wm_event e = empty(t_s, WM_EVENT_HEADING);
  e.as.heading = {heading, sigma};
  return e;
}

inline wm_event set_pose(double t_s, double x, double y, double heading, double sigma_xy, double sigma_heading) {
  wm_event e = empty(t_s, WM_EVENT_SET_POSE);
  e.as.set_pose.pose_map_base = {{x, y, 0.0}, {0.0, 0.0, std::sin(heading / 2), std::cos(heading / 2)}};
  e.as.set_pose.sigma_xy_m = sigma_xy;
  e.as.set_pose.sigma_heading_rad = sigma_heading;
  return e;
}

// Wheels of which nothing is known.
inline wm_wheels no_wheels() { return {NAN, NAN, NAN, NAN, NAN, NAN, 0, {}, {}}; }

// A differential robot: 0.1 m wheels with 1000 ticks a turn, 0.5 m apart.
inline wm_wheels two_wheels() { return {0.1, 1000, 0.5, NAN, NAN, NAN, 0, {}, {}}; }

// A car: 2.5 m long, 1.5 m wide, steering ratio 15, an actuator from 0 to 100 mm for -0.5 to 0.5 rad.
inline wm_wheels car() {
  wm_wheels w = {0.3, 1000, 1.5, 2.5, 15.0, NAN, 3, {}, {}};
  const double x[3] = {0.0, 0.05, 0.1}, y[3] = {-0.5, 0.02, 0.5};
  for (int i = 0; i < 3; i++) w.actuator_m[i] = x[i], w.road_wheel_rad[i] = y[i];
  return w;
}

// A sensor in base_link's place that sees without end; NaN: its sigma is not known.
inline wm_sensor sensor(const char *name, double bearing_sigma_rad, double range_sigma_m) {
  wm_sensor s{};
  std::strncpy(s.name, name, sizeof s.name - 1);
  s.bearing_sigma_rad = bearing_sigma_rad;
  s.range_sigma_m = range_sigma_m;
  s.max_range_m = INFINITY;
  return s;
}

// The defaults, but measured twists and nothing to calibrate: what a test is not about is exact.
inline void exact_motion(wm_motion_params *motion) {
  wm_params_defaults(&wm_motion_params_table, motion);
  motion->twist = WM_TWIST_MEASURED;
  motion->noise_speed_rel = motion->noise_yaw_rate_rel = 0.03;
  motion->noise_yaw_rate_radps = 0.01;
  motion->noise_adapt_log_sigma = 0.0;
  for (double &sigma : motion->states.sigma) sigma = 0.0;
  motion->states.wheel_difference_sigma = 0.0;
}

// The shared parameters of sightings; those of motion are each test's.
inline wm_sighting_params sightings;
template <class T>
T defaults_of(const wm_param_table &table) {
  T out;
  wm_params_defaults(&table, &out);
  return out;
}
inline wm_position_params positions = defaults_of<wm_position_params>(wm_position_params_table);
inline wm_marker_params markers = defaults_of<wm_marker_params>(wm_marker_params_table);
inline void exact_sensors(wm_motion_params *motion) {
  exact_motion(motion);
  positions = defaults_of<wm_position_params>(wm_position_params_table);
  markers = defaults_of<wm_marker_params>(wm_marker_params_table);
  wm_params_defaults(&wm_sighting_params_table, &sightings);
  for (double &sigma : sightings.states.sigma) sigma = 0.0;
  sightings.correlated_slots = 0;
  sightings.correlated_bearing_rad = sightings.correlated_lateral_m = 0.0;
  sightings.correlated_range_m = sightings.correlated_range_rel = 0.0;
  sightings.gate_hard = 25.0;
}
inline void exact_map(wm_landmark_ekf_params *params) {
  wm_params_defaults(&wm_landmark_ekf_params_table, params);
  positions.time_offset_sigma_s = positions.correlated_m = positions.heading_bias_sigma_rad = 0.0;
  positions.antenna_sigma_m = 0.0;
  positions.sigma_factor = params->recover_sigma_xy_m = 1.0;
  positions.correlated_tau_s = 60.0;
  params->recover_sigma_heading_rad = 0.25;
  sightings.map_slots = 0;
}

// A robot of which only its motion and one sensor are known; both must outlive what is started with it.
inline wm_setup setup(const wm_motion_params &motion, const wm_sensor &sensor) {
  wm_setup s{};
  s.motion = &motion;
  s.sightings = &sightings;
  s.positions = &positions;
  s.markers = &markers;
  s.wheels = no_wheels();
  s.sensors = &sensor;
  s.sensor_count = 1;
  return s;
}

// What an estimator that begins so remembers, for std::free; nullptr: it can't begin.
inline void *begun(const wm_estimator &estimator, const void *params, const wm_setup &setup) {
  const char *why = nullptr;
  const size_t bytes = estimator.state_bytes(params, &setup, &why);
  if (bytes == 0) return nullptr;
  void *state = aligned_alloc(64, (bytes + 63) / 64 * 64);
  if (estimator.init(state, params, &setup) == WM_OK) return state;
  std::free(state);
  return nullptr;
}

// Gives an event to `predict` or to `correct`, by its kind.
inline wm_status feed(const wm_estimator &estimator, void *state, const wm_event &e) {
  size_t innovations = 0;
  return wm_event_is_motion(&e) ? estimator.predict(state, &e) : estimator.correct(state, &e, nullptr, 0, &innovations);
}

}  // namespace make
