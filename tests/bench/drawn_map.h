// SPDX-License-Identifier: Apache-2.0
// A map for benchmarks, of the paper's size: 4676 x 1372 pixels at 75 a metre; and a cloud that is weighed on it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "common/block.hpp"
#include "filters/pf_edges/particles.hpp"
#include "waymark/random.h"

namespace bench {

inline constexpr int kMapWidth = 4676, kMapHeight = 1372;
inline constexpr double kMapPixel_m = 1.0 / 75;

// Two corridors and what joins them, with recesses, as a building of this size has: its edges.
inline std::vector<uint8_t> drawn_edges() {
  std::vector<uint8_t> edges(static_cast<size_t>(kMapWidth) * kMapHeight, 0);
  const auto line = [&](int x0, int y0, int x1, int y1) {
    const int steps = std::max(std::abs(x1 - x0), std::abs(y1 - y0));
    for (int i = 0; i <= steps; i++) {
      const int x = x0 + (x1 - x0) * i / steps, y = y0 + (y1 - y0) * i / steps;
      edges[static_cast<size_t>(y) * kMapWidth + static_cast<size_t>(x)] = 255;
    }
  };
  for (int y : {150, 330, 1000, 1180})
    for (int x = 100; x < 4500; x += 200) {
      line(x, y, x + 130, y);
      line(x + 130, y, x + 130, y + 15);
      line(x + 130, y + 15, x + 200, y + 15);
      line(x + 200, y + 15, x + 200, y);
    }
  for (int x : {1000, 1180, 3000, 3180}) line(x, 345, x, 1000);
  return edges;
}

inline constexpr int kScanPoints = 180;
inline constexpr double kScanAperture_rad = 2.4;
inline double scan_range_m(int i) { return 1 + 5 * wm_random_uniform(1, 1, static_cast<uint64_t>(i)); }
inline double scan_bearing_rad(int i) { return kScanAperture_rad * (i / (kScanPoints - 1.0) - 0.5); }
inline constexpr wm_pose2 kCloudMean = {2000 / 75.0, 15.0, 0};

// The map with its scores baked, a scan, and a cloud of particles to be weighed by it.
class cloud_at_work {
 public:
  explicit cloud_at_work(int particles)
      : edges_(drawn_edges()), raster_{kMapWidth, kMapHeight, kMapPixel_m, 0, 0, 0, edges_.data(), nullptr, 0} {
    map_memory_ = allocate(wm::edge_map::bytes(raster_));
    map_.init(raster_, map_memory_.get());
    const double sigma[wm::kSigmaClasses] = {0.05, 0.06, 0.08, 0.12};
    wm::make_score_table(map_, sigma, 0.05, false, &table_);
    layers_ = allocate(wm::score_field::bytes(raster_));
    field_.init(map_, table_, layers_.get());
    points_.count = kScanPoints;
    points_.reach_m = 6.0f;
    for (int i = 0; i < kScanPoints; i++) {
      points_.x_m[i] = static_cast<float>(scan_range_m(i) * std::cos(scan_bearing_rad(i)));
      points_.y_m[i] = static_cast<float>(scan_range_m(i) * std::sin(scan_bearing_rad(i)));
    }
    for (int k = 0; k < wm::kSigmaClasses; k++) points_.class_end[k] = kScanPoints * (k + 1) / wm::kSigmaClasses;
    state_.resize(wm::particles::bytes(particles) / sizeof(double));
    particles_.init(particles, 1, state_.data());
    const double covariance[3][3] = {{0.0025, 0, 0}, {0, 0.0025, 0}, {0, 0, 0.0004}};
    particles_.spread(kCloudMean, covariance);
  }

  void weigh() { (void)particles_.weigh(map_, field_, points_, table_, 1e-6, false); }
  void move() { particles_.propagate({0.05, 0, 0.001}, {0.005, 0.003, 0.003}); }
  void resample() { particles_.resample(); }

 private:
  std::vector<uint8_t> edges_;
  wm_raster raster_;
  block map_memory_, layers_;
  wm::edge_map map_;
  wm::score_table table_;
  wm::score_field field_;
  wm::scan_points points_;
  std::vector<double> state_;
  wm::particles particles_;
};

}  // namespace bench
