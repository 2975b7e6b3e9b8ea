// SPDX-License-Identifier: Apache-2.0
#include "calibrate/bundle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calibrate/fit.h"
#include "calibrate/solver.h"
#include "common/linear.h"

namespace wm::calibrate {
namespace {

using images::Camera;
using images::Model;
using images::Pose;

constexpr double kPoseGood_px = 8;  // with the guessed focal length

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
    if (!images::unproject(camera, corner.pixel, d)) continue;
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
  view.rms_px = solve_pose(camera, view.corners, view.T_camera_board);
  return true;
}

// All views as a bundle of one camera, a shot each.
Bundle bundle_of(const Calibration &c) {
  Bundle out{
      .cameras = {c.camera}, .T_camera_rig = {Pose::Identity()}, .T_rig_board = {}, .sightings = {}, .measured = {}};
  for (size_t i = 0; i < c.views.size(); i++) {
    out.T_rig_board.push_back(c.views[i].T_camera_board);
    out.sightings.push_back({0, i, c.views[i].corners});
  }
  return out;
}

void refine_all(Calibration &c, bool robust) {
  Bundle bundle = bundle_of(c);
  if (!solve(bundle, robust)) return;
  c.camera = bundle.cameras[0];
  for (size_t i = 0; i < c.views.size(); i++) c.views[i].T_camera_board = bundle.T_rig_board[i];
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
  refine_all(c, true);
  drop_outliers(c);
  refine_all(c, false);
  double sum = 0;
  c.corners = 0;
  for (View &view : c.views) {
    double here = 0;
    for (const BoardCorner &corner : view.corners) here += miss(c.camera, view.T_camera_board, corner).squaredNorm();
    view.rms_px = std::sqrt(here / static_cast<double>(view.corners.size()));
    sum += here;
    c.corners += view.corners.size();
  }
  c.rms_px = std::sqrt(sum / static_cast<double>(std::max<size_t>(1, c.corners)));
  const Eigen::Index n = parameters(c.camera).size();
  const double unknowns = static_cast<double>(n) + 6.0 * static_cast<double>(c.views.size());
  const double variance = sum / std::max(1.0, 2.0 * static_cast<double>(c.corners) - unknowns);
  const std::optional<Eigen::MatrixXd> unit = covariance(bundle_of(c));
  constexpr double kUnknown = 1e6;  // a variance: nothing is known of a parameter
  c.determined = unit.has_value();
  c.covariance = unit ? Eigen::MatrixXd(variance * *unit) : Eigen::MatrixXd(kUnknown * Eigen::MatrixXd::Identity(n, n));
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
      if (images::unproject(known, corner.pixel, d)) widest = std::max(widest, std::acos(std::clamp(d.z(), -1.0, 1.0)));
    }
  const auto rays = [&](const Vec2 &pixel, Vec3 &d) {
    return images::unproject(known, pixel, d) && std::acos(std::clamp(d.z(), -1.0, 1.0)) <= widest;
  };
  const size_t n = known.intrinsics.size();
  std::optional<Calibration> out;
  // Minima that fit the rays nearly alike are distinguished by the corners.
  for (const Camera &start :
       fit_minima(model, rays, known.width, known.height, {known.intrinsics[n - 2], known.intrinsics[n - 1]})) {
    Calibration next = from;
    next.camera = start;
    finish(next);
    if (next.views.size() >= 3 && (!out || next.rms_px < out->rms_px)) out = next;
  }
  return out;
}

double find_board(const Camera &camera, const std::vector<BoardCorner> &corners, Pose &T_camera_board) {
  View view{.name = "", .corners = corners};
  if (!find_pose(camera, view)) return kNoPixel_px;
  T_camera_board = view.T_camera_board;
  return view.rms_px;
}

double pixel_sigma(const Calibration &calibration, const Vec2 &pixel) {
  const Camera &camera = calibration.camera;
  Vec3 ray(0, 0, 1);
  if (!images::unproject(camera, pixel, ray)) return std::nan("");
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
    if (!images::project(up, ray, a) || !images::project(down, ray, b)) return std::nan("");
    J.col(k) = (a - b) / (2 * step);
  }
  return std::sqrt(std::max(0.0, (J * calibration.covariance * J.transpose()).trace()));
}

}  // namespace wm::calibrate
