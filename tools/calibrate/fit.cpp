// SPDX-License-Identifier: Apache-2.0
#include "calibrate/fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace wm::calibrate {
namespace {

using images::Camera;
using images::Model;

// What a ray counts that the model can't show: far worse than any fit, yet not so that one such ray decides all.
constexpr double kNoPixel_px = 300;

Vec2 miss(const Camera &camera, const Ray &ray) {
  Vec2 pixel(0, 0);
  return images::project(camera, ray.direction, pixel) ? Vec2(pixel - ray.pixel) : Vec2(kNoPixel_px, kNoPixel_px);
}

bool possible(const Camera &camera) {
  std::string error;
  if (!images::camera_valid(camera, error)) return false;
  const auto &v = camera.intrinsics;
  if (camera.model == Model::double_sphere) return v[0] > -0.99 && v[0] < 1 && v[1] >= 0 && v[1] < 1;
  return camera.model != Model::omni || (v[0] >= 0 && v[0] < 20);
}

double cost(const Camera &camera, const std::vector<Ray> &rays) {
  double sum = 0;
  for (const Ray &ray : rays) sum += miss(camera, ray).squaredNorm();
  return sum;
}

void refine(Camera &camera, const std::vector<Ray> &rays) {
  const Eigen::Index n = parameters(camera).size();
  double lambda = 1e-3, now = cost(camera, rays);
  for (int iteration = 0; iteration < 200 && lambda < 1e12; iteration++) {
    const Eigen::VectorXd at = parameters(camera);
    Eigen::MatrixXd N = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
    Eigen::VectorXd steps(n);
    for (Eigen::Index k = 0; k < n; k++) steps[k] = 1e-6 * std::max(1.0, std::fabs(at[k]));
    std::vector<Camera> up(static_cast<size_t>(n), camera), down(static_cast<size_t>(n), camera);
    for (Eigen::Index k = 0; k < n; k++) {
      Eigen::VectorXd v = at;
      v[k] += steps[k];
      set_parameters(v, up[static_cast<size_t>(k)]);
      v[k] -= 2 * steps[k];
      set_parameters(v, down[static_cast<size_t>(k)]);
    }
    Eigen::MatrixXd J(2, n);
    for (const Ray &ray : rays) {
      const Vec2 r = miss(camera, ray);
      if (r.x() == kNoPixel_px) continue;
      for (Eigen::Index k = 0; k < n; k++)
        J.col(k) = (miss(up[static_cast<size_t>(k)], ray) - miss(down[static_cast<size_t>(k)], ray)) / (2 * steps[k]);
      if (J.cwiseAbs().maxCoeff() > 1e7) continue;  // at the rim of what the model shows
      N += J.transpose() * J;
      g += J.transpose() * r;
    }
    bool better = false;
    while (!better && lambda < 1e12) {
      Eigen::MatrixXd damped = N;
      damped.diagonal() *= 1 + lambda;
      damped.diagonal().array() += 1e-12;
      Camera next = camera;
      set_parameters(at - damped.ldlt().solve(g), next);
      const double then = possible(next) ? cost(next, rays) : std::numeric_limits<double>::infinity();
      better = then < now;
      lambda = better ? std::max(lambda / 5, 1e-12) : lambda * 4;
      if (!better) continue;
      const bool done = now - then < 1e-12 * (1 + now);
      camera = next;
      now = then;
      if (done) return;
    }
  }
}

std::vector<Camera> starts(Model model, int width, int height, const Vec2 &centre, double focal) {
  std::vector<Camera> out{undistorted(model, width, height, centre, focal)};
  const auto with = [&](std::vector<double> shape) {
    Camera camera = out.front();
    std::copy(shape.begin(), shape.end(), camera.intrinsics.begin());
    const double scale = (1 + shape[0]) / (1 + out.front().intrinsics[0]);
    camera.intrinsics[shape.size()] *= scale;
    camera.intrinsics[shape.size() + 1] *= scale;
    out.push_back(camera);
  };
  if (model == Model::double_sphere)
    for (const double alpha : {0.5, 0.65}) with({-0.2, alpha}), with({0.15, alpha}), with({0.4, alpha});
  if (model == Model::omni) with({0.3}), with({1.6}), with({2.5});
  return out;
}

// Pixels an angle of 1 rad is away from the axis, near it.
double focal_near(const std::function<bool(const Vec2 &, Vec3 &)> &unproject, const Vec2 &centre) {
  Vec3 a(0, 0, 1), b(0, 0, 1);
  constexpr double kReach_px = 8;
  if (!unproject(centre - Vec2(kReach_px, 0), a) || !unproject(centre + Vec2(kReach_px, 0), b)) return 500;
  const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
  return angle > 1e-6 ? 2 * kReach_px / angle : 500;
}

}  // namespace

