// SPDX-License-Identifier: Apache-2.0
// Upright lines in one polar picture: candidates where the votes peak, each measured to a part of a column.
#ifndef WAYMARK_ESTIMATOR_VISION_RADIAL_EDGES_HPP
#define WAYMARK_ESTIMATOR_VISION_RADIAL_EDGES_HPP

#include "vision/lines/votes.hpp"

namespace wm {

inline constexpr int kRadialEdgesMax = 192;

struct radial_edge {
  double azimuth_rad, sigma_rad;  // at the horizon, in base_link
  double lean, lean_sigma;        // azimuth by the elevation's tangent: the zenith's error, as seen here
  double left_grey, right_grey;   // means of the sides; left: towards larger azimuths
  int rows_first, rows_last;
  double score;
};

// Where the zenith is against the mounting's: small turns about base_link's x and y, with their covariance.
struct zenith {
  double x_rad, y_rad;
  double xx, xy, yy;
  // What an upright line's lean is expected to be, and how sure that is.
  double lean(const sin_cos &azimuth) const { return -(x_rad * azimuth.cos + y_rad * azimuth.sin); }
  double variance(const sin_cos &a) const { return xx * a.cos * a.cos + 2 * xy * a.cos * a.sin + yy * a.sin * a.sin; }
};

// Lines of the picture by azimuth, at most kRadialEdgesMax; returns how many.
int find_radial_edges(const polar_view &view, const wm_lines_params &params, const zenith &up, vote_work *work,
                      radial_edge *out);
// What a line's lean says of the zenith.
void correct_zenith(const radial_edge &edge, zenith *up);

}  // namespace wm

#endif
