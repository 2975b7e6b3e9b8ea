// SPDX-License-Identifier: Apache-2.0
#include "calibrate/solver.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <glog/logging.h>

#include <algorithm>
#include <cmath>

#include "calibrate/lens.h"

namespace wm::calibrate {
namespace {

using images::Camera;

constexpr double kHuber_px = 1.5;
constexpr int kPose = 6;  // a rotation vector and a translation, both from where the pose was at the start

// T * exp(step): the step is on the left, as in T_new = {exp(w) R, p + v}.
template <typename T>
void moved_point(const Pose &from, const T *step, const T point[3], T out[3]) {
  const Vec3 p = from.translation();
  T turned[3], rotated[3];
  for (int i = 0; i < 3; i++)
    turned[i] = from.linear()(i, 0) * point[0] + from.linear()(i, 1) * point[1] + from.linear()(i, 2) * point[2];
  ceres::AngleAxisRotatePoint(step, turned, rotated);
  for (int i = 0; i < 3; i++) out[i] = rotated[i] + p[i] + step[3 + i];
}

Pose moved(const Pose &from, const double *step) {
  Pose out = from;
  double R[9];
  ceres::AngleAxisToRotationMatrix(step, R);  // by columns
  out.linear() = Eigen::Map<const Eigen::Matrix3d>(R) * from.linear();
  out.translation() += Vec3(step[3], step[4], step[5]);
  return out;
}

double plain(double v) { return v; }
template <typename T, int N>
double plain(const ceres::Jet<T, N> &v) {
  return v.a;
}

// Pixel of a point less the one that was seen, for Ceres. Outside of what the camera shows: far off, without slope.
template <Model model>
class Lens {
 public:
  Lens(const Camera &camera, const Vec2 &pixel) : camera_(camera), pixel_(pixel) {}

  template <typename T>
  void miss(const T *v, const T point[3], T *residual) const {
    size_t i = 0;
    for (double &value : camera_.intrinsics) value = plain(v[i++]);
    for (double &value : camera_.distortion) value = plain(v[i++]);
    Vec2 unused(0, 0);
    if (!images::project(camera_, {plain(point[0]), plain(point[1]), plain(point[2])}, unused)) {
      residual[0] = residual[1] = T(kNoPixel_px);
      return;
    }
    T there[2];
    lens_pixel<model>(v, point, there);
    residual[0] = there[0] - pixel_.x();
    residual[1] = there[1] - pixel_.y();
  }

 private:
  mutable Camera camera_;  // for the test whether it shows the point; a problem is solved by one thread
  Vec2 pixel_;
};

template <Model model>
struct CornerCost {
  Lens<model> lens;
  Pose T_camera_rig, T_rig_board;
  Vec2 board;

  template <typename T>
  bool operator()(const T *v, const T *rig, const T *shot, T *residual) const {
    const T corner[3] = {T(board.x()), T(board.y()), T(0)};
    T in_rig[3], in_camera[3];
    moved_point(T_rig_board, shot, corner, in_rig);
    moved_point(T_camera_rig, rig, in_rig, in_camera);
    lens.miss(v, in_camera, residual);
    return true;
  }
};

// A measured board: T_base_rig T_rig_board against T_base_board, in sigmas.
struct MeasuredCost {
  MeasuredBoard measured;
  Pose T_base_rig, T_rig_board;

