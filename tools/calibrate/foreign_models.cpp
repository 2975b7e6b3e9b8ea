// SPDX-License-Identifier: Apache-2.0
// Rays of models that are not ours.
#include <cmath>

#include "calibrate/foreign.h"

namespace wm::calibrate {
namespace {

Vec2 normalised(const Matrix3 &k, const Vec2 &pixel) {
  const double y = (pixel.y() - k.cy) / k.fy;
  return {(pixel.x() - k.cx - k.skew * y) / k.fx, y};
}

images::Camera ours(images::Model model, const Matrix3 &k, const std::vector<double> &distortion, int width,
                    int height) {
  images::Camera out;
  out.model = model;
  out.width = width;
  out.height = height;
  out.intrinsics = {k.fx, k.fy, k.cx, k.cy};
  out.distortion = distortion;
  return out;
}

ForeignCamera with_rays(const Matrix3 &k, int width, int height, const std::function<bool(const Vec2 &, Vec3 &)> &ray) {
  ForeignCamera out;
  out.width = width;
  out.height = height;
  out.centre = {k.cx, k.cy};
  out.unproject = [k, ray](const Vec2 &pixel, Vec3 &direction) {
    if (!ray(normalised(k, pixel), direction)) return false;
    direction.normalize();
    return direction.allFinite();
  };
  return out;
}

// OpenCV's whole model with up to twelve coefficients: radial as a quotient, tangential, thin prism.
Vec2 bend(const std::vector<double> &d, const Vec2 &p) {
  const auto at = [&](size_t i) { return i < d.size() ? d[i] : 0.0; };
  const double x = p.x(), y = p.y(), r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
  const double radial = (1 + at(0) * r2 + at(1) * r4 + at(4) * r6) / (1 + at(5) * r2 + at(6) * r4 + at(7) * r6);
  return {x * radial + 2 * at(2) * x * y + at(3) * (r2 + 2 * x * x) + at(8) * r2 + at(9) * r4,
          y * radial + at(2) * (r2 + 2 * y * y) + 2 * at(3) * x * y + at(10) * r2 + at(11) * r4};
}

// Newton's method from the centre outwards, so that it stays on the branch that the lens is on.
bool unbend(const std::vector<double> &d, const Vec2 &bent, Vec2 &out) {
  constexpr int kStages = 12;
  constexpr double kStep = 1e-6;
  out = Vec2::Zero();
  for (int stage = 1; stage <= kStages; stage++) {
    const Vec2 wanted = bent * (static_cast<double>(stage) / kStages);
    for (int i = 0; i < 20; i++) {
      const Vec2 miss = wanted - bend(d, out);
      const Vec2 dx = (bend(d, out + Vec2(kStep, 0)) - bend(d, out - Vec2(kStep, 0))) / (2 * kStep);
      const Vec2 dy = (bend(d, out + Vec2(0, kStep)) - bend(d, out - Vec2(0, kStep))) / (2 * kStep);
      const double det = dx.x() * dy.y() - dx.y() * dy.x();
      if (!(det > 1e-4)) return false;  // the picture folds here
      out += Vec2(dy.y() * miss.x() - dy.x() * miss.y(), dx.x() * miss.y() - dx.y() * miss.x()) / det;
      if (miss.squaredNorm() < 1e-24) break;
    }
  }
  return (bend(d, out) - bent).norm() < 1e-9;
}

}  // namespace

ForeignCamera our_camera(const images::Camera &camera) {
  ForeignCamera out;
  out.width = camera.width;
  out.height = camera.height;
  const size_t n = camera.intrinsics.size();
  out.centre = {camera.intrinsics[n - 2], camera.intrinsics[n - 1]};
  out.same = camera;
  out.unproject = [camera](const Vec2 &pixel, Vec3 &direction) { return images::unproject(camera, pixel, direction); };
  return out;
}

ForeignCamera plain_camera(const Matrix3 &k, const std::vector<double> &distortion, int width, int height) {
  std::vector<double> d = distortion;
  while (d.size() > 5 && d.back() == 0) d.pop_back();
  if (d.size() < 4) d.resize(4, 0.0);
  if (d.size() <= 5 && k.skew == 0) return our_camera(ours(images::Model::pinhole_radtan, k, d, width, height));
  return with_rays(k, width, height, [d](const Vec2 &m, Vec3 &direction) {
    Vec2 p(0, 0);
    if (!unbend(d, m, p)) return false;
    direction = {p.x(), p.y(), 1};
    return true;
  });
}

ForeignCamera fisheye_camera(const Matrix3 &k, const std::vector<double> &distortion, int width, int height) {
  std::vector<double> d = distortion;
  d.resize(4, 0.0);
  if (k.skew == 0) return our_camera(ours(images::Model::equidistant, k, d, width, height));
  const images::Camera straight = ours(images::Model::equidistant, {1, 1, 0, 0, 0}, d, width, height);
  return with_rays(k, width, height,
                   [straight](const Vec2 &m, Vec3 &direction) { return images::unproject(straight, m, direction); });
}

ForeignCamera fov_camera(const Matrix3 &k, double w, int width, int height) {
  return with_rays(k, width, height, [w](const Vec2 &m, Vec3 &direction) {
    const double distorted = m.norm();
    if (distorted * w >= images::kPi / 2) return false;
    const double r = std::tan(distorted * w) / (2 * std::tan(w / 2));
    direction = distorted > 0 ? Vec3(m.x() / distorted * r, m.y() / distorted * r, 1) : Vec3(0, 0, 1);
    return true;
  });
}

ForeignCamera eucm_camera(double alpha, double beta, const Matrix3 &k, int width, int height) {
  return with_rays(k, width, height, [alpha, beta](const Vec2 &m, Vec3 &direction) {
    const double r2 = m.squaredNorm(), root = 1 - (2 * alpha - 1) * beta * r2;
    if (root < 0) return false;
    direction = {m.x(), m.y(), (1 - beta * alpha * alpha * r2) / (alpha * std::sqrt(root) + 1 - alpha)};
    return true;
  });
}

}  // namespace wm::calibrate
