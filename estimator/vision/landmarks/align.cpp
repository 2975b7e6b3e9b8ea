// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/align.hpp"

namespace wm {
namespace {

constexpr int kRounds = 12;
constexpr double kSettled_px = 0.005, kAway_px = 2.5, kStretchMax = 0.3;
constexpr int kScaleFrom = 60, kAffineFrom = 400;  // px: fewer pixels bear fewer unknowns

// x to a x + t, about the drawn middle.
struct affine {
  double a[2][2], t[2];
};

// Columns: landmark, 1, then by each unknown of the warp. Returns how many pixels.
int fill(const raster &what, const pixel &middle, int unknowns, align_work *work) {
  int n = 0;
  for (int y = 1; y + 1 < what.height; y++)
    for (int x = 1; x + 1 < what.width && n < kAlignPixels; x++) {
      const int k = y * raster::kSide + x;
      if (!what.inside[k] || !what.inside[k - 1] || !what.inside[k + 1] || !what.inside[k - raster::kSide] ||
          !what.inside[k + raster::kSide])
        continue;
      const float *g = what.grey + k;
      const double gu = 0.5 * static_cast<double>(g[1] - g[-1]),
                   gv = 0.5 * static_cast<double>(g[raster::kSide] - g[-raster::kSide]);
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

// Inverse of the columns' products by Cholesky's factors; false where some unknown has no contrast.
bool invert(const align_work &work, int n, int columns, double out[kAlignColumns][kAlignColumns]) {
  double a[kAlignColumns][kAlignColumns] = {}, l[kAlignColumns][kAlignColumns] = {},
         inverse[kAlignColumns][kAlignColumns] = {};
  for (int p = 0; p < n; p++) {
    const double *c = work.column[p];
    for (int i = 0; i < columns; i++)
      for (int j = 0; j <= i; j++) a[i][j] += c[i] * c[j];
  }
  for (int j = 0; j < columns; j++)
    for (int i = j; i < columns; i++) {
      double sum = a[i][j];
      for (int k = 0; k < j; k++) sum -= l[i][k] * l[j][k];
      if (i == j) {
        if (!(sum > 1e-5 * a[j][j])) return false;
        l[j][j] = std::sqrt(sum);
      } else {
        l[i][j] = sum / l[j][j];
      }
    }
  for (int j = 0; j < columns; j++)
    for (int i = j; i < columns; i++) {
      double sum = i == j ? 1.0 : 0.0;
      for (int k = j; k < i; k++) sum -= l[i][k] * inverse[k][j];
      inverse[i][j] = sum / l[i][i];
    }
  for (int i = 0; i < columns; i++)
    for (int j = 0; j < columns; j++) {
      out[i][j] = 0;
      for (int k = i > j ? i : j; k < columns; k++) out[i][j] += inverse[k][i] * inverse[k][j];
    }
  return true;
}

bool grey_at(const grey_plane &picture, double u, double v, double *out) {
  if (!(u >= 0) || !(v >= 0) || !(u < picture.width - 1) || !(v < picture.height - 1)) return false;
  const int column = static_cast<int>(u), row = static_cast<int>(v);
  const double fx = u - column, fy = v - row;
  const uint8_t *p = picture.grey + static_cast<ptrdiff_t>(row) * picture.width + column;
  const uint8_t *q = p + picture.width;
  *out = (1 - fy) * ((1 - fx) * p[0] + fx * p[1]) + fy * ((1 - fx) * q[0] + fx * q[1]);
  return true;
}

// What of the picture the columns explain.
struct fit {
  double x[kAlignColumns];
  double left, variance, likeness;  // sums of squares
};

bool solve(const grey_plane &picture, const align_work &work, int n, int columns, const pixel &middle,
           const affine &warp, const double inverse[kAlignColumns][kAlignColumns], fit *out) {
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
  out->left = larger(squares - explained, 0);
  const double own_variance = own_squares - own * own / n, together = right[0] - own * sum / n;
  if (!(out->variance > 0) || !(own_variance > 0)) return false;
  out->likeness = together / std::sqrt(out->variance * own_variance);
  return out->x[0] > 0.02;
}

// The warp, then back by the step that the landmark would have to go.
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

bool align_by(int unknowns, const grey_plane &picture, const raster &what, const pixel &middle, int right, int down,
              align_work *work, aligned *out) {
  const int columns = unknowns + 2;
  const int n = fill(what, middle, unknowns, work);
  double inverse[kAlignColumns][kAlignColumns];
  if (n < columns + 6 || !invert(*work, n, columns, inverse)) return false;
  affine warp = {{{1, 0}, {0, 1}}, {static_cast<double>(right), static_cast<double>(down)}};
  fit found{};
  bool settled = false;
  for (int round = 0; round < kRounds && !settled; round++) {
    if (!solve(picture, *work, n, columns, middle, warp, inverse, &found)) return false;
    double step[6] = {};
    for (int i = 0; i < unknowns; i++) step[i] = found.x[2 + i] / found.x[0];
    const double size = std::sqrt(step[0] * step[0] + step[1] * step[1]), shorter = size > 1 ? 1 / size : 1;
    for (double &s : step) s *= shorter;
    if (unknowns > 2 && !(std::fabs(step[2]) < 0.5)) return false;
    warp = composed(warp, step, unknowns);
    settled = size < kSettled_px;
    if (!(std::fabs(warp.t[0] - right) < kAway_px) || !(std::fabs(warp.t[1] - down) < kAway_px)) return false;
  }
  if (!settled) return false;
  out->stretch = 0;
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++) out->stretch = larger(out->stretch, std::fabs(warp.a[i][j] - (i == j ? 1 : 0)));
  if (!(out->stretch < kStretchMax)) return false;
  const double noise = found.left / (n - columns) / (found.x[0] * found.x[0]);
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

bool align_landmark(const grey_plane &picture, const raster &what, const pixel &middle, int right, int down,
                    align_work *work, aligned *out) {
  const auto by = [&](int unknowns) { return align_by(unknowns, picture, what, middle, right, down, work, out); };
  return (what.count >= kAffineFrom && by(6)) || (what.count >= kScaleFrom && by(3)) || by(2);
}

}  // namespace wm
