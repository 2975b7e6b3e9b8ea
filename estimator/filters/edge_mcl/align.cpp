// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/align.hpp"

#include "math/elementary.hpp"

namespace wm {

floor_edge moved(const floor_edge &point, const wm_pose2 &from, const sin_cos &h) {
  const auto turn = [&h](float x, float y, float *to_x, float *to_y) {
    *to_x = (float)(h.cos * (double)x - h.sin * (double)y);
    *to_y = (float)(h.sin * (double)x + h.cos * (double)y);
  };
  const double x = (double)point.x_m, y = (double)point.y_m;
  floor_edge out = point;
  out.x_m = (float)(from.x_m + h.cos * x - h.sin * y);
  out.y_m = (float)(from.y_m + h.sin * x + h.cos * y);
  turn(point.ray_x_m, point.ray_y_m, &out.ray_x_m, &out.ray_y_m);
  for (int e = 0; e < kMountingErrors; e++) turn(point.x_by[e], point.y_by[e], &out.x_by[e], &out.y_by[e]);
  return out;
}

int take_evenly(const floor_edge *points, int count, int most, floor_edge *out) {
  if (most > count) most = count;
  for (int i = 0; i < most; i++) out[i] = points[(int64_t)i * count / most];
  return most;
}

bool on_a_line(const wm_points &points, uint32_t i) {
  if (i == 0 || i + 1 >= points.count) return false;
  const double ax = (double)points.x_m[i - 1], ay = (double)points.y_m[i - 1];
  const double bx = (double)points.x_m[i + 1], by = (double)points.y_m[i + 1];
  const double x = (double)points.x_m[i], y = (double)points.y_m[i];
  const double length2 = square(bx - ax) + square(by - ay), across = (bx - ax) * (y - ay) - (by - ay) * (x - ax);
  // Neighbours at most 0.6 m apart (a gap otherwise), the point within 3 cm and a pixel's error, which grows with the
  // range squared. Chosen on corridor-hard; not swept.
  return length2 < square(0.6) && square(across) < square(0.03 + 0.005 * (x * x + y * y)) * length2;
}

bool before_an_edge(const edge_map &map, double x_m, double y_m, double ray_x_m, double ray_y_m) {
  constexpr double kGrazing_m = 0.1;        // least way of a ray towards an edge: grazing rays meet it anywhere
  constexpr double kBeyondMax = 0.5;        // of the ray: the map's edge is at most so much farther than its reflection
  constexpr double kProbes[] = {0.0, 0.3};  // places along the ray: edge_map reaches 0.6 m
  for (const double on : kProbes) {
    const edge_line line = map.nearest(x_m + on * ray_x_m, y_m + on * ray_y_m);
    const double towards_m = line.normal_x * ray_x_m + line.normal_y * ray_y_m;
    if (!line.found || std::fabs(towards_m) < kGrazing_m) continue;
    const double beyond = on + line.offset_m / towards_m;
    if (beyond > 0.0 && beyond < kBeyondMax) return true;
  }
  return false;
}

// Sphere tracing: steps by the distance to the nearest edge.
bool through_an_edge(const edge_map &map, double x_m, double y_m, double ray_x_m, double ray_y_m) {
  constexpr double kBegin_m = 0.1, kFarthest_m = 20.0;  // of the ray: bounds the work; cameras see the floor to 6 m
  constexpr double kMargin_m = 0.2, kMargin = 0.05;     // error of pose and camera, and per metre of range; not swept
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

namespace {

// Weight of a residual of `sigma`, as Cauchy's distribution has it.
double cauchy_weight(double residual, double sigma) { return square(sigma) / (square(sigma) + square(residual)); }

// A point's place by these errors of its camera's mounting.
inline void shifted(const floor_edge &point, const double error[kMountingAll], double *x, double *y) {
  *x = (double)point.x_m;
  *y = (double)point.y_m;
  for (int k = 0; k < kMountingErrors; k++) {
    const double e = error[kMountingErrors * point.camera + k];
    *x += e * (double)point.x_by[k];
    *y += e * (double)point.y_by[k];
  }
}

// A point and its edge as the pose's derivative has them: towards the edge by x, y, heading.
struct pose_row {
  edge_line line;
  vector<3> by;
};
pose_row row_at(const edge_map &map, const wm_pose2 &pose, const sin_cos &h, double x, double y) {
  const double rx = h.cos * x - h.sin * y, ry = h.sin * x + h.cos * y;
  pose_row row;
  row.line = map.nearest(pose.x_m + rx, pose.y_m + ry);
  row.by << row.line.normal_x, row.line.normal_y, row.line.normal_y * rx - row.line.normal_x * ry;
  return row;
}

void step_pose(const double *step, wm_pose2 *pose) {
  pose->x_m += step[0];
  pose->y_m += step[1];
  pose->heading_rad = wrap(pose->heading_rad + step[2]);
}

// Levenberg's damping, in points: directions without information stay.
constexpr double kDamping = 1.0;
// Points whose errors are common, where they are weighed against the prior of a camera's mounting. Not swept.
constexpr double kCorrelatedPoints = 15.0;

}  // namespace

void align_pose(const edge_map &map, const floor_edge *points, int count, int stride, double gate_m, double explained_m,
                int iterations, wm_pose2 *pose) {
  for (int round = 0; round < iterations; round++) {
    matrix<3> a = kDamping * matrix<3>::Identity();
    vector<3> b = vector<3>::Zero(), step;
    const sin_cos h = sincos(pose->heading_rad);
    for (int i = 0; i < count; i += stride) {
      const pose_row row = row_at(map, *pose, h, (double)points[i].x_m, (double)points[i].y_m);
      if (!row.line.found || row.line.distance_m > gate_m) continue;
      const vector<3> weighted = cauchy_weight(row.line.offset_m, explained_m) * row.by;
      b += row.line.offset_m * weighted;
      a.noalias() += weighted * row.by.transpose();
    }
    if (!solve_positive(a, b, &step)) break;
    step_pose(step.data(), pose);
  }
}

void align_place(const edge_map &map, const floor_points &points, int stride, double gate_m, double explained_m,
                 int iterations, wm_pose2 *pose, double error[kMountingAll]) {
  constexpr int kOwn = 3 + kMountingErrors, kAll = 3 + kMountingAll;  // unknowns of a point; of all points
  for (int round = 0; round < iterations; round++) {
    matrix<kOwn> information[kMountingCameras] = {matrix<kOwn>::Zero(), matrix<kOwn>::Zero()};
    vector<kOwn> right[kMountingCameras] = {vector<kOwn>::Zero(), vector<kOwn>::Zero()};
    const sin_cos h = sincos(pose->heading_rad);
    for (int i = 0; i < points.count; i += stride) {
      const floor_edge &point = points.of[i];
      double x, y;
      shifted(point, error, &x, &y);
      const pose_row row = row_at(map, *pose, h, x, y);
      const edge_line &line = row.line;
      if (!line.found || line.distance_m > gate_m) continue;
      vector<kOwn> by;
      by.head<3>() = row.by;
      // The normal in base_link.
      const double ahead = h.cos * line.normal_x + h.sin * line.normal_y;
      const double left = h.cos * line.normal_y - h.sin * line.normal_x;
      for (int k = 0; k < kMountingErrors; k++)
        by[3 + k] = ahead * (double)point.x_by[k] + left * (double)point.y_by[k];
      const vector<kOwn> weighted = cauchy_weight(line.offset_m, explained_m) * by;
      right[point.camera] += line.offset_m * weighted;
      information[point.camera].noalias() += weighted * by.transpose();
    }
    matrix<kAll> a = matrix<kAll>::Zero();
    vector<kAll> b = vector<kAll>::Zero(), step;
    a.topLeftCorner<3, 3>() = kDamping * matrix<3>::Identity();
    const double known = kCorrelatedPoints * square(explained_m);
    for (int c = 0; c < kMountingCameras; c++) {
      const int at = 3 + kMountingErrors * c;
      a.topLeftCorner<3, 3>() += information[c].topLeftCorner<3, 3>();
      b.head<3>() += right[c].head<3>();
      a.block<kMountingErrors, 3>(at, 0) = information[c].bottomLeftCorner<kMountingErrors, 3>();
      a.block<3, kMountingErrors>(0, at) = information[c].topRightCorner<3, kMountingErrors>();
      a.block<kMountingErrors, kMountingErrors>(at, at) =
          information[c].bottomRightCorner<kMountingErrors, kMountingErrors>() +
          known * matrix<kMountingErrors>::Identity();
      for (int k = 0; k < kMountingErrors; k++) b[at + k] = right[c][3 + k] - known * error[kMountingErrors * c + k];
    }
    if (!solve_positive(a, b, &step)) break;
    step_pose(step.data(), pose);
    for (int k = 0; k < kMountingAll; k++) error[k] += step[3 + k];
  }
}

double explained_share(const edge_map &map, const floor_points &points, double explained_m, const wm_pose2 &pose,
                       const double error[kMountingAll], bool reflections) {
  const sin_cos h = sincos(pose.heading_rad);
  double explained = 0.0;
  for (int i = 0; i < points.count; i++) {
    const floor_edge &point = points.of[i];
    double px, py;
    shifted(point, error, &px, &py);
    const double x = pose.x_m + h.cos * px - h.sin * py, y = pose.y_m + h.sin * px + h.cos * py;
    const edge_line line = map.nearest(x, y);
    if (line.found && line.distance_m <= explained_m) {
      explained += 1.0;
    } else if (reflections) {
      const double rx = (double)point.ray_x_m, ry = (double)point.ray_y_m;
      if (before_an_edge(map, x, y, h.cos * rx - h.sin * ry, h.sin * rx + h.cos * ry))
        explained += (double)point.reflection;
    }
  }
  return points.count > 0 ? explained / points.count : 0.0;
}

}  // namespace wm
