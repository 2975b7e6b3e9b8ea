// SPDX-License-Identifier: Apache-2.0
#include "images/camera.h"

#include <algorithm>
#include <cmath>

#include "waymark/internal/math/elementary.hpp"

namespace wm::images {

namespace {

struct Focal {
  double fx, fy, cx, cy;
};

size_t focal_place(Model model) { return model == Model::omni ? 1 : model == Model::double_sphere ? 2 : 0; }

Focal focal(const Camera &camera) {
  const double *v = camera.intrinsics.data() + focal_place(camera.model);
  return {v[0], v[1], v[2], v[3]};
}

double coefficient(const Camera &camera, size_t i) { return i < camera.distortion.size() ? camera.distortion[i] : 0.0; }

// Kannala-Brandt: the distorted angle and its derivative.
struct Angle {
  double value, slope;
};
Angle distort_angle(const Camera &camera, double theta) {
  const double t2 = theta * theta;
  const double k1 = coefficient(camera, 0), k2 = coefficient(camera, 1), k3 = coefficient(camera, 2),
               k4 = coefficient(camera, 3);
  return {theta * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))),
          1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4)))};
}

// Brown's distortion on the normalised plane and its Jacobian.
struct Bent {
  Vec2 value;
  double dxx, dxy, dyy;  // symmetric by construction of the model
};
Bent bend(const Camera &camera, const Vec2 &p) {
  const double k1 = coefficient(camera, 0), k2 = coefficient(camera, 1), p1 = coefficient(camera, 2),
               p2 = coefficient(camera, 3), k3 = coefficient(camera, 4);
  const double x = p.x(), y = p.y(), r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3));  // d radial / d r2, times two
  return {{x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y},
          radial + x * x * slope + 2 * p1 * y + 6 * p2 * x,
          x * y * slope + 2 * p1 * x + 2 * p2 * y,
          radial + y * y * slope + 6 * p1 * y + 2 * p2 * x};
}

// Where the distortion turns back on itself the picture folds: such points have no pixel.
bool folds(const Camera &camera, const Vec2 &p) {
  const Bent b = bend(camera, p);
  return b.dxx * b.dyy - b.dxy * b.dxy <= 0 || b.dxx + b.dyy <= 0;
}

bool unbend(const Camera &camera, const Vec2 &bent, Vec2 &out) {
  out = bent;
  for (int i = 0; i < 40; i++) {
    const Bent b = bend(camera, out);
    const double det = b.dxx * b.dyy - b.dxy * b.dxy;
    if (!(det > 1e-6)) return false;
    const Vec2 miss = bent - b.value;
    const Vec2 step{(b.dyy * miss.x() - b.dxy * miss.y()) / det, (b.dxx * miss.y() - b.dxy * miss.x()) / det};
    out += step;
    if (step.squaredNorm() < 1e-28 * (1 + out.squaredNorm())) return !folds(camera, out);
  }
  return false;
}

bool inside_lens(const Camera &camera, const Vec3 &unit) {
  return camera.fov_rad >= 2 * kPi || unit.z() >= wm::cos(camera.fov_rad / 2);
}

bool project_equidistant(const Camera &camera, const Vec3 &d, Vec2 &m) {
  const double r = std::sqrt(d.x() * d.x() + d.y() * d.y());
  const double theta = wm::atan2(r, d.z());
  // Beyond the first angle where the curve turns back there is no picture.
  constexpr int kSteps = 32;
  for (int i = 1; i <= kSteps; i++)
    if (distort_angle(camera, theta * i / kSteps).slope <= 0) return false;
  const double value = distort_angle(camera, theta).value;
  m = r > 0 ? Vec2(d.x() / r * value, d.y() / r * value) : Vec2(0, 0);
  return r > 0 || d.z() > 0;
}

bool unproject_equidistant(const Camera &camera, const Vec2 &m, Vec3 &d) {
  const double distorted = m.norm();
  double theta = std::min(distorted, kPi);
  for (int i = 0; i < 60; i++) {
    const Angle a = distort_angle(camera, theta);
    if (!(a.slope > 1e-9)) return false;
    const double step = (distorted - a.value) / a.slope;
    theta = std::clamp(theta + step, 0.0, kPi);
    if (std::fabs(step) < 1e-14) break;
  }
  if (std::fabs(distort_angle(camera, theta).value - distorted) > 1e-9) return false;
  const sin_cos a = sincos(theta);
  d = distorted > 0 ? Vec3(m.x() / distorted * a.sin, m.y() / distorted * a.sin, a.cos) : Vec3(0, 0, 1);
  return true;
}

bool project_omni(const Camera &camera, const Vec3 &d, Vec2 &m) {
  const double xi = camera.intrinsics[0];
  // Mei's mirror sees what lies above z = -1/xi on the sphere (xi > 1), or before the plane z = -xi (xi <= 1).
  if (d.z() <= (xi > 1 ? -1 / xi : -xi) + 1e-9) return false;
  const Vec2 p{d.x() / (d.z() + xi), d.y() / (d.z() + xi)};
  if (folds(camera, p)) return false;
  m = bend(camera, p).value;
  return true;
}

bool unproject_omni(const Camera &camera, const Vec2 &m, Vec3 &d) {
  const double xi = camera.intrinsics[0];
  Vec2 p(0, 0);
  if (!unbend(camera, m, p)) return false;
  const double r2 = p.squaredNorm(), root = 1 + (1 - xi * xi) * r2;
  if (root < 0) return false;
  const double factor = (xi + std::sqrt(root)) / (r2 + 1);
  d = Vec3(factor * p.x(), factor * p.y(), factor - xi);
  return true;
}

