// SPDX-License-Identifier: Apache-2.0
#include "math/absolute_orientation.hpp"

namespace wm {
namespace {

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

bool absolute_orientation(const vec3 *from, const vec3 *to, const double *weight, int count, pose3 *out) {
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

}  // namespace wm
