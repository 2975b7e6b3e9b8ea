// SPDX-License-Identifier: Apache-2.0
#include "images/types.h"

#include "waymark/internal/math/elementary.hpp"

namespace wm::images {

Pose pose_xyz_rpy(const Vec3 &xyz_m, double roll_rad, double pitch_rad, double yaw_rad) {
  const sin_cos r = sincos(roll_rad), p = sincos(pitch_rad), y = sincos(yaw_rad);
  Pose out = Pose::Identity();
  out.linear() << y.cos * p.cos, y.cos * p.sin * r.sin - y.sin * r.cos, y.cos * p.sin * r.cos + y.sin * r.sin,
      y.sin * p.cos, y.sin * p.sin * r.sin + y.cos * r.cos, y.sin * p.sin * r.cos - y.cos * r.sin,  //
      -p.sin, p.cos * r.sin, p.cos * r.cos;
  out.translation() = xyz_m;
  return out;
}

}  // namespace wm::images
