// SPDX-License-Identifier: Apache-2.0
#include "calibrate/rig.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "calibrate/corners.h"
#include "calibrate/solver.h"
#include "common/failure.h"

namespace wm::calibrate {
namespace {

constexpr double kGood_px = 5;  // of a pose by corners that were counted anew

// What one camera saw in one shot: corners in metres from the board's middle.
struct Seen {
  std::vector<BoardCorner> corners;
  Pose T_camera_board;
};

void turn(double angle, Seen &seen) {
  const Eigen::Matrix2d back = Eigen::Rotation2Dd(-angle).toRotationMatrix();
  for (BoardCorner &corner : seen.corners) corner.board = back * corner.board;
  seen.T_camera_board = seen.T_camera_board * Pose(Eigen::AngleAxisd(angle, Vec3::UnitZ()));
}

int ways_round(const BoardShape &shape) { return shape.numbered ? 1 : shape.columns == shape.rows ? 4 : 2; }

// A lattice counts from where its seed was: only of a whole board is known which corner is which, but for its turns.
bool count_from_middle(const BoardShape &shape, std::vector<BoardCorner> &corners) {
  const LatticeSize size = lattice_size(corners);
  const auto all = static_cast<size_t>(shape.columns) * static_cast<size_t>(shape.rows);
  const bool upright = size.columns == shape.columns && size.rows == shape.rows;
  if (corners.size() < all - all / 20 || (!upright && (size.columns != shape.rows || size.rows != shape.columns)))
    return false;
  Vec2 low = corners[0].board, high = low;
  for (const BoardCorner &corner : corners) low = low.cwiseMin(corner.board), high = high.cwiseMax(corner.board);
  const Eigen::Matrix2d turned = upright ? Eigen::Matrix2d::Identity() : Eigen::Matrix2d{{0, 1}, {-1, 0}};
  for (BoardCorner &corner : corners) corner.board = turned * (corner.board - 0.5 * (low + high));
  return true;
}

bool seen_by(const Calibration &c, const View &view, const BoardShape &shape, Seen &out) {
  out.corners = view.corners;
  out.T_camera_board = view.T_camera_board;
  if (shape.numbered) {
    out.T_camera_board = out.T_camera_board * Eigen::Translation3d(shape.middle.x(), shape.middle.y(), 0);
    for (BoardCorner &corner : out.corners) corner.board -= shape.middle;
  } else if (!count_from_middle(shape, out.corners)) {
    return false;
  }
  for (BoardCorner &corner : out.corners) corner.board *= shape.unit_m;
  return find_board(c.camera, out.corners, out.T_camera_board) < kGood_px;
}

// The pose of the first camera's frame in the second's that a shot alone gives, for the way round that is nearest to no
// rotation about the line of sight: cameras of a pair are upright alike.
Pose between(const BoardShape &shape, const Seen &first, Seen &second) {
  Seen best = second;
  double least = std::numeric_limits<double>::infinity();
  for (int way = 0; way < ways_round(shape); way++) {
    Seen other = second;
    turn(2 * images::kPi * way / ways_round(shape), other);
    const Pose T = other.T_camera_board * first.T_camera_board.inverse();
    const double angle = Eigen::AngleAxisd(T.linear()).angle();
    if (angle >= least) continue;
    least = angle;
    best = other;
  }
  second = best;
  return second.T_camera_board * first.T_camera_board.inverse();
}

Pose on_floor(const FloorBoard &board, bool faces_viewer) {
  return images::pose_xyz_rpy({board.x_m, board.y_m, 0}, faces_viewer ? 0 : images::kPi, 0, board.yaw_rad);
}

class Assembly {
 public:
  Assembly(const std::vector<Calibration> &cameras, const BoardShape &shape) : cameras_(cameras), shape_(shape) {
    for (const Calibration &c : cameras) bundle_.cameras.push_back(c.camera);
    bundle_.T_camera_rig.assign(cameras.size(), Pose::Identity());
  }

  // All views of the first camera: a shot each, turned so that a board on the floor has the camera nearest to
  // base_link.
  void add_first(const std::vector<size_t> &shots, const std::vector<FloorBoard> &floor) {
    for (size_t i = 0; i < cameras_[0].views.size(); i++) {
      const View &view = cameras_[0].views[i];
      Seen seen;
      if (!seen_by(cameras_[0], view, shape_, seen)) continue;
      for (const FloorBoard &board : floor)
        if (board.picture == view.name) measure(board, seen);
      number_[shots[i]] = bundle_.T_rig_board.size();
      first_.push_back(seen);
      bundle_.T_rig_board.push_back(seen.T_camera_board);
      bundle_.sightings.push_back({0, bundle_.T_rig_board.size() - 1, seen.corners});
    }
  }

