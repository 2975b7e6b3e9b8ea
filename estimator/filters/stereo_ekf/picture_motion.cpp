// SPDX-License-Identifier: Apache-2.0
#include "filters/stereo_ekf/picture_motion.hpp"

namespace wm {
namespace {

// Errors of a track's rows as multiples of the pixel's sigma. u and v drift by kDrift from one picture to the next. A
// disparity is off by kDisparity, new in each picture, and its change by kDisparityWalk. From three drives of cars by
// their truth, with a pixel's sigma stated as 1 px: 1.0, 0.4 and 0.3. Not swept.
constexpr double kDrift = 1.0, kDisparity = 0.5, kDisparityWalk = 0.3;
// Nearer than that to the camera's plane, a point has no useful derivative. Not swept.
constexpr double kNearest_m = 0.5;
// Least disparity as a multiple of its sigma: below, the point may as well be behind the camera.
constexpr double kDisparityLeast = 1.0;
// Tracks that a fit needs: three determine a motion, and half of them may be wrong.
constexpr int kLeast = 6;
constexpr int kIterations = 10;
// Scale of the robust kernel: four times the median of the squared misfits (a chi-square of three degrees: 2.37 where
// the stated noise holds), of which the least is taken as 0.5. Not swept.
constexpr double kKernel = 4.0, kMedianLeast = 0.5, kMedianOfThree = 2.37;
// A misfit beyond the 99 % quantile of three degrees, scaled by what the median shows, is no part of the scene; by at
// most 9 (three sigma), so that a picture in which most tracks are wrong does not pass for a noisy one.
constexpr double kCut = 11.3, kScaleMost = 9.0;
// Pictures in which a track is cut before it is no longer used.
constexpr int kMissesMost = 2;
// Tracks of one picture err alike (drift along the flow, shutter, rectification), so they are not as many observations
// as there are tracks: their information is divided by this. On three drives 9 to 36 give the same errors to 15 %, and
// below 4 the covariance excludes the truth.
constexpr double kAlike = 16.0;
// Information of a direction that no track determines, 1/m^2 and 1/rad^2: sigma 1000, and no effect elsewhere.
constexpr double kLeastInformation = 1e-6;
// A depth that is off by more than three sigma begins again.
constexpr double kDepthGate = 9.0;

// Where a point of the earlier picture is seen now.
struct carried_point {
  vec3 in_body, in_camera;  // now
  vec3 before;              // in the body, at the earlier picture
};

carried_point carry(const pair_view &pair, const pose3 &moved, const mat3 &turned, double u, double v,
                    double disparity) {
  const double depth_m = pair.fu * pair.baseline_m / disparity;
  const vec3 x = {depth_m * (u - pair.cu) / pair.fu, depth_m * (v - pair.cv) / pair.fv, depth_m};
  carried_point out;
  out.before = pair.axes * x + pair.place;
  out.in_body = transposed_times(turned, out.before - moved.p);
  out.in_camera = transposed_times(pair.axes, out.in_body - pair.place);
  return out;
}

}  // namespace

bool picture_motion::add(int32_t id, double u, double disparity, double v) {
  if (seen_ == kTracks) return false;
  // Trackers keep their order: the search begins behind the track that was found last.
  const int begin = seen_ > 0 && view_[seen_ - 1].earlier >= 0 ? view_[seen_ - 1].earlier + 1 : 0;
  int earlier = -1;
  for (int k = 0; k < tracks_ && earlier < 0; k++) {
    const int i = begin + k < tracks_ ? begin + k : begin + k - tracks_;
    if (tracks()[i].id == id) earlier = i;
  }
  view_[seen_++] = {u, v, disparity, id, earlier};
  return earlier < 0 || tracks()[earlier].misses < kMissesMost;
}

// e = R'(x - p), pixels of B'(e - t); errors of the motion: e changes by -R' dp + R' [x - p] dr.
bool picture_motion::make_row(const pair_view &pair, const pose3 &moved, const view &now, fit_row *out) const {
  const track &from = tracks()[now.earlier];
  const mat3 turned = matrix_of(moved.q);
  const carried_point at = carry(pair, moved, turned, from.u, from.v, from.disparity);
  const vec3 &c = at.in_camera;
  if (!(c.z > kNearest_m)) return false;
  const double iz = 1.0 / c.z, shift = pair.fu * pair.baseline_m * iz;
  matrix<3> by_point, noise, root;
  by_point << pair.fu * iz, 0, -pair.fu * c.x * iz * iz, 0, 0, -shift * iz, 0, pair.fv * iz, -pair.fv * c.y * iz * iz;
  matrix<3, 6> by_error;
  const mat3 by_place = -1.0 * (transposed(pair.axes) * transposed(turned));
  const mat3 by_turn = -1.0 * (by_place * skew(at.before - moved.p));
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      by_error(i, j) = by_place.m[i][j];
      by_error(i, 3 + j) = by_turn.m[i][j];
    }
  matrix<3, 6> by = by_point * by_error;
  // The point moves along its ray by -depth / disparity.
  const vec3 ray =
      (-1.0 / from.disparity) * transposed_times(pair.axes, transposed_times(turned, at.before - pair.place));
  const vector<3> by_disparity = by_point * vector<3>(ray.x, ray.y, ray.z);
  noise = by_disparity * by_disparity.transpose() * from.variance;
  noise(0, 0) += square(kDrift * pair.sigma_px);
  noise(1, 1) += square(kDisparity * pair.sigma_px);
  noise(2, 2) += square(kDrift * pair.sigma_px);
  if (!cholesky<3>(noise, &root)) return false;
  double left[3] = {now.u - (pair.fu * c.x * iz + pair.cu), now.disparity - shift,
                    now.v - (pair.fv * c.y * iz + pair.cv)};
  for (int i = 0; i < 3; i++) {  // L^-1
    for (int k = 0; k < i; k++) {
      left[i] -= root(i, k) * left[k];
      for (int j = 0; j < 6; j++) by(i, j) -= root(i, k) * by(k, j);
    }
    left[i] /= root(i, i);
    for (int j = 0; j < 6; j++) by(i, j) /= root(i, i);
    out->left[i] = left[i];
    for (int j = 0; j < 6; j++) out->by[i][j] = by(i, j);
  }
  out->earlier = now.earlier;
  return true;
}

