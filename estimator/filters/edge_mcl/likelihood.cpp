// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/likelihood.hpp"

#include "math/elementary.hpp"

namespace wm {
namespace {

typedef float lanes __attribute__((vector_size(4 * kScanLanes), aligned(16), may_alias));
typedef int32_t int_lanes __attribute__((vector_size(4 * kScanLanes), aligned(16), may_alias));

// The pose as what takes a point to pixels: column = c0 + c x - s y, row = r0 - s x - c y.
struct pixel_pose {
  float c0, r0, c, s;
  bool whole;  // every point falls into the map
};

pixel_pose pose_in_pixels(const edge_map &map, const scan_points &points, double x_m, double y_m, double heading_cos,
                          double heading_sin) {
  double u, v;
  map.to_pixels(x_m, y_m, &u, &v);
  const double inverse = 1.0 / map.pixel_m();
  const double c = (heading_cos * map.yaw_cos() + heading_sin * map.yaw_sin()) * inverse;
  const double s = (heading_sin * map.yaw_cos() - heading_cos * map.yaw_sin()) * inverse;
  const double reach = (double)points.reach_m * inverse + 2.0;
  const wm_raster &r = map.raster();
  const bool whole = u >= reach && v >= reach && u + reach < r.width_px && v + reach < r.height_px;
  return {(float)u, (float)v, (float)c, (float)s, whole};
}

// A map's byte under one point; the same operations in the same order as a lane's.
int byte_under(const edge_map &map, const pixel_pose &p, float x, float y) {
  const float column = p.c0 + (p.c * x - p.s * y), row = p.r0 - (p.s * x + p.c * y);
  const wm_raster &r = map.raster();
  if (!(column >= 0.0f && row >= 0.0f && column < (float)r.width_px && row < (float)r.height_px)) return edge_map::kFar;
  return map.distance_of((int)column, (int)row);
}

int32_t score_one_by_one(const edge_map &map, const scan_points &points, const score_table &table,
                         const pixel_pose &p) {
  int32_t sum = 0;
  for (int k = 0, from = 0; k < kSigmaClasses; from = points.class_end[k++])
    for (int i = from; i < points.class_end[k]; i++)
      sum += table.value[k][byte_under(map, p, points.x_m[i], points.y_m[i])];
  return sum;
}

}  // namespace

void make_score_table(const edge_map &map, const double sigma_m[kSigmaClasses], double floor, bool sum,
                      score_table *out) {
  for (int k = 0; k < kSigmaClasses; k++)
    for (int i = 0; i < 256; i++) {
      const double d = i * map.unit_m() / sigma_m[k];
      const double hit = i == edge_map::kFar ? 0.0 : exp(-0.5 * d * d);
      const double likelihood = (1.0 - floor) * hit + floor;
      const double value = sum ? likelihood : log(likelihood);
      out->value[k][i] = (int32_t)std::floor(value / kScoreUnit + 0.5);
    }
}

int32_t score_scalar(const edge_map &map, const scan_points &points, const score_table &table, double x_m, double y_m,
                     double heading_cos, double heading_sin) {
  return score_one_by_one(map, points, table, pose_in_pixels(map, points, x_m, y_m, heading_cos, heading_sin));
}

int32_t score(const edge_map &map, const scan_points &points, const score_table &table, double x_m, double y_m,
              double heading_cos, double heading_sin) {
  const pixel_pose p = pose_in_pixels(map, points, x_m, y_m, heading_cos, heading_sin);
  if (!p.whole) return score_one_by_one(map, points, table, p);
  // First where each point falls, then what is there: the second loop is loads and additions only.
  alignas(16) int32_t tile[WM_POINTS_MAX + kScanLanes], inside[WM_POINTS_MAX + kScanLanes];
  const int32_t columns = map.tile_columns();
  for (int i = 0; i < points.count; i += kScanLanes) {
    const lanes x = *reinterpret_cast<const lanes *>(points.x_m + i);
    const lanes y = *reinterpret_cast<const lanes *>(points.y_m + i);
    const int_lanes column = __builtin_convertvector(p.c0 + (p.c * x - p.s * y), int_lanes);
    const int_lanes row = __builtin_convertvector(p.r0 - (p.s * x + p.c * y), int_lanes);
    *reinterpret_cast<int_lanes *>(tile + i) =
        (row >> edge_map::kTileShift) * columns + (column >> edge_map::kTileShift);
    *reinterpret_cast<int_lanes *>(inside + i) = (row & 56) << 6 | (column & 56) << 3 | (row & 7) << 3 | (column & 7);
  }
  const uint32_t *tiles = map.tiles();
  const uint8_t *distances = map.distances();
  int32_t sum = 0;
  for (int k = 0, i = 0; k < kSigmaClasses; k++) {
    const int32_t *value = table.value[k];
    for (; i < points.class_end[k]; i++) sum += value[distances[tiles[tile[i]] + (uint32_t)inside[i]]];
  }
  return sum;
}

}  // namespace wm
