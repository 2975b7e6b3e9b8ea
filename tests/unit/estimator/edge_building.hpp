// SPDX-License-Identifier: Apache-2.0
// A small drawn building, and a drive through it whose camera sees the joints of wall and floor: for tests of the
// estimators that localize by edges.
#pragma once

#include <memory>
#include <vector>

#include "common/drawn_walls.hpp"
#include "common/suite.h"
#include "events.hpp"
#include "math/arc.hpp"
#include "waymark/estimator.h"
#include "waymark/random.h"

namespace edge_building {

constexpr double kPixel_m = 0.02;
constexpr int kWidth = 900, kHeight = 600;  // 18 x 12 m

inline const std::vector<segment> &kWalls = kCorridors;

inline const wm_estimator *ops;
inline std::vector<uint8_t> edges, drivable;
inline wm_raster map;
inline wm_rig rig;
inline std::vector<char> motion_params, params;
inline wm_setup setup;

inline bool inside(double x, double y) {
  return (x > 1 && x < 16 && y > 1 && y < 3) || (x > 3.5 && x < 6 && y > 1 && y < 11);
}

inline void without_a_start() { setup.start.p_m[0] = setup.start.p_m[1] = setup.start.heading_rad = NAN; }

// A robot that begins when it is made.
struct drive {
  std::unique_ptr<void, void (*)(void *)> state{make::begun(*ops, params.data(), setup), std::free};
  wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];  // of the newest event
  size_t count = 0;
  wm_pose2 truth{2, 2, 0};
  double t = 0;
  uint64_t draws = 0;
  double pitch_rad = 0;         // of the camera, more than is believed
  int late = 0;                 // hundredths of a second by which pictures are older than their stamps
  double thick_m = 0;           // walls' edges are seen so much nearer than the map has them
  bool silent = false;          // motion sensors say nothing
  double blocked_m = INFINITY;  // something stands across the way, so far before the camera
  int glass = 0;                // so many rays, from the right on, go on through the wall
  drive() { TEST_ASSERT_NOT_NULL(state.get()); }
  double noise() { return wm_random_normal(7, 1, draws++); }

  wm_status tell(const wm_event &e) {
    count = 0;
    if (wm_event_is_motion(&e)) return ops->predict(state.get(), &e);
    return ops->correct(state.get(), &e, records, WM_INNOVATIONS_PER_EVENT_MAX, &count);
  }
  void feed(const wm_event &e) { TEST_ASSERT_EQUAL(WM_OK, tell(e)); }
  wm_estimate estimate() const {
    wm_estimate e;
    ops->estimate(state.get(), &e);
    return e;
  }
  wm_state published_state() const { return static_cast<wm_state>(estimate().state); }
  std::vector<wm_hypothesis> hypotheses() const {
    std::vector<wm_hypothesis> out(200);
    out.resize(ops->hypotheses(state.get(), out.data(), out.size()));
    return out;
  }
  double calibrated(const char *name) const {
    wm_calibration_value values[64];
    const size_t n = ops->calibration(state.get(), values, 64);
    for (size_t i = 0; i < n; i++)
      if (std::strcmp(values[i].name, name) == 0) return values[i].value;
    TEST_FAIL_MESSAGE(name);
    return 0;
  }
  // Share of the edge points that lie on edges of the map.
  double explained() const {
    wm_counter counters[16];
    const size_t n = ops->counters(state.get(), counters, 16);
    for (size_t i = 0; i < n; i++)
      if (counters[i].kind == WM_COUNTER_EXPLAINED_PERMILLE) return 1e-3 * (double)counters[i].count;
    return NAN;
  }

