// SPDX-License-Identifier: Apache-2.0
// The tangent plane of a camera at one direction: coordinates of an undistorted camera that looks there. Straight edges
// are straight, and a unit is about a pixel, whatever the lens. Origin on the direction.
#ifndef WAYMARK_ESTIMATOR_IMAGE_TANGENT_HPP
#define WAYMARK_ESTIMATOR_IMAGE_TANGENT_HPP

#include "image/picture_sample.hpp"

namespace wm {

struct tangent_point {
  double x, y;
};
inline tangent_point operator+(const tangent_point &a, const tangent_point &b) { return {a.x + b.x, a.y + b.y}; }
inline tangent_point operator-(const tangent_point &a, const tangent_point &b) { return {a.x - b.x, a.y - b.y}; }
inline tangent_point operator*(double s, const tangent_point &a) { return {s * a.x, s * a.y}; }
inline tangent_point mix(const tangent_point &a, const tangent_point &b, double t) { return a + t * (b - a); }
inline double dot(const tangent_point &a, const tangent_point &b) { return a.x * b.x + a.y * b.y; }
inline double cross(const tangent_point &a, const tangent_point &b) { return a.x * b.y - a.y * b.x; }
inline double length(const tangent_point &a) { return std::sqrt(dot(a, a)); }

struct tangent_view {
  const lens *optics;
  mat3 R_optical_view;  // columns: the view's axes (x right, y down, z along the direction)
  double focal_px;
};

// False where the lens has no pixel there.
inline bool tangent_init(tangent_view *out, const lens &optics, const vec3 &direction) {
  const vec3 z = (1 / length(direction)) * direction;
  // The view's x lies in the plane of the picture's x.
  const vec3 across = std::fabs(z.x) < 0.8 ? vec3{1, 0, 0} : vec3{0, 0, z.x > 0 ? -1.0 : 1.0};
  vec3 x = across - dot(across, z) * z;
  x = (1 / length(x)) * x;
  const vec3 y = cross(z, x);
  out->optics = &optics;
  out->R_optical_view = {{{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}};
  constexpr double kStep = 1e-3;  // of the numerical derivative, rad
  pixel at, right, down;
  if (!project(optics, z, &at) || !project(optics, z + kStep * x, &right) || !project(optics, z + kStep * y, &down))
    return false;
  const double area = (right.u - at.u) * (down.v - at.v) - (right.v - at.v) * (down.u - at.u);
  out->focal_px = std::sqrt(std::fabs(area)) / kStep;
  return out->focal_px > 1.0;
}

inline vec3 ray_of(const tangent_view &self, const tangent_point &p) {
  return self.R_optical_view * vec3{p.x / self.focal_px, p.y / self.focal_px, 1.0};
}

// False beyond 84 degrees from the direction, where the plane is useless.
inline bool point_of_ray(const tangent_view &self, const vec3 &ray, tangent_point *out) {
  constexpr double kCosMin = 0.1;  // 84 degrees
  const vec3 d = transposed_times(self.R_optical_view, ray);
  if (!(d.z > kCosMin * length(d))) return false;
  *out = {self.focal_px * d.x / d.z, self.focal_px * d.y / d.z};
  return true;
}

// Bilinear grey level. False outside of the picture.
inline bool grey_at(const tangent_view &self, const wm_frame &frame, const tangent_point &p, double *out) {
  pixel at;
  if (!project(*self.optics, ray_of(self, p), &at)) return false;
  if (!(at.u >= 0 && at.v >= 0 && at.u < frame.width_px - 1.0 && at.v < frame.height_px - 1.0)) return false;
  const int u = static_cast<int>(at.u), v = static_cast<int>(at.v);
  *out = bilinear(frame.grey + static_cast<size_t>(v) * frame.stride_bytes + u, frame.stride_bytes, at.u - u, at.v - v);
  return true;
}

// A straight line: n . p = d, n of length 1.
struct tangent_line {
  tangent_point n;
  double d;
};

// Intersection. False where they are within 6 degrees of parallel.
inline bool meet(const tangent_line &a, const tangent_line &b, tangent_point *out) {
  const double determinant = cross(a.n, b.n);
  constexpr double kSinMin = 0.1;  // 6 degrees
  if (!(std::fabs(determinant) > kSinMin)) return false;
  *out = {(a.d * b.n.y - b.d * a.n.y) / determinant, (a.n.x * b.d - b.n.x * a.d) / determinant};
  return true;
}

// Total least squares through `count` points (at least 2); n points to the side of `outwards`.
inline tangent_line line_through(const tangent_point *points, int count, const tangent_point &outwards) {
  double mx = 0, my = 0, xx = 0, xy = 0, yy = 0;
  for (int i = 0; i < count; i++) mx += points[i].x, my += points[i].y;
  mx /= count, my /= count;
  for (int i = 0; i < count; i++) {
    const double x = points[i].x - mx, y = points[i].y - my;
    xx += x * x, xy += x * y, yy += y * y;
  }
  const sin_cos s = sincos(0.5 * atan2(2.0 * xy, xx - yy));
  tangent_point n = {-s.sin, s.cos};
  if (dot(n, outwards) < 0) n = {s.sin, -s.cos};
  return {n, n.x * mx + n.y * my};
}

}  // namespace wm

#endif