int picture_motion::make_rows(const pair_view &pair, const pose3 &moved) {
  int count = 0;
  for (int i = 0; i < seen_; i++) {
    const view &now = view_[i];
    if (now.earlier < 0 || tracks()[now.earlier].misses >= kMissesMost) continue;
    if (!(now.disparity > kDisparityLeast * pair.sigma_px)) continue;
    if (make_row(pair, moved, now, &row_[count])) count++;
  }
  return count;
}

double picture_motion::misfit(const fit_row &row, const vector<6> &x) const {
  double sum = 0.0;
  for (int i = 0; i < 3; i++) {
    double left = row.left[i];
    for (int j = 0; j < 6; j++) left -= row.by[i][j] * x[j];
    sum += square(left);
  }
  return sum;
}

double picture_motion::median_misfit(int count, const vector<6> &x) {
  for (int i = 0; i < count; i++) {  // sorted by insertion
    const double value = misfit(row_[i], x);
    int at = i;
    for (; at > 0 && sorted_[at - 1] > value; at--) sorted_[at] = sorted_[at - 1];
    sorted_[at] = value;
  }
  return sorted_[count / 2];
}

// Adds the rows' information and its product with what is left of them; the upper triangle, then mirrored.
void picture_motion::sum_up(int count, matrix<6> *information, vector<6> *weighted) const {
  for (int i = 0; i < 3 * count; i++) {
    const fit_row &row = row_[i / 3];
    const double(&by)[6] = row.by[i % 3];
    for (int a = 0; a < 6; a++) {
      const double scaled = row.weight * by[a];
      (*weighted)[a] += scaled * row.left[i % 3];
      for (int b = a; b < 6; b++) (*information)(a, b) += scaled * by[b];
    }
  }
  for (int a = 1; a < 6; a++)
    for (int b = 0; b < a; b++) (*information)(a, b) = (*information)(b, a);
}

