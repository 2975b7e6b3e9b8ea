// SPDX-License-Identifier: Apache-2.0
// Matching of one known landmark in one picture: its expected view from a pose, and its place.
#ifndef WAYMARK_ESTIMATOR_VISION_MATCHER_HPP
#define WAYMARK_ESTIMATOR_VISION_MATCHER_HPP

#include "vision/landmarks/align.hpp"
#include "vision/landmarks/guess.hpp"
#include "vision/landmarks/match.hpp"
#include "vision/landmarks/params.h"
#include "waymark/detector.h"

namespace wm {

// Landmarks are measured at the pyramid's level at which they have at most this area: cost, and no gain beyond.
inline constexpr double kAreaMax_px2 = 2000;
// Smallest cosine between the line of sight and a landmark's normal, 80 degrees: more slanted ones are not searched.
inline constexpr double kFacingMin = 0.17;

// A camera's picture and the work space of the matching.
struct matcher {
  wm_landmarks_params params;
  mounted_camera camera;
  ray_table rays;
  pyramid picture;
  float *scores;
  drawn_view drawn;
  align_work work;
};

struct expected_view {
  const appearance *what;
  panel_view view;
  pixel middle, corners[4];
  double shorter_px, area_px2;
  int level;
};

struct landmark_match {
  pixel at;
  double uu, uv, vv, likeness;
  double wider, taller;  // scale of width and height against the expected view
};

// Whether the landmark should be visible, and its expected view at the level at which it has at most `area_max` px^2.
wm_look expect_landmark(const matcher &self, const camera_guess &guess, const appearance &what, double area_max,
                        expected_view *out);

// Searches for the landmark around its expected place. `is_final`: no agreement with other landmarks is required
// afterwards, so the needed likeness grows with the window.
wm_look match_landmark(matcher *self, const expected_view &one, double across_px, double down_px, bool is_final,
                       landmark_match *out);

}  // namespace wm

#endif