  wm_event scan() {
    wm_event e = make::empty(t, WM_EVENT_POINTS);
    wm_points &p = e.as.points;
    const double eye_x = truth.x_m + std::cos(truth.heading_rad), eye_y = truth.y_m + std::sin(truth.heading_rad);
    for (int i = 0; i < 140; i++) {
      const double angle = -1.2 + 2.4 * i / 139, wall = cast(kWalls, eye_x, eye_y, truth.heading_rad + angle);
      const double range = std::fmin((i < glass ? 1.5 * wall : wall) - thick_m, blocked_m / std::cos(angle));
      if (range < 0.3 || range > 5) continue;
      // Seen at an angle below the horizon of atan(h/r); believed to be pitched less, it seems farther.
      const double seen = std::atan2(0.4, range) - pitch_rad * std::cos(angle) + 0.001 * noise();
      if (seen < 0.05) continue;
      const double r = 0.4 / std::tan(seen);
      p.x_m[p.count] = (float)(1 + r * std::cos(angle));
      p.y_m[p.count] = (float)(r * std::sin(angle));
      p.normal_rad[p.count] = p.sigma_m[p.count] = NAN;
      p.count++;
    }
    return e;
  }
  // Seconds with this twist; the scan may be spoilt. Returns the largest error.
  double go(double seconds, double v, double w, bool nonsense = false) {
    double worst = 0;
    for (int i = 0; i < (int)(seconds * 10 + 0.5); i++) {
      if (!silent) feed(make::twist(t, v, w));
      wm_event picture{};
      for (int k = 0; k < 10; k++) {
        if (k == 10 - late) picture = scan();
        truth.heading_rad += 0.005 * w * 1.01;
        truth.x_m += 0.01 * v * 0.99 * std::cos(truth.heading_rad);
        truth.y_m += 0.01 * v * 0.99 * std::sin(truth.heading_rad);
        truth.heading_rad += 0.005 * w * 1.01;
      }
      t += 0.1;
      if (late == 0) picture = scan();
      picture.t_ns = picture.arrival_ns = wm_ns_from_seconds(t);
      if (nonsense)
        for (uint32_t k = 0; k < picture.as.points.count; k++) {
          picture.as.points.x_m[k] = (float)(3 + 2 * noise());
          picture.as.points.y_m[k] = (float)(2 * noise());
        }
      feed(picture);
      const wm_estimate now = estimate();
      TEST_ASSERT_TRUE(std::isfinite(now.pose_map_base.p_m[0]) && std::isfinite(now.covariance[0]));
      TEST_ASSERT_TRUE(now.covariance[0] > 0 && now.covariance[35] > 0);
      worst = std::fmax(worst, error());
    }
    return worst;
  }
  double error() const {
    const wm_estimate now = estimate();
    return std::hypot(now.pose_map_base.p_m[0] - truth.x_m, now.pose_map_base.p_m[1] - truth.y_m);
  }
  // Of the place: its error squared over the covariance, of two numbers.
  double nees() const {
    const wm_estimate e = estimate();
    const double dx = e.pose_map_base.p_m[0] - truth.x_m, dy = e.pose_map_base.p_m[1] - truth.y_m;
    const double xx = e.covariance[wm_cov_index(0, 0)], xy = e.covariance[wm_cov_index(0, 1)],
                 yy = e.covariance[wm_cov_index(1, 1)];
    return (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
  }
};

// Draws the building, for this estimator with the defaults of its parameters.
inline void draw(const char *estimator) {
  ops = wm_estimator_find(estimator);
  edges = drawn(kWalls, kWidth, kHeight, kPixel_m);
  drivable.assign((size_t)kWidth * kHeight, 0);
  for (int row = 0; row < kHeight; row++)
    for (int column = 0; column < kWidth; column++)
      drivable[(size_t)row * kWidth + (size_t)column] =
          inside((column + 0.5) * kPixel_m, (kHeight - 0.5 - row) * kPixel_m) ? 255 : 0;
  map = {kWidth, kHeight, kPixel_m, 0, 0, 0, edges.data(), drivable.data(), 1};
  wm_rig_init(&rig);
  rig.camera_count = 1;
  std::strcpy(rig.cameras[0].name, "front");
  rig.cameras[0].model = WM_CAMERA_EQUIDISTANT;
  rig.cameras[0].width_px = 1280;
  rig.cameras[0].intrinsics_count = 4;
  rig.cameras[0].intrinsics[0] = rig.cameras[0].intrinsics[1] = 520;
  rig.cameras[0].mounting = {{1.0, 0, 0.4}, {0, 0.38, 0}};
  motion_params.resize(wm_motion_params_table.bytes);
  make::exact_motion(reinterpret_cast<wm_motion_params *>(motion_params.data()));
  params.resize(ops->params.bytes);
  wm_params_defaults(&ops->params, params.data());
  setup = {};
  setup.motion = reinterpret_cast<const wm_motion_params *>(motion_params.data());
  setup.wheels = {NAN, NAN, NAN, NAN, NAN, NAN, 0, {}, {}};
  setup.rig = &rig;
  setup.map = &map;
  setup.start = {WM_TIME_NONE, {2, 2, 0}, {0, 0, 0, 1}, 0, 0.05, 0.05};
  setup.seed = 1;
}

// All walls get a second face, so far behind the first, and floor behind it.
inline void thin_walls(double thickness_m) {
  const std::vector<uint8_t> floor = drivable;
  const int reach = (int)(thickness_m / kPixel_m + 0.5);
  for (int row = reach; row + reach < kHeight; row++)
    for (int column = reach; column + reach < kWidth; column++) {
      int nearest2 = reach * reach + 1;
      for (int y = -reach; y <= reach; y++)
        for (int x = -reach; x <= reach; x++)
          if (floor[(size_t)(row + y) * kWidth + (size_t)(column + x)] && x * x + y * y < nearest2)
            nearest2 = x * x + y * y;
      const size_t at = (size_t)row * kWidth + (size_t)column;
      if (nearest2 > reach * reach) drivable[at] = 255;
      if (nearest2 <= reach * reach && nearest2 > (reach - 1) * (reach - 1)) edges[at] = 255;
    }
}

}  // namespace edge_building
