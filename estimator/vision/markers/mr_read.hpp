// SPDX-License-Identifier: Apache-2.0
// Reads the modules of an MR code through a homography.
#ifndef WAYMARK_ESTIMATOR_VISION_MR_READ_HPP
#define WAYMARK_ESTIMATOR_VISION_MR_READ_HPP

#include "image/homography.hpp"
#include "waymark/mr_code.h"

namespace wm {

struct mr_reading {
  uint32_t id;
  int tip;    // which of the corners is the tip
  int wrong;  // modules that were corrected
};

// `corner`: the outer corners of a black pentagon in the view, clockwise from any of them. False where the shape is not
// a print's, or no vertex has the tip's black module and an identity of at most `id_max`.
bool mr_read(const tangent_view &view, const wm_frame &frame, const tangent_point corner[5], uint32_t id_max,
             int contrast, mr_reading *out);

}  // namespace wm

#endif
