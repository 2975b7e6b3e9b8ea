// SPDX-License-Identifier: Apache-2.0
#include "filters/stereo_ekf/consensus.hpp"

#include <cstring>

#include "waymark/random.h"

namespace wm {
namespace {

constexpr int kHypotheses = 100;
constexpr double kAgrees = 11.3;   // 99 % of three normal numbers
constexpr double kAgreeing = 0.6;  // share of the clues that must agree
constexpr int kFewest = 4;         // three fit always
constexpr int kRounds = 4;
constexpr double kWayError = 0.05;  // motion's error in parts of the way and the turn
constexpr double kTurnError = 0.05;
constexpr uint64_t kStream = 0x636f6e73;

struct problem {
  vec3 from[pose_consensus::kCapacity], to[pose_consensus::kCapacity];
  double weight[pose_consensus::kCapacity];  // 1 / variance
  int32_t id[pose_consensus::kCapacity];
  int count;
};

double misfit(const problem &all, int i, const placed &at, const mat3 &r) {
  const vec3 off = at.p + r * all.from[i] - all.to[i];
  return all.weight[i] * dot(off, off);
}

// Clipped sum of squares; fewer is better.
double cost_of(const problem &all, const placed &at, int *agreeing) {
  const mat3 r = matrix_of(at.q);
  double cost = 0.0;
  *agreeing = 0;
  for (int i = 0; i < all.count; i++) {
    const double chi2 = misfit(all, i, at, r);
    cost += chi2 < kAgrees ? chi2 : kAgrees;
    *agreeing += chi2 < kAgrees;
  }
  return cost;
}

// Largest eigenvalue's vector of a symmetric 4 x 4 matrix by Jacobi's rotations.
quat largest_vector(double a[4][4]) {
  double v[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  for (int sweep = 0; sweep < 12; sweep++)
    for (int i = 0; i < 3; i++)
      for (int j = i + 1; j < 4; j++) {
        if (a[i][j] == 0.0) continue;
        const double theta = (a[j][j] - a[i][i]) / (2 * a[i][j]);
        const double size = theta < 0 ? -theta : theta;
        double t = 1 / (size + std::sqrt(theta * theta + 1));
        if (theta < 0) t = -t;
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 4; k++) {
          const double x = a[k][i], y = a[k][j];
          a[k][i] = c * x - s * y;
          a[k][j] = s * x + c * y;
        }
        for (int k = 0; k < 4; k++) {
          const double x = a[i][k], y = a[j][k];
          a[i][k] = c * x - s * y;
          a[j][k] = s * x + c * y;
        }
        for (auto &row : v) {
          const double x = row[i], y = row[j];
          row[i] = c * x - s * y;
          row[j] = s * x + c * y;
        }
      }
  int best = 0;
  for (int i = 1; i < 4; i++)
    if (a[i][i] > a[best][best]) best = i;
  return normalized({v[0][best], {v[1][best], v[2][best], v[3][best]}});
}

int differing_ids(const problem &all, const placed &at) {
  const mat3 r = matrix_of(at.q);
  int32_t ids[pose_consensus::kCapacity];
  int count = 0;
  for (int i = 0; i < all.count; i++) {
    if (!(misfit(all, i, at, r) < kAgrees)) continue;
    bool known = false;
    for (int k = 0; k < count; k++) known = known || ids[k] == all.id[i];
    if (!known) ids[count++] = all.id[i];
  }
  return count;
}

// Information of the pose (place, turn, in map axes) at `base`, from what agrees.
bool covariance_of(const problem &all, const placed &at, const vec3 &base, double out[6][6]) {
  const mat3 r = matrix_of(at.q);
  double information[6][6] = {};
  for (int i = 0; i < all.count; i++) {
    if (!(misfit(all, i, at, r) < kAgrees)) continue;
    const mat3 lever = -1.0 * skew(at.p + r * all.from[i] - base);
    for (int a = 0; a < 6; a++)
      for (int b = 0; b < 6; b++)
        for (int k = 0; k < 3; k++) {
          const double x = a < 3 ? (a == k ? 1.0 : 0.0) : lever.m[k][a - 3];
          const double y = b < 3 ? (b == k ? 1.0 : 0.0) : lever.m[k][b - 3];
          information[a][b] += all.weight[i] * x * y;
        }
  }
  return invert6(information, out);
}

}  // namespace

bool invert6(const double a[6][6], double out[6][6]) {
  double l[6][6] = {}, inverse[6][6] = {};
  for (int j = 0; j < 6; j++)
    for (int i = j; i < 6; i++) {
      double sum = a[i][j];
      for (int k = 0; k < j; k++) sum -= l[i][k] * l[j][k];
      if (i == j) {
        if (!(sum > 1e-12 * a[j][j])) return false;
        l[j][j] = std::sqrt(sum);
      } else {
        l[i][j] = sum / l[j][j];
      }
    }
  for (int j = 0; j < 6; j++)
    for (int i = j; i < 6; i++) {
      double sum = i == j ? 1.0 : 0.0;
      for (int k = j; k < i; k++) sum -= l[i][k] * inverse[k][j];
      inverse[i][j] = sum / l[i][i];
    }
  for (int i = 0; i < 6; i++)
    for (int j = 0; j < 6; j++) {
      out[i][j] = 0.0;
      for (int k = i > j ? i : j; k < 6; k++) out[i][j] += inverse[k][i] * inverse[k][j];
    }
  return true;
}

bool absolute_orientation(const vec3 *from, const vec3 *to, const double *weight, int count, placed *out) {
  vec3 a = {0, 0, 0}, b = {0, 0, 0};
  double sum = 0.0;
  for (int i = 0; i < count; i++) {
    a = a + weight[i] * from[i];
    b = b + weight[i] * to[i];
    sum += weight[i];
  }
  if (!(sum > 0.0)) return false;
  a = (1 / sum) * a;
  b = (1 / sum) * b;
  double s[3][3] = {};
  // Spread of the points: what is left across the line through the two farthest apart must not vanish.
  vec3 line = {0, 0, 0};
  for (int i = 0; i < count; i++) {
    const vec3 x = from[i] - a, y = to[i] - b;
    if (dot(x, x) > dot(line, line)) line = x;
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++) s[j][k] += weight[i] * x[j] * y[k];
  }
  double across = 0.0;
  for (int i = 0; i < count; i++) {
    const vec3 off = cross(line, from[i] - a);
    if (dot(off, off) > across) across = dot(off, off);
  }
  const double length2 = dot(line, line);
  if (!(across > square(0.05 * length2)) || !(length2 > 0.0)) return false;
  double n[4][4] = {{s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]},
                    {s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]},
                    {s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]},
                    {s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1]}};
  out->q = largest_vector(n);
  out->p = b - matrix_of(out->q) * a;
  return true;
}

