// SPDX-License-Identifier: Apache-2.0
// Appearance of a landmark: an upright flat picture at a place of the map, and its drawing as a camera at a given pose
// sees it.
#ifndef WAYMARK_ESTIMATOR_VISION_APPEARANCE_HPP
#define WAYMARK_ESTIMATOR_VISION_APPEARANCE_HPP

#include <cstddef>
#include <cstdint>

#include "image/ray_table.hpp"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/setup.h"

namespace wm {

// A learnt picture as a pyramid.
struct appearance {
  static constexpr int kSizes = 6;      // of the pyramid: from kSideMax to 8 px
  static constexpr int kSideMax = 256;  // px of the largest size: more than a landmark has in a picture
  int32_t id;
  vec3 place_m;  // of its middle, in map
  double sigma_m, width_m, height_m, yaw_rad;
  int sizes;
  int columns[kSizes], rows[kSizes];
  uint8_t *grey[kSizes];

  // Bytes for a picture of this size, which is halved first where a side is longer than kSideMax.
  static size_t bytes(uint32_t width_px, uint32_t height_px);
  void make(const wm_appearance &learnt, const wm_landmark &landmark, uint8_t *memory);
};

// Bilinear grey level: x and y in pixels of the largest size, `size` the one that is read. Beyond the picture its edge
// is repeated.
double grey_of(const appearance &what, int size, double x, double y);

// From a ray of the camera to the landmark's plane.
struct panel_view {
  vec3 middle;      // of the landmark, in optical axes
  mat3 plane;       // (a, b, 1) ~ plane * ray: metres to the right of and above the middle, for a reader
  double facing;    // cosine between the line of sight and the normal; negative from behind
  double distance;  // m
};

// R_map_optical and eye: pose of the camera. False where it is in the landmark's plane.
bool view_panel(const appearance &what, const mat3 &R_map_optical, const vec3 &eye_m, panel_view *out);

// Expected picture of a landmark, in pixels of one level of the camera's pyramid.
struct drawn_view {
  static constexpr int kSide = 112;  // 2.5 times the root of kAreaMax_px2: room for oblong ones
  int left, top, width, height;      // of the level; rows are kSide apart
  int count;                         // pixels inside of the landmark
  double spread_grey;                // standard deviation of these
  int64_t energy;                    // sum of `level` squared
  float grey[kSide * kSide];         // meaningful inside
  float work[kSide * kSide];
  int16_t level[kSide * kSide];   // 1/4 grey levels about the mean; 0 outside
  int16_t inside[kSide * kSide];  // -1 inside, 0 outside
};

// Draws the appearance as the camera sees it at 1 / 2^level of the picture's resolution; `corners` in pixels of the
// picture. `blur_px`: sigma of the lens' blur. False where it does not fit into the drawn_view or has no pixel.
bool draw(const appearance &what, const panel_view &view, const ray_table &rays, const pixel corners[4], int level,
          double blur_px, drawn_view *out);

}  // namespace wm

#endif