// Iterated weighted least squares with the prediction as prior.
bool picture_motion::iterate(int count, const matrix<6> &prior, vector<6> *x) {
  matrix<6> expected;
  if (!invert_positive<6>(prior, &expected)) return false;
  *x = vector<6>::Zero();
  for (int iteration = 0; iteration < kIterations; iteration++) {
    const double median = median_misfit(count, *x);
    const double scale = kKernel * (median > kMedianLeast ? median : kMedianLeast);
    for (int i = 0; i < count; i++) row_[i].weight = 1.0 / square(1.0 + misfit(row_[i], *x) / scale);
    matrix<6> information = expected;
    vector<6> weighted = vector<6>::Zero();
    sum_up(count, &information, &weighted);
    factor<6> f;
    if (!f.init(information)) return false;
    *x = weighted;
    f.solve(x);
  }
  return true;
}

bool picture_motion::fit(const pair_view &pair, const pose3 &moved, const matrix<6> &prior, motion_error *out) {
  const int count = rows_ = make_rows(pair, moved);
  vector<6> x;
  if (count < kLeast || !iterate(count, prior, &x)) return false;
  const double shown = median_misfit(count, x) / kMedianOfThree, noisy = shown > 1.0 ? shown : 1.0;
  const double cut = kCut * (noisy < kScaleMost ? noisy : kScaleMost);
  for (int i = 0; i < count; i++) {
    if (!(misfit(row_[i], x) < cut)) row_[i].weight = 0.0;
  }
  matrix<6> information = kLeastInformation * matrix<6>::Identity(), covariance;
  vector<6> weighted = vector<6>::Zero();
  sum_up(count, &information, &weighted);
  if (!invert_positive<6>(information, &covariance)) return false;
  map(out->value) = covariance * weighted;
  map(out->covariance) = kAlike * noisy * covariance;
  return true;
}

void picture_motion::count_misses() {
  for (int i = 0; i < rows_; i++) tracks()[row_[i].earlier].misses += row_[i].weight == 0.0;
}

// Disparities d' = f b / z' with variance P (d'/d)^4: the inverse of z' = z - a.
void picture_motion::close(const pair_view &pair, const pose3 &moved) {
  const mat3 turned = matrix_of(moved.q);
  const double measured = square(kDisparity * pair.sigma_px);
  track *const next = track_[1 - side_];
  int count = 0;
  for (int i = 0; i < seen_; i++) {
    const view &now = view_[i];
    if (!(now.disparity > kDisparityLeast * pair.sigma_px)) continue;
    track out = {now.u, now.v, now.disparity, measured, now.id, 0};
    if (now.earlier >= 0) {
      const track &from = tracks()[now.earlier];
      out.misses = from.misses;
      const vec3 c = carry(pair, moved, turned, from.u, from.v, from.disparity).in_camera;
      if (c.z > kNearest_m) {
        const double expected = pair.fu * pair.baseline_m / c.z, grows = expected / from.disparity;
        const double variance = from.variance * square(square(grows)) + square(kDisparityWalk * pair.sigma_px);
        if (square(now.disparity - expected) < kDepthGate * (variance + measured)) {
          const double share = variance / (variance + measured);
          out.disparity = expected + share * (now.disparity - expected);
          out.variance = (1.0 - share) * variance;
        }
      }
    }
    next[count++] = out;
  }
  side_ = 1 - side_;
  tracks_ = count;
  seen_ = 0;
}

}  // namespace wm
