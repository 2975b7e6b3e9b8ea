// SPDX-License-Identifier: Apache-2.0
// What a camera on the floor would see of a map's edges from a pose, by the map alone: whether two places can be
// distinguished apart at all.
#pragma once

#include <vector>

#include "waymark/frames.h"
#include "waymark/setup.h"

namespace wm::montecarlo {

// Distances along rays from the camera to the first edge; those beyond the range are the range.
using View = std::vector<double>;

class Viewer {
 public:
  // `eye_m`: the camera ahead of base_link.
  Viewer(const wm_raster &map, double eye_m);
  [[nodiscard]] View at(const wm_pose2 &base) const;
  // Share of the rays, of those that meet an edge in either view, that are longer in one of them by more than 0.15 m
  // and a twentieth.
  [[nodiscard]] static double difference(const View &a, const View &b);
  // The smallest difference of the view at `there` from those within 0.5 m and 8 degrees of `estimated`: what a filter
  // that shifts its pose a little can't talk away.
  [[nodiscard]] double distinction(const wm_pose2 &there, const wm_pose2 &estimated) const;

 private:
  [[nodiscard]] double cast(double x_m, double y_m, double angle_rad) const;
  const wm_raster &map_;
  double eye_m_, cos_, sin_;
};

// Views that differ by more are other views.
inline constexpr double kOtherView = 0.3;

}  // namespace wm::montecarlo
