// SPDX-License-Identifier: Apache-2.0
// Planar motion along an exact arc, and what is needed to compose and split such motions.
#ifndef WAYMARK_ESTIMATOR_MATH_ARC_HPP
#define WAYMARK_ESTIMATOR_MATH_ARC_HPP

#include "math/elementary.hpp"
#include "waymark/frames.h"

namespace wm {

// Motion over a way s forwards and l to the left with a turn w, all constant in time, in the frame at its beginning:
// (V (s, l), w) with V = [[sin(w)/w, -(1-cos w)/w], [(1-cos w)/w, sin(w)/w]]. Derivatives are with respect to s and w;
// that by l is that by s turned by a right angle to the left.
struct arc {
  double x_m, y_m, turn_rad;
  double x_by_way, y_by_way;    // = cos and sin of the chord, times its length over the arc's
  double x_by_turn, y_by_turn;  // metres per radian
};

// Below this turn the series are exact to the last digit: the first term left out is turn^6 / 5040.
inline constexpr double kSmallTurn = 0.01;

inline arc make_arc(double way_m, double side_m, double turn_rad) {
  arc out;
  out.turn_rad = turn_rad;
  double sinc, cosc;    // sin(w)/w, (1-cos w)/w
  double dsinc, dcosc;  // their derivatives
  const double q = turn_rad * turn_rad;
  if (q < kSmallTurn * kSmallTurn) {
    sinc = 1.0 - q * (1.0 / 6 - q * (1.0 / 120));
    cosc = turn_rad * (0.5 - q * (1.0 / 24 - q * (1.0 / 720)));
    dsinc = -turn_rad * (1.0 / 3 - q * (1.0 / 30));
    dcosc = 0.5 - q * (1.0 / 8 - q * (1.0 / 144));
  } else {
    const sin_cos a = sincos(turn_rad);
    const double inverse = 1.0 / turn_rad;
    sinc = a.sin * inverse;
    cosc = (1.0 - a.cos) * inverse;
    dsinc = (a.cos - sinc) * inverse;
    dcosc = (a.sin - cosc) * inverse;
  }
  out.x_m = way_m * sinc - side_m * cosc;
  out.y_m = way_m * cosc + side_m * sinc;
  out.x_by_way = sinc;
  out.y_by_way = cosc;
  out.x_by_turn = way_m * dsinc - side_m * dcosc;
  out.y_by_turn = way_m * dcosc + side_m * dsinc;
  return out;
}

inline arc make_arc(double way_m, double turn_rad) { return make_arc(way_m, 0.0, turn_rad); }

// a (+) b: b is given in a's frame.
inline wm_pose2 compose(const wm_pose2 &a, const wm_pose2 &b) {
  const sin_cos h = sincos(a.heading_rad);
  return {a.x_m + h.cos * b.x_m - h.sin * b.y_m, a.y_m + h.sin * b.x_m + h.cos * b.y_m,
          wrap(a.heading_rad + b.heading_rad)};
}

// a^-1 (+) b: b seen from a.
inline wm_pose2 between(const wm_pose2 &a, const wm_pose2 &b) {
  const sin_cos h = sincos(a.heading_rad);
  const double dx = b.x_m - a.x_m;
  const double dy = b.y_m - a.y_m;
  return {h.cos * dx + h.sin * dy, h.cos * dy - h.sin * dx, wrap(b.heading_rad - a.heading_rad)};
}

// The constant twist over one unit of time that makes the motion `whole`: forwards, to the left, turning.
struct ways {
  double way_m, side_m, turn_rad;
};
inline ways ways_of(const wm_pose2 &whole) {
  const arc all = make_arc(1.0, whole.heading_rad);
  const double determinant = all.x_m * all.x_m + all.y_m * all.y_m;
  return {(all.x_m * whole.x_m + all.y_m * whole.y_m) / determinant,
          (all.x_m * whole.y_m - all.y_m * whole.x_m) / determinant, whole.heading_rad};
}

// The part `fraction` of the motion `whole`, taken along the constant twist that makes it.
inline wm_pose2 part_of(const wm_pose2 &whole, double fraction) {
  const ways all = ways_of(whole);
  const arc part = make_arc(fraction, fraction * whole.heading_rad);
  return {part.x_m * all.way_m - part.y_m * all.side_m, part.y_m * all.way_m + part.x_m * all.side_m,
          fraction * whole.heading_rad};
}

}  // namespace wm

#endif
