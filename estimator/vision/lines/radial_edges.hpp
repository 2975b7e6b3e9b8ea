// SPDX-License-Identifier: Apache-2.0
// Upright lines in one polar picture: candidates where the votes peak, each measured to a part of a column.
#ifndef WAYMARK_ESTIMATOR_VISION_RADIAL_EDGES_HPP
#define WAYMARK_ESTIMATOR_VISION_RADIAL_EDGES_HPP

#include "vision/lines/votes.hpp"

namespace wm {

inline constexpr int kRadialEdgesMax = 192;  // of a picture: bounds the memory and the time

struct radial_edge {
  double azimuth_rad, sigma_rad;  // at the horizon, in base_link
  double lean, lean_sigma;        // azimuth per tangent of elevation, rad: the zenith's error in this direction
  double left_grey, right_grey;   // means of the sides; left: towards larger azimuths
  int rows_first, rows_last;
  double score;
};

// Error of the zenith that follows from the mounting: small rotations about base_link's x and y, rad, with covariance.
struct zenith {
  double x_rad, y_rad;
  double xx, xy, yy;
  // Expected lean of an upright line at an azimuth, and its variance.
  double lean(const sin_cos &azimuth) const { return -(x_rad * azimuth.cos + y_rad * azimuth.sin); }
  double variance(const sin_cos &a) const { return xx * a.cos * a.cos + 2 * xy * a.cos * a.sin + yy * a.sin * a.sin; }
};

// The upright lines of the picture, at most kRadialEdgesMax. Returns their number.
int find_radial_edges(const polar_view &view, const wm_lines_params &params, const zenith &up, vote_work *work,
                      radial_edge *out);
// Kalman update of the zenith by a line's lean.
void correct_zenith(const radial_edge &edge, zenith *up);

}  // namespace wm

#endif
