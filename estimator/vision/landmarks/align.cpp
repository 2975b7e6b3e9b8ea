// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/align.hpp"

#include "image/picture_sample.hpp"
#include "math/eigen.hpp"

namespace wm {
namespace {

constexpr int kRounds = 12;            // Gauss-Newton steps; most landmarks settle in 4
constexpr double kSettled_px = 0.005;  // of the last step: a tenth of sigma_px
constexpr double kReach_px = 2.5;      // from the whole-pixel match; farther is another minimum. Not swept
constexpr double kStretchMax = 0.3;    // of the affine warp: the prediction is better than that. Not swept
constexpr double kScaleStepMax = 0.5;  // a step that halves the size diverges
constexpr double kGainMin = 0.02;      // contrast of the picture over the drawn one
constexpr double kPivotMin = 1e-5;     // of Cholesky, relative: an unknown without contrast
constexpr int kScaleFrom_px = 60, kAffineFrom_px = 400;  // drawn pixels that determine 3 or 6 unknowns. Not swept
constexpr int kRedundancy = 6;                           // pixels beyond the unknowns

// x -> a x + t, about the drawn middle.
struct affine {
  double a[2][2], t[2];
};

// Design matrix: grey level, 1, and the derivatives by the warp. Returns the number of pixels.
int fill_columns(const drawn_view &what, const pixel &middle, int unknowns, align_work *work) {
  int n = 0;
  for (int y = 1; y + 1 < what.height; y++)
    for (int x = 1; x + 1 < what.width && n < kAlignPixels; x++) {
      const int k = y * drawn_view::kSide + x;
      if (!what.inside[k] || !what.inside[k - 1] || !what.inside[k + 1] || !what.inside[k - drawn_view::kSide] ||
          !what.inside[k + drawn_view::kSide])
        continue;
      const float *g = what.grey + k;
      const double gu = 0.5 * static_cast<double>(g[1] - g[-1]),
                   gv = 0.5 * static_cast<double>(g[drawn_view::kSide] - g[-drawn_view::kSide]);
      const double u = what.left + x - middle.u, v = what.top + y - middle.v;
      double *c = work->column[n];
      c[0] = static_cast<double>(*g);
      c[1] = 1;
      c[2] = gu;
      c[3] = gv;
      if (unknowns == 3) c[4] = gu * u + gv * v;
      if (unknowns == 6) c[4] = gu * u, c[5] = gu * v, c[6] = gv * u, c[7] = gv * v;
      work->x[n] = static_cast<int16_t>(what.left + x);
      work->y[n] = static_cast<int16_t>(what.top + y);
      n++;
    }
  return n;
}

// Inverse of the normal equations' matrix of the first kN columns. False where some unknown has no contrast.
template <int kN>
bool invert_products(const align_work &work, int n, double out[kAlignColumns][kAlignColumns]) {
  double a[kN][kN] = {};
  for (int p = 0; p < n; p++) {
    const double *c = work.column[p];
    for (int i = 0; i < kN; i++)
      for (int j = 0; j <= i; j++) a[i][j] += c[i] * c[j];
  }
  matrix<kN> inverse;
  if (!invert_positive<kN>(map(a), &inverse, kPivotMin)) return false;
  for (int i = 0; i < kN; i++)
    for (int j = 0; j < kN; j++) out[i][j] = inverse(i, j);
  return true;
}

bool grey_at(const grey_plane &picture, double u, double v, double *out) {
  if (!(u >= 0) || !(v >= 0) || !(u < picture.width - 1) || !(v < picture.height - 1)) return false;
  const int column = static_cast<int>(u), row = static_cast<int>(v);
  *out =
      bilinear(picture.grey + static_cast<ptrdiff_t>(row) * picture.width + column, picture.width, u - column, v - row);
  return true;
}

// Least squares fit of the columns to the picture.
struct gain_fit {
  double x[kAlignColumns];
  double residual, variance, likeness;  // sums of squares; normalised correlation
};

bool fit_gain(const grey_plane &picture, const align_work &work, int n, int columns, const pixel &middle,
              const affine &warp, const double inverse[kAlignColumns][kAlignColumns], gain_fit *out) {
  double right[kAlignColumns] = {}, sum = 0, squares = 0, own = 0, own_squares = 0;
  for (int p = 0; p < n; p++) {
    const double u = work.x[p] - middle.u, v = work.y[p] - middle.v;
    double grey;
    if (!grey_at(picture, middle.u + warp.a[0][0] * u + warp.a[0][1] * v + warp.t[0],
                 middle.v + warp.a[1][0] * u + warp.a[1][1] * v + warp.t[1], &grey))
      return false;
    const double *c = work.column[p];
    for (int i = 0; i < columns; i++) right[i] += c[i] * grey;
    sum += grey;
    squares += grey * grey;
    own += c[0];
    own_squares += c[0] * c[0];
  }
  double explained = 0;
  for (int i = 0; i < columns; i++) {
    out->x[i] = 0;
    for (int j = 0; j < columns; j++) out->x[i] += inverse[i][j] * right[j];
    explained += out->x[i] * right[i];
  }
  out->variance = squares - sum * sum / n;
  out->residual = larger(squares - explained, 0);
  const double own_variance = own_squares - own * own / n, together = right[0] - own * sum / n;
  if (!(out->variance > 0) || !(own_variance > 0)) return false;
  out->likeness = together / std::sqrt(out->variance * own_variance);
  return out->x[0] > kGainMin;
}

// Inverse composition: the warp after the inverse of the step.
affine composed(const affine &warp, const double *step, int unknowns) {
  double d[2][2] = {{1, 0}, {0, 1}};
  if (unknowns == 3) d[0][0] += step[2], d[1][1] += step[2];
  if (unknowns == 6) d[0][0] += step[2], d[0][1] += step[3], d[1][0] += step[4], d[1][1] += step[5];
  const double determinant = d[0][0] * d[1][1] - d[0][1] * d[1][0];
  const double back[2][2] = {{d[1][1] / determinant, -d[0][1] / determinant},
                             {-d[1][0] / determinant, d[0][0] / determinant}};
  affine out;
  for (int i = 0; i < 2; i++) {
    for (int j = 0; j < 2; j++) out.a[i][j] = warp.a[i][0] * back[0][j] + warp.a[i][1] * back[1][j];
    out.t[i] = warp.t[i] - out.a[i][0] * step[0] - out.a[i][1] * step[1];
  }
  return out;
}

// One round: the step by the fit at the warp, at most a pixel long. False where it diverges.
bool improve(const grey_plane &picture, const align_work &work, int n, int unknowns, const pixel &middle,
             const double inverse[kAlignColumns][kAlignColumns], affine *warp, gain_fit *found, double *step_px) {
  if (!fit_gain(picture, work, n, unknowns + 2, middle, *warp, inverse, found)) return false;
  double step[6] = {};
  for (int i = 0; i < unknowns; i++) step[i] = found->x[2 + i] / found->x[0];
  *step_px = std::sqrt(step[0] * step[0] + step[1] * step[1]);
  const double shorter = *step_px > 1 ? 1 / *step_px : 1;
  for (double &s : step) s *= shorter;
  if (unknowns > 2 && !(std::fabs(step[2]) < kScaleStepMax)) return false;
  *warp = composed(*warp, step, unknowns);
  return true;
}

double stretch_of(const affine &warp) {
  double out = 0;
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++) out = larger(out, std::fabs(warp.a[i][j] - (i == j ? 1 : 0)));
  return out;
}

template <int kUnknowns>
bool align_by(const grey_plane &picture, const drawn_view &what, const pixel &middle, int right, int down,
              align_work *work, aligned *out) {
  constexpr int columns = kUnknowns + 2;
  const int n = fill_columns(what, middle, kUnknowns, work);
  double inverse[kAlignColumns][kAlignColumns];
  if (n < columns + kRedundancy || !invert_products<columns>(*work, n, inverse)) return false;
  affine warp = {{{1, 0}, {0, 1}}, {static_cast<double>(right), static_cast<double>(down)}};
  gain_fit found{};
  bool settled = false;
  for (int round = 0; round < kRounds && !settled; round++) {
    double step_px;
    if (!improve(picture, *work, n, kUnknowns, middle, inverse, &warp, &found, &step_px)) return false;
    settled = step_px < kSettled_px;
    if (!(std::fabs(warp.t[0] - right) < kReach_px) || !(std::fabs(warp.t[1] - down) < kReach_px)) return false;
  }
  out->stretch = stretch_of(warp);
  if (!settled || !(out->stretch < kStretchMax)) return false;
  const double noise = found.residual / (n - columns) / (found.x[0] * found.x[0]);
  out->wider = warp.a[0][0];
  out->taller = warp.a[1][1];
  out->middle = {middle.u + warp.t[0], middle.v + warp.t[1]};
  out->uu = noise * inverse[2][2];
  out->uv = noise * inverse[2][3];
  out->vv = noise * inverse[3][3];
  out->likeness = found.likeness;
  return true;
}

}  // namespace

bool align_landmark(const grey_plane &picture, const drawn_view &what, const pixel &middle, int right, int down,
                    align_work *work, aligned *out) {
  if (what.count >= kAffineFrom_px && align_by<6>(picture, what, middle, right, down, work, out)) return true;
  if (what.count >= kScaleFrom_px && align_by<3>(picture, what, middle, right, down, work, out)) return true;
  return align_by<2>(picture, what, middle, right, down, work, out);
}

}  // namespace wm
