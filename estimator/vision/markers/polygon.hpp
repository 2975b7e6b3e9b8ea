// SPDX-License-Identifier: Apache-2.0
// A closed border as a convex polygon with a given number of vertices.
#ifndef WAYMARK_ESTIMATOR_VISION_POLYGON_HPP
#define WAYMARK_ESTIMATOR_VISION_POLYGON_HPP

#include "image/tangent.hpp"

namespace wm {

inline constexpr int kPolygonMax = 8;

// Fits straight sides to `count` points of a closed border that goes round once, against the clock with y down.
// `corner`: `vertices` of them (at most kPolygonMax), clockwise, on the points' own line. False where the border is no
// such polygon: not convex, or a tenth of a side's points farther off it than `off_px`.
bool polygon_of(const flat *border, int count, int vertices, double off_px, flat *corner);

// Twice the area within; positive when it goes with the clock, y down.
double doubled_area(const flat *points, int count);

}  // namespace wm

#endif
