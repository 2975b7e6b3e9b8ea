// SPDX-License-Identifier: Apache-2.0
// One known landmark in one picture: what should be seen of it from a pose, and where it is found.
#ifndef WAYMARK_ESTIMATOR_VISION_MATCHER_HPP
#define WAYMARK_ESTIMATOR_VISION_MATCHER_HPP

#include "vision/landmarks/align.hpp"
#include "vision/landmarks/guess.hpp"
#include "vision/landmarks/match.hpp"
#include "vision/landmarks/params.h"
#include "waymark/detector.h"

namespace wm {

// Landmarks are measured in pictures in which they have at most so many pixels.
inline constexpr double kAreaMax = 2000;

// A camera's picture and the work space for looking at it.
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
  double wider, taller;  // than it was expected, by the fit
};

// Whether the landmark should be in this picture, and how, at the level at which it has at most `area_max` pixels.
wm_look expect_landmark(const matcher &self, const camera_guess &guess, const appearance &what, double area_max,
                        expected_view *out);

// Looks for it about where it is expected. `believed`: nobody asks afterwards whether it agrees with others, so it must
// be the more alike, the larger the window is.
wm_look match_landmark(matcher *self, const expected_view &one, double across_px, double down_px, bool believed,
                       landmark_match *out);

}  // namespace wm

#endif
