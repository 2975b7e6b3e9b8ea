// SPDX-License-Identifier: Apache-2.0
// Pictures of coded markers.
#pragma once

#include "render/texture.h"

namespace wm::sim {

// How many markers tag36h11 has.
int tag36h11_count();
// Marker `id` of the family tag36h11 with a white rim of one module: 10 x 10 modules of `module_px` pixels, the black
// square in the middle 8 x 8. White is 0.85, black 0.04. Upright as ArUco's dictionary
// DICT_APRILTAG_36h11 has it, which is AprilTag's own picture turned by 180 degrees. id in [0, tag36h11_count()).
images::Picture tag36h11_picture(int id, int module_px);
// MR code `id` in the middle of a white square whose edge is kMrSheet times the code's size. `size_px` is the square's.
inline constexpr double kMrSheet = 1.3;
images::Picture mr_picture(int id, int size_px);

}  // namespace wm::sim
