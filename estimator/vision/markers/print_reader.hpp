// SPDX-License-Identifier: Apache-2.0
// Reads the modules of a print in a picture: brightness of its white and black over the print, each module between
// them.
#ifndef WAYMARK_ESTIMATOR_VISION_PRINT_READER_HPP
#define WAYMARK_ESTIMATOR_VISION_PRINT_READER_HPP

#include "image/homography.hpp"

namespace wm {

// Shading model of one colour over the print: grey = a + b x + c y, by least squares.
struct shade {
  double normal[3][3], right[3], a, b, c;

  void add(double x, double y, double grey);
  bool solve();
  double at(double x, double y) const { return a + b * x + c * y; }
};

struct print_reader {
  const tangent_view &view;
  const wm_frame &frame;
  double module_size;  // on the print, in its units
  homography h;        // from the print to the view
  shade white, black;

  bool grey(double x, double y, double *out) const { return grey_at(view, frame, h(x, y), out); }
  // Mean over the middle of a module.
  bool module(double x, double y, double *out) const;
  // White and black along two copies of the outline, scaled by these factors. False where half of it is outside of the
  // picture.
  bool measure_shades(const double (*outline)[2], int count, double white_scale, double black_scale);
  // Level of a module between black (-0.5) and white (0.5). False outside of the picture or without contrast.
  bool level(double x, double y, double *out) const;
};

// Whether module i of a grid is black after deconvolution from its four neighbours by `sharpen`.
bool is_black_module(const double *level, int across, int i, double sharpen);
inline constexpr double kSharpen = 0.25;  // as AprilTag's decoder has it

}  // namespace wm

#endif
