// SPDX-License-Identifier: Apache-2.0
#include "map/fuse_maps.h"

#include <algorithm>
#include <cmath>

#include "common/failure.h"
#include "common/linear.h"

namespace wm::tools {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kSteps = 30;          // of Gauss-Newton; it takes 3 to 6
constexpr double kStill = 1e-9;     // m, rad: converged
constexpr double kRounding = 1e-9;  // of a covariance, relative to its variances: filters' rounding made good
constexpr double kShared = 1e-6;    // of the information: a direction that other drives know, too

Eigen::Matrix2d rotation(double angle) {
  Eigen::Matrix2d out;
  out << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  return out;
}

double turn(double angle) { return std::remainder(angle, 2 * 3.14159265358979323846); }

// A drive's rows: residual, derivative by its frame; derivative by its landmarks, which is a rotation of pairs.
struct Rows {
  VectorXd residual;
  MatrixXd by_frame;       // n x 3
  Eigen::Matrix2d turned;  // d h / d x of a place; 1 of a heading
};

Rows rows_of(const Measured &drive, const VectorXd &local) {
  const int width = drive.map->width, count = static_cast<int>(drive.map->landmarks.size());
  Rows out{VectorXd(drive.map->states()), MatrixXd::Zero(drive.map->states(), 3), rotation(-drive.frame.z())};
  const Eigen::Matrix2d across = out.turned * rotation(-1.57079632679489661923);  // d R' / d theta
  for (int j = 0; j < count; j++) {
    const Index at = Index{j} * width;
    const Eigen::Vector2d way = local.segment<2>(at) - drive.frame.head<2>();
    out.residual.segment<2>(at) = drive.map->mean.segment<2>(at) - out.turned * way;
    out.by_frame.block<2, 2>(at, 0) = -out.turned;
    out.by_frame.block<2, 1>(at, 2) = across * way;
    if (width == 2) continue;
    out.residual[at + 2] = turn(drive.map->mean[at + 2] - (local[at + 2] - drive.frame.z()));
    out.by_frame(at + 2, 2) = -1;
  }
  return out;
}

// g and k: what an error changes size and turn by, about the centre of the places.
MatrixXd shape_of(const DriveMap &map) {
  const Index count = static_cast<Index>(map.landmarks.size());
  MatrixXd out = MatrixXd::Zero(map.states(), 2);
  Eigen::Vector2d centre(0, 0);
  for (Index j = 0; j < count; j++) centre += map.mean.segment<2>(j * map.width) / static_cast<double>(count);
  double spread = 0;
  for (Index j = 0; j < count; j++) {
    const Eigen::Vector2d way = map.mean.segment<2>(j * map.width) - centre;
    out.block<2, 1>(j * map.width, 0) = way;
    out.block<2, 1>(j * map.width, 1) << -way.y(), way.x();
    spread += way.squaredNorm();
  }
  return spread > 0 ? out / spread : out;
}

// e and J e, of the residual m - h.
MatrixXd carried_by(const VectorXd &residual, int width) {
  MatrixXd out = MatrixXd::Zero(residual.size(), 2);
  for (Index at = 0; at + 1 < residual.size(); at += width) {
    out.block<2, 1>(at, 0) = -residual.segment<2>(at);
    out.block<2, 1>(at, 1) << residual[at + 1], -residual[at];
  }
  return out;
}

// W T^-1 by the identity of Woodbury.
MatrixXd whitener_at(const Measured &drive, const VectorXd &residual) {
  const MatrixXd e = carried_by(residual, drive.map->width);
  const Eigen::Matrix2d small = Eigen::Matrix2d::Identity() + drive.by_shape.transpose() * e;
  Eigen::Matrix2d inverse;
  inverse << small(1, 1), -small(0, 1), -small(1, 0), small(0, 0);
  inverse /= small(0, 0) * small(1, 1) - small(0, 1) * small(1, 0);
  return drive.whitener - (drive.whitener * e) * inverse * drive.by_shape.transpose();
}

// T P T'.
MatrixXd covariance_at(const DriveMap &map, const VectorXd &residual) {
  const MatrixXd T =
      MatrixXd::Identity(map.states(), map.states()) + carried_by(residual, map.width) * shape_of(map).transpose();
  return T * map.covariance * T.transpose();
}

// B' A of the rotation B: rows of places.
void turn_rows(const Eigen::Matrix2d &turned, int width, MatrixXd *of) {
  for (Index at = 0; at + 1 < of->rows(); at += width)
    of->middleRows(at, 2) = (turned.transpose() * of->middleRows(at, 2)).eval();
}

MatrixXd turned_both(const Eigen::Matrix2d &turned, int width, const MatrixXd &of) {
  MatrixXd out = of;
  turn_rows(turned, width, &out);
  out.transposeInPlace();
  turn_rows(turned, width, &out);
  return out;
}

// Where each of a drive's states is in the merged map.
std::vector<Index> states_of(const Measured &drive, const FusedMap &map) {
  std::vector<Index> out;
  for (const int l : drive.landmark) {
    const auto i = static_cast<size_t>(l);
    out.push_back(map.x_at[i]);
    out.push_back(map.x_at[i] + 1);
    if (drive.map->width == 3) out.push_back(map.heading_at[i]);
  }
  return out;
}

VectorXd picked(const VectorXd &from, const std::vector<Index> &at) {
  VectorXd out(static_cast<Index>(at.size()));
  for (size_t i = 0; i < at.size(); i++) out[static_cast<Index>(i)] = from[at[i]];
  return out;
}

MatrixXd picked(const MatrixXd &from, const std::vector<Index> &rows, const std::vector<Index> &columns) {
  MatrixXd out(static_cast<Index>(rows.size()), static_cast<Index>(columns.size()));
  for (size_t j = 0; j < columns.size(); j++)
    for (size_t i = 0; i < rows.size(); i++)
      out(static_cast<Index>(i), static_cast<Index>(j)) = from(rows[i], columns[j]);
  return out;
}

// A drive's part of the normal equations, its frame eliminated (Schur's complement).
struct Share {
  MatrixXd information;  // of its landmarks
  VectorXd right;
  MatrixXd frame_by_places;  // S^-1 Jt' A B, 3 x n
  Eigen::Matrix3d frame_covariance;
  Eigen::Vector3d frame_right;  // S^-1 Jt' A r
};

Share share_of(const Measured &drive, const Rows &rows) {
  const int width = drive.map->width;
  Share out;
  const MatrixXd whitener = whitener_at(drive, rows.residual), weight = whitener.transpose() * whitener;
  out.information = turned_both(rows.turned, width, weight);
  MatrixXd weighted = weight * rows.residual;
  turn_rows(rows.turned, width, &weighted);
  out.right = weighted;
  if (drive.is_fixed) return out;
  const MatrixXd by_frame = weight * rows.by_frame;  // A Jt
  out.frame_covariance = inverse_symmetric(rows.by_frame.transpose() * by_frame);
  MatrixXd cross = by_frame;
  turn_rows(rows.turned, width, &cross);  // B' A Jt
  out.frame_by_places = out.frame_covariance * cross.transpose();
  out.frame_right = out.frame_covariance * (by_frame.transpose() * rows.residual);
  out.information -= cross * out.frame_by_places;
  out.right -= cross * out.frame_right;
  return out;
}

// States of the landmarks that a drive has; places begin where the first one puts them.
FusedMap begin(const std::vector<Measured *> &drives, int landmarks) {
  FusedMap out;
  out.x_at.assign(static_cast<size_t>(landmarks), -1);
  out.heading_at = out.x_at;
  int states = 0;
  std::vector<double> values;
  for (const Measured *drive : drives) {
    const int width = drive->map->width;
    for (size_t j = 0; j < drive->landmark.size(); j++) {
      const auto l = static_cast<size_t>(drive->landmark[j]);
      const Index at = static_cast<Index>(j) * width;
      if (out.x_at[l] < 0) {
        const Eigen::Vector2d place =
            drive->frame.head<2>() + rotation(drive->frame.z()) * drive->map->mean.segment<2>(at);
        out.x_at[l] = states;
        values.insert(values.end(), {place.x(), place.y()});
        states += 2;
      }
      if (width == 3 && out.heading_at[l] < 0) {
        out.heading_at[l] = states++;
        values.push_back(drive->map->mean[at + 2] + drive->frame.z());
      }
    }
  }
  out.mean = Eigen::Map<VectorXd>(values.data(), states);
  return out;
}

// r' D^+ r with D = P - G C G', the covariance of the residual after the fusion: the same as the innovation of the
// drive against all the others.
void judge(const Measured &drive, const FusedMap &map, double *chi2, int *dof) {
  const std::vector<Index> at = states_of(drive, map);
  const Rows rows = rows_of(drive, picked(map.mean, at));
  const Share share = share_of(drive, rows);
  const int width = drive.map->width;
  const MatrixXd whitener = whitener_at(drive, rows.residual);
  MatrixXd by_places = whitener.transpose();  // W B, by W and its transpose
  turn_rows(rows.turned, width, &by_places);
  by_places.transposeInPlace();
  MatrixXd rest = MatrixXd::Identity(by_places.rows(), by_places.rows());
  if (!drive.is_fixed) {
    const MatrixXd by_frame = whitener * rows.by_frame;
    by_places -= by_frame * share.frame_by_places;
    rest -= by_frame * share.frame_covariance * by_frame.transpose();
  }
  rest -= by_places * picked(map.covariance, at, at) * by_places.transpose();
  const Spectrum spectrum = spectrum_of(0.5 * (rest + rest.transpose()));
  const VectorXd along = spectrum.vectors.transpose() * (whitener * rows.residual);
  *chi2 = 0;
  *dof = 0;
  for (Index i = 0; i < along.size(); i++) {
    if (spectrum.values[i] < kShared) continue;
    *chi2 += along[i] * along[i] / spectrum.values[i];
    ++*dof;
  }
}

}  // namespace

