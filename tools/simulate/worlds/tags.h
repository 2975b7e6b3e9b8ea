// SPDX-License-Identifier: Apache-2.0
// Pictures of coded markers.
#pragma once

#include "simulate/render/texture.h"

namespace wm::sim {

// How many markers tag36h11 has.
int tag36h11_count();
// Marker `id` of the family tag36h11 with a white rim of one module: 10 x 10 modules of `module_px` pixels, the black
// square in the middle 8 x 8. White is 0.85, black 0.04. Upright as ArUco's dictionary
// DICT_APRILTAG_36h11 has it, which is AprilTag's own picture turned by 180 degrees. id in [0, tag36h11_count()).
render::Picture tag36h11_picture(int id, int module_px);

}  // namespace wm::sim
