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

// The outer corners of a black pentagon in the view, clockwise from any of them. False where it isn't a print's shape,
// or none of its five directions has a black module below the tip alone and an identity of at most `id_max`.
bool mr_read(const tangent_view &view, const wm_frame &frame, const flat corner[5], uint32_t id_max, int contrast,
             mr_reading *out);

}  // namespace wm

#endif
