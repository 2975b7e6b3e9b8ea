// SPDX-License-Identifier: Apache-2.0
#include "filters/relocalize/pose_consensus.hpp"

#include "math/absolute_orientation.hpp"
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

double misfit(const problem &all, int i, const pose3 &at, const mat3 &r) {
  const vec3 off = at.p + r * all.from[i] - all.to[i];
  return all.weight[i] * dot(off, off);
}

// Clipped sum of squares; fewer is better.
double cost_of(const problem &all, const pose3 &at, int *agreeing) {
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

int differing_ids(const problem &all, const pose3 &at) {
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
bool covariance_of(const problem &all, const pose3 &at, const vec3 &base, double out[6][6]) {
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

void pose_consensus::add(const point_clue &clue) {
  clue_[count_ % kCapacity] = clue;
  count_++;
  if (count_ == 4 * kCapacity) count_ -= 2 * kCapacity;  // the index stays small; its place in the ring is the same
}

pose_found pose_consensus::find(wm_time_ns since_ns, const pose3 &odom, double way_m, double turn_rad, double sigma_m,
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

  pose3 best{};
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
    pose3 at;
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
    pose3 at;
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
