// SPDX-License-Identifier: Apache-2.0
#include "math/absolute_orientation.hpp"

#include "math/symmetric_eigen.hpp"

namespace wm {
namespace {

// Points whose distances from the longest line through their mean are all below this fraction of its length lie in a
// line: the rotation about it is open. Not swept.
constexpr double kLeastSpread = 0.05;

struct mean_pair {
  vec3 from, to;
};

bool lie_in_a_line(const vec3 *from, int count, const vec3 &mean) {
  vec3 line = {0, 0, 0};
  for (int i = 0; i < count; i++)
    if (const vec3 x = from[i] - mean; dot(x, x) > dot(line, line)) line = x;
  double across = 0.0;
  for (int i = 0; i < count; i++) {
    const vec3 off = cross(line, from[i] - mean);
    if (dot(off, off) > across) across = dot(off, off);
  }
  const double length2 = dot(line, line);
  return !(across > square(kLeastSpread * length2)) || !(length2 > 0.0);
}

}  // namespace

bool absolute_orientation(const vec3 *from, const vec3 *to, const double *weight, int count, pose3 *out) {
  mean_pair mean = {{0, 0, 0}, {0, 0, 0}};
  double sum = 0.0;
  for (int i = 0; i < count; i++) {
    mean.from = mean.from + weight[i] * from[i];
    mean.to = mean.to + weight[i] * to[i];
    sum += weight[i];
  }
  if (!(sum > 0.0)) return false;
  mean.from = (1 / sum) * mean.from;
  mean.to = (1 / sum) * mean.to;
  if (lie_in_a_line(from, count, mean.from)) return false;
  double s[3][3] = {};
  for (int i = 0; i < count; i++) {
    const vec3 x = from[i] - mean.from, y = to[i] - mean.to;
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++) s[j][k] += weight[i] * x[j] * y[k];
  }
  // The quaternion (w, x, y, z) is the eigenvector of the largest eigenvalue.
  double n[4][4] = {{s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]},
                    {s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]},
                    {s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]},
                    {s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1]}};
  double q[4][4];
  symmetric_eigen<4>(n, q);
  int best = 0;
  for (int i = 1; i < 4; i++)
    if (n[i][i] > n[best][best]) best = i;
  out->q = normalized({q[0][best], {q[1][best], q[2][best], q[3][best]}});
  out->p = mean.to - matrix_of(out->q) * mean.from;
  return true;
}

}  // namespace wm