  template <typename T>
  bool operator()(const T *base, const T *shot, T *residual) const {
    // The board's origin and two points a metre from it along its axes give its pose.
    const Vec3 places[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    T is[3][3], want[3][3];
    for (int k = 0; k < 3; k++) {
      const T corner[3] = {T(places[k].x()), T(places[k].y()), T(places[k].z())};
      T in_rig[3];
      moved_point(T_rig_board, shot, corner, in_rig);
      moved_point(T_base_rig, base, in_rig, is[k]);
      const Vec3 there = measured.T_base_board * places[k];
      for (int i = 0; i < 3; i++) want[k][i] = T(there[i]);
    }
    for (int i = 0; i < 3; i++) residual[i] = (is[0][i] - want[0][i]) / measured.sigma_m;
    // Rotation, small: the x axis' two sideways components, the y axis' upward one, all along the measured axes.
    const Eigen::Matrix3d R = measured.T_base_board.linear();
    T x[3], y[3];
    for (int i = 0; i < 3; i++) {
      x[i] = is[1][i] - is[0][i];
      y[i] = is[2][i] - is[0][i];
    }
    const auto along = [&](const T *a, int axis) { return R(0, axis) * a[0] + R(1, axis) * a[1] + R(2, axis) * a[2]; };
    residual[3] = along(x, 1) / measured.sigma_rad;
    residual[4] = along(x, 2) / measured.sigma_rad;
    residual[5] = along(y, 2) / measured.sigma_rad;
    return true;
  }
};

ceres::CostFunction *corner_cost(const Camera &camera, const BoardCorner &corner, const Pose &T_camera_rig,
                                 const Pose &T_rig_board) {
  const auto make = [&]<Model model>() -> ceres::CostFunction * {
    return new ceres::AutoDiffCostFunction<CornerCost<model>, 2, lens_parameters(model), kPose, kPose>(
        new CornerCost<model>{Lens<model>(camera, corner.pixel), T_camera_rig, T_rig_board, corner.board});
  };
  switch (camera.model) {
    case Model::equidistant: return make.operator()<Model::equidistant>();
    case Model::pinhole_radtan: return make.operator()<Model::pinhole_radtan>();
    case Model::omni: return make.operator()<Model::omni>();
    case Model::double_sphere: return make.operator()<Model::double_sphere>();
  }
  return nullptr;
}

// Where a model means something: focal lengths above a pixel, shapes inside of their papers' bounds.
void bound(ceres::Problem &problem, Model model, double *v) {
  const int focal = model == Model::omni ? 1 : model == Model::double_sphere ? 2 : 0;
  for (int i = focal; i < focal + 2; i++) problem.SetParameterLowerBound(v, i, 1);
  if (model == Model::double_sphere) {
    problem.SetParameterLowerBound(v, 0, -0.99), problem.SetParameterUpperBound(v, 0, 0.999);
    problem.SetParameterLowerBound(v, 1, 0), problem.SetParameterUpperBound(v, 1, 0.999);
  } else if (model == Model::omni) {
    problem.SetParameterLowerBound(v, 0, 0), problem.SetParameterUpperBound(v, 0, 20);
  }
}

ceres::Solver::Options options(int iterations, double tolerance) {
  ceres::Solver::Options out;
  out.max_num_iterations = iterations;
  out.function_tolerance = tolerance;
  out.parameter_tolerance = 1e-12;
  out.num_threads = 1;
  out.logging_type = ceres::SILENT;
  return out;
}

// The bundle as a problem of Ceres; the steps are from the bundle's own values.
class Problem {
 public:
  Problem(const Bundle &bundle, bool robust) : bundle_(bundle) {
    for (const Camera &camera : bundle.cameras) lens_.push_back(parameters(camera));
    rig_.assign(bundle.cameras.size(), {});
    shots_.assign(bundle.T_rig_board.size(), {});
    for (const Sighting &s : bundle.sightings)
      for (const BoardCorner &corner : s.corners)
        problem_.AddResidualBlock(
            corner_cost(bundle.cameras[s.camera], corner, bundle.T_camera_rig[s.camera], bundle.T_rig_board[s.shot]),
            robust ? new ceres::HuberLoss(kHuber_px) : nullptr, lens_[s.camera].data(), rig_[s.camera].data(),
            shots_[s.shot].data());
    for (const MeasuredBoard &m : bundle.measured)
      problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<MeasuredCost, 6, kPose, kPose>(
                                    new MeasuredCost{m, bundle.T_base_rig, bundle.T_rig_board[m.shot]}),
                                nullptr, base_.data(), shots_[m.shot].data());
    if (problem_.HasParameterBlock(rig_[0].data())) problem_.SetParameterBlockConstant(rig_[0].data());
  }

