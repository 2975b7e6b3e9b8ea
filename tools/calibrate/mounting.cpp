// SPDX-License-Identifier: Apache-2.0
#include "calibrate/mounting.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <numbers>

#include "common/failure.h"
#include "common/pose.h"
#include "waymark/internal/filters/edge_mcl/floor_camera.hpp"
#include "waymark/internal/maps/edge_map.hpp"

namespace wm::calibrate {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kPiece_s = 7;
constexpr int kRoundsMax = 25;
constexpr double kRange_m = 6, kPoint_m = 0.012, kPixel_px = 0.5, kCorrelated = 30;
constexpr double kNormalGate = 0.8;  // cosine
// What is taken for possible beforehand: ten times what people measure badly.
constexpr double kPrior[kMountingErrors] = {0.05, 0.05, 0.05, 0.05, 0.1, 0.03, 0.05, 0.05};

// The estimator's map of lines, with its memory.
class Lines {
 public:
  explicit Lines(const wm_raster &raster) {
    const size_t own = (sizeof(edge_map) + 63) / 64 * 64, bytes = edge_map::bytes(raster);
    if (bytes == 0) throw tools::Failure("the map has no edges, or is too large", tools::kUsage);
    memory_ = std::make_unique<Block[]>((own + bytes + 63) / 64);
    map_ = new (memory_.get()) edge_map;
    map_->init(raster, memory_[own / 64].bytes);
  }
  [[nodiscard]] edge_line nearest(double x, double y) const { return map_->nearest(x, y); }

 private:
  struct alignas(64) Block {
    char bytes[64];
  };
  std::unique_ptr<Block[]> memory_;
  edge_map *map_;
};

Vector3d relative(const Vector3d &a, const Vector3d &b) {
  const double c = std::cos(a.z()), s = std::sin(a.z());
  const Vector3d d = b - a;
  return {c * d.x() + s * d.y(), c * d.y() - s * d.x(), tools::wrap(d.z())};
}

// Normal equations of a piece of the drive: 3 unknowns a scan, then the errors; and those of the errors alone, with the
// poses eliminated.
struct Piece {
  size_t from, to;
  MatrixXd h;
  VectorXd g;
  MatrixXd reduced_h;
  VectorXd reduced_g;
  MatrixXd back;  // poses' change = pose_g - back * errors' change
  VectorXd pose_g;
};

class Problem {
 public:
  Problem(const std::vector<MountingScan> &scans, const wm_raster &map, const wm_camera &camera)
      : scans_(scans), lines_(map), error_(VectorXd::Zero(kMountingErrors)) {
    camera_.init(camera);
    for (const MountingScan &scan : scans) poses_.push_back(scan.start);
    const double all_s = 1e-9 * static_cast<double>(scans.back().t_ns - scans.front().t_ns);
    const size_t count = std::max<size_t>(4, static_cast<size_t>(all_s / kPiece_s));
    for (size_t k = 0; k < count; k++)
      pieces_.push_back({k * scans.size() / count, (k + 1) * scans.size() / count, {}, {}, {}, {}, {}, {}});
  }

