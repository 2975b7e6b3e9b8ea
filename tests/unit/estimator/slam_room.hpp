// SPDX-License-Identifier: Apache-2.0
// A simulated room whose landmarks nobody measured, and a robot that drives a circle in it: what tests of SLAM share.
// All noise is drawn from fixed seeds.
#pragma once

#include "filters/slam/params.h"
#include "world.hpp"

namespace room {

using namespace world;

inline constexpr int kCount = 12;

inline wm_slam_params params;
inline double place[kCount][2];
inline double stretch;      // of speeds and ranges as they are measured, over the true ones
inline double false_share;  // of sightings that are of nothing
inline bool hidden, twice, nameless, coded, two_poses, two_heights;
inline double turned[kCount];      // coded: by how much a print hangs otherwise than it did
inline double leans[2];            // coded: the camera's roll and pitch beyond what calibration.yaml says
inline double eccentric[2];        // of a turntable: bearings err by -x sin + y cos
inline bool in_turn;               // coded: with a second camera, 1 m higher, which doesn't lean
inline wm_innovation last;         // what became of the last sighting, its last number
inline int taken, rejected, twin;  // twin: 0, or where a second print of the first identity hangs

inline void make_room() {
  prepare("slam", &params, make::sensor("camera", 0.01, 0.03));
  put_on_map({}, 10);
  setup.landmark_count = kCount;
  for (int i = 0; i < kCount; i++) {
    const wm::sin_cos a = wm::sincos(wm::kTwoPi * i / kCount + 0.1);
    const double radius = i % 2 == 0 ? 5.0 : 3.5;
    place[i][0] = radius * a.cos;
    place[i][1] = radius * a.sin;
    landmarks[i] = {10 + i, {place[i][0], place[i][1], 0}, 0.01, kAbsent, {}, 0};
  }
  sensor.mounting.xyz_m[0] = 0.2;
  start_at({2, 0, wm::kHalfPi}, 0.001, 0.001);
  false_share = 0.0;
  stretch = 1.0;
  hidden = twice = nameless = coded = two_poses = two_heights = false;
  for (double &by : turned) by = 0.0;
  leans[0] = leans[1] = eccentric[0] = eccentric[1] = 0.0;
  in_turn = false;
  taken = rejected = twin = 0;
}

inline wm_verdict see(const wm_event &e) {
  const int verdict = verdict_of(e);
  last = records[count - 1];
  (verdict == WM_FUSED ? taken : rejected)++;
  return static_cast<wm_verdict>(verdict);
}

// What a camera sees that is mounted as the sensor, with its yaw beside what calibration.yaml says.
inline view seen(int i, double yaw_rad = 0.0) {
  return view_of(place[i][0], place[i][1], wm::compose(truth, {0.2, 0, yaw_rad}));
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
    feed(make::twist(now_s, stretch * v + gauss(0.02), w + gauss(0.01)));
    if (step % 10 == 0 && !hidden) {
      for (int k = 0; k < kCount + (twin > 0); k++) {
        const int i = k % kCount;
        const auto [bearing, distance] = seen(k < kCount ? k : twin);
        if (std::fabs(bearing) > 1.2) continue;
        const bool wrong = wm_random_next_uniform(&noise) < false_share;
        const double error = eccentric[1] * wm::cos(bearing) - eccentric[0] * wm::sin(bearing);
        const double b = wrong ? gauss(0.7) : bearing + error + gauss(0.01);
        const double r = wrong ? 1.0 + 5.0 * wm_random_next_uniform(&noise) : stretch * distance + gauss(0.03);
        if (coded) {
          wm_event e = make::empty(now_s, WM_EVENT_MARKER);
          const double x = r * wm::cos(b), y = r * wm::sin(b), z = two_heights && i % 3 == 0 ? 0.6 : 2.2;
          const bool other = in_turn && step % 20 == 10;
          const double roll = other ? 0.0 : leans[0], pitch = other ? 0.0 : leans[1], up = other ? z - 1.0 : z;
          e.as.marker = marker(10 + i, x - pitch * up, y + roll * up, up - roll * y + pitch * x,
                               wm::wrap(0.5 * i + turned[i] - truth.heading_rad + gauss(0.01)));
          e.as.marker.sensor = other;
          if (two_poses) {  // the wrong one first, turned to the other side of the line of sight
            wm_marker &m = e.as.marker;
            m.poses = 2;
            std::memcpy(m.other_p_m, m.p_m, sizeof m.p_m);
            m.other_yaw_rad = m.yaw_rad;
            m.yaw_rad = wm::wrap(m.yaw_rad + (bearing > 0 ? 0.4 : -0.4));
          }
          see(e);
          if (twice) see(e);
          continue;
        }
        see(make::sighting(now_s, nameless ? -1 : 10 + i, b, range ? r : kAbsent));
        if (twice) see(make::sighting(now_s, nameless ? -1 : 10 + i, b, range ? r : kAbsent));
      }
    }
    go_on(v, w, 0.02);
  }
  feed(make::twist(now_s, stretch * v, w));
}

// Largest distance between a landmark found and the true place that its id (or, without ids, its neighbourhood) names.
inline double worst_landmark(size_t *found) {
  double worst = 0.0;
  const std::vector<mapped> all = map();
  *found = all.size();
  for (const mapped &m : all) {
    double least = 1e300;
    for (int k = 0; k < kCount; k++) {
      if (!nameless && m.landmark.id != 10 + k) continue;
      least = std::fmin(least, std::hypot(m.landmark.p_m[0] - place[k][0], m.landmark.p_m[1] - place[k][1]));
    }
    TEST_ASSERT_TRUE(m.covariance[0] > 0.0 && m.covariance[2] > 0.0);
    worst = std::fmax(worst, least);
  }
  return worst;
}

// The whole map is found, each landmark within so much of its place.
inline void expect_whole_map(double within_m, size_t of = kCount) {
  size_t found = 0;
  TEST_ASSERT_LESS_THAN_DOUBLE(within_m, worst_landmark(&found));
  TEST_ASSERT_EQUAL(of, found);
}

// The directions in which prints hang, on the map.
inline void put_yaws_on_map() {
  for (int i = 0; i < kCount; i++) landmarks[i].yaw_rad = wm::wrap(0.5 * i);
}

}  // namespace room
