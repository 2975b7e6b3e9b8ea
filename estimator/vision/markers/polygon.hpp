// SPDX-License-Identifier: Apache-2.0
// A closed border as a convex polygon with a given number of vertices.
#ifndef WAYMARK_ESTIMATOR_VISION_POLYGON_HPP
#define WAYMARK_ESTIMATOR_VISION_POLYGON_HPP

#include "image/tangent.hpp"

namespace wm {

inline constexpr int kPolygonMax = 8;  // vertices; prints have 4 or 5

// Fits straight sides to `count` points of a simple closed border, counterclockwise with y down. `corner`: `vertices`
// of them (at most kPolygonMax), clockwise, on the line of the points. False where the border is no such polygon: not
// convex, or a tenth of a side's points are farther off it than `off_px`.
bool polygon_of(const tangent_point *border, int count, int vertices, double off_px, tangent_point *corner);

// Twice the enclosed area; positive when clockwise, y down.
double doubled_area(const tangent_point *points, int count);

}  // namespace wm

#endif
