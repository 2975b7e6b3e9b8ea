// SPDX-License-Identifier: Apache-2.0
#include "calibrate/bundle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calibrate/fit.h"
#include "common/linear.h"

namespace wm::calibrate {
namespace {

using render::Camera;
using render::Model;
using render::Pose;
using Vec6 = Eigen::Matrix<double, 6, 1>;

constexpr double kNoPixel_px = 100;  // what a corner counts that the camera can't show
constexpr double kHuber_px = 1.5;
constexpr double kPoseGood_px = 8;  // with the guessed focal length

Vec2 miss(const Camera &camera, const Pose &T, const BoardCorner &corner) {
  Vec2 pixel(0, 0);
  const Vec3 point = T * Vec3(corner.board.x(), corner.board.y(), 0);
  return render::project(camera, point, pixel) ? Vec2(pixel - corner.pixel) : Vec2(kNoPixel_px, kNoPixel_px);
}

Pose moved(const Pose &T, const Vec6 &step) {
  Pose out = T;
  const double angle = step.head<3>().norm();
  if (angle > 0) out.linear() = Eigen::AngleAxisd(angle, step.head<3>() / angle).toRotationMatrix() * T.linear();
  out.translation() += step.tail<3>();
  return out;
}

double weight(double r, bool robust) { return robust && r > kHuber_px ? kHuber_px / r : 1.0; }
double cost_of(double r, bool robust) { return robust && r > kHuber_px ? kHuber_px * (2 * r - kHuber_px) : r * r; }

double cost(const Camera &camera, const View &view, bool robust) {
  double sum = 0;
  for (const BoardCorner &corner : view.corners)
    sum += cost_of(miss(camera, view.T_camera_board, corner).norm(), robust);
  return sum;
}

double cost(const Camera &camera, const std::vector<View> &views, bool robust) {
  double sum = 0;
  for (const View &view : views) sum += cost(camera, view, robust);
  return sum;
}

Eigen::Matrix<double, 2, 6> by_pose(const Camera &camera, const Pose &T, const BoardCorner &corner) {
  Eigen::Matrix<double, 2, 6> J;
  for (int k = 0; k < 6; k++) {
    Vec6 step = Vec6::Zero();
    step[k] = 1e-6 * (k < 3 ? 1 : std::max(1e-3, T.translation().norm()));
    J.col(k) = (miss(camera, moved(T, step), corner) - miss(camera, moved(T, -step), corner)) / (2 * step[k]);
  }
  return J;
}

void refine_pose(const Camera &camera, View &view) {
  double lambda = 1e-3, now = cost(camera, view, true);
  for (int iteration = 0; iteration < 20; iteration++) {
    Eigen::Matrix<double, 6, 6> N = Eigen::Matrix<double, 6, 6>::Zero();
    Vec6 g = Vec6::Zero();
    for (const BoardCorner &corner : view.corners) {
      const Vec2 r = miss(camera, view.T_camera_board, corner);
      const auto J = by_pose(camera, view.T_camera_board, corner);
      const double w = weight(r.norm(), true);
      N += w * J.transpose() * J;
      g += w * J.transpose() * r;
    }
    N.diagonal() *= 1 + lambda;
    N.diagonal().array() += 1e-12;
    View next = view;
    next.T_camera_board = moved(view.T_camera_board, -tools::solve_symmetric(N, g));
    const double then = cost(camera, next, true);
    lambda = then < now ? lambda / 5 : lambda * 10;
    if (!(then < now)) continue;
    const bool done = now - then < 1e-4 * now;
    view = std::move(next);
    now = then;
    if (done) break;
  }
  view.rms_px = std::sqrt(now / static_cast<double>(view.corners.size()));
}

// The pose of a plane from rays: d x (H p) = 0 for H = [r1 r2 t], the smallest eigenvector of the normal matrix; then
// refined in pixels.
bool find_pose(const Camera &camera, View &view) {
  Vec2 middle = Vec2::Zero();
  double size = 0;
  for (const BoardCorner &corner : view.corners) middle += corner.board / static_cast<double>(view.corners.size());
  for (const BoardCorner &corner : view.corners) size = std::max(size, (corner.board - middle).norm());
  Eigen::Matrix<double, 9, 9> N = Eigen::Matrix<double, 9, 9>::Zero();
  std::vector<std::pair<Vec3, Vec3>> pairs;
  for (const BoardCorner &corner : view.corners) {
    Vec3 d(0, 0, 1);
    if (!render::unproject(camera, corner.pixel, d)) continue;
    const Vec3 p((corner.board.x() - middle.x()) / size, (corner.board.y() - middle.y()) / size, 1);
    Eigen::Matrix3d cross;
    cross << 0, -d.z(), d.y(), d.z(), 0, -d.x(), -d.y(), d.x(), 0;
    Eigen::Matrix<double, 3, 9> A;
    for (int c = 0; c < 3; c++) A.middleCols<3>(3 * c) = cross * p[c];
    N += A.transpose() * A;
    pairs.emplace_back(d, p);
  }
  if (pairs.size() < 6) return false;
  const Eigen::Matrix<double, 9, 1> h = tools::smallest_eigenvector(N);
  Eigen::Matrix3d H;
  for (int c = 0; c < 3; c++) H.col(c) = h.segment<3>(3 * c);
  double ahead = 0;
  for (const auto &[d, p] : pairs) ahead += d.dot(H * p) > 0 ? 1 : -1;
  if (ahead < 0) H = -H;
  const double scale = 2 / (H.col(0).norm() + H.col(1).norm());
  if (!std::isfinite(scale)) return false;
  Eigen::Matrix3d R;
  R.col(0) = H.col(0) * scale;
  R.col(1) = H.col(1) * scale;
  R.col(2) = R.col(0).cross(R.col(1));
  const tools::Svd3 svd = tools::svd_of(R);
  view.T_camera_board.linear() = svd.U * svd.V.transpose();
  if (view.T_camera_board.linear().determinant() < 0) return false;
  view.T_camera_board.translation() =
      H.col(2) * scale * size - view.T_camera_board.linear() * Vec3(middle.x(), middle.y(), 0);
  refine_pose(camera, view);
  return true;
}

// Normal equations of all, the poses eliminated (Schur): solves for the camera's step and gives back the poses'.
class Normal {
 public:
  Normal(const Camera &camera, const std::vector<View> &views, bool robust, double lambda) {
    const Eigen::VectorXd at = parameters(camera);
    const Eigen::Index n = at.size();
    reduced_ = Eigen::MatrixXd::Zero(n, n);
    right_ = Eigen::VectorXd::Zero(n);
    std::vector<Camera> up(static_cast<size_t>(n), camera), down(static_cast<size_t>(n), camera);
    Eigen::VectorXd steps(n);
    for (Eigen::Index k = 0; k < n; k++) {
      steps[k] = 1e-6 * std::max(1.0, std::fabs(at[k]));
      Eigen::VectorXd v = at;
      v[k] += steps[k];
      set_parameters(v, up[static_cast<size_t>(k)]);
      v[k] -= 2 * steps[k];
      set_parameters(v, down[static_cast<size_t>(k)]);
    }
    Eigen::MatrixXd J(2, n);
    for (const View &view : views) {
      Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n), B = Eigen::MatrixXd::Zero(n, 6);
      Eigen::Matrix<double, 6, 6> C = Eigen::Matrix<double, 6, 6>::Zero();
      Eigen::VectorXd a = Eigen::VectorXd::Zero(n);
      Vec6 c = Vec6::Zero();
      for (const BoardCorner &corner : view.corners) {
        const Vec2 r = miss(camera, view.T_camera_board, corner);
        for (Eigen::Index k = 0; k < n; k++)
          J.col(k) = (miss(up[static_cast<size_t>(k)], view.T_camera_board, corner) -
                      miss(down[static_cast<size_t>(k)], view.T_camera_board, corner)) /
                     (2 * steps[k]);
        const auto P = by_pose(camera, view.T_camera_board, corner);
        if (!(J.cwiseAbs().maxCoeff() < 1e7) || !(P.cwiseAbs().maxCoeff() < 1e7))
          continue;  // at the rim of what the camera shows
        const double w = weight(r.norm(), robust);
        A += w * J.transpose() * J;
        B += w * J.transpose() * P;
        C += w * P.transpose() * P;
        a += w * J.transpose() * r;
        c += w * P.transpose() * r;
      }
      A.diagonal() *= 1 + lambda;
      C.diagonal() *= 1 + lambda;
      C.diagonal().array() += 1e-12;
      const Eigen::Matrix<double, 6, 6> inverse = tools::inverse_of_six(C);
      reduced_ += A - B * inverse * B.transpose();
      right_ += a - B * inverse * c;
      parts_.push_back({B, inverse, c});
    }
  }

