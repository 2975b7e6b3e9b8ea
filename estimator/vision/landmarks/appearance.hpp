// SPDX-License-Identifier: Apache-2.0
// How a landmark looks: an upright flat picture of known or unknown size at a place of the map, and what of it a camera
// at a given pose should see.
#ifndef WAYMARK_ESTIMATOR_VISION_APPEARANCE_HPP
#define WAYMARK_ESTIMATOR_VISION_APPEARANCE_HPP

#include <cstddef>
#include <cstdint>

#include "image/ray_table.hpp"
#include "sensors/lens.hpp"
#include "waymark/setup.h"

namespace wm {

// A learnt picture in halving sizes.
struct appearance {
  static constexpr int kSizes = 6;
  static constexpr int kSideMax = 256;
  int32_t id;
  vec3 place_m;  // of its middle, in map
  double sigma_m, width_m, height_m, yaw_rad;
  int sizes;
  int columns[kSizes], rows[kSizes];
  uint8_t *grey[kSizes];

  // Bytes for a picture of this size, which is halved before where a side is longer than kSideMax.
  static size_t bytes(uint32_t width_px, uint32_t height_px);
  void make(const wm_appearance &learnt, const wm_landmark &landmark, uint8_t *memory);
};

// Grey level at a place of the kept picture: x and y in pixels of the largest one, `size` the one that is read. Beside
// the picture the edge goes on.
double grey_of(const appearance &what, int size, double x, double y);

// From a ray of the camera to the landmark's plane.
struct panel_view {
  vec3 middle;      // of the landmark, in optical axes
  mat3 plane;       // (a, b, 1) ~ plane * ray: metres to the right of and above the middle, as a reader sees it
  double facing;    // cosine between the line of sight and the normal; negative from behind
  double distance;  // m
};

// R_map_optical and eye: where the camera is. False where it stands in the landmark's plane.
bool view_panel(const appearance &what, const mat3 &R_map_optical, const vec3 &eye_m, panel_view *out);

// What a camera should see, in pixels of one level of its pyramid.
struct raster {
  static constexpr int kSide = 112;
  int left, top, width, height;  // of the level; rows are kSide apart
  int count;                     // pixels inside of the landmark
  double spread_grey;            // standard deviation of these
  int64_t energy;                // sum of `level` squared
  float grey[kSide * kSide];     // meaningful inside
  float work[kSide * kSide];
  int16_t level[kSide * kSide];   // quarters of a grey level from the mean; 0 outside
  int16_t inside[kSide * kSide];  // -1 inside, 0 outside
};

// Draws the appearance as the camera sees it at 1 / 2^level of the picture's resolution; `corners` are its corners'
// pixels. `blur_px` is the width of a point in the picture. False where it doesn't fit into the raster or has no pixel.
bool draw(const appearance &what, const panel_view &view, const ray_table &rays, const pixel corners[4], int level,
          double blur_px, raster *out);

}  // namespace wm

#endif
