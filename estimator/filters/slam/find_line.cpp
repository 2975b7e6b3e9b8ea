// SPDX-License-Identifier: Apache-2.0
// A landmark from lines of sight: homogeneous least squares, and the unscented transform over poses and azimuths.
#include <cstring>

#include "filters/slam/bearing_tracks.hpp"
#include "math/arc.hpp"

namespace wm {
namespace {

constexpr int kInputs = 4 * kLinePoses - 3;  // poses 2..k relative to the first, azimuths 1..k
constexpr double kAlpha = 0.5;               // the print's alpha and kappa are lost; kappa = 0
constexpr double kStep = 1e-6;               // of the linear method's derivatives

// Eigenvector of the smallest eigenvalue of a symmetric 3 x 3 matrix, by Jacobi's rotations: of A'A it is the singular
// vector of A's smallest singular value.
void smallest_eigenvector(double m[3][3], double out[3]) {
  double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 12; sweep++) {
    const double off = square(m[0][1]) + square(m[0][2]) + square(m[1][2]);
    if (!(off > 1e-30 * (square(m[0][0]) + square(m[1][1]) + square(m[2][2])))) break;
    for (int i = 0; i < 2; i++)
      for (int j = i + 1; j < 3; j++) {
        if (m[i][j] == 0.0) continue;
        const double tau = (m[j][j] - m[i][i]) / (2.0 * m[i][j]);
        const double t = (tau >= 0.0 ? 1.0 : -1.0) / (std::fabs(tau) + std::sqrt(1.0 + tau * tau));
        const double c = 1.0 / std::sqrt(1.0 + t * t), s = t * c;
        for (int k = 0; k < 3; k++) {
          const double a = m[k][i], b = m[k][j];
          m[k][i] = c * a - s * b;
          m[k][j] = s * a + c * b;
        }
        for (int k = 0; k < 3; k++) {
          const double a = m[i][k], b = m[j][k];
          m[i][k] = c * a - s * b;
          m[j][k] = s * a + c * b;
        }
        for (int k = 0; k < 3; k++) {
          const double a = v[k][i], b = v[k][j];
          v[k][i] = c * a - s * b;
          v[k][j] = s * a + c * b;
        }
      }
  }
  int least = 0;
  for (int i = 1; i < 3; i++)
    if (m[i][i] < m[least][least]) least = i;
  for (int k = 0; k < 3; k++) out[k] = v[k][least];
}

// The problem in the first pose's frame, in units of `scale`, so that the equations' entries are alike in size.
struct problem {
  int poses;
  double scale;
  double weight[kLinePoses];  // of each equation: its sine of azimuth becomes a distance in sigmas
};

// input: x, y, heading of poses 2..k in the first one's frame, then azimuths 1..k. False: no finite crossing.
bool solve(const problem &p, const double *input, double place[2]) {
  double m[3][3] = {};
  for (int i = 0; i < p.poses; i++) {
    const double *pose = input + 3 * (i - 1);
    const double azimuth = input[3 * (p.poses - 1) + i] + (i > 0 ? pose[2] : 0.0);
    const sin_cos a = sincos(azimuth);
    const double x = i > 0 ? pose[0] / p.scale : 0.0, y = i > 0 ? pose[1] / p.scale : 0.0;
    // sin(a) (X - x) - cos(a) (Y - y) = 0
    const double row[3] = {p.weight[i] * a.sin, -p.weight[i] * a.cos, -p.weight[i] * (a.sin * x - a.cos * y)};
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++) m[r][c] += row[r] * row[c];
  }
  double v[3];
  smallest_eigenvector(m, v);
  if (!(std::fabs(v[2]) > 1e-9)) return false;
  place[0] = p.scale * v[0] / v[2];
  place[1] = p.scale * v[1] / v[2];
  return finite(place[0]) && finite(place[1]);
}

// Cholesky of a covariance that may lack rank: a column whose pivot is nothing is nothing.
void root(double (*l)[kInputs], int n) {
  for (int j = 0; j < n; j++) {
    const double before = l[j][j];
    for (int k = 0; k < j; k++) l[j][j] -= l[j][k] * l[j][k];
    const bool empty = !(l[j][j] > 1e-12 * before) || !(before > 0.0);
    l[j][j] = empty ? 0.0 : std::sqrt(l[j][j]);
    for (int i = j + 1; i < n; i++) {
      if (empty) {
        l[i][j] = 0.0;
        continue;
      }
      for (int k = 0; k < j; k++) l[i][j] -= l[i][k] * l[j][k];
      l[i][j] /= l[j][j];
    }
  }
}

