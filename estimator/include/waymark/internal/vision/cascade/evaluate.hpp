// SPDX-License-Identifier: Apache-2.0
// Evaluates a cascade on one window of a picture with the results of OpenCV's CascadeClassifier: tests/unit compares
// them.
#ifndef WAYMARK_INTERNAL_VISION_EVALUATE_HPP
#define WAYMARK_INTERNAL_VISION_EVALUATE_HPP

#include <cstddef>
#include <cstdint>

#include "waymark/cascade.h"

namespace wm {

// Integral images: at row y, column x the sum of all pixels above and to the left, modulo 2^32.
struct integral {
  const uint32_t *sums, *squares;
  ptrdiff_t stride;
};

// Number of stages passed by the window with its upper left pixel at (x, y); all of them: a detection. -1: a HAAR
// cascade rejects a window without contrast. *surplus: the last stage's sum minus its threshold. The window lies inside
// of the picture. Most windows end after a few features, some 5 ns each.
int stages_passed(const wm_cascade &self, const integral &picture, int x, int y, double *surplus);

// The code of a window's LBP feature; a bit for each neighbour block that is at least as bright as the middle one,
// clockwise from the upper left, which is the highest.
unsigned lbp_code(const wm_cascade_feature &feature, const integral &picture, int x, int y);

}  // namespace wm

#endif
