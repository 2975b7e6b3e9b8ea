// SPDX-License-Identifier: Apache-2.0
#include "image/homography.hpp"

#include "math/eigen.hpp"

namespace wm {

namespace {
constexpr double kScaleMin = 1e-9;  // mean distance of the points from their middle: not all the same
}

bool homography_init(homography *out, const double (*from)[2], const tangent_point *to, int count) {
  tangent_point middle = {0, 0};
  double scale = 0;
  for (int i = 0; i < count; i++) middle = middle + (1.0 / count) * to[i];
  for (int i = 0; i < count; i++) scale += length(to[i] - middle) / count;
  if (!(scale > kScaleMin)) return false;
  double normal[8][8] = {}, right[8] = {};
  for (int i = 0; i < count; i++) {
    const double x = from[i][0], y = from[i][1], u = (to[i].x - middle.x) / scale, v = (to[i].y - middle.y) / scale;
    const double rows[2][9] = {{x, y, 1, 0, 0, 0, -u * x, -u * y, u}, {0, 0, 0, x, y, 1, -v * x, -v * y, v}};
    for (const double *row : rows)
      for (int r = 0; r < 8; r++) {
        for (int c = 0; c < 8; c++) normal[r][c] += row[r] * row[c];
        right[r] += row[r] * row[8];
      }
  }
  vector<8> solution;
  if (!solve_positive<8, 1>(map(normal), map(right), &solution)) return false;
  double h[3][3];
  for (int i = 0; i < 9; i++) h[i / 3][i % 3] = i < 8 ? solution(i) : 1.0;
  for (int c = 0; c < 3; c++) {
    out->h[0][c] = scale * h[0][c] + middle.x * h[2][c];
    out->h[1][c] = scale * h[1][c] + middle.y * h[2][c];
    out->h[2][c] = h[2][c];
  }
  return true;
}

}  // namespace wm