// Derivatives of poses 2..k, seen from the first, by the poses in map.
void relative_poses(const line_bundle &b, double *input, double (*by)[3 * kLinePoses]) {
  const sin_cos h = sincos(b.pose[0].heading_rad);
  for (int i = 1; i < b.count; i++) {
    const wm_pose2 d = between(b.pose[0], b.pose[i]);
    const int r = 3 * (i - 1);
    input[r] = d.x_m;
    input[r + 1] = d.y_m;
    input[r + 2] = d.heading_rad;
    const double rotation[2][2] = {{h.cos, h.sin}, {-h.sin, h.cos}};
    for (int k = 0; k < 2; k++)
      for (int l = 0; l < 2; l++) {
        by[r + k][l] = -rotation[k][l];
        by[r + k][3 * i + l] = rotation[k][l];
      }
    by[r][2] = d.y_m;
    by[r + 1][2] = -d.x_m;
    by[r + 2][2] = -1.0;
    by[r + 2][3 * i + 2] = 1.0;
  }
}

struct distribution {
  double mean[2], covariance[2][2];
  double by[2][kInputs];
};

// Covariance and regression on the inputs, by sigma points [Julier1997], about the place of the
// measured inputs. Not about the points' mean, as printed: measurements scatter about the truth, so the place of the
// measured inputs contains that curvature, and the points' mean would add it once more (a quarter more error at
// two degrees of parallax).
// `l` is the root of the covariance; azimuths, behind the `poses` numbers, are independent of all others.
bool transform(const problem &p, const double *input, double (*l)[kInputs], int poses, int n, distribution *out) {
  const double spread = kAlpha * std::sqrt(n), weight = 0.5 / square(spread);
  double point[kInputs], at[2 * kInputs][2];
  if (!solve(p, input, out->mean)) return false;
  std::memcpy(point, input, sizeof point);
  for (int i = 0; i < 2 * n; i++) {
    const int j = i / 2, end = j < poses ? poses : j + 1;
    const double way = i % 2 == 0 ? spread : -spread;
    for (int k = j; k < end; k++) point[k] = input[k] + way * l[k][j];
    if (!solve(p, point, at[i])) return false;
    for (int k = j; k < end; k++) point[k] = input[k];
  }
  for (int r = 0; r < 2; r++)
    for (int c = 0; c < 2; c++) {
      out->covariance[r][c] = 0.0;
      for (int i = 0; i < 2 * n; i++)
        out->covariance[r][c] += weight * (at[i][r] - out->mean[r]) * (at[i][c] - out->mean[c]);
    }
  // Regression: by L = D, D_j the mean slope along column j of the root.
  for (int r = 0; r < 2; r++)
    for (int j = n - 1; j >= 0; j--) {
      double sum = 0.5 / spread * (at[2 * j][r] - at[2 * j + 1][r]);
      for (int k = j + 1; k < poses; k++) sum -= out->by[r][k] * l[k][j];
      out->by[r][j] = l[j][j] > 0.0 ? sum / l[j][j] : 0.0;
    }
  return true;
}

// The textbook's one linearisation, at the mean.
bool linearise(const problem &p, const double *input, double (*covariance)[kInputs], int n, distribution *out) {
  if (!solve(p, input, out->mean)) return false;
  double point[kInputs];
  std::memcpy(point, input, sizeof point);
  for (int j = 0; j < n; j++) {
    double plus[2], minus[2];
    point[j] = input[j] + kStep;
    if (!solve(p, point, plus)) return false;
    point[j] = input[j] - kStep;
    if (!solve(p, point, minus)) return false;
    point[j] = input[j];
    for (int r = 0; r < 2; r++) out->by[r][j] = (plus[r] - minus[r]) / (2.0 * kStep);
  }
  for (int r = 0; r < 2; r++)
    for (int c = 0; c < 2; c++) {
      out->covariance[r][c] = 0.0;
      for (int j = 0; j < n; j++)
        for (int k = 0; k < n; k++) out->covariance[r][c] += out->by[r][j] * covariance[j][k] * out->by[c][k];
    }
  return true;
}

// Variance of the angle by which line i misses a place in the first pose's frame: its azimuth's, its pose's heading and
// place across the line. Each line alone; what lines share is the transform's business.
double miss_variance(const line_bundle &b, const double *input, const double (*covariance)[kInputs], int i,
                     const double place[2], double distance_floor) {
  double variance = square(b.sigma_rad[i]);
  if (i == 0) return variance;
  const int r = 3 * (i - 1);
  const double dx = place[0] - input[r], dy = place[1] - input[r + 1];
  const double q = larger(dx * dx + dy * dy, square(distance_floor));
  const double by[3] = {dy / q, -dx / q, -1.0};
  for (int k = 0; k < 3; k++)
    for (int l = 0; l < 3; l++) variance += by[k] * covariance[r + k][r + l] * by[l];
  return variance;
}

