// SPDX-License-Identifier: Apache-2.0
#include "vision/stereo/motion.hpp"

#include "math/absolute_orientation.hpp"
#include "math/eigen.hpp"
#include "waymark/random.h"

namespace wm {
namespace {

constexpr int kHypotheses = 60;   // with 40 % of the points in agreement one is right with 98 %
constexpr int kRounds = 6;        // of Gauss-Newton, two of them with a wider limit. Not swept
constexpr double kEnough = 0.85;  // of all agree: no better guess is looked for
constexpr uint64_t kStream = 0x73746572;

// Squared misfit of the worst coordinate, px^2; far beyond any limit where the point is behind.
double misfit(const pair_geometry &rig, const seen_twice &point, const rigid &motion) {
  pair_pixels px;
  if (!pixels_of(rig, motion * point.before, &px)) return 1e12;
  const double a = square(px.left_u - point.now.left_u), b = square(px.left_v - point.now.left_v),
               c = square(px.right_u - point.now.right_u);
  return a > b ? (a > c ? a : c) : (b > c ? b : c);
}

// Clipped sum of squares: less is better.
double cost_of(const pair_geometry &rig, const seen_twice *points, int count, const rigid &motion, double limit,
               int *agreeing) {
  double cost = 0.0;
  *agreeing = 0;
  for (int i = 0; i < count; i++) {
    const double off = misfit(rig, points[i], motion);
    *agreeing += off < limit;
    cost += off < limit ? off : limit;
  }
  return cost;
}

// One step of Gauss-Newton over those that agree, the residual's weight falling with its size.
bool refine(const pair_geometry &rig, const seen_twice *points, int count, double limit, rigid *motion) {
  matrix<6> sums = matrix<6>::Zero();
  vector<6> right = vector<6>::Zero(), step;
  for (int i = 0; i < count; i++) {
    const vec3 x = *motion * points[i].before;
    pair_pixels px;
    if (!pixels_of(rig, x, &px)) continue;
    const double off[3] = {points[i].now.left_u - px.left_u, points[i].now.left_v - px.left_v,
                           points[i].now.right_u - px.right_u};
    const double z = 1.0 / x.z;
    const double by[3][3] = {{rig.fu * z, 0, -rig.fu * x.x * z * z},
                             {0, rig.fv * z, -rig.fv * x.y * z * z},
                             {rig.fu * z, 0, -rig.fu * (x.x - rig.baseline_m) * z * z}};
    const double size = square(off[0]) + square(off[1]) + square(off[2]);
    if (size > 3 * limit) continue;
    const double weight = 1.0 / (1.0 + 9.0 * size / limit);
    for (int k = 0; k < 3; k++) {
      // x moves by the step's first three, and by the turn's cross product with x.
      vector<6> row;
      row << by[k][0], by[k][1], by[k][2], by[k][2] * x.y - by[k][1] * x.z, by[k][0] * x.z - by[k][2] * x.x,
          by[k][1] * x.x - by[k][0] * x.y;
      right += weight * off[k] * row;
      sums += weight * row * row.transpose();
    }
  }
  if (!solve_positive<6, 1>(sums, right, &step)) return false;
  const mat3 turn = matrix_of(turn_by({step(3), step(4), step(5)}));
  motion->R = turn * motion->R;
  motion->t = turn * motion->t + vec3{step(0), step(1), step(2)};
  return finite(motion->t);
}

}  // namespace

vec3 place_of(const pair_geometry &rig, const pair_pixels &px) {
  const double z = rig.fu * rig.baseline_m / (px.left_u - px.right_u);
  return {z * (px.left_u - rig.cu) / rig.fu, z * (px.left_v - rig.cv) / rig.fv, z};
}

bool pixels_of(const pair_geometry &rig, const vec3 &place, pair_pixels *out) {
  if (!(place.z > 0.02)) return false;
  const double z = 1.0 / place.z;
  *out = {rig.cu + rig.fu * place.x * z, rig.cv + rig.fv * place.y * z,
          rig.cu + rig.fu * (place.x - rig.baseline_m) * z};
  return true;
}

bool find_motion(const pair_geometry &rig, const seen_twice *points, int count, const rigid *prior, double agree_px,
                 uint64_t seed, rigid *out, uint8_t *agrees) {
  if (count < kFewest) return false;
  const double limit = square(agree_px);
  rigid best = prior ? *prior : kIdentityMotion;
  int agreeing;
  double least = cost_of(rig, points, count, best, limit, &agreeing);
  uint64_t draw = 0;
  for (int h = 0; h < kHypotheses && agreeing < kEnough * count; h++) {
    vec3 from[3], to[3];
    const double weight[3] = {1, 1, 1};
    int chosen[3];
    for (int k = 0; k < 3; k++) {
      chosen[k] = static_cast<int>(wm_random_uniform(seed, kStream, draw++) * count);
      from[k] = points[chosen[k]].before;
      to[k] = place_of(rig, points[chosen[k]].now);
    }
    if (chosen[0] == chosen[1] || chosen[1] == chosen[2] || chosen[0] == chosen[2]) continue;
    pose3 at;
    if (!absolute_orientation(from, to, weight, 3, &at)) continue;
    rigid motion = {matrix_of(at.q), at.p};
    int number;
    const double cost = cost_of(rig, points, count, motion, limit, &number);
    if (cost >= least) continue;
    least = cost;
    best = motion;
    agreeing = number;
  }
  if (agreeing < 3) return false;
  for (int round = 0; round < kRounds; round++)
    if (!refine(rig, points, count, round < 2 ? 4 * limit : limit, &best)) return false;
  cost_of(rig, points, count, best, limit, &agreeing);
  for (int i = 0; i < count; i++) agrees[i] = misfit(rig, points[i], best) < limit;
  *out = best;
  return agreeing >= kFewest && agreeing >= kAgreeing * count;
}

}  // namespace wm
