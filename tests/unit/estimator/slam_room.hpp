// SPDX-License-Identifier: Apache-2.0
// A simulated room whose landmarks nobody measured, and a robot that drives a circle in it: what tests of SLAM share.
// All noise is drawn from fixed seeds.
#pragma once

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "events.hpp"
#include "filters/slam/params.h"
#include "math/arc.hpp"
#include "motion/motion_params.h"
#include "unity.h"
#include "waymark/estimator.h"
#include "waymark/random.h"

namespace room {

inline constexpr int kCount = 12;
inline const double kAbsent = std::numeric_limits<double>::quiet_NaN();

inline const wm_estimator *slam;
inline wm_motion_params motion;
inline wm_slam_params params;
inline wm_setup setup;
inline wm_sensor sensor;
inline wm_landmark known[kCount];
inline double place[kCount][2];
inline void *state;
inline wm_random noise;
inline wm_pose2 truth;
inline double now_s;
inline double stretch;      // of speeds and ranges as they are measured, over the true ones
inline double false_share;  // of sightings that are of nothing
inline bool hidden, twice, nameless, coded, two_poses, two_heights;
inline double turned[kCount];      // coded: by how much a print hangs otherwise than it did
inline double leans[2];            // coded: the camera's roll and pitch beyond what calibration.yaml says
inline double eccentric[2];        // of a turntable: bearings err by -x sin + y cos
inline bool in_turn;               // coded: with a second camera, 1 m higher, which doesn't lean
inline wm_innovation last;         // what became of the last sighting, its last number
inline int fused, rejected, twin;  // twin: 0, or where a second print of the first identity hangs

inline double gauss(double sigma) { return sigma * wm_random_next_normal(&noise); }

inline void make_room() {
  slam = wm_estimator_find("slam");
  make::exact_sensors(&motion);
  wm_params_defaults(&slam->params, &params);
  for (int i = 0; i < kCount; i++) {
    const wm::sin_cos a = wm::sincos(wm::kTwoPi * i / kCount + 0.1);
    const double radius = i % 2 == 0 ? 5.0 : 3.5;
    place[i][0] = radius * a.cos;
    place[i][1] = radius * a.sin;
    known[i] = {10 + i, {place[i][0], place[i][1], 0}, 0.01, kAbsent, {}, 0};
  }
  sensor = make::sensor("camera", 0.01, 0.03);
  sensor.mounting.xyz_m[0] = 0.2;
  setup = make::setup(motion, sensor);
  setup.landmarks = known;
  setup.landmark_count = kCount;
  setup.start = {WM_TIME_NONE, {2, 0, 0}, {0, 0, 0, 1}, wm::kHalfPi, 0.001, 0.001};
  truth = {2, 0, wm::kHalfPi};
  noise = {42, 1, 0};
  now_s = false_share = 0.0;
  stretch = 1.0;
  hidden = twice = nameless = coded = two_poses = two_heights = false;
  for (double &by : turned) by = 0.0;
  leans[0] = leans[1] = eccentric[0] = eccentric[1] = 0.0;
  in_turn = false;
  fused = rejected = twin = 0;
}

inline void begin() {
  std::free(state);
  state = make::begun(*slam, &params, setup);
  TEST_ASSERT_NOT_NULL(state);
}

inline wm_verdict see(const wm_event &e) {
  wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX];
  size_t count = 0;
  TEST_ASSERT_EQUAL(WM_OK, slam->correct(state, &e, out, WM_INNOVATIONS_PER_EVENT_MAX, &count));
  TEST_ASSERT_GREATER_THAN(0, count);
  last = out[count - 1];
  (out[0].verdict == WM_FUSED ? fused : rejected)++;
  return (wm_verdict)out[0].verdict;
}

inline wm_marker marker(int32_t id, double x, double y, double z, double yaw_rad) {
  wm_marker m{};
  m.id = id;
  m.p_m[0] = x;
  m.p_m[1] = y;
  m.p_m[2] = z;
  m.yaw_rad = yaw_rad;
  m.along_sigma_m = m.yaw_sigma_rad = m.bloom_px = NAN;
  return m;
}