// Ahead of every pose? And how well, and under which angle, do the lines cross?
void judge(const line_bundle &b, const double *variance, line_landmark *out) {
  double direction[kLinePoses];
  out->misfit = out->parallax_rad = 0.0;
  for (int i = 0; i < b.count; i++) {
    const double dx = out->place_m[0] - b.pose[i].x_m, dy = out->place_m[1] - b.pose[i].y_m;
    direction[i] = atan2(dy, dx);
    const double residual = wrap(direction[i] - b.pose[i].heading_rad - b.azimuth_rad[i]);
    out->solved &= std::fabs(residual) < 1.0;
    out->misfit += square(residual) / (variance[i] * b.count);
    for (int j = 0; j < i; j++) {
      const double angle = std::fabs(wrap(direction[i] - direction[j]));
      if (angle > out->parallax_rad) out->parallax_rad = angle;
    }
    if (i == b.count - 1) out->distance_m = std::sqrt(dx * dx + dy * dy);
  }
}

}  // namespace

line_landmark find_line(const line_bundle &b, bool unscented) {
  line_landmark out{};
  const int poses = 3 * (b.count - 1), n = poses + b.count;
  double input[kInputs], by_poses[3 * kLinePoses][3 * kLinePoses] = {}, covariance[kInputs][kInputs] = {};
  relative_poses(b, input, by_poses);
  for (int i = 0; i < b.count; i++) input[poses + i] = b.azimuth_rad[i];
  for (int r = 0; r < poses; r++) {
    double row[3 * kLinePoses];
    for (int k = 0; k < 3 * b.count; k++) {
      row[k] = 0.0;
      for (int l = 0; l < 3 * b.count; l++) row[k] += by_poses[r][l] * b.pose_covariance[l][k];
    }
    for (int c = 0; c < poses; c++)
      for (int k = 0; k < 3 * b.count; k++) covariance[r][c] += row[k] * by_poses[c][k];
  }
  for (int i = 0; i < b.count; i++) covariance[poses + i][poses + i] = square(b.sigma_rad[i]);

  // A first crossing with equal weights tells the distances; each equation's error is its distance times its sigma.
  problem p{b.count, 1.0, {}};
  for (int i = 1; i < b.count; i++) {
    const double way = std::sqrt(square(input[3 * (i - 1)]) + square(input[3 * (i - 1) + 1]));
    if (way > p.scale) p.scale = way;
  }
  for (int i = 0; i < b.count; i++) p.weight[i] = 1.0;
  double place[2], variance[kLinePoses];
  if (!solve(p, input, place)) return out;
  for (int i = 0; i < b.count; i++) {
    const double dx = place[0] - (i > 0 ? input[3 * (i - 1)] : 0.0),
                 dy = place[1] - (i > 0 ? input[3 * (i - 1) + 1] : 0.0);
    const double distance = larger(std::sqrt(dx * dx + dy * dy), 0.05 * p.scale);
    variance[i] = miss_variance(b, input, covariance, i, place, 0.05 * p.scale);
    p.weight[i] = p.scale * b.sigma_rad[0] / (std::sqrt(variance[i]) * distance);
  }
  distribution d{};
  double l[kInputs][kInputs];
  std::memcpy(l, covariance, sizeof l);
  if (unscented) root(l, poses);
  for (int i = poses; i < n; i++) l[i][i] = b.sigma_rad[i - poses];
  if (!(unscented ? transform(p, input, l, poses, n, &d) : linearise(p, input, covariance, n, &d))) return out;

  // What the poses don't explain: azimuths' noise and the transform's remainder.
  double rest[2][2];
  for (int r = 0; r < 2; r++)
    for (int c = 0; c < 2; c++) {
      rest[r][c] = d.covariance[r][c];
      for (int j = 0; j < poses; j++)
        for (int k = 0; k < poses; k++) rest[r][c] -= d.by[r][j] * covariance[j][k] * d.by[c][k];
    }
  // From the first pose's frame to map.
  const sin_cos h = sincos(b.pose[0].heading_rad);
  const double rotation[2][2] = {{h.cos, -h.sin}, {h.sin, h.cos}};
  for (int r = 0; r < 2; r++) {
    const double turned = rotation[r][0] * d.mean[0] + rotation[r][1] * d.mean[1];
    out.place_m[r] = (r == 0 ? b.pose[0].x_m : b.pose[0].y_m) + turned;
    out.by_pose[r][r] = 1.0;
    for (int c = 0; c < 2; c++)
      for (int k = 0; k < 2; k++)
        for (int m = 0; m < 2; m++) out.noise[r][c] += rotation[r][k] * rest[k][m] * rotation[c][m];
    for (int j = 0; j < 3 * b.count; j++)
      for (int k = 0; k < 2; k++)
        for (int i = 0; i < poses; i++) out.by_pose[r][j] += rotation[r][k] * d.by[k][i] * by_poses[i][j];
  }
  out.by_pose[0][2] -= out.place_m[1] - b.pose[0].y_m;
  out.by_pose[1][2] += out.place_m[0] - b.pose[0].x_m;
  out.solved = true;
  for (int r = 0; r < 2; r++)
    if (out.noise[r][r] < 0.0) out.noise[r][r] = 0.0;
  judge(b, variance, &out);
  return out;
}

}  // namespace wm
