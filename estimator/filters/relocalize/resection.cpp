// SPDX-License-Identifier: Apache-2.0
#include "filters/relocalize/resection.hpp"

#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr double kParallel = 1e-4;     // sine between two lines below which they are parallel
constexpr double kNoiseMargin = 1.05;  // noise may make C a little larger than sqrt(A^2 + B^2)
constexpr double kCircle = 1e-6;       // of A and B relative to their terms: all sensors and landmarks on one circle

double cross(const double a[2], const double b[2]) { return a[0] * b[1] - a[1] * b[0]; }

}  // namespace

int resect(const line_of_sight line[3], wm_pose2 out[2]) {
  // Relative to the first landmark and the first beginning: maps may be far from their origin.
  double place[3][2], from[3][2], weight[3];
  int best = 0;
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 2; k++) {
      place[i][k] = line[i].place_m[k] - line[0].place_m[k];
      from[i][k] = line[i].from_m[k] - line[0].from_m[k];
    }
    weight[i] = cross(line[(i + 1) % 3].along, line[(i + 2) % 3].along);
    if (std::fabs(weight[i]) > std::fabs(weight[best])) best = i;
  }
  if (!(std::fabs(weight[best]) > kParallel)) return 0;
  double a[3], b[3], c[3], sum[3] = {0, 0, 0}, size = 0.0;
  for (int i = 0; i < 3; i++) {
    const double nx = -line[i].along[1], ny = line[i].along[0];
    a[i] = nx * place[i][0] + ny * place[i][1];
    b[i] = nx * place[i][1] - ny * place[i][0];
    c[i] = nx * from[i][0] + ny * from[i][1];
    sum[0] += weight[i] * a[i];
    sum[1] += weight[i] * b[i];
    sum[2] += weight[i] * c[i];
    size += std::fabs(weight[i]) * std::sqrt(a[i] * a[i] + b[i] * b[i]);
  }
  const double reach = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1]);
  if (!(reach > kCircle * size) || !(std::fabs(sum[2]) < kNoiseMargin * reach)) return 0;
  const double left = reach * reach - sum[2] * sum[2];
  const double middle = atan2(sum[1], sum[0]), aside = atan2(left > 0.0 ? std::sqrt(left) : 0.0, sum[2]);
  int found = 0;
  for (int k = 0; k < (left > 0.0 ? 2 : 1); k++) {
    const double turn = wrap(k == 0 ? middle + aside : middle - aside);
    const sin_cos r = sincos(turn);
    // R' t from the two lines that cross best: n' (R' t) = a cos + b sin - c.
    const int i = (best + 1) % 3, j = (best + 2) % 3;
    const double vi = a[i] * r.cos + b[i] * r.sin - c[i], vj = a[j] * r.cos + b[j] * r.sin - c[j];
    const double tx = (line[j].along[0] * vi - line[i].along[0] * vj) / weight[best];
    const double ty = (line[j].along[1] * vi - line[i].along[1] * vj) / weight[best];
    bool ahead = true;
    for (int m = 0; m < 3; m++) {
      const double ux = r.cos * place[m][0] + r.sin * place[m][1] - tx - from[m][0];
      const double uy = r.cos * place[m][1] - r.sin * place[m][0] - ty - from[m][1];
      ahead = ahead && ux * line[m].along[0] + uy * line[m].along[1] > 0.0;
    }
    if (!ahead) continue;
    // Back to the frame's own origin: t = L_0 + R (t' - s_0).
    const double x = tx - line[0].from_m[0], y = ty - line[0].from_m[1];
    out[found++] = {line[0].place_m[0] + r.cos * x - r.sin * y, line[0].place_m[1] + r.sin * x + r.cos * y, turn};
  }
  return found;
}

}  // namespace wm
