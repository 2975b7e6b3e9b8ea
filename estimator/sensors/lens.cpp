// SPDX-License-Identifier: Apache-2.0
#include "waymark/internal/sensors/lens.hpp"

namespace wm {

namespace {

// A point of the normalised plane.
struct plane_point {
  double x, y;
};

double distorted_angle(const lens &self, double theta) {
  const double t = theta * theta;
  return theta * (1 + t * (self.k[0] + t * (self.k[1] + t * (self.k[2] + t * self.k[3]))));
}

double distorted_angle_slope(const lens &self, double theta) {
  const double t = theta * theta;
  return 1 + t * (3 * self.k[0] + t * (5 * self.k[1] + t * (7 * self.k[2] + t * 9 * self.k[3])));
}

// The angle up to which the distorted angle is monotonous.
double largest_angle(const lens &self) {
  constexpr int kSteps = 512;
  for (int i = 1; i <= kSteps; i++)
    if (!(distorted_angle_slope(self, kPi * i / kSteps) > 0)) return kPi * (i - 1) / kSteps;
  return kPi;
}

struct distorted_point {
  plane_point at;
  double dxx, dxy, dyy;  // Jacobian, symmetric
};

distorted_point distort(const lens &self, const plane_point &p) {
  const double k1 = self.k[0], k2 = self.k[1], p1 = self.k[2], p2 = self.k[3], k3 = self.k[4];
  const double x = p.x, y = p.y, r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3));
  return {{x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y},
          radial + x * x * slope + 2 * p1 * y + 6 * p2 * x,
          x * y * slope + 2 * p1 * x + 2 * p2 * y,
          radial + y * y * slope + 6 * p1 * y + 2 * p2 * x};
}

// Beyond the fold a pixel would have two rays.
bool is_folded(const distorted_point &b) { return !(b.dxx * b.dyy - b.dxy * b.dxy > 1e-9 && b.dxx + b.dyy > 0); }

bool distort_unfolded(const lens &self, const plane_point &p, plane_point *out) {
  const distorted_point b = distort(self, p);
  *out = b.at;
  return !is_folded(b);
}

// Newton's method, from the distorted point.
bool undistort(const lens &self, const plane_point &distorted, plane_point *out) {
  *out = distorted;
  for (int i = 0; i < 40; i++) {
    const distorted_point b = distort(self, *out);
    if (is_folded(b)) return false;
    const double det = b.dxx * b.dyy - b.dxy * b.dxy, mx = distorted.x - b.at.x, my = distorted.y - b.at.y;
    const double sx = (b.dyy * mx - b.dxy * my) / det, sy = (b.dxx * my - b.dxy * mx) / det;
    out->x += sx;
    out->y += sy;
    if (sx * sx + sy * sy < 1e-28 * (1 + out->x * out->x + out->y * out->y)) return true;
  }
  return false;
}

bool project_equidistant(const lens &self, const vec3 &d, plane_point *out) {
  const double r = std::sqrt(d.x * d.x + d.y * d.y), theta = atan2(r, d.z);
  if (theta > self.angle_max_rad) return false;
  const double scale = r > 0 ? distorted_angle(self, theta) / r : 0;
  *out = {d.x * scale, d.y * scale};
  return r > 0 || d.z > 0;
}

bool unproject_equidistant(const lens &self, const plane_point &m, vec3 *out) {
  const double distorted = std::sqrt(m.x * m.x + m.y * m.y);
  if (!(distorted <= distorted_angle(self, self.angle_max_rad))) return false;
  // Monotonous in this interval: Newton's method, bisection where a step would leave it.
  double low = 0, high = self.angle_max_rad, theta = distorted < high ? distorted : high;
  for (int i = 0; i < 60; i++) {
    const double miss = distorted - distorted_angle(self, theta);
    (miss > 0 ? low : high) = theta;
    double next = theta + miss / distorted_angle_slope(self, theta);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (next == theta) break;
    theta = next;
  }
  const sin_cos a = sincos(theta);
  *out = distorted > 0 ? vec3{m.x / distorted * a.sin, m.y / distorted * a.sin, a.cos} : vec3{0, 0, 1};
  return true;
}

// `d` has length 1.
bool project_omni(const lens &self, const vec3 &d, plane_point *out) {
  if (!(d.z > (self.xi > 1 ? -1 / self.xi : -self.xi) + 1e-9)) return false;
  return distort_unfolded(self, {d.x / (d.z + self.xi), d.y / (d.z + self.xi)}, out);
}

bool unproject_omni(const lens &self, const plane_point &m, vec3 *out) {
  plane_point p;
  if (!undistort(self, m, &p)) return false;
  const double r2 = p.x * p.x + p.y * p.y, root = 1 + (1 - self.xi * self.xi) * r2;
  if (!(root >= 0)) return false;
  const double factor = (self.xi + std::sqrt(root)) / (r2 + 1);
  *out = {factor * p.x, factor * p.y, factor - self.xi};
  return true;
}

bool project_double_sphere(const lens &self, const vec3 &d, plane_point *out) {
  const double xi = self.xi, alpha = self.alpha;
  const double w1 = alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
  const double w2 = (w1 + xi) / std::sqrt(2 * w1 * xi + xi * xi + 1);  // equation 43
  if (!(d.z > -w2)) return false;
  const double z2 = xi + d.z, under = alpha * std::sqrt(d.x * d.x + d.y * d.y + z2 * z2) + (1 - alpha) * z2;
  if (!(under > 1e-9)) return false;
  *out = {d.x / under, d.y / under};
  return true;
}

