// SPDX-License-Identifier: Apache-2.0
// How the cameras moved between two pictures, by points that both pairs saw: what most of them agree about. What stands
// still in the world agrees; particles, fish and wrong matches don't.
#ifndef WAYMARK_ESTIMATOR_VISION_STEREO_MOTION_HPP
#define WAYMARK_ESTIMATOR_VISION_STEREO_MOTION_HPP

#include "vision/stereo/params.h"
#include "waymark/internal/math/rotation.hpp"

namespace wm {

// A rectified pair: what its pixels mean. Axes of the left camera: right, down, ahead.
struct pair_geometry {
  double fu, fv, cu, cv, baseline_m;
};

// A point as it stands in both pictures: u and v in the left one, u in the right one.
struct pair_pixels {
  double left_u, left_v, right_u;
};

vec3 place_of(const pair_geometry &rig, const pair_pixels &px);  // left_u > right_u
bool pixels_of(const pair_geometry &rig, const vec3 &place, pair_pixels *out);

// x_b = R x_a + t.
struct rigid {
  mat3 R;
  vec3 t;
};
inline constexpr rigid kIdentityMotion = {kIdentity3, {0, 0, 0}};
inline vec3 operator*(const rigid &m, const vec3 &x) { return m.R * x + m.t; }
inline rigid operator*(const rigid &a, const rigid &b) { return {a.R * b.R, a.R * b.t + a.t}; }
inline rigid inverse(const rigid &m) {
  const mat3 R = transposed(m.R);
  return {R, -1.0 * (R * m.t)};
}

struct seen_twice {
  vec3 before;      // in the camera's axes then
  pair_pixels now;  // measured now
};

// The motion that takes `before` to what is seen now, for the largest part of at most STEREO_TRACKS_MAX points; the
// prior, where there is one, is one of the guesses. `agrees` gets a byte a point. False where fewer than kAgreeing of
// them, or than kFewest, agree. Random choices by `seed`. Cost: about 50 hypotheses over all points, 0.2 ms for 100.
// Sources: [Fischler1981]; [Horn1987] for three points; Gauss-Newton on pixels.
inline constexpr int kFewest = 6;         // twice as many as determine a motion
inline constexpr double kAgreeing = 0.4;  // of the points; the others are moving objects and slipped tracks. Not swept
bool find_motion(const pair_geometry &rig, const seen_twice *points, int count, const rigid *prior, double agree_px,
                 uint64_t seed, rigid *out, uint8_t *agrees);

}  // namespace wm

#endif
