// SPDX-License-Identifier: Apache-2.0
// The reference trajectory of M. P. Abramov et al. 2019: a particle filter over the whole drive that keeps each step's
// resampling ancestry; back from the end, the mean of the particles that have descendants there; once more from their
// first poses; until nothing changes. It looks at the drive as a whole and is no rival of a filter: a yardstick where
// there is no truth.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "waymark/setup.h"

namespace wm::tools {

// Distance to the nearest edge, m, cut at `reach_m`: a table over the map.
class EdgeField {
 public:
  EdgeField(const wm_raster &map, double reach_m);
  // Of a place in the map, linear between pixels; the reach outside.
  [[nodiscard]] double distance_m(double x_m, double y_m) const;
  [[nodiscard]] bool drivable(double x_m, double y_m) const;

 private:
  [[nodiscard]] Eigen::Vector2d pixel(double x_m, double y_m) const;
  const wm_raster &map_;
  double reach_m_, cos_, sin_;
  std::vector<float> distance_;
};

struct SmootherStep {
  int64_t t_ns = 0;
  Eigen::Vector3d odom = Eigen::Vector3d::Zero();  // x, y, heading, dead reckoning
  std::vector<Eigen::Vector2d> points;             // edges in base_link, m
};

struct SmootherOptions {
  int particles = 500;
  double sigma_m = 0.05;    // of an edge point against the map
  double informative = 12;  // so many independent points a picture is worth
  double along_rel = 0.03, across_m = 0.01, turn_rel = 0.05, turn_rad = 0.004;  // odometry: shares, per root of a metre
  double start_xy_m = 0.05, start_heading_rad = 0.05;
  double settled_m = 0.005;  // the mean of the passes moves by no more: done
  int passes_max = 12;
  uint64_t seed = 1;
};

struct Reference {
  std::vector<Eigen::Vector3d> poses;  // one a step
  int passes = 0;
  double moved_m = 0;    // mean change by the last pass
  double explained = 0;  // share of the points within three sigma of an edge
};

// Each pass has its own random numbers; the result is the mean of the passes. `tell` hears of each pass.
Reference smooth(const std::vector<SmootherStep> &steps, const EdgeField &field, const Eigen::Vector3d &start,
                 const SmootherOptions &options, const std::function<void(int pass, double moved_m)> &tell);

}  // namespace wm::tools