Measured measured(const DriveMap &map) {
  Measured out;
  out.map = &map;
  MatrixXd covariance = map.covariance;
  covariance.diagonal() *= 1 + kRounding;
  out.whitener = inverse_factor(covariance);
  if (!out.whitener.allFinite()) throw Failure(map.name + ": its covariance is not positive definite");
  out.by_shape = shape_of(map);
  return out;
}

FusedMap fuse(const std::vector<Measured *> &drives, int landmarks) {
  FusedMap out = begin(drives, landmarks);
  MatrixXd information;
  for (int step = 0; step < kSteps; step++) {
    information = MatrixXd::Zero(out.mean.size(), out.mean.size());
    VectorXd right = VectorXd::Zero(out.mean.size());
    std::vector<Share> shares;
    std::vector<std::vector<Index>> places;
    for (const Measured *drive : drives) {
      places.push_back(states_of(*drive, out));
      const std::vector<Index> &at = places.back();
      shares.push_back(share_of(*drive, rows_of(*drive, picked(out.mean, at))));
      const Share &share = shares.back();
      for (size_t j = 0; j < at.size(); j++) {
        right[at[j]] += share.right[static_cast<Index>(j)];
        for (size_t i = 0; i < at.size(); i++)
          information(at[i], at[j]) += share.information(static_cast<Index>(i), static_cast<Index>(j));
      }
    }
    const VectorXd moved = solve_symmetric(information, right);
    if (!moved.allFinite()) throw Failure("the drives do not determine the landmarks");
    out.mean += moved;
    double frames_moved = 0;
    for (size_t k = 0; k < drives.size(); k++) {
      if (drives[k]->is_fixed) continue;
      const Eigen::Vector3d by = shares[k].frame_right - shares[k].frame_by_places * picked(moved, places[k]);
      drives[k]->frame += by;
      drives[k]->frame.z() = turn(drives[k]->frame.z());
      frames_moved = std::max(frames_moved, by.cwiseAbs().maxCoeff());
    }
    if (moved.cwiseAbs().maxCoeff() < kStill && frames_moved < kStill) break;
  }
  out.covariance = inverse_symmetric(information);
  out.chi2.resize(drives.size());
  out.dof.resize(drives.size());
  for (size_t k = 0; k < drives.size(); k++) judge(*drives[k], out, &out.chi2[k], &out.dof[k]);
  return out;
}

