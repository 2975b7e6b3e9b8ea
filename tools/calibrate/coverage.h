// SPDX-License-Identifier: Apache-2.0
// What a calibration rests on, as figures, a verdict and a picture.
#pragma once

#include <string>
#include <vector>

#include "calibrate/bundle.h"
#include "common/grey_picture.h"

namespace wm::calibrate {

struct Coverage {
  double covered = 0;      // share of the 12 x 8 cells of the picture, those that the lens shows, with a corner in them
  double widest_rad = 0;   // angle of the outermost corner from the axis
  double picture_rad = 0;  // and of the outermost pixel
  double tilt_rad = 0;     // largest angle between two boards
  double sigma_mean_px = 0, sigma_worst_px = 0;  // how well a ray's pixel is known, over the covered cells
};
Coverage coverage_of(const Calibration &calibration);

// What is wrong with it and what to do, one sentence each; empty: nothing.
std::vector<std::string> complaints(const Calibration &calibration, const Coverage &coverage);

// The corners over one of the pictures, dimmed: green up to 0.3 px off, yellow to 1, red beyond; cells without a corner
// are shaded. Throws tools::Failure where the file can't be written.
void draw_coverage(const Calibration &calibration, const tools::GreyPicture &picture, const std::string &file);

}  // namespace wm::calibrate
