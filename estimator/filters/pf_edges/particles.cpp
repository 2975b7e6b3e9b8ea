// SPDX-License-Identifier: Apache-2.0
#include "filters/pf_edges/particles.hpp"

#include <cstring>

#include "math/arc.hpp"
#include "math/eigen.hpp"
#include "waymark/random.h"

namespace wm {
namespace {

constexpr int kDrawsMax = 200;  // of a place, before an undrivable one is taken: of 0.5 % drivable floor 63 % are found
constexpr double kImpossible = -1.0e300;  // score where the map is not drivable
constexpr double kTotalMin = 1.0e-280;  // of the products' sum, from which on it is normalised: above denormal numbers

}  // namespace

void particles::init(int count, uint64_t seed, void *memory) {
  count_ = count;
  seed_ = seed;
  step_ = 0;
  arrays_.set(static_cast<double *>(memory));
  std::memset(memory, 0, bytes(count));
}

// Four numbers of variance 1 from one block of random bits: each the sum of three uniform ones of 10 bits. A step's
// noise need not have the normal's tails; it must be cheap.
void particles::normals(int particle, double out[4]) const {
  uint32_t block[4];
  wm_random_block(seed_, step_, (uint64_t)particle, block);
  for (int k = 0; k < 4; k++) {
    const int sum = (int)(block[k] & 1023u) + (int)(block[k] >> 10 & 1023u) + (int)(block[k] >> 20 & 1023u);
    out[k] = (sum - 1534.5) * (1.0 / 512.0);  // variance of the sum: 3 (1024^2 - 1)/12 = 512^2
  }
}

void particles::level() {
  for (int i = 0; i < count_; i++) array(3)[i] = 1.0 / count_;
}

void particles::spread(const wm_pose2 &pose, const double covariance[3][3]) {
  matrix<3> lower;
  vector<3> variance;  // 0 along an axis without spread
  factorize_semidefinite<3>(Eigen::Map<const matrix<3>>(&covariance[0][0]), 0.0, &lower, &variance);
  step_++;
  for (int i = 0; i < count_; i++) {
    double n[4];
    normals(i, n);
    vector<3> off;
    for (int k = 0; k < 3; k++) off[k] = std::sqrt(variance[k]) * n[k];
    off = lower * off.eval();
    array(0)[i] = pose.x_m + off[0];
    array(1)[i] = pose.y_m + off[1];
    array(2)[i] = wrap(pose.heading_rad + off[2]);
  }
  level();
}

void particles::spread_over(const edge_map &map) {
  const wm_raster &raster = map.raster();
  for (int i = 0; i < count_; i++) {
    for (int draw = 0; draw < kDrawsMax; draw++) {
      step_++;
      map.to_map(raster.width_px * wm_random_uniform(seed_, step_, 0),
                 raster.height_px * wm_random_uniform(seed_, step_, 1), &array(0)[i], &array(1)[i]);
      if (map.drivable(array(0)[i], array(1)[i])) break;
    }
    array(2)[i] = wrap(kTwoPi * wm_random_uniform(seed_, step_, 2));
  }
  level();
}

void particles::propagate(const wm_pose2 &increment, const step_noise &noise) {
  double *x = array(0), *y = array(1), *heading = array(2);
  step_++;
  for (int i = 0; i < count_; i++) {
    double n[4];
    normals(i, n);
    // Half of the turn's noise comes before the way, half behind it.
    const double turn = noise.turn_rad * n[2];
    const double dx = increment.x_m + noise.along_m * n[0], dy = increment.y_m + noise.across_m * n[1];
    const sin_cos h = sincos(heading[i] + 0.5 * turn);
    x[i] += h.cos * dx - h.sin * dy;
    y[i] += h.sin * dx + h.cos * dy;
    heading[i] = wrap(heading[i] + increment.heading_rad + turn);
  }
}

// All particles against a block of points, block after block.
void particles::score_by_field(const edge_map &map, const score_field &field, const scan_points &points,
                               double *scored) {
  packed_scan packed;
  field.pack(map, points, &packed);
  auto *words = reinterpret_cast<int16_t *>(array(5));
  const field_poses poses = {words,
                             words + count_,
                             words + (ptrdiff_t)2 * count_,
                             words + (ptrdiff_t)3 * count_,
                             words + (ptrdiff_t)4 * count_,
                             words + (ptrdiff_t)5 * count_};
  auto *sums = reinterpret_cast<int32_t *>(array(7));
  field.place(map, packed, count_, array(0), array(1), array(2), poses);
  field.score(packed, poses, count_, sums);
  const double least = field.floor() * points.count;
  for (int i = 0; i < count_; i++) scored[i] = least + field.unit() * sums[i];
}

bool particles::weigh(const edge_map &map, const score_field &field, const scan_points &points,
                      const score_table &table, double exponent, bool sum) {
  const double *x = array(0), *y = array(1), *heading = array(2);
  double *weight = array(3), *scored = array(4);
  if (field.ready()) score_by_field(map, field, points, scored);
  double best = 0.0;
  bool any = false;
  for (int i = 0; i < count_; i++) {
    if (!map.drivable(x[i], y[i])) {
      scored[i] = kImpossible;
      continue;
    }
    if (!field.ready()) {
      const sin_cos h = sincos(heading[i]);
      scored[i] = kScoreUnit * score(map, points, table, x[i], y[i], h.cos, h.sin);
    }
    if (!any || scored[i] > best) best = scored[i];
    any = true;
  }
  if (!any || (sum && !(best > 0.0))) return false;
  double total = 0.0;
  for (int i = 0; i < count_; i++) {
    const double likelihood = scored[i] <= kImpossible ? 0.0
                              : sum                    ? scored[i] / best
                                                       : exp(exponent * (scored[i] - best));
    scored[i] = weight[i] * likelihood;
    total += scored[i];
  }
  if (!(total > kTotalMin)) return false;
  for (int i = 0; i < count_; i++) weight[i] = scored[i] / total;
  return true;
}

double particles::effective() const {
  const double *weight = array(3);
  double squares = 0.0;
  for (int i = 0; i < count_; i++) squares += weight[i] * weight[i];
  return squares > 0.0 ? 1.0 / squares : 0.0;
}

void particles::resample() {
  step_++;
  const double step = 1.0 / count_;
  double at = step * wm_random_uniform(seed_, step_, 0), sum = array(3)[0];
  int from = 0;
  for (int i = 0; i < count_; i++, at += step) {
    while (sum < at && from + 1 < count_) sum += array(3)[++from];
    for (int k = 0; k < 3; k++) array(4 + k)[i] = array(k)[from];
  }
  for (int k = 0; k < 3; k++) std::memcpy(array(k), array(4 + k), (size_t)count_ * sizeof(double));
  for (int i = 0; i < count_; i++) array(3)[i] = step;
}

particle_moments particles::main_cluster(double radius_m, double radius_rad) const {
  int best = 0;
  for (int i = 1; i < count_; i++)
    if (weight(i) > weight(best)) best = i;
  const wm_pose2 centre = {x(best), y(best), heading(best)};
  const auto near = [&](int i) {
    return square(x(i) - centre.x_m) + square(y(i) - centre.y_m) <= square(radius_m) &&
           std::fabs(wrap(heading(i) - centre.heading_rad)) <= radius_rad;
  };
  particle_moments out{};
  double sum[2] = {}, circle[2] = {};
  for (int i = 0; i < count_; i++) {
    if (!near(i)) continue;
    const double w = weight(i);
    const sin_cos h = sincos(heading(i));
    out.share += w;
    sum[0] += w * (x(i) - centre.x_m);
    sum[1] += w * (y(i) - centre.y_m);
    circle[0] += w * h.cos;
    circle[1] += w * h.sin;
  }
  out.mean = {centre.x_m + sum[0] / out.share, centre.y_m + sum[1] / out.share, atan2(circle[1], circle[0])};
  for (int i = 0; i < count_; i++) {
    if (!near(i)) continue;
    const double d[3] = {x(i) - out.mean.x_m, y(i) - out.mean.y_m, wrap(heading(i) - out.mean.heading_rad)};
    for (int r = 0; r < 3; r++)
      for (int c = 0; c < 3; c++) out.covariance[r][c] += weight(i) / out.share * d[r] * d[c];
  }
  return out;
}

}  // namespace wm