bool unproject_double_sphere(const lens &self, const plane_point &m, vec3 *out) {
  const double xi = self.xi, alpha = self.alpha, r2 = m.x * m.x + m.y * m.y;
  const double root = 1 - (2 * alpha - 1) * r2;  // equations 46 to 51
  if (!(root >= 0)) return false;
  const double mz = (1 - alpha * alpha * r2) / (alpha * std::sqrt(root) + 1 - alpha);
  const double second = mz * mz + (1 - xi * xi) * r2;
  if (!(second >= 0)) return false;
  const double factor = (mz * xi + std::sqrt(second)) / (mz * mz + r2);
  *out = {factor * m.x, factor * m.y, factor * mz - xi};
  return true;
}

}  // namespace

const char *lens_init(lens *out, const wm_camera &camera) {
  *out = lens{};
  out->model = camera.model;
  int focal = 0;
  switch (camera.model) {
    case WM_CAMERA_EQUIDISTANT:
    case WM_CAMERA_PINHOLE_RADTAN: break;
    case WM_CAMERA_OMNI: focal = 1; break;
    case WM_CAMERA_DOUBLE_SPHERE: focal = 2; break;
    case WM_CAMERA_OCAM: return "the camera's model is ocam: fit one of the others to it by `waymark calibrate import`";
    default: return "the camera's model is unknown";
  }
  const double *values = camera.intrinsics;
  if (focal > 0) out->xi = values[0];
  if (focal > 1) out->alpha = values[1];
  out->fx = values[focal];
  out->fy = values[focal + 1];
  out->cx = values[focal + 2];
  out->cy = values[focal + 3];
  for (int i = 0; i < 5; i++) out->k[i] = camera.distortion[i];
  if (!(out->fx > 0 && out->fy > 0)) return "the camera's focal lengths are not positive";
  if (out->model == WM_CAMERA_EQUIDISTANT) out->angle_max_rad = largest_angle(*out);
  return nullptr;
}

bool project(const lens &self, const vec3 &ray, pixel *out) {
  const double size = length(ray);
  if (!(size > 0) || !finite(ray)) return false;
  const vec3 d = (1 / size) * ray;
  plane_point m = {0, 0};
  bool there = false;
  switch (self.model) {
    case WM_CAMERA_EQUIDISTANT: there = project_equidistant(self, d, &m); break;
    case WM_CAMERA_PINHOLE_RADTAN: there = d.z > 1e-6 && distort_unfolded(self, {d.x / d.z, d.y / d.z}, &m); break;
    case WM_CAMERA_OMNI: there = project_omni(self, d, &m); break;
    case WM_CAMERA_DOUBLE_SPHERE: there = project_double_sphere(self, d, &m); break;
    default: break;
  }
  *out = {self.fx * m.x + self.cx, self.fy * m.y + self.cy};
  return there;
}

bool unproject(const lens &self, const pixel &at, vec3 *out) {
  const plane_point m = {(at.u - self.cx) / self.fx, (at.v - self.cy) / self.fy};
  plane_point p;
  bool there = false;
  switch (self.model) {
    case WM_CAMERA_EQUIDISTANT: there = unproject_equidistant(self, m, out); break;
    case WM_CAMERA_PINHOLE_RADTAN:
      there = undistort(self, m, &p);
      *out = {p.x, p.y, 1};
      break;
    case WM_CAMERA_OMNI: there = unproject_omni(self, m, out); break;
    case WM_CAMERA_DOUBLE_SPHERE: there = unproject_double_sphere(self, m, out); break;
    default: break;
  }
  if (!there) return false;
  *out = (1 / length(*out)) * *out;
  return finite(*out);
}

const char *mounted_camera_init(mounted_camera *out, const wm_camera &camera) {
  *out = mounted_camera{};
  const char *why = lens_init(&out->optics, camera);
  if (why) return why;
  if (camera.width_px == 0 || camera.height_px == 0) return "the camera's size is not given";
  out->width_px = camera.width_px;
  out->height_px = camera.height_px;
  // The optical axes lie along (-y, -z, x) of the body.
  const mat3 body = matrix_of_rpy(camera.mounting.rpy_rad);
  const mat3 R_body_optical = {{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}}};
  out->R_base_optical = body * R_body_optical;
  out->centre_m = vec_of(camera.mounting.xyz_m);
  return nullptr;
}

bool pixel_of(const mounted_camera &self, const vec3 &point_m, double margin_px, pixel *out) {
  if (!project(self.optics, transposed_times(self.R_base_optical, point_m - self.centre_m), out)) return false;
  return out->u >= margin_px && out->v >= margin_px && out->u <= self.width_px - 1 - margin_px &&
         out->v <= self.height_px - 1 - margin_px;
}

bool floor_of(const mounted_camera &self, const pixel &at, double *x_m, double *y_m) {
  vec3 ray;
  if (!unproject(self.optics, at, &ray)) return false;
  const vec3 d = self.R_base_optical * ray;
  if (!(d.z * self.centre_m.z < 0)) return false;
  const double s = -self.centre_m.z / d.z;
  *x_m = self.centre_m.x + s * d.x;
  *y_m = self.centre_m.y + s * d.y;
  return finite(*x_m) && finite(*y_m);
}

}  // namespace wm
