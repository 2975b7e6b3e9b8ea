// SPDX-License-Identifier: Apache-2.0
// Camera models: projection and unprojection, the same bits on every machine. Optical axes: z forward, x right, y down;
// whole pixel coordinates are the centres of pixels. For tables computed at the start: projecting costs 0.1 us,
// unprojecting up to a few.
// Sources: [Kannala2006] (equidistant), [Brown1966] (radtan), [Mei2007] (omni), [Usenko2018] (double sphere),
// [Scaramuzza2006] (ocam).
#ifndef WAYMARK_INTERNAL_SENSORS_LENS_HPP
#define WAYMARK_INTERNAL_SENSORS_LENS_HPP

#include "waymark/internal/math/rotation.hpp"
#include "waymark/setup.h"

namespace wm {

struct pixel {
  double u, v;
};

struct lens {
  int32_t model;          // wm_camera_model
  double fx, fy, cx, cy;  // px
  double xi, alpha;       // omni, double sphere
  double k[5];            // equidistant: k1 to k4; else k1, k2, p1, p2, k3
  double angle_max_rad;   // equidistant: up to which the distortion is monotonous, at most pi
};

// NULL, or the reason why this camera cannot be used (a constant string).
const char *lens_init(lens *out, const wm_camera &camera);

// Pixel of a ray of any length. False where the model has none (behind, or beyond the fold of the distortion). The
// pixel may lie outside of the picture.
bool project(const lens &self, const vec3 &ray, pixel *out);
// Ray of length 1. False where the pixel has none.
bool unproject(const lens &self, const pixel &at, vec3 *out);

// A camera with its mounting on the robot.
struct mounted_camera {
  lens optics;
  uint32_t width_px, height_px;
  mat3 R_base_optical;
  vec3 centre_m;  // in base_link
};

const char *mounted_camera_init(mounted_camera *out, const wm_camera &camera);
// Pixel of a point in base_link. False unless inside of the picture by `margin_px`.
bool pixel_of(const mounted_camera &self, const vec3 &point_m, double margin_px, pixel *out);
// Intersection of a pixel's ray with the floor (z = 0 of base_link). False above the horizon.
bool floor_of(const mounted_camera &self, const pixel &at, double *x_m, double *y_m);

}  // namespace wm

#endif
