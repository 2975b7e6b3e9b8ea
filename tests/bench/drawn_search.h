// SPDX-License-Identifier: Apache-2.0
// A robot on the map of drawn_map.h, whose corridors repeat themselves. Not told where it is, it searches, and keeps
// searching, because many places look alike; told, it keeps a list of them.
#pragma once

#include <cstring>
#include <vector>

#include "drawn_map.h"
#include "waymark/estimator.h"

namespace bench {

class search_at_work {
 public:
  explicit search_at_work(bool told = false)
      : ops_(wm_estimator_find("edge_mcl")), edges_(drawn_edges()), drivable_(edges_.size(), 0) {
    const auto floor = [&](int x0, int x1, int y0, int y1) {
      for (int y = y0; y < y1; y++) std::memset(&drivable_[(size_t)y * kMapWidth + (size_t)x0], 255, (size_t)(x1 - x0));
    };
    floor(100, 4500, 165, 330);
    floor(100, 4500, 1015, 1180);
    floor(1000, 1180, 330, 1015);
    floor(3000, 3180, 330, 1015);
    map_ = {kMapWidth, kMapHeight, kMapPixel_m, 0, 0, 0, edges_.data(), drivable_.data(), 1};
    motion_.resize(wm_motion_params_table.bytes);
    wm_params_defaults(&wm_motion_params_table, motion_.data());
    params_.resize(ops_->params.bytes);
    wm_params_defaults(&ops_->params, params_.data());
    setup_.motion = reinterpret_cast<const wm_motion_params *>(motion_.data());
    setup_.wheels = {NAN, NAN, NAN, NAN, NAN, NAN, 0, {}, {}};
    setup_.map = &map_;
    setup_.start = {WM_TIME_NONE, {NAN, NAN, NAN}, {0, 0, 0, 1}, NAN, 0.05, 0.05};
    if (told) setup_.start = {WM_TIME_NONE, {x_m_, y_m_, 0}, {0, 0, 0, 1}, 0, 0.05, 0.05};
    setup_.seed = 1;
    const char *why = "";
    state_ = allocate(ops_->state_bytes(params_.data(), &setup_, &why));
    (void)ops_->init(state_.get(), params_.data(), &setup_);
  }

  // Goes on by a tenth of a second, and looks.
  void prepare() {
    now_s_ += 0.1;
    event_ = wm_event{};
    event_.kind = WM_EVENT_TWIST2;
    event_.t_ns = wm_ns_from_seconds(now_s_ - 0.1);
    event_.as.twist2 = {kSpeed_mps, 0.0};
    (void)ops_->predict(state_.get(), &event_);
    x_m_ += 0.1 * kSpeed_mps;
    event_ = wm_event{};
    event_.kind = WM_EVENT_POINTS;
    event_.t_ns = wm_ns_from_seconds(now_s_);
    wm_points &points = event_.as.points;
    points.camera = -1;
    for (int i = 0; i < kScanPoints; i++) {
      const double bearing = scan_bearing_rad(i), range = cast(bearing);
      if (range < 0) continue;
      points.x_m[points.count] = (float)(range * std::cos(bearing));
      points.y_m[points.count] = (float)(range * std::sin(bearing));
      points.normal_rad[points.count] = points.sigma_m[points.count] = NAN;
      points.count++;
    }
  }
  void scan() {
    wm_innovation records[WM_INNOVATIONS_PER_EVENT_MAX];
    size_t count = 0;
    (void)ops_->correct(state_.get(), &event_, records, WM_INNOVATIONS_PER_EVENT_MAX, &count);
  }
  bool searching() const {
    wm_estimate e;
    ops_->estimate(state_.get(), &e);
    return e.state == WM_STATE_SEARCHING || e.state == WM_STATE_LOST;
  }

 private:
  static constexpr double kSpeed_mps = 0.8, kReach_m = 6.0;

  // First edge along a ray, with some noise; negative: none.
  double cast(double bearing) {
    for (double range = 0.3; range < kReach_m; range += 0.5 * kMapPixel_m) {
      const int column = (int)((x_m_ + range * std::cos(bearing)) / kMapPixel_m);
      const int row = kMapHeight - 1 - (int)((y_m_ + range * std::sin(bearing)) / kMapPixel_m);
      for (int k = 0; k < 2; k++)  // a line drawn aslant is not let through
        if (edges_[(size_t)row * kMapWidth + (size_t)(column + k)])
          return range + 0.01 * wm_random_normal(2, 1, draws_++);
    }
    return -1;
  }

  const wm_estimator *ops_;
  std::vector<uint8_t> edges_, drivable_;
  wm_raster map_;
  std::vector<char> motion_, params_;
  wm_setup setup_ = {};
  block state_;
  wm_event event_;
  uint64_t draws_ = 0;
  double now_s_ = 0.0, x_m_ = 5.0, y_m_ = (kMapHeight - 250) * kMapPixel_m;
};

}  // namespace bench