void pose_consensus::add(const point_clue &clue) {
  clue_[count_ % kCapacity] = clue;
  count_++;
  if (count_ == 4 * kCapacity) count_ -= 2 * kCapacity;  // the index stays small; its place in the ring is the same
}

pose_found pose_consensus::find(wm_time_ns since_ns, const placed &odom, double way_m, double turn_rad, double sigma_m,
                                double sigma_rad, uint64_t seed) const {
  pose_found out{};
  problem all;
  all.count = 0;
  for (int i = count_ > kCapacity ? count_ - kCapacity : 0; i < count_; i++) {
    const point_clue &c = clue_[i % kCapacity];
    if (c.t_ns < since_ns) continue;
    const double far = length(c.seen - odom.p);
    all.from[all.count] = c.seen;
    all.to[all.count] = c.place;
    all.id[all.count] = c.id;
    all.weight[all.count++] = 1 / (square(c.sigma_m) + square(kWayError * (way_m - c.way_m)) +
                                   square(kTurnError * (turn_rad - c.turn_rad) * far));
  }
  if (all.count < kFewest) return out;

  placed best{};
  double least = 1e300;
  int agreeing = 0;
  uint64_t draw = 0;
  for (int h = 0; h < kHypotheses; h++) {
    vec3 from[3], to[3];
    const double weight[3] = {1, 1, 1};
    int chosen[3];
    for (int k = 0; k < 3; k++) {
      const double u = wm_random_uniform(seed, kStream, draw++);
      chosen[k] = (int)(u * all.count);
      from[k] = all.from[chosen[k]];
      to[k] = all.to[chosen[k]];
    }
    const int32_t a = all.id[chosen[0]], b = all.id[chosen[1]], c = all.id[chosen[2]];
    if (a == b || b == c || a == c) continue;
    placed at;
    int count;
    if (!absolute_orientation(from, to, weight, 3, &at)) continue;
    const double cost = cost_of(all, at, &count);
    if (cost >= least) continue;
    least = cost;
    best = at;
    agreeing = count;
  }
  for (int round = 0; round < kRounds && agreeing >= 3; round++) {
    const mat3 r = matrix_of(best.q);
    double weight[kCapacity];
    for (int i = 0; i < all.count; i++) weight[i] = misfit(all, i, best, r) < kAgrees ? all.weight[i] : 0.0;
    placed at;
    int count;
    if (!absolute_orientation(all.from, all.to, weight, all.count, &at)) break;
    if (cost_of(all, at, &count) >= least) break;
    least = cost_of(all, at, &agreeing);
    best = at;
  }
  if (agreeing < kFewest || agreeing < kAgreeing * all.count || differing_ids(all, best) < 3) return out;
  const mat3 r = matrix_of(best.q);
  out.pose = {best.p + r * odom.p, normalized(best.q * odom.q)};
  if (!covariance_of(all, best, out.pose.p, out.covariance)) return out;
  double place = 0.0, turn = 0.0;
  for (int i = 0; i < 3; i++) {
    place += out.covariance[i][i];
    turn += out.covariance[3 + i][3 + i];
  }
  out.found = place < square(sigma_m) && turn < square(sigma_rad);
  return out;
}

}  // namespace wm