Eigen::VectorXd parameters(const Camera &camera) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(camera.intrinsics.size() + camera.distortion.size()));
  Eigen::Index i = 0;
  for (const double v : camera.intrinsics) out[i++] = v;
  for (const double v : camera.distortion) out[i++] = v;
  return out;
}

void set_parameters(const Eigen::VectorXd &values, Camera &camera) {
  Eigen::Index i = 0;
  for (double &v : camera.intrinsics) v = values[i++];
  for (double &v : camera.distortion) v = values[i++];
}

std::vector<std::string> parameter_names(Model model) {
  switch (model) {
    case Model::equidistant: return {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};
    case Model::pinhole_radtan: return {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
    case Model::omni: return {"xi", "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
    case Model::double_sphere: return {"xi", "alpha", "fx", "fy", "cx", "cy"};
  }
  return {};
}

Camera undistorted(Model model, int width, int height, const Vec2 &centre, double focal_px) {
  Camera out{.model = model, .width = width, .height = height, .intrinsics = {}, .distortion = {}};
  const double cx = centre.x(), cy = centre.y();
  switch (model) {
    case Model::equidistant:
      out.intrinsics = {focal_px, focal_px, cx, cy};
      out.distortion.assign(4, 0.0);
      break;
    case Model::pinhole_radtan:
      out.intrinsics = {focal_px, focal_px, cx, cy};
      out.distortion.assign(5, 0.0);
      break;
    case Model::omni:
      out.intrinsics = {1, 2 * focal_px, 2 * focal_px, cx, cy};
      out.distortion.assign(4, 0.0);
      break;
    case Model::double_sphere: out.intrinsics = {0, 0.57, focal_px, focal_px, cx, cy}; break;
  }
  return out;
}

std::vector<Ray> sample_rays(const std::function<bool(const Vec2 &, Vec3 &)> &unproject, int width, int height,
                             int columns, int rows) {
  std::vector<Ray> out;
  for (int j = 0; j < rows; j++)
    for (int i = 0; i < columns; i++) {
      const Vec2 pixel((width - 1.0) * i / (columns - 1), (height - 1.0) * j / (rows - 1));
      Vec3 direction(0, 0, 1);
      if (unproject(pixel, direction)) out.push_back({pixel, direction});
    }
  return out;
}

double widest_angle(const std::vector<Ray> &rays) {
  double widest = 0;
  for (const Ray &ray : rays) widest = std::max(widest, std::atan2(ray.direction.head<2>().norm(), ray.direction.z()));
  return widest;
}

std::vector<Camera> fit_minima(Model model, const std::function<bool(const Vec2 &, Vec3 &)> &unproject, int width,
                               int height, const Vec2 &centre) {
  const std::vector<Ray> rays = sample_rays(unproject, width, height, 33, 25);
  std::vector<std::pair<double, Camera>> found;
  for (Camera start : starts(model, width, height, centre, focal_near(unproject, centre))) {
    refine(start, rays);
    found.emplace_back(cost(start, rays), start);
  }
  std::stable_sort(found.begin(), found.end(), [](const auto &a, const auto &b) { return a.first < b.first; });
  constexpr double kAnother = 0.1;  // of the first parameter, a shape where there are several starts
  std::vector<Camera> out;
  for (const auto &[left, camera] : found)
    if (std::none_of(out.begin(), out.end(), [&, &camera = camera](const Camera &other) {
          return std::fabs(other.intrinsics[0] - camera.intrinsics[0]) < kAnother;
        }))
      out.push_back(camera);
  return out;
}

Fit fit_model(Model model, const std::function<bool(const Vec2 &, Vec3 &)> &unproject, int width, int height,
              const Vec2 &centre) {
  Fit out;
  out.camera = fit_minima(model, unproject, width, height, centre).front();
  double sum = 0;
  for (const Ray &ray : sample_rays(unproject, width, height, width / 8 + 2, height / 8 + 2)) {
    out.rays++;
    const double off = miss(out.camera, ray).norm();
    if (off >= kNoPixel_px) {
      out.failed++;
      continue;
    }
    sum += off;
    if (off <= out.max_px) continue;
    out.max_px = off;
    out.worst = ray.pixel;
  }
  if (out.rays > out.failed) sum /= static_cast<double>(out.rays - out.failed);
  out.mean_px = sum;
  return out;
}

}  // namespace wm::calibrate
