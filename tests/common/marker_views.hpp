// SPDX-License-Identifier: Apache-2.0
// Pictures of coded markers for tests and benchmarks, drawn by a seed: a print before clutter, seen askew, with a lens'
// blur, motion, a shadow's border, noise and a response that makes white grow. Print and modules are areas: each pixel
// is the mean of 5 x 5 places.
#pragma once

#include <functional>
#include <vector>

#include "waymark/frame.h"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/setup.h"

namespace wm::views {

// What a print has at (x, y) in parts of its size, y down: 1 black, 0 white, -1 nothing (what is behind it).
using Ink = std::function<int(double x, double y)>;
Ink mr_ink(uint32_t id);

struct View {
  wm_camera camera;
  double size_m;
  vec3 centre_m;           // of the print, in optical axes
  vec3 right, down, away;  // of the print
  double distance_m, tilt_rad;
  double scale_px;  // of a length of 1 on the print (size_m metres), where it is seen smallest
  double blur_px, motion_px, shade, noise_grey, response;
  uint64_t seed;
};

// View number `seed`: 0.5 to 4 m, up to 60 degrees oblique; cameras of 640 x 480, a pinhole and a fisheye by turns. The
// whole print is in the picture.
View draw_view(uint64_t seed, double size_m);
// The print hangs `tilt_rad` askew, straight ahead, without blur or noise beyond the least: for what must be exact.
View plain_view(double distance_m, double tilt_rad, double size_m);

// Grey pixels, 640 x 480.
std::vector<uint8_t> take_picture(const View &view, const Ink &ink);
wm_frame frame_of(const std::vector<uint8_t> &grey, const wm_camera &camera);

}  // namespace wm::views
