// SPDX-License-Identifier: Apache-2.0
// The picture about one direction as a camera without distortion would show it that looks there: straight edges are
// straight, and a unit is about a pixel, however bent the lens is. "Flat" coordinates: origin on the direction.
#ifndef WAYMARK_ESTIMATOR_IMAGE_TANGENT_HPP
#define WAYMARK_ESTIMATOR_IMAGE_TANGENT_HPP

#include "sensors/lens.hpp"
#include "waymark/frame.h"

namespace wm {

struct flat {
  double x, y;
};
inline flat operator+(const flat &a, const flat &b) { return {a.x + b.x, a.y + b.y}; }
inline flat operator-(const flat &a, const flat &b) { return {a.x - b.x, a.y - b.y}; }
inline flat operator*(double s, const flat &a) { return {s * a.x, s * a.y}; }
inline flat mix(const flat &a, const flat &b, double t) { return a + t * (b - a); }
inline double dot(const flat &a, const flat &b) { return a.x * b.x + a.y * b.y; }
inline double cross(const flat &a, const flat &b) { return a.x * b.y - a.y * b.x; }
inline double length(const flat &a) { return std::sqrt(dot(a, a)); }

struct tangent_view {
  const lens *optics;
  mat3 R_optical_view;  // columns: the view's axes (x right, y down, z along the direction)
  double focal_px;
};

// False where the lens shows nothing there.
inline bool tangent_init(tangent_view *out, const lens &optics, const vec3 &direction) {
  const vec3 z = (1 / length(direction)) * direction;
  // Upright like the picture: the view's x lies in the plane of the picture's x.
  const vec3 across = std::fabs(z.x) < 0.8 ? vec3{1, 0, 0} : vec3{0, 0, z.x > 0 ? -1.0 : 1.0};
  vec3 x = across - dot(across, z) * z;
  x = (1 / length(x)) * x;
  const vec3 y = cross(z, x);
  out->optics = &optics;
  out->R_optical_view = {{{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}};
  constexpr double kStep = 1e-3;
  pixel at, right, down;
  if (!project(optics, z, &at) || !project(optics, z + kStep * x, &right) || !project(optics, z + kStep * y, &down))
    return false;
  const double area = (right.u - at.u) * (down.v - at.v) - (right.v - at.v) * (down.u - at.u);
  out->focal_px = std::sqrt(std::fabs(area)) / kStep;
  return out->focal_px > 1.0;
}

inline vec3 ray_of(const tangent_view &self, const flat &p) {
  return self.R_optical_view * vec3{p.x / self.focal_px, p.y / self.focal_px, 1.0};
}

inline bool flat_of_ray(const tangent_view &self, const vec3 &ray, flat *out) {
  const vec3 d = transposed_times(self.R_optical_view, ray);
  if (!(d.z > 0.1 * length(d))) return false;
  *out = {self.focal_px * d.x / d.z, self.focal_px * d.y / d.z};
  return true;
}

// Grey between pixels; false outside of the picture.
inline bool grey_at(const tangent_view &self, const wm_frame &frame, const flat &p, double *out) {
  pixel at;
  if (!project(*self.optics, ray_of(self, p), &at)) return false;
  if (!(at.u >= 0 && at.v >= 0 && at.u < frame.width_px - 1.0 && at.v < frame.height_px - 1.0)) return false;
  const int u = static_cast<int>(at.u), v = static_cast<int>(at.v);
  const uint8_t *row = frame.grey + static_cast<size_t>(v) * frame.stride_bytes + u;
  const uint8_t *below = row + frame.stride_bytes;
  const double a = at.u - u, b = at.v - v;
  *out = (1 - b) * ((1 - a) * row[0] + a * row[1]) + b * ((1 - a) * below[0] + a * below[1]);
  return true;
}

// A straight line: n . p = d, n of length 1.
struct line {
  flat n;
  double d;
};

inline bool meet(const line &a, const line &b, flat *out) {
  const double determinant = cross(a.n, b.n);
  if (!(std::fabs(determinant) > 0.1)) return false;
  *out = {(a.d * b.n.y - b.d * a.n.y) / determinant, (a.n.x * b.d - b.n.x * a.d) / determinant};
  return true;
}

// Total least squares through `count` points (at least 2), n on the side of `outwards`.
inline line line_through(const flat *points, int count, const flat &outwards) {
  double mx = 0, my = 0, xx = 0, xy = 0, yy = 0;
  for (int i = 0; i < count; i++) mx += points[i].x, my += points[i].y;
  mx /= count, my /= count;
  for (int i = 0; i < count; i++) {
    const double x = points[i].x - mx, y = points[i].y - my;
    xx += x * x, xy += x * y, yy += y * y;
  }
  const sin_cos s = sincos(0.5 * atan2(2.0 * xy, xx - yy));
  flat n = {-s.sin, s.cos};
  if (dot(n, outwards) < 0) n = {s.sin, -s.cos};
  return {n, n.x * mx + n.y * my};
}

}  // namespace wm

#endif