  // Returns by how many sigmas the errors moved at most.
  double round(double gate_m) {
    explained_ = seen_ = 0;
    squares_ = 0;
    MatrixXd h = MatrixXd::Zero(kMountingErrors, kMountingErrors);
    VectorXd g = VectorXd::Zero(kMountingErrors);
    for (int i = 0; i < kMountingErrors; i++) {
      h(i, i) = 1 / (kPrior[i] * kPrior[i]);
      g[i] = -error_[i] / (kPrior[i] * kPrior[i]);
    }
    for (Piece &piece : pieces_) {
      fill(piece, gate_m);
      reduce(piece);
      h += piece.reduced_h;
      g += piece.reduced_g;
    }
    covariance_ = h.ldlt().solve(MatrixXd::Identity(kMountingErrors, kMountingErrors));
    const VectorXd step = covariance_ * g;
    error_ += step;
    for (const Piece &piece : pieces_) {
      const VectorXd change = piece.pose_g - piece.back * step;
      for (size_t k = piece.from; k < piece.to; k++) {
        poses_[k] += change.segment<3>(static_cast<Eigen::Index>(3 * (k - piece.from)));
        poses_[k].z() = tools::wrap(poses_[k].z());
      }
    }
    return step.cwiseQuotient(covariance_.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff();
  }

  [[nodiscard]] Mounting result() const {
    MatrixXd scatter = MatrixXd::Zero(kMountingErrors, kMountingErrors);
    VectorXd mean = VectorXd::Zero(kMountingErrors);
    for (const Piece &p : pieces_) mean += p.reduced_g / static_cast<double>(pieces_.size());
    for (const Piece &p : pieces_) scatter += (p.reduced_g - mean) * (p.reduced_g - mean).transpose();
    const double n = static_cast<double>(pieces_.size());
    const MatrixXd sandwich = covariance_ * scatter * covariance_ * (n / (n - 1));
    Mounting out;
    for (int i = 0; i < kMountingErrors; i++) {
      const auto k = static_cast<size_t>(i);
      out.value[k] = error_[i];
      out.sigma[k] = std::sqrt(std::max(covariance_(i, i), sandwich(i, i)));
    }
    out.explained = seen_ > 0 ? explained_ / seen_ : 0;
    out.rms_m = explained_ > 0 ? std::sqrt(squares_ / explained_) : 0;
    out.scans = static_cast<int>(scans_.size());
    return out;
  }

 private:
  void fill(Piece &piece, double gate_m) {
    const auto poses = static_cast<Eigen::Index>(3 * (piece.to - piece.from)), all = poses + kMountingErrors;
    piece.h = MatrixXd::Zero(all, all);
    piece.g = VectorXd::Zero(all);
    for (size_t k = piece.from; k < piece.to; k++) {
      const auto at = static_cast<Eigen::Index>(3 * (k - piece.from));
      see(piece, k, at, poses, gate_m);
      if (k + 1 < piece.to) drive(piece, k, at, poses);
    }
  }

  // The scan's points on the map's lines.
  void see(Piece &piece, size_t k, Eigen::Index at, Eigen::Index errors, double gate_m) {
    const MountingScan &scan = scans_[k];
    const double v = (1 + error_[kSpeedScale]) * scan.v_mps, w = scan.w_radps - error_[kYawRateBias];
    const double age = error_[kTimeOffset];
    const Vector3d &now = poses_[k];
    const double heading = now.z() - w * age, middle = now.z() - 0.5 * w * age;
    const double c = std::cos(heading), s = std::sin(heading);
    const double there_x = now.x() - v * age * std::cos(middle), there_y = now.y() - v * age * std::sin(middle);
    const double eye_x = there_x + c * camera_.x_m - s * camera_.y_m,
                 eye_y = there_y + s * camera_.x_m + c * camera_.y_m;
    const wm_points &p = scan.points;
    Eigen::Matrix<double, 3 + kMountingErrors, 3 + kMountingErrors> h;
    Eigen::Matrix<double, 3 + kMountingErrors, 1> g, row;
    h.setZero();
    g.setZero();
    for (uint32_t i = 0; i < p.count; i++) {
      const double px = static_cast<double>(p.x_m[i]), py = static_cast<double>(p.y_m[i]);
      const double range = camera_.range(px, py);
      floor_point f{};
      if (range > kRange_m || !camera_.correct(px, py, error_.data(), &f)) continue;
      seen_++;
      const double rx = c * f.x - s * f.y, ry = s * f.x + c * f.y;
      edge_line line = lines_.nearest(there_x + rx, there_y + ry);
      if (!line.found || line.distance_m > gate_m) continue;
      if (line.normal_x * (there_x + rx - eye_x) + line.normal_y * (there_y + ry - eye_y) < 0) {
        line.normal_x = -line.normal_x;
        line.normal_y = -line.normal_y;
        line.offset_m = -line.offset_m;
      }
      const double normal = static_cast<double>(p.normal_rad[i]) + heading;
      if (std::isfinite(normal) && std::cos(normal) * line.normal_x + std::sin(normal) * line.normal_y < kNormalGate)
        continue;
      const double given = static_cast<double>(p.sigma_m[i]);
      const double own = given > 0 ? given : camera_.sigma(range, kPixel_px);
      const double variance = own * own + kPoint_m * kPoint_m;
      const double residual = line.offset_m - error_[kEdgeOffset];
      explained_++;
      squares_ += residual * residual;
      row[0] = line.normal_x;
      row[1] = line.normal_y;
      row[2] = line.normal_y * rx - line.normal_x * ry;
      for (int e = 0; e < kCameraErrors; e++)
        row[3 + e] = line.normal_x * (c * f.x_by[e] - s * f.y_by[e]) + line.normal_y * (s * f.x_by[e] + c * f.y_by[e]);
      row[3 + kTimeOffset] = -(line.normal_x * (v * c - w * ry) + line.normal_y * (v * s + w * rx));
      row[3 + kEdgeOffset] = 1;
      row[3 + kSpeedScale] = -age * scan.v_mps * (line.normal_x * c + line.normal_y * s);
      row[3 + kYawRateBias] = age * row[2];
      const double weight = 5 / (4 + residual * residual / variance) / (variance * kCorrelated);
      h += weight * row * row.transpose();
      g += weight * residual * row;
    }
    add(piece, at, errors, h, g);
  }

  // From this scan's pose to the next one's.
  void drive(Piece &piece, size_t k, Eigen::Index at, Eigen::Index errors) {
    const double dt = 1e-9 * static_cast<double>(scans_[k + 1].t_ns - scans_[k].t_ns);
    const Vector3d raw = relative(scans_[k].odom, scans_[k + 1].odom), is = relative(poses_[k], poses_[k + 1]);
    const double scale = 1 + error_[kSpeedScale], back = -0.5 * error_[kYawRateBias] * dt;
    const double cb = std::cos(back), sb = std::sin(back);
    const Vector3d said(scale * (cb * raw.x() - sb * raw.y()), scale * (sb * raw.x() + cb * raw.y()),
                        raw.z() - error_[kYawRateBias] * dt);
    Vector3d off = said - is;
    off.z() = tools::wrap(off.z());
    const double way = raw.head<2>().norm();
    const Vector3d variance(1e-4 * way + 1e-7, 1e-4 * way + 1e-7, 1e-5 * dt + 1e-4 * std::fabs(raw.z()) + 1e-9);
    const double c = std::cos(poses_[k].z()), s = std::sin(poses_[k].z());
    // Derivatives of `is` less those of `said`.
    Eigen::Matrix<double, 3, 6 + kMountingErrors> j;
    j.setZero();
    j.block<3, 3>(0, 0) << -c, -s, is.y(), s, -c, -is.x(), 0, 0, -1;
    j.block<3, 3>(0, 3) << c, s, 0, -s, c, 0, 0, 0, 1;
    j.col(6 + kSpeedScale) << -said.x() / scale, -said.y() / scale, 0;
    j.col(6 + kYawRateBias) << -0.5 * dt * said.y(), 0.5 * dt * said.x(), dt;
    const Vector3d information = variance.cwiseInverse();
    const Eigen::Matrix<double, 6 + kMountingErrors, 6 + kMountingErrors> h =
        j.transpose() * information.asDiagonal() * j;
    const Eigen::Matrix<double, 6 + kMountingErrors, 1> g = j.transpose() * information.asDiagonal() * off;
    piece.h.block<6, 6>(at, at) += h.topLeftCorner<6, 6>();
    piece.h.block<6, kMountingErrors>(at, errors) += h.topRightCorner<6, kMountingErrors>();
    piece.h.block<kMountingErrors, kMountingErrors>(errors, errors) +=
        h.bottomRightCorner<kMountingErrors, kMountingErrors>();
    piece.g.segment<6>(at) += g.head<6>();
    piece.g.segment<kMountingErrors>(errors) += g.tail<kMountingErrors>();
  }

  template <class Matrix, class Vector>
  static void add(Piece &piece, Eigen::Index at, Eigen::Index errors, const Matrix &h, const Vector &g) {
    piece.h.block<3, 3>(at, at) += h.template topLeftCorner<3, 3>();
    piece.h.block<3, kMountingErrors>(at, errors) += h.template topRightCorner<3, kMountingErrors>();
    piece.h.block<kMountingErrors, kMountingErrors>(errors, errors) +=
        h.template bottomRightCorner<kMountingErrors, kMountingErrors>();
    piece.g.segment<3>(at) += g.template head<3>();
    piece.g.segment<kMountingErrors>(errors) += g.template tail<kMountingErrors>();
  }

  static void reduce(Piece &piece) {
    const Eigen::Index n = piece.h.rows() - kMountingErrors;
    MatrixXd poses = piece.h.topLeftCorner(n, n);
    poses.diagonal().array() += 1e-3;  // where nothing is seen, nothing moves
    const Eigen::LDLT<MatrixXd> factor(poses);
    const MatrixXd shared = piece.h.topRightCorner(n, kMountingErrors);
    piece.back = factor.solve(shared);
    piece.pose_g = factor.solve(piece.g.head(n));
    piece.reduced_h = piece.h.bottomRightCorner(kMountingErrors, kMountingErrors) - shared.transpose() * piece.back;
    piece.reduced_g = piece.g.tail(kMountingErrors) - shared.transpose() * piece.pose_g;
  }

  const std::vector<MountingScan> &scans_;
  Lines lines_;
  floor_camera camera_{};
  VectorXd error_;
  MatrixXd covariance_;
  std::vector<Vector3d> poses_;
  std::vector<Piece> pieces_;
  double explained_ = 0, seen_ = 0, squares_ = 0;
};

}  // namespace

Mounting find_mounting(const std::vector<MountingScan> &scans, const wm_raster &map, const wm_camera &camera) {
  if (scans.size() < 50)
    throw tools::Failure(std::to_string(scans.size()) +
                         " pictures with edges: too few; drive for at least half a minute");
  Problem problem(scans, map, camera);
  int rounds = 0;
  double moved = 1e9;
  while (rounds < kRoundsMax && moved > 0.02) moved = problem.round(rounds++ < 4 ? 0.3 : 0.15);
  Mounting out = problem.result();
  out.rounds = rounds;
  out.moved = moved;
  return out;
}

}  // namespace wm::calibrate