  [[nodiscard]] Eigen::VectorXd camera_step() const { return -tools::solve_symmetric(reduced_, right_); }
  [[nodiscard]] Vec6 pose_step(size_t view, const Eigen::VectorXd &camera) const {
    return -parts_[view].inverse * (parts_[view].right + parts_[view].cross.transpose() * camera);
  }
  [[nodiscard]] Eigen::MatrixXd information() const { return reduced_; }

 private:
  struct Part {
    Eigen::MatrixXd cross;
    Eigen::Matrix<double, 6, 6> inverse;
    Vec6 right;
  };
  Eigen::MatrixXd reduced_;
  Eigen::VectorXd right_;
  std::vector<Part> parts_;
};

void refine_all(Camera &camera, std::vector<View> &views, bool robust) {
  double lambda = 1e-3, now = cost(camera, views, robust);
  for (int iteration = 0; iteration < 60 && lambda < 1e10; iteration++) {
    const Normal normal(camera, views, robust, lambda);
    const Eigen::VectorXd step = normal.camera_step();
    Camera next = camera;
    set_parameters(parameters(camera) + step, next);
    std::vector<View> moved_views = views;
    for (size_t i = 0; i < views.size(); i++)
      moved_views[i].T_camera_board = moved(views[i].T_camera_board, normal.pose_step(i, step));
    std::string error;
    const double then =
        render::camera_valid(next, error) ? cost(next, moved_views, robust) : std::numeric_limits<double>::infinity();
    lambda = then < now ? lambda / 5 : lambda * 6;
    if (!(then < now)) continue;
    const bool done = now - then < 1e-9 * now;
    camera = next;
    views = std::move(moved_views);
    now = then;
    if (done) break;
  }
}

void drop_outliers(Calibration &c) {
  std::vector<double> sizes;
  for (const View &view : c.views)
    for (const BoardCorner &corner : view.corners) sizes.push_back(miss(c.camera, view.T_camera_board, corner).norm());
  if (sizes.empty()) return;
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
  const double limit = std::max(1.0, 5 * sizes[sizes.size() / 2] / 1.1774);  // median of a Rayleigh distribution
  for (View &view : c.views) {
    const size_t before = view.corners.size();
    std::erase_if(view.corners, [&](const BoardCorner &corner) {
      return miss(c.camera, view.T_camera_board, corner).norm() > limit;
    });
    c.dropped_corners += before - view.corners.size();
  }
  std::erase_if(c.views, [&](const View &view) {
    if (view.corners.size() >= 8) return false;
    c.dropped_views.push_back(view.name);
    return true;
  });
}

void finish(Calibration &c) {
  refine_all(c.camera, c.views, true);
  drop_outliers(c);
  refine_all(c.camera, c.views, false);
  double sum = 0;
  c.corners = 0;
  for (View &view : c.views) {
    const double here = cost(c.camera, view, false);
    view.rms_px = std::sqrt(here / static_cast<double>(view.corners.size()));
    sum += here;
    c.corners += view.corners.size();
  }
  c.rms_px = std::sqrt(sum / static_cast<double>(std::max<size_t>(1, c.corners)));
  const Normal normal(c.camera, c.views, false, 0);
  const double unknowns = static_cast<double>(normal.information().rows()) + 6.0 * static_cast<double>(c.views.size());
  const double variance = sum / std::max(1.0, 2.0 * static_cast<double>(c.corners) - unknowns);
  c.covariance = variance * tools::inverse_symmetric(normal.information());
}

// Poses of all views by a guessed focal length; the sum of what is left, large where a view has none.
double try_focal(double focal_px, int width, int height, std::vector<View> &views) {
  const Camera guess =
      undistorted(Model::equidistant, width, height, {(width - 1) / 2.0, (height - 1) / 2.0}, focal_px);
  double sum = 0;
  for (View &view : views) {
    if (!find_pose(guess, view)) view.rms_px = kNoPixel_px;
    sum += std::min(view.rms_px, kNoPixel_px);
  }
  return sum;
}

}  // namespace