FusedMap alone(const Measured &drive, int landmarks) {
  Measured copy = drive;
  copy.frame.setZero();
  FusedMap out = begin({&copy}, landmarks);
  out.covariance = MatrixXd::Zero(out.mean.size(), out.mean.size());
  const std::vector<Index> at = states_of(copy, out);
  for (size_t i = 0; i < at.size(); i++)
    for (size_t j = 0; j < at.size(); j++)
      out.covariance(at[i], at[j]) = drive.map->covariance(static_cast<Index>(i), static_cast<Index>(j));
  return out;
}

namespace {

// The part of a drive's map that `map` has, too.
DriveMap shared_part(const Measured &drive, const FusedMap &map, std::vector<int> *landmark) {
  DriveMap out;
  out.name = drive.map->name;
  const int width = drive.map->width;
  bool headings = width == 3;
  std::vector<Index> kept;
  for (const int l : drive.landmark)
    if (map.has(l)) headings &= map.heading_at[static_cast<size_t>(l)] >= 0;
  out.width = headings ? 3 : 2;
  for (size_t j = 0; j < drive.landmark.size(); j++) {
    if (!map.has(drive.landmark[j])) continue;
    out.landmarks.push_back(drive.map->landmarks[j]);
    landmark->push_back(drive.landmark[j]);
    for (int k = 0; k < out.width; k++) kept.push_back(static_cast<Index>(j) * width + k);
  }
  out.mean = picked(drive.map->mean, kept);
  out.covariance = picked(drive.map->covariance, kept, kept);
  return out;
}

// The rigid motion that lays the drive's places over the map's, all alike [Horn1987].
Eigen::Vector3d laid_over(const DriveMap &drive, const VectorXd &places) {
  const auto count = static_cast<int>(drive.landmarks.size());
  Eigen::Vector2d from(0, 0), to(0, 0);
  for (int j = 0; j < count; j++) {
    from += drive.mean.segment<2>(Index{j} * drive.width) / count;
    to += places.segment<2>(Index{j} * drive.width) / count;
  }
  double along = 0, across = 0;
  for (int j = 0; j < count; j++) {
    const Eigen::Vector2d a = drive.mean.segment<2>(Index{j} * drive.width) - from,
                          b = places.segment<2>(Index{j} * drive.width) - to;
    along += a.dot(b);
    across += a.x() * b.y() - a.y() * b.x();
  }
  const double angle = std::atan2(across, along);
  Eigen::Vector3d out;
  out << to - rotation(angle) * from, angle;
  return out;
}

}  // namespace

