// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/align.hpp"

#include "math/elementary.hpp"

namespace wm {
namespace {

void solve(const double lower[kAlignStates][kAlignStates], const double *b, int n, double *x) {
  for (int i = 0; i < n; i++) {
    x[i] = b[i];
    for (int k = 0; k < i; k++) x[i] -= lower[i][k] * x[k];
    x[i] /= lower[i][i];
  }
  for (int i = n - 1; i >= 0; i--) {
    for (int k = i + 1; k < n; k++) x[i] -= lower[k][i] * x[k];
    x[i] /= lower[i][i];
  }
}

}  // namespace

bool factor_positive(const double a[kAlignStates][kAlignStates], int n, double lower[kAlignStates][kAlignStates]) {
  for (int i = 0; i < n; i++)
    for (int j = 0; j <= i; j++) {
      double sum = a[i][j];
      for (int k = 0; k < j; k++) sum -= lower[i][k] * lower[j][k];
      if (i != j)
        lower[i][j] = sum / lower[j][j];
      else if (!(sum > 0.0))
        return false;
      else
        lower[i][i] = std::sqrt(sum);
    }
  return true;
}

bool solve_positive(const double a[kAlignStates][kAlignStates], const double *b, int n, double *x) {
  double lower[kAlignStates][kAlignStates];
  if (!factor_positive(a, n, lower)) return false;
  solve(lower, b, n, x);
  return true;
}

bool invert_positive(const double a[kAlignStates][kAlignStates], int n, double out[kAlignStates][kAlignStates]) {
  double lower[kAlignStates][kAlignStates];
  if (!factor_positive(a, n, lower)) return false;
  for (int j = 0; j < n; j++) {
    double unit[kAlignStates] = {}, column[kAlignStates];
    unit[j] = 1.0;
    solve(lower, unit, n, column);
    for (int i = 0; i < n; i++) out[i][j] = column[i];
  }
  return true;
}

bool on_a_line(const wm_points &points, uint32_t i) {
  if (i == 0 || i + 1 >= points.count) return false;
  const double ax = (double)points.x_m[i - 1], ay = (double)points.y_m[i - 1];
  const double bx = (double)points.x_m[i + 1], by = (double)points.y_m[i + 1];
  const double x = (double)points.x_m[i], y = (double)points.y_m[i];
  const double length2 = square(bx - ax) + square(by - ay), across = (bx - ax) * (y - ay) - (by - ay) * (x - ax);
  return length2 < square(0.6) && square(across) < square(0.03 + 0.005 * (x * x + y * y)) * length2;
}

bool before_an_edge(const edge_map &map, double x_m, double y_m, double ray_x_m, double ray_y_m) {
  constexpr double kGrazing_m = 0.1, kMost = 0.5;
  constexpr double kLooks[] = {0.0, 0.3};  // the map knows what is within 0.6 m alone
  for (const double on : kLooks) {
    const edge_line line = map.nearest(x_m + on * ray_x_m, y_m + on * ray_y_m);
    const double towards_m = line.normal_x * ray_x_m + line.normal_y * ray_y_m;
    if (!line.found || std::fabs(towards_m) < kGrazing_m) continue;
    const double beyond = on + line.offset_m / towards_m;
    if (beyond > 0.0 && beyond < kMost) return true;
  }
  return false;
}

// From pixel to pixel by the distance to the nearest edge, which none can be within.
bool through_an_edge(const edge_map &map, double x_m, double y_m, double ray_x_m, double ray_y_m) {
  constexpr double kBegin_m = 0.1, kFarthest_m = 20.0;
  constexpr double kMargin_m = 0.2, kMargin = 0.05;  // what a pose and a camera may be off by
  const double range = std::sqrt(square(ray_x_m) + square(ray_y_m));
  double end = range - (kMargin_m + kMargin * range);
  if (end > kFarthest_m) end = kFarthest_m;
  for (double at = kBegin_m; at < end;) {
    const double back = (range - at) / range;
    double column, row;
    map.to_pixels(x_m - back * ray_x_m, y_m - back * ray_y_m, &column, &row);
    if (!map.inside_map(column, row)) return false;
    const int distance = map.distance_of((int)column, (int)row);
    const double free_m = distance == edge_map::kFar ? edge_map::kReach_m : distance * map.unit_m();
    if (free_m < 1.1 * map.pixel_m()) return true;
    at += free_m;
  }
  return false;
}

void align_pose(const edge_map &map, const float *x_m, const float *y_m, int count, int stride, double gate_m,
                double explained_m, int iterations, wm_pose2 *pose) {
  for (int round = 0; round < iterations; round++) {
    double a[kAlignStates][kAlignStates] = {}, b[kAlignStates] = {}, step[kAlignStates];
    const sin_cos h = sincos(pose->heading_rad);
    for (int i = 0; i < count; i += stride) {
      const double px = (double)x_m[i], py = (double)y_m[i];
      const double rx = h.cos * px - h.sin * py, ry = h.sin * px + h.cos * py;
      const edge_line line = map.nearest(pose->x_m + rx, pose->y_m + ry);
      if (!line.found || line.distance_m > gate_m) continue;
      const double row[3] = {line.normal_x, line.normal_y, line.normal_y * rx - line.normal_x * ry};
      const double weight = square(explained_m) / (square(explained_m) + square(line.offset_m));
      for (int r = 0; r < 3; r++) {
        b[r] += weight * row[r] * line.offset_m;
        for (int c = 0; c <= r; c++) a[r][c] += weight * row[r] * row[c];
      }
    }
    for (int r = 0; r < 3; r++) a[r][r] += 1.0;  // what the scan doesn't say stays
    if (!solve_positive(a, b, 3, step)) break;   // reads the lower triangle
    pose->x_m += step[0];
    pose->y_m += step[1];
    pose->heading_rad = wrap(pose->heading_rad + step[2]);
  }
}

namespace {

constexpr double kTogether =
    15.0;  // so many points err together, where they are held against what is known of a camera

// Where a point is by these errors.
inline void moved(const slack_points &points, int i, const double error[kSlackMost], double *x, double *y) {
  *x = (double)points.x_m[i];
  *y = (double)points.y_m[i];
  for (int k = 0; k < kSlackErrors; k++) {
    const double e = error[kSlackErrors * points.camera[i] + k];
    *x += e * (double)points.x_by[k][i];
    *y += e * (double)points.y_by[k][i];
  }
}

}  // namespace

void align_place(const edge_map &map, const slack_points &points, int stride, double gate_m, double explained_m,
                 int iterations, wm_pose2 *pose, double error[kSlackMost]) {
  constexpr int kOf = 3 + kSlackErrors;  // states that a point speaks of: the pose, its camera's errors
  for (int round = 0; round < iterations; round++) {
    double part[kSlackCameras][kOf][kOf] = {}, right[kSlackCameras][kOf] = {};
    int cameras = 1;
    const sin_cos h = sincos(pose->heading_rad);
    for (int i = 0; i < points.count; i += stride) {
      double px, py;
      moved(points, i, error, &px, &py);
      const double rx = h.cos * px - h.sin * py, ry = h.sin * px + h.cos * py;
      const edge_line line = map.nearest(pose->x_m + rx, pose->y_m + ry);
      if (!line.found || line.distance_m > gate_m) continue;
      double row[kOf] = {line.normal_x, line.normal_y, line.normal_y * rx - line.normal_x * ry, 0.0, 0.0, 0.0};
      // The normal as base_link sees it.
      const double ahead = h.cos * line.normal_x + h.sin * line.normal_y;
      const double left = h.cos * line.normal_y - h.sin * line.normal_x;
      for (int k = 0; k < kSlackErrors; k++)
        row[3 + k] = ahead * (double)points.x_by[k][i] + left * (double)points.y_by[k][i];
      const double weight = square(explained_m) / (square(explained_m) + square(line.offset_m));
      const int camera = points.camera[i];
      if (camera >= cameras) cameras = camera + 1;
      for (int r = 0; r < kOf; r++) {
        const double weighted = weight * row[r];
        right[camera][r] += weighted * line.offset_m;
        for (int c = 0; c <= r; c++) part[camera][r][c] += weighted * row[c];
      }
    }
    double a[kAlignStates][kAlignStates] = {}, b[kAlignStates] = {}, step[kAlignStates];
    for (int k = 0; k < cameras; k++)
      for (int r = 0; r < kOf; r++) {
        const int of = kSlackErrors * k, to = r < 3 ? r : of + r;
        b[to] += right[k][r];
        for (int c = 0; c <= r; c++) a[to][c < 3 ? c : of + c] += part[k][r][c];
      }
    for (int r = 0; r < 3; r++) a[r][r] += 1.0;  // what the points don't say stays
    const int n = 3 + kSlackErrors * cameras;
    const double known = kTogether * square(explained_m);
    for (int r = 3; r < n; r++) {
      a[r][r] += known;
      b[r] -= known * error[r - 3];
    }
    if (!solve_positive(a, b, n, step)) break;
    pose->x_m += step[0];
    pose->y_m += step[1];
    pose->heading_rad = wrap(pose->heading_rad + step[2]);
    for (int r = 3; r < n; r++) error[r - 3] += step[r];
  }
}

double explained_share(const edge_map &map, const slack_points &points, double explained_m, const wm_pose2 &pose,
                       const double error[kSlackMost], bool images) {
  const sin_cos h = sincos(pose.heading_rad);
  double explained = 0.0;
  for (int i = 0; i < points.count; i++) {
    double px, py;
    moved(points, i, error, &px, &py);
    const double x = pose.x_m + h.cos * px - h.sin * py, y = pose.y_m + h.sin * px + h.cos * py;
    const edge_line line = map.nearest(x, y);
    if (line.found && line.distance_m <= explained_m) {
      explained += 1.0;
    } else if (images) {
      const double rx = (double)points.ray_x_m[i], ry = (double)points.ray_y_m[i];
      if (before_an_edge(map, x, y, h.cos * rx - h.sin * ry, h.sin * rx + h.cos * ry))
        explained += (double)points.image[i];
    }
  }
  return points.count > 0 ? explained / points.count : 0.0;
}

}  // namespace wm