// Drives a circle of 2 m and looks around five times a second.
inline void drive(double seconds, bool range = true) {
  const double v = 0.5, w = 0.25, until = now_s + seconds;
  for (int step = 0; now_s < until; step++) {
    const wm_event e = make::twist(now_s, stretch * v + gauss(0.02), w + gauss(0.01));
    TEST_ASSERT_EQUAL(WM_OK, slam->predict(state, &e));
    if (step % 10 == 0 && !hidden) {
      const wm_pose2 eye = wm::compose(truth, {0.2, 0, 0});
      for (int k = 0; k < kCount + (twin > 0); k++) {
        const int i = k % kCount, at = k < kCount ? k : twin;
        const double dx = place[at][0] - eye.x_m, dy = place[at][1] - eye.y_m;
        const double bearing = wm::wrap(wm::atan2(dy, dx) - truth.heading_rad), distance = std::sqrt(dx * dx + dy * dy);
        if (std::fabs(bearing) > 1.2) continue;
        const bool wrong = wm_random_next_uniform(&noise) < false_share;
        const double error = eccentric[1] * wm::cos(bearing) - eccentric[0] * wm::sin(bearing);
        const double b = wrong ? gauss(0.7) : bearing + error + gauss(0.01);
        const double r = wrong ? 1.0 + 5.0 * wm_random_next_uniform(&noise) : stretch * distance + gauss(0.03);
        if (coded) {
          wm_event seen = make::empty(now_s, WM_EVENT_MARKER);
          const double x = r * wm::cos(b), y = r * wm::sin(b), z = two_heights && i % 3 == 0 ? 0.6 : 2.2;
          const bool other = in_turn && step % 20 == 10;
          const double roll = other ? 0.0 : leans[0], pitch = other ? 0.0 : leans[1], up = other ? z - 1.0 : z;
          seen.as.marker = marker(10 + i, x - pitch * up, y + roll * up, up - roll * y + pitch * x,
                                  wm::wrap(0.5 * i + turned[i] - truth.heading_rad + gauss(0.01)));
          seen.as.marker.sensor = other;
          if (two_poses) {  // the wrong one first, turned to the other side of the line of sight
            wm_marker &m = seen.as.marker;
            m.poses = 2;
            std::memcpy(m.other_p_m, m.p_m, sizeof m.p_m);
            m.other_yaw_rad = m.yaw_rad;
            m.yaw_rad = wm::wrap(m.yaw_rad + (bearing > 0 ? 0.4 : -0.4));
          }
          see(seen);
          if (twice) see(seen);
          continue;
        }
        see(make::sighting(now_s, nameless ? -1 : 10 + i, b, range ? r : kAbsent));
        if (twice) see(make::sighting(now_s, nameless ? -1 : 10 + i, b, range ? r : kAbsent));
      }
    }
    const double dt = 0.02;
    const wm::arc a = wm::make_arc(v * dt, w * dt);
    truth = wm::compose(truth, {a.x_m, a.y_m, a.turn_rad});
    now_s += dt;
  }
  const wm_event e = make::twist(now_s, stretch * v, w);
  TEST_ASSERT_EQUAL(WM_OK, slam->predict(state, &e));
}

inline double off() {
  wm_estimate e;
  slam->estimate(state, &e);
  const double dx = e.pose_map_base.p_m[0] - truth.x_m, dy = e.pose_map_base.p_m[1] - truth.y_m;
  return std::sqrt(dx * dx + dy * dy);
}

inline double sigma() {
  wm_estimate e;
  slam->estimate(state, &e);
  return std::sqrt(e.covariance[0] + e.covariance[wm_cov_index(1, 1)]);
}

inline double calibrated(const char *name, double *sigma = nullptr) {
  wm_calibration_value values[64];
  const size_t n = slam->calibration(state, values, 64);
  for (size_t i = 0; i < n; i++)
    if (std::strcmp(values[i].name, name) == 0) {
      if (sigma) *sigma = values[i].sigma;
      return values[i].value;
    }
  return NAN;
}

inline double counted(wm_counter_kind kind) {
  wm_counter counters[16];
  const size_t n = slam->counters(state, counters, 16);
  for (size_t i = 0; i < n; i++)
    if (counters[i].kind == (uint32_t)kind) return (double)counters[i].count;
  return -1.0;
}

// Largest distance between a landmark found and the true place that its id (or, without ids, its neighbourhood) names.
inline double worst_landmark(size_t *found) {
  wm_landmark l[64];
  double covariance[64][4], worst = 0.0;
  *found = slam->landmarks(state, l, covariance, 64);
  for (size_t i = 0; i < *found; i++) {
    double least = 1e300;
    for (int k = 0; k < kCount; k++) {
      if (!nameless && l[i].id != 10 + k) continue;
      const double dx = l[i].p_m[0] - place[k][0], dy = l[i].p_m[1] - place[k][1];
      least = std::fmin(least, std::sqrt(dx * dx + dy * dy));
    }
    TEST_ASSERT_TRUE(covariance[i][0] > 0.0 && covariance[i][2] > 0.0);
    worst = std::fmax(worst, least);
  }
  return worst;
}

inline wm_state published_state() {
  wm_estimate e;
  slam->estimate(state, &e);
  return (wm_state)e.state;
}

inline void leave_room() {
  std::free(state);
  state = nullptr;
}

}  // namespace room