Fit fit(const Measured &drive, const FusedMap &map) {
  Fit out;
  Measured part;
  const DriveMap shared = shared_part(drive, map, &part.landmark);
  out.shared = static_cast<int>(shared.landmarks.size());
  out.frame = drive.frame;
  const int unknown = drive.is_fixed ? 0 : 3;
  if (shared.states() <= unknown || (out.shared < 2 && !drive.is_fixed)) return out;
  part.map = &shared;
  const std::vector<Index> at = states_of(part, map);
  const VectorXd places = picked(map.mean, at);
  part.frame = drive.is_fixed ? drive.frame : laid_over(shared, places);
  const MatrixXd of_map = picked(map.covariance, at, at);
  Rows rows = rows_of(part, places);
  MatrixXd information;
  for (int step = 0; step < kSteps; step++) {
    const Eigen::Matrix2d back = rows.turned.transpose();
    information = inverse_symmetric(covariance_at(shared, rows.residual) + turned_both(back, shared.width, of_map));
    if (drive.is_fixed) break;
    const MatrixXd weighted = information * rows.by_frame;
    const Eigen::Vector3d by =
        solve_symmetric(rows.by_frame.transpose() * weighted, weighted.transpose() * rows.residual);
    part.frame += by;
    rows = rows_of(part, places);
    if (by.cwiseAbs().maxCoeff() < kStill) break;
  }
  out.frame = part.frame;
  out.chi2 = rows.residual.dot(information * rows.residual);
  out.dof = shared.states() - unknown;
  return out;
}

}  // namespace wm::tools