  // The second camera's views that the first has, too; the first guess is the joint that is nearest to all others.
  size_t add_second(const std::vector<size_t> &shots) {
    std::vector<Pose> joints;
    for (size_t i = 0; i < cameras_[1].views.size(); i++) {
      const auto shot = number_.find(shots[i]);
      Seen seen;
      if (shot == number_.end() || !seen_by(cameras_[1], cameras_[1].views[i], shape_, seen)) continue;
      joints.push_back(between(shape_, first_[shot->second], seen));
      bundle_.sightings.push_back({1, shot->second, seen.corners});
    }
    double least = std::numeric_limits<double>::infinity();
    for (const Pose &a : joints) {
      double sum = 0;
      for (const Pose &b : joints) sum += std::min(0.5, Eigen::AngleAxisd((a * b.inverse()).linear()).angle());
      if (sum >= least) continue;
      least = sum;
      bundle_.T_camera_rig[1] = a;
    }
    return joints.size();
  }

  Bundle &bundle() { return bundle_; }

 private:
  void measure(const FloorBoard &board, Seen &seen) {
    const Pose floor = on_floor(board, shape_.faces_viewer);
    Seen best = seen;
    double least = std::numeric_limits<double>::infinity();
    for (int way = 0; way < ways_round(shape_); way++) {
      Seen other = seen;
      turn(2 * images::kPi * way / ways_round(shape_), other);
      const Pose T_base_rig = floor * other.T_camera_board.inverse();
      const double away = T_base_rig.translation().head<2>().norm();
      if (away >= least) continue;
      least = away;
      best = other;
      bundle_.T_base_rig = T_base_rig;
    }
    seen = best;
    bundle_.measured.push_back({bundle_.T_rig_board.size(), floor, kFloor_m, kFloor_rad});
  }

  const std::vector<Calibration> &cameras_;
  const BoardShape &shape_;
  Bundle bundle_;
  std::map<size_t, size_t> number_;  // of a shot in the bundle
  std::vector<Seen> first_;
};

// What is left, and the cameras as they are now.
double write_back(const Bundle &bundle, Rig &rig) {
  std::vector<double> squares(bundle.cameras.size(), 0), count(bundle.cameras.size(), 0);
  for (const Sighting &s : bundle.sightings)
    for (const BoardCorner &corner : s.corners) {
      squares[s.camera] +=
          miss(bundle.cameras[s.camera], bundle.T_camera_rig[s.camera] * bundle.T_rig_board[s.shot], corner)
              .squaredNorm();
      count[s.camera]++;
    }
  double sum = 0, n = 0;
  for (size_t i = 0; i < rig.cameras.size(); i++) {
    rig.cameras[i].camera = bundle.cameras[i];
    rig.cameras[i].rms_px = std::sqrt(squares[i] / std::max(1.0, count[i]));
    sum += squares[i], n += count[i];
  }
  rig.rms_px = std::sqrt(sum / std::max(1.0, n));
  return sum / std::max(1.0, 2 * n - 6.0 * static_cast<double>(bundle.T_rig_board.size()));
}

void take_sigmas(const Bundle &bundle, double variance, Rig &rig) {
  const std::optional<Eigen::MatrixXd> unit = covariance(bundle);
  const auto nan = std::nan("");
  rig.pair_sigma_m = rig.pair_sigma_rad = rig.base_sigma_m = rig.base_sigma_rad = nan;
  if (!unit) return;
  Eigen::Index at = 0;
  for (const images::Camera &camera : bundle.cameras) at += parameters(camera).size();
  const auto largest = [&](Eigen::Index from) { return std::sqrt(unit->diagonal().segment<3>(from).maxCoeff()); };
  if (bundle.cameras.size() > 1) {
    rig.pair_sigma_rad = std::sqrt(variance) * largest(at);
    rig.pair_sigma_m = std::sqrt(variance) * largest(at + 3);
    at += 6;
  }
  if (bundle.measured.empty()) return;
  rig.base_sigma_rad = largest(at);
  rig.base_sigma_m = largest(at + 3);
}

}  // namespace

Rig solve_rig(const std::vector<Calibration> &cameras, const std::vector<std::vector<size_t>> &shots,
              const BoardShape &shape, const std::vector<FloorBoard> &floor) {
  Rig out;
  out.cameras = cameras;
  Assembly assembly(cameras, shape);
  assembly.add_first(shots[0], floor);
  Bundle &bundle = assembly.bundle();
  if (bundle.measured.size() < floor.size())
    throw tools::Failure("--floor: " + floor[bundle.measured.size()].picture +
                         ": no whole board was found in a picture of this name");
  if (cameras.size() > 1) {
    out.shared = assembly.add_second(shots[1]);
    if (out.shared < 3)
      throw tools::Failure("the whole board was seen by both cameras at once in " + std::to_string(out.shared) +
                           " pictures; three are the least, ten are good");
  }
  if (!solve(bundle, true) || !solve(bundle, false))
    throw tools::Failure(
        "the cameras and boards do not fit together: are the pictures of both cameras of the same instants?");
  const double variance = write_back(bundle, out);
  if (cameras.size() > 1) out.T_first_second = bundle.T_camera_rig[1].inverse();
  if (!floor.empty()) out.T_base_first = bundle.T_base_rig;
  take_sigmas(bundle, variance, out);
  return out;
}

}  // namespace wm::calibrate
