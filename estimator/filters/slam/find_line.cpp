// SPDX-License-Identifier: Apache-2.0
// A landmark from lines of sight [LinesND, initialisation]: homogeneous least squares for its place, the unscented
// transform over poses and azimuths for its covariance.
#include "filters/slam/bearing_tracks.hpp"
#include "math/arc.hpp"
#include "math/se2.hpp"
#include "math/symmetric_eigen.hpp"

namespace wm {
namespace {

constexpr int kPoseNumbers = 3 * kLinePoses;
constexpr int kInputs = kPoseNumbers - 3 + kLinePoses;  // poses 2..k relative to the first, azimuths 1..k
constexpr double kAlpha = 0.5;         // spread of the sigma points; unreadable in the source, not swept. kappa = 0
constexpr double kStep = 1e-6;         // m and rad, of the linear method's central differences
constexpr double kLeastPivot = 1e-12;  // of a variance that is left: below, the column is rounding error
constexpr double kAtInfinity = 1e-9;   // homogeneous coordinate of a crossing at 1e9 times the poses' extent
constexpr double kNearest = 0.05;      // floor of the distance to a pose, in units of the poses' extent
constexpr double kAhead_rad = 1.0;     // a line that misses by more points away from the place

using input_vector = vector<kInputs>;
using input_matrix = matrix<kInputs>;

// A bundle in the first pose's frame.
struct problem {
  int lines, poses, inputs;  // of the inputs, the first `poses` are of poses
  input_vector input;
  input_matrix covariance;
  matrix<kPoseNumbers> by_pose;  // derivatives of the poses' inputs by the poses in map
  double scale_m;                // the poses' extent: coordinates in units of this are alike in size
  double weight[kLinePoses];     // of each equation: its sine of azimuth becomes a distance in sigmas
};

struct distribution {
  vector<2> mean;
  matrix<2> covariance;
  matrix<2, kInputs> by;  // derivative, or regression, by the inputs
};

// Place of the landmark: sin(a) (X - x) - cos(a) (Y - y) = 0 for each line, solved by the eigenvector of the smallest
// eigenvalue of A'A. False: no finite crossing.
bool cross(const problem &p, const input_vector &input, vector<2> *place) {
  double m[3][3] = {}, vectors[3][3];
  for (int i = 0; i < p.lines; i++) {
    const int pose = 3 * (i - 1);
    const sin_cos a = sincos(input[p.poses + i] + (i > 0 ? input[pose + 2] : 0.0));
    const double x = i > 0 ? input[pose] / p.scale_m : 0.0, y = i > 0 ? input[pose + 1] / p.scale_m : 0.0;
    const double row[3] = {p.weight[i] * a.sin, -p.weight[i] * a.cos, -p.weight[i] * (a.sin * x - a.cos * y)};
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++) m[r][c] += row[r] * row[c];
  }
  symmetric_eigen(m, vectors);
  int least = 0;
  for (int i = 1; i < 3; i++)
    if (m[i][i] < m[least][least]) least = i;
  if (!(std::fabs(vectors[2][least]) > kAtInfinity)) return false;
  for (int k = 0; k < 2; k++) (*place)[k] = p.scale_m * vectors[k][least] / vectors[2][least];
  return finite(place->sum());
}

problem problem_of(const line_bundle &b) {
  problem p{b.count, 3 * (b.count - 1), 4 * b.count - 3, input_vector::Zero(), input_matrix::Zero(), {}, 1.0, {}};
  p.by_pose.setZero();
  for (int i = 1; i < b.count; i++) {
    matrix<3> by_first, by_own;
    const wm_pose2 d = between(b.pose[0], b.pose[i], &by_first, &by_own);
    const int r = 3 * (i - 1);
    p.input.segment<3>(r) << d.x_m, d.y_m, d.heading_rad;
    p.by_pose.block<3, 3>(r, 0) = by_first;
    p.by_pose.block<3, 3>(r, 3 * i) = by_own;
    p.scale_m = larger(p.scale_m, std::sqrt(square(d.x_m) + square(d.y_m)));
  }
  const auto by = p.by_pose.topLeftCorner(p.poses, 3 * b.count);
  const auto part = by.lazyProduct(map(b.pose_covariance).topLeftCorner(3 * b.count, 3 * b.count)).eval();
  p.covariance.topLeftCorner(p.poses, p.poses) = part.lazyProduct(by.transpose());
  for (int i = 0; i < b.count; i++) {
    p.input[p.poses + i] = b.azimuth_rad[i];
    p.covariance(p.poses + i, p.poses + i) = square(b.sigma_rad[i]);
    p.weight[i] = 1.0;
  }
  return p;
}

// Variance of the angle by which line i misses a place: its azimuth's, its pose's heading and place across the line.
// Each line alone; what lines share is in the transform.
double miss_variance(const problem &p, int i, const vector<2> &from_pose) {
  const double azimuth = p.covariance(p.poses + i, p.poses + i);
  if (i == 0) return azimuth;
  const double q = larger(from_pose.squaredNorm(), square(kNearest * p.scale_m));
  const vector<3> by(from_pose[1] / q, -from_pose[0] / q, -1.0);
  return azimuth + by.dot(p.covariance.block<3, 3>(3 * (i - 1), 3 * (i - 1)) * by);
}

// A first crossing with equal weights gives the distances; each equation's error is its distance times its sigma.
bool weigh_lines(problem *p, double variance[kLinePoses]) {
  vector<2> place;
  if (!cross(*p, p->input, &place)) return false;
  const double sigma = std::sqrt(p->covariance(p->poses, p->poses));
  for (int i = 0; i < p->lines; i++) {
    vector<2> from_pose = place;
    if (i > 0) from_pose -= p->input.segment<2>(3 * (i - 1));
    variance[i] = miss_variance(*p, i, from_pose);
    const double distance = larger(from_pose.norm(), kNearest * p->scale_m);
    p->weight[i] = p->scale_m * sigma / (std::sqrt(variance[i]) * distance);
  }
  return true;
}

// Lower factor of the inputs' covariance. The poses' part may lack rank: a column without a pivot is 0. Azimuths are
// independent of all others.
input_matrix root_of(const problem &p) {
  input_matrix l = input_matrix::Zero();
  for (int j = 0; j < p.inputs; j++) {
    const double pivot = p.covariance(j, j) - l.row(j).head(j).squaredNorm();
    if (!(pivot > kLeastPivot * p.covariance(j, j))) continue;
    l(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < p.poses; i++)
      l(i, j) = (p.covariance(i, j) - l.row(i).head(j).dot(l.row(j).head(j))) / l(j, j);
  }
  return l;
}

// Covariance and regression on the inputs by sigma points [Julier1997], about the place of the measured inputs. Not
// about the points' mean, as printed: measurements scatter about the truth, so the place of the measured inputs
// contains that curvature already, and the points' mean would add it once more (a quarter more error at two degrees of
// parallax).
bool transform(const problem &p, distribution *out) {
  const input_matrix l = root_of(p);
  const double spread = kAlpha * std::sqrt(p.inputs);
  matrix<2, kInputs> slope = matrix<2, kInputs>::Zero();  // mean, along each column of the root
  out->covariance.setZero();
  for (int j = 0; j < p.inputs; j++) {
    vector<2> at[2];
    for (int side = 0; side < 2; side++) {
      const input_vector point = p.input + (side == 0 ? spread : -spread) * l.col(j);
      if (!cross(p, point, &at[side])) return false;
      const vector<2> off = at[side] - out->mean;
      out->covariance += 0.5 / square(spread) * off * off.transpose();
    }
    slope.col(j) = 0.5 / spread * (at[0] - at[1]);
  }
  // by L = slope
  out->by.setZero();
  for (int j = p.inputs - 1; j >= 0; j--) {
    if (!(l(j, j) > 0.0)) continue;
    vector<2> rest = slope.col(j);
    for (int k = j + 1; k < p.poses; k++) rest -= out->by.col(k) * l(k, j);
    out->by.col(j) = rest / l(j, j);
  }
  return true;
}

// The textbook's one linearisation, at the mean.
bool linearise(const problem &p, distribution *out) {
  out->by.setZero();
  for (int j = 0; j < p.inputs; j++) {
    vector<2> at[2];
    for (int side = 0; side < 2; side++) {
      input_vector point = p.input;
      point[j] += side == 0 ? kStep : -kStep;
      if (!cross(p, point, &at[side])) return false;
    }
    out->by.col(j) = (at[0] - at[1]) / (2.0 * kStep);
  }
  const matrix<2, kInputs> part = out->by.lazyProduct(p.covariance);
  out->covariance = part.lazyProduct(out->by.transpose());
  return true;
}

// From the first pose's frame to map: place, derivatives by the poses, and the covariance that these do not explain.
void to_map(const line_bundle &b, const problem &p, const distribution &d, line_landmark *out) {
  const auto by = d.by.leftCols(p.poses);
  const auto part = by.lazyProduct(p.covariance.topLeftCorner(p.poses, p.poses)).eval();
  const matrix<2> rest = d.covariance - matrix<2>(part.lazyProduct(by.transpose()));
  const sin_cos h = sincos(b.pose[0].heading_rad);
  matrix<2> rotation;
  rotation << h.cos, -h.sin, h.sin, h.cos;
  map(out->noise) = rotation * rest * rotation.transpose();
  const vector<2> turned = rotation * d.mean;
  out->place_m[0] = b.pose[0].x_m + turned[0];
  out->place_m[1] = b.pose[0].y_m + turned[1];
  const auto turned_by = rotation.lazyProduct(by).eval();
  auto by_pose = map(out->by_pose).leftCols(3 * b.count);
  by_pose = turned_by.lazyProduct(p.by_pose.topLeftCorner(p.poses, 3 * b.count));
  by_pose.leftCols<2>() += matrix<2>::Identity();
  by_pose(0, 2) -= turned[1];
  by_pose(1, 2) += turned[0];
  for (int r = 0; r < 2; r++) out->noise[r][r] = larger(out->noise[r][r], 0.0);
}

// Whether the place is ahead of every pose; how well, and at which angle, the lines cross there.
void judge(const line_bundle &b, const double variance[kLinePoses], line_landmark *out) {
  double direction[kLinePoses];
  out->solved = true;
  for (int i = 0; i < b.count; i++) {
    const double dx = out->place_m[0] - b.pose[i].x_m, dy = out->place_m[1] - b.pose[i].y_m;
    direction[i] = atan2(dy, dx);
    const double residual = wrap(direction[i] - b.pose[i].heading_rad - b.azimuth_rad[i]);
    out->solved &= std::fabs(residual) < kAhead_rad;
    out->misfit += square(residual) / (variance[i] * b.count);
    for (int j = 0; j < i; j++)
      out->parallax_rad = larger(out->parallax_rad, std::fabs(wrap(direction[i] - direction[j])));
    out->distance_m = std::sqrt(dx * dx + dy * dy);
  }
}

}  // namespace

line_landmark find_line(const line_bundle &b, bool unscented) {
  line_landmark out{};
  problem p = problem_of(b);
  double variance[kLinePoses];
  distribution d;
  if (!weigh_lines(&p, variance) || !cross(p, p.input, &d.mean)) return out;
  if (!(unscented ? transform(p, &d) : linearise(p, &d))) return out;
  to_map(b, p, d, &out);
  judge(b, variance, &out);
  return out;
}

}  // namespace wm
