// SPDX-License-Identifier: Apache-2.0
#include "filters/relocalize/pose_consensus.hpp"

#include "math/absolute_orientation.hpp"
#include "math/eigen.hpp"
#include "waymark/random.h"

namespace wm {
namespace {

// With 40 % outliers one triple in five has none: 100 triples all have some with a probability of 3e-11.
constexpr int kHypotheses = 100;
constexpr double kInlierChi2 = 11.345;  // 99 % quantile of chi2, 3 degrees of freedom
constexpr double kInlierShare = 0.6;    // of the observations, at least, for a pose to be taken; not swept
constexpr int kFewestInliers = 4;       // three points agree on some pose always
constexpr int kFewestPoints = 3;        // that differ, among the inliers
constexpr int kRounds = 4;              // of the refinement; it stops earlier where the cost no longer falls
// Sigma of the odometry per metre travelled and per radian turned: a bad velocity log. Not swept.
constexpr double kTravelSigma_mpm = 0.05, kTurnSigma_radprad = 0.05;
constexpr uint64_t kStream = 0x636f6e73;  // of random numbers: "cons"

double chi2_of(const matched_points &all, int i, const pose3 &at, const mat3 &r) {
  const vec3 off = at.p + r * all.from[i] - all.to[i];
  return all.weight[i] * dot(off, off);
}

agreed_pose judged(const matched_points &all, const pose3 &at) {
  const mat3 r = matrix_of(at.q);
  agreed_pose out = {at, 0.0, 0};
  for (int i = 0; i < all.count; i++) {
    const double chi2 = chi2_of(all, i, at, r);
    out.cost += chi2 < kInlierChi2 ? chi2 : kInlierChi2;
    out.inliers += chi2 < kInlierChi2;
  }
  return out;
}

int differing_points(const matched_points &all, const pose3 &at) {
  const mat3 r = matrix_of(at.q);
  int64_t ids[matched_points::kCapacity];
  int count = 0;
  for (int i = 0; i < all.count; i++) {
    if (!(chi2_of(all, i, at, r) < kInlierChi2)) continue;
    bool known = false;
    for (int k = 0; k < count; k++) known = known || ids[k] == all.id[i];
    if (!known) ids[count++] = all.id[i];
  }
  return count;
}

// The best of random triples.
agreed_pose best_of_triples(const matched_points &all, int hypotheses, uint64_t seed) {
  agreed_pose best;
  uint64_t draw = 0;
  for (int h = 0; h < hypotheses; h++) {
    vec3 from[3], to[3];
    const double weight[3] = {1, 1, 1};
    int64_t id[3];
    for (int k = 0; k < 3; k++) {
      const int chosen = (int)(wm_random_uniform(seed, kStream, draw++) * all.count);
      from[k] = all.from[chosen];
      to[k] = all.to[chosen];
      id[k] = all.id[chosen];
    }
    pose3 at;
    if (id[0] == id[1] || id[1] == id[2] || id[0] == id[2]) continue;
    if (!absolute_orientation(from, to, weight, 3, &at)) continue;
    if (const agreed_pose next = judged(all, at); next.cost < best.cost) best = next;
  }
  return best;
}

// Least squares over the inliers, again and again while the cost falls.
void refine(const matched_points &all, agreed_pose *best) {
  for (int round = 0; round < kRounds && best->inliers >= 3; round++) {
    const mat3 r = matrix_of(best->at.q);
    double weight[matched_points::kCapacity];
    for (int i = 0; i < all.count; i++) weight[i] = chi2_of(all, i, best->at, r) < kInlierChi2 ? all.weight[i] : 0.0;
    pose3 at;
    if (!absolute_orientation(all.from, all.to, weight, all.count, &at)) return;
    const agreed_pose next = judged(all, at);
    if (next.cost >= best->cost) return;
    *best = next;
  }
}

// Of the pose (place and rotation, map axes) at `base`, by the information of the inliers: the derivative of a point's
// displacement is [I, -skew(lever)].
bool covariance_of(const matched_points &all, const pose3 &at, const vec3 &base, double out[6][6]) {
  const mat3 r = matrix_of(at.q);
  matrix<6> information = matrix<6>::Zero(), covariance;
  for (int i = 0; i < all.count; i++) {
    if (!(chi2_of(all, i, at, r) < kInlierChi2)) continue;
    const mat3 lever = -1.0 * skew(at.p + r * all.from[i] - base);
    matrix<3, 6> by;
    by.leftCols<3>().setIdentity();
    by.rightCols<3>() = map(lever.m);
    information += all.weight[i] * (by.transpose() * by);
  }
  if (!invert_positive<6>(information, &covariance)) return false;
  for (int i = 0; i < 6; i++)
    for (int j = 0; j < 6; j++) out[i][j] = covariance(i, j);
  return true;
}

}  // namespace

agreed_pose pose_of_most(const matched_points &all, int hypotheses, uint64_t seed) {
  agreed_pose best;
  if (all.count < 3) return best;
  best = best_of_triples(all, hypotheses, seed);
  refine(all, &best);
  return best;
}

bool agrees(const matched_points &all, int i, const pose3 &at) {
  return chi2_of(all, i, at, matrix_of(at.q)) < kInlierChi2;
}

void pose_consensus::add(const point_observation &observation) {
  observation_[count_ % kCapacity] = observation;
  count_++;
  if (count_ == 4 * kCapacity) count_ -= 2 * kCapacity;  // bounds the counter; the place in the ring stays
}

pose_found pose_consensus::find(wm_time_ns since_ns, const travelled_pose &now, double sigma_m, double sigma_rad,
                                uint64_t seed) const {
  pose_found out{};
  matched_points all;
  for (int i = count_ > kCapacity ? count_ - kCapacity : 0; i < count_; i++) {
    const point_observation &o = observation_[i % kCapacity];
    if (o.t_ns < since_ns) continue;
    const double lever_m = length(o.seen - now.pose.p);
    all.from[all.count] = o.seen;
    all.to[all.count] = o.place;
    all.id[all.count] = o.id;
    all.weight[all.count++] = 1 / (square(o.sigma_m) + square(kTravelSigma_mpm * (now.travelled_m - o.travelled_m)) +
                                   square(kTurnSigma_radprad * (now.turned_rad - o.turned_rad) * lever_m));
  }
  if (all.count < kFewestInliers) return out;
  out.searched = true;
  const agreed_pose best = pose_of_most(all, kHypotheses, seed);
  if (best.inliers < kFewestInliers || best.inliers < kInlierShare * all.count ||
      differing_points(all, best.at) < kFewestPoints)
    return out;
  const pose3 &at = best.at;
  out.pose = {at.p + matrix_of(at.q) * now.pose.p, normalized(at.q * now.pose.q)};
  if (!covariance_of(all, at, out.pose.p, out.covariance)) return out;
  double place = 0.0, turn = 0.0;
  for (int i = 0; i < 3; i++) {
    place += out.covariance[i][i];
    turn += out.covariance[3 + i][3 + i];
  }
  out.found = place < square(sigma_m) && turn < square(sigma_rad);
  return out;
}

}  // namespace wm
