// SPDX-License-Identifier: Apache-2.0
// Fisheye cameras for tests and benchmarks that draw their own pictures.
#pragma once

#include <algorithm>
#include <initializer_list>

#include "waymark/setup.h"

namespace wm::drawn {

// An equidistant camera of width x height pixels whose axis goes through the middle of the picture; its body frame sits
// at `mounting` in base_link. `distortion` has the model's k1 to k4, or nothing.
inline wm_camera fisheye(uint32_t width_px, uint32_t height_px, double focal_px, const wm_mounting &mounting,
                         std::initializer_list<double> distortion = {}) {
  wm_camera c{};
  c.model = WM_CAMERA_EQUIDISTANT;
  c.width_px = width_px;
  c.height_px = height_px;
  const double intrinsics[] = {focal_px, focal_px, 0.5 * width_px, 0.5 * height_px};
  c.intrinsics_count = 4;
  std::copy(intrinsics, intrinsics + 4, c.intrinsics);
  std::copy(distortion.begin(), distortion.end(), c.distortion);
  c.distortion_count = static_cast<uint32_t>(distortion.size());
  c.mounting = mounting;
  return c;
}

// A robot with these cameras, number 0 first.
inline wm_rig rig_of(std::initializer_list<wm_camera> cameras) {
  wm_rig rig;
  wm_rig_init(&rig);
  rig.camera_count = static_cast<uint32_t>(cameras.size());
  std::copy(cameras.begin(), cameras.end(), rig.cameras);
  return rig;
}

}  // namespace wm::drawn
