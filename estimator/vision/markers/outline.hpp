// SPDX-License-Identifier: Apache-2.0
// Outlines of coded markers: regions of a picture whose undistorted outer border is a convex polygon.
#ifndef WAYMARK_ESTIMATOR_VISION_OUTLINE_HPP
#define WAYMARK_ESTIMATOR_VISION_OUTLINE_HPP

#include "image/tangent.hpp"
#include "vision/markers/dark_regions.hpp"
#include "waymark/internal/memory/layout.hpp"
#include "waymark/setup.h"

namespace wm {

inline constexpr int kOutlineCornersMax = 5;

struct outline_work {
  uint32_t width_px, height_px;
  lens optics;
  dark_work regions;
  tangent_point *border;  // undistorted border of the current region
};

// NULL, or the reason why the camera cannot be used (a constant string). Sets size and lens.
const char *outline_init(outline_work *self, const wm_camera &camera);
// Takes the memory; places the arrays if there is any.
void outline_place(outline_work *self, memory_layout *memory, bool is_counting);

// Outer corners of the region that begins with this run, clockwise, in the tangent plane of its middle. False where it
// is no convex polygon of `count` corners (at most kOutlineCornersMax) or is too small. One corner may lie outside of
// the picture.
bool find_outline(outline_work *self, uint32_t region, int count, tangent_view *view, tangent_point *corner);
// Corners `first`, first + 1, ... in the picture.
bool outline_in_picture(const outline_work &self, const tangent_view &view, const tangent_point *corner, int count,
                        int first, double (*corners_px)[2]);

}  // namespace wm

#endif