bool project_double_sphere(const Camera &camera, const Vec3 &d, Vec2 &m) {
  const double xi = camera.intrinsics[0], alpha = camera.intrinsics[1];
  const double w1 = alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
  const double w2 = (w1 + xi) / std::sqrt(2 * w1 * xi + xi * xi + 1);
  if (d.z() <= -w2) return false;  // equation 43
  const double z2 = xi + d.z(), d2 = std::sqrt(d.x() * d.x() + d.y() * d.y() + z2 * z2);
  const double under = alpha * d2 + (1 - alpha) * z2;
  if (under <= 1e-9) return false;
  m = Vec2(d.x() / under, d.y() / under);
  return true;
}

bool unproject_double_sphere(const Camera &camera, const Vec2 &m, Vec3 &d) {
  const double xi = camera.intrinsics[0], alpha = camera.intrinsics[1], r2 = m.squaredNorm();
  const double root = 1 - (2 * alpha - 1) * r2;
  if (root < 0) return false;  // alpha > 0.5: r2 beyond 1 / (2 alpha - 1), equation 51
  const double mz = (1 - alpha * alpha * r2) / (alpha * std::sqrt(root) + 1 - alpha);
  const double second = mz * mz + (1 - xi * xi) * r2;
  if (second < 0) return false;
  const double factor = (mz * xi + std::sqrt(second)) / (mz * mz + r2);
  d = Vec3(factor * m.x(), factor * m.y(), factor * mz - xi);
  return true;
}

bool project_radtan(const Camera &camera, const Vec3 &d, Vec2 &m) {
  if (d.z() <= 1e-6) return false;
  const Vec2 p{d.x() / d.z(), d.y() / d.z()};
  if (folds(camera, p)) return false;
  m = bend(camera, p).value;
  return true;
}

bool unproject_radtan(const Camera &camera, const Vec2 &m, Vec3 &d) {
  Vec2 p(0, 0);
  if (!unbend(camera, m, p)) return false;
  d = Vec3(p.x(), p.y(), 1);
  return true;
}

}  // namespace

bool model_from_name(const std::string &name, Model &out) {
  for (Model model : {Model::equidistant, Model::pinhole_radtan, Model::omni, Model::double_sphere}) {
    if (name != model_name(model)) continue;
    out = model;
    return true;
  }
  return false;
}

const char *model_name(Model model) {
  switch (model) {
    case Model::equidistant: return "equidistant";
    case Model::pinhole_radtan: return "pinhole-radtan";
    case Model::omni: return "omni";
    case Model::double_sphere: return "double-sphere";
  }
  return "";
}

bool camera_valid(const Camera &camera, std::string &error) {
  const std::string name = model_name(camera.model);
  if (camera.width < 1 || camera.height < 1 || camera.width > 16384 || camera.height > 16384)
    return error = "size: 1 to 16384 pixels a side", false;
  if (camera.intrinsics.size() != focal_place(camera.model) + 4)
    return error = "intrinsics: " + name + " needs " + std::to_string(focal_place(camera.model) + 4) + " values", false;
  const Focal f = focal(camera);
  if (!(f.fx > 0) || !(f.fy > 0)) return error = "intrinsics: focal lengths must be positive", false;
  const size_t n = camera.distortion.size();
  const bool fits = n == 0 || (camera.model == Model::equidistant     ? n == 4
                               : camera.model == Model::double_sphere ? false
                                                                      : n == 4 || n == 5);
  if (!fits) return error = "distortion: " + std::to_string(n) + " values don't fit " + name, false;
  for (double v : camera.intrinsics)
    if (!std::isfinite(v)) return error = "intrinsics: not a number", false;
  for (double v : camera.distortion)
    if (!std::isfinite(v)) return error = "distortion: not a number", false;
  return true;
}

bool project(const Camera &camera, const Vec3 &point, Vec2 &pixel) {
  const double length = point.norm();
  if (!(length > 0)) return false;
  const Vec3 d = point / length;
  if (!inside_lens(camera, d)) return false;
  Vec2 m(0, 0);
  bool there = false;
  switch (camera.model) {
    case Model::equidistant: there = project_equidistant(camera, d, m); break;
    case Model::pinhole_radtan: there = project_radtan(camera, d, m); break;
    case Model::omni: there = project_omni(camera, d, m); break;
    case Model::double_sphere: there = project_double_sphere(camera, d, m); break;
  }
  const Focal f = focal(camera);
  if (there) pixel = Vec2(f.fx * m.x() + f.cx, f.fy * m.y() + f.cy);
  return there;
}

bool unproject(const Camera &camera, const Vec2 &pixel, Vec3 &direction) {
  const Focal f = focal(camera);
  const Vec2 m{(pixel.x() - f.cx) / f.fx, (pixel.y() - f.cy) / f.fy};
  Vec3 d(0, 0, 1);
  bool there = false;
  switch (camera.model) {
    case Model::equidistant: there = unproject_equidistant(camera, m, d); break;
    case Model::pinhole_radtan: there = unproject_radtan(camera, m, d); break;
    case Model::omni: there = unproject_omni(camera, m, d); break;
    case Model::double_sphere: there = unproject_double_sphere(camera, m, d); break;
  }
  if (!there) return false;
  direction = d.normalized();
  return inside_lens(camera, direction);
}

Pose T_body_optical() {
  Pose out = Pose::Identity();
  out.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return out;
}

Pose T_base_optical(const Camera &camera) { return camera.T_base_camera * T_body_optical(); }

double row_offset_ns(const Camera &camera, double v_px) {
  if (camera.height < 2) return 0;
  return (v_px - 0.5 * (camera.height - 1)) / (camera.height - 1) * static_cast<double>(camera.readout_ns);
}

}  // namespace wm::images
