// SPDX-License-Identifier: Apache-2.0
// A detector's edge points joined to polylines, in pixels of the picture that they were seen in.
#pragma once

#include <vector>

#include "waymark/event.h"
#include "waymark/internal/sensors/lens.hpp"

namespace wm::tools {

using PixelLine = std::vector<wm::pixel>;

// Neighbours in the detector's order belong together where they are near each other as seen from the camera, and the
// way from one to the next runs along both edges. Single points are left out.
std::vector<PixelLine> join_points(const wm_points &points, const wm::mounted_camera &camera);

}  // namespace wm::tools
