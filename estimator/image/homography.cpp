// SPDX-License-Identifier: Apache-2.0
#include "image/homography.hpp"

namespace wm {

namespace {

// Solves a x = b in place by elimination with pivots; false where `a` is singular.
bool solve(double a[8][9]) {
  for (int k = 0; k < 8; k++) {
    int pivot = k;
    for (int i = k + 1; i < 8; i++)
      if (std::fabs(a[i][k]) > std::fabs(a[pivot][k])) pivot = i;
    if (!(std::fabs(a[pivot][k]) > 1e-12)) return false;
    for (int j = k; j < 9 && pivot != k; j++) {
      const double kept = a[k][j];
      a[k][j] = a[pivot][j];
      a[pivot][j] = kept;
    }
    for (int i = 0; i < 8; i++) {
      if (i == k) continue;
      const double factor = a[i][k] / a[k][k];
      for (int j = k; j < 9; j++) a[i][j] -= factor * a[k][j];
    }
  }
  for (int k = 0; k < 8; k++) a[k][8] /= a[k][k];
  return true;
}

}  // namespace

bool homography_init(homography *out, const double (*from)[2], const tangent_point *to, int count) {
  tangent_point middle = {0, 0};
  double scale = 0;
  for (int i = 0; i < count; i++) middle = middle + (1.0 / count) * to[i];
  for (int i = 0; i < count; i++) scale += length(to[i] - middle) / count;
  if (!(scale > 1e-9)) return false;
  double normal[8][9] = {};
  for (int i = 0; i < count; i++) {
    const double x = from[i][0], y = from[i][1], u = (to[i].x - middle.x) / scale, v = (to[i].y - middle.y) / scale;
    const double rows[2][9] = {{x, y, 1, 0, 0, 0, -u * x, -u * y, u}, {0, 0, 0, x, y, 1, -v * x, -v * y, v}};
    for (const double *row : rows)
      for (int r = 0; r < 8; r++)
        for (int c = 0; c < 9; c++) normal[r][c] += row[r] * row[c];
  }
  if (!solve(normal)) return false;
  double h[3][3];
  for (int i = 0; i < 9; i++) h[i / 3][i % 3] = i < 8 ? normal[i][8] : 1.0;
  for (int c = 0; c < 3; c++) {
    out->h[0][c] = scale * h[0][c] + middle.x * h[2][c];
    out->h[1][c] = scale * h[1][c] + middle.y * h[2][c];
    out->h[2][c] = h[2][c];
  }
  return true;
}

}  // namespace wm