std::optional<Calibration> calibrate_camera(const std::vector<View> &views, int width, int height) {
  // The focal length by trying: from lenses of 250 degrees across the picture's diagonal to those of 20.
  std::vector<View> few;
  const size_t stride = std::max<size_t>(1, views.size() / 12);
  for (size_t i = 0; i < views.size(); i += stride) few.push_back(views[i]);
  const double diagonal = std::hypot(width, height);
  double best = std::numeric_limits<double>::infinity(), focal = diagonal / 2;
  for (double angle = 4.4; angle > 0.35; angle /= 1.15) {
    const double left = try_focal(diagonal / angle, width, height, few);
    if (!(left < best)) continue;
    best = left;
    focal = diagonal / angle;
  }
  Calibration out;
  out.views = views;
  try_focal(focal, width, height, out.views);
  std::erase_if(out.views, [&](const View &view) {
    if (view.rms_px < kPoseGood_px) return false;
    out.dropped_views.push_back(view.name);
    return true;
  });
  if (out.views.size() < 3) return {};
  out.camera = undistorted(Model::equidistant, width, height, {(width - 1) / 2.0, (height - 1) / 2.0}, focal);
  finish(out);
  return out.views.size() < 3 ? std::nullopt : std::optional<Calibration>(out);
}

std::optional<Calibration> with_model(const Calibration &from, Model model) {
  const Camera &known = from.camera;
  // Rays are only held as far out as corners were seen.
  double widest = 0;
  for (const View &view : from.views)
    for (const BoardCorner &corner : view.corners) {
      Vec3 d(0, 0, 1);
      if (render::unproject(known, corner.pixel, d)) widest = std::max(widest, std::acos(std::clamp(d.z(), -1.0, 1.0)));
    }
  const auto rays = [&](const Vec2 &pixel, Vec3 &d) {
    return render::unproject(known, pixel, d) && std::acos(std::clamp(d.z(), -1.0, 1.0)) <= widest;
  };
  Calibration out = from;
  const size_t n = known.intrinsics.size();
  out.camera =
      fit_model(model, rays, known.width, known.height, {known.intrinsics[n - 2], known.intrinsics[n - 1]}).camera;
  if (out.camera.intrinsics.empty()) return {};
  finish(out);
  return out.views.size() < 3 ? std::nullopt : std::optional<Calibration>(out);
}

double pixel_sigma(const Calibration &calibration, const Vec2 &pixel) {
  const Camera &camera = calibration.camera;
  Vec3 ray(0, 0, 1);
  if (!render::unproject(camera, pixel, ray)) return std::nan("");
  const Eigen::VectorXd at = parameters(camera);
  Eigen::MatrixXd J(2, at.size());
  for (Eigen::Index k = 0; k < at.size(); k++) {
    Camera up = camera, down = camera;
    Eigen::VectorXd v = at;
    const double step = 1e-6 * std::max(1.0, std::fabs(at[k]));
    v[k] += step;
    set_parameters(v, up);
    v[k] -= 2 * step;
    set_parameters(v, down);
    Vec2 a(0, 0), b(0, 0);
    if (!render::project(up, ray, a) || !render::project(down, ray, b)) return std::nan("");
    J.col(k) = (a - b) / (2 * step);
  }
  return std::sqrt(std::max(0.0, (J * calibration.covariance * J.transpose()).trace()));
}

}  // namespace wm::calibrate