  bool solve() {
    for (size_t i = 0; i < lens_.size(); i++)
      if (problem_.HasParameterBlock(lens_[i].data())) bound(problem_, bundle_.cameras[i].model, lens_[i].data());
    ceres::Solver::Options o = options(100, 1e-10);
    o.linear_solver_type = ceres::DENSE_SCHUR;
    ceres::Solver::Summary summary;
    ceres::Solve(o, &problem_, &summary);
    return summary.IsSolutionUsable();
  }

  void write(Bundle &out) const {
    for (size_t i = 0; i < lens_.size(); i++) {
      set_parameters(lens_[i], out.cameras[i]);
      out.T_camera_rig[i] = moved(bundle_.T_camera_rig[i], rig_[i].data());
    }
    for (size_t i = 0; i < shots_.size(); i++) out.T_rig_board[i] = moved(bundle_.T_rig_board[i], shots_[i].data());
    out.T_base_rig = moved(bundle_.T_base_rig, base_.data());
  }

  std::optional<Eigen::MatrixXd> covariance() {
    std::vector<const double *> blocks;
    for (Eigen::VectorXd &v : lens_) blocks.push_back(v.data());
    for (size_t i = 1; i < rig_.size(); i++) blocks.push_back(rig_[i].data());
    if (!bundle_.measured.empty()) blocks.push_back(base_.data());
    Eigen::Index n = 0;
    for (const double *block : blocks) n += problem_.ParameterBlockSize(block);
    FLAGS_minloglevel = google::GLOG_FATAL;  // the result states what is not determined
    ceres::Covariance::Options o;
    o.num_threads = 1;
    ceres::Covariance of(o);
    if (!of.Compute(blocks, &problem_)) return {};
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> out(n, n);
    if (!of.GetCovarianceMatrix(blocks, out.data())) return {};
    return Eigen::MatrixXd(out);
  }

 private:
  using Step = std::array<double, kPose>;
  const Bundle &bundle_;
  std::vector<Eigen::VectorXd> lens_;
  std::vector<Step> rig_, shots_;
  Step base_{};
  ceres::Problem problem_;
};

}  // namespace

Vec2 miss(const Camera &camera, const Pose &T, const BoardCorner &corner) {
  Vec2 pixel(0, 0);
  const Vec3 point = T * Vec3(corner.board.x(), corner.board.y(), 0);
  return images::project(camera, point, pixel) ? Vec2(pixel - corner.pixel) : Vec2(kNoPixel_px, kNoPixel_px);
}

bool solve(Bundle &bundle, bool robust) {
  const Bundle start = bundle;
  Problem problem(start, robust);
  if (!problem.solve()) return false;
  problem.write(bundle);
  return true;
}

double solve_pose(const Camera &camera, const std::vector<BoardCorner> &corners, Pose &T_camera_board) {
  Eigen::VectorXd lens = parameters(camera);
  double rig[kPose] = {}, shot[kPose] = {};
  ceres::Problem problem;
  for (const BoardCorner &corner : corners)
    problem.AddResidualBlock(corner_cost(camera, corner, Pose::Identity(), T_camera_board),
                             new ceres::HuberLoss(kHuber_px), lens.data(), rig, shot);
  problem.SetParameterBlockConstant(lens.data());
  problem.SetParameterBlockConstant(rig);
  ceres::Solver::Options o = options(20, 1e-4);
  o.linear_solver_type = ceres::DENSE_QR;
  ceres::Solver::Summary summary;
  ceres::Solve(o, &problem, &summary);
  if (!summary.IsSolutionUsable()) return kNoPixel_px;
  T_camera_board = moved(T_camera_board, shot);
  return std::sqrt(2 * summary.final_cost / static_cast<double>(corners.size()));
}

std::optional<Eigen::MatrixXd> covariance(const Bundle &bundle) { return Problem(bundle, false).covariance(); }

}  // namespace wm::calibrate
