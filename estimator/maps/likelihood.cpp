// SPDX-License-Identifier: Apache-2.0
#include "maps/likelihood.hpp"

#include "math/elementary.hpp"
#include "math/wide.hpp"
#include "waymark/vectors.h"

namespace wm {
namespace {

template <int kLanes>
struct vectors {
  typedef float lanes __attribute__((vector_size(4 * kLanes), aligned(16), may_alias));
  typedef int32_t int_lanes __attribute__((vector_size(4 * kLanes), aligned(16), may_alias));
};

// The pose as what takes a point to pixels of the padded map: column = c0 + c x - s y, row = r0 - s x - c y.
struct pixel_pose {
  float c0, r0, c, s;
};

pixel_pose pose_in_pixels(const edge_map &map, double x_m, double y_m, double heading_cos, double heading_sin) {
  double u, v;
  map.to_pixels(x_m, y_m, &u, &v);
  const double inverse = 1.0 / map.pixel_m();
  const double c = (heading_cos * map.yaw_cos() + heading_sin * map.yaw_sin()) * inverse;
  const double s = (heading_sin * map.yaw_cos() - heading_cos * map.yaw_sin()) * inverse;
  return {(float)(u + edge_map::kTile), (float)(v + edge_map::kTile), (float)c, (float)s};
}

// First where each point falls, then what is there: the second loop is loads and additions only.
template <int kLanes>
WM_KERNEL int32_t score_by(const edge_map &map, const scan_points &points, const score_table &table,
                           const pixel_pose &p) {
  using lanes = typename vectors<kLanes>::lanes;
  using int_lanes = typename vectors<kLanes>::int_lanes;
  const lanes zero = {}, most_column = zero + (float)(map.padded_columns() - 1),
              most_row = zero + (float)(map.padded_rows() - 1);
  alignas(32) int32_t tile[WM_POINTS_MAX + kScanLanes], inside[WM_POINTS_MAX + kScanLanes];
  const int shift = map.row_shift();
  for (int i = 0; i < points.count; i += kLanes) {
    const lanes x = *reinterpret_cast<const lanes *>(points.x_m + i);
    const lanes y = *reinterpret_cast<const lanes *>(points.y_m + i);
    lanes u = p.c0 + (p.c * x - p.s * y), v = p.r0 - (p.s * x + p.c * y);
    u = u > zero ? u : zero;  // NaN becomes 0: the ring
    v = v > zero ? v : zero;
    u = u < most_column ? u : most_column;
    v = v < most_row ? v : most_row;
    const int_lanes column = __builtin_convertvector(u, int_lanes), row = __builtin_convertvector(v, int_lanes);
    *reinterpret_cast<int_lanes *>(tile + i) =
        (row >> edge_map::kTileShift) << shift | (column >> edge_map::kTileShift);
    *reinterpret_cast<int_lanes *>(inside + i) =
        (row & (edge_map::kTile - 1)) << edge_map::kTileShift | (column & (edge_map::kTile - 1));
  }
  const uint32_t *tiles = map.tiles();
  const uint8_t *distances = map.distances();
  int32_t sum = 0;
  for (int k = 0, i = 0; k < kSigmaClasses; k++) {
    const int32_t *value = table.value[k];
    // The classes end where the points do, so all of it was written above; the analyser can't know.
    // NOLINTNEXTLINE(clang-analyzer-core.uninitialized.ArraySubscript)
    for (; i < points.class_end[k]; i++) sum += value[distances[tiles[tile[i]] + (uint32_t)inside[i]]];
  }
  return sum;
}

#if WM_HAS_WIDE
WM_WIDE int32_t score_wide(const edge_map &map, const scan_points &points, const score_table &table,
                           const pixel_pose &p) {
  return score_by<8>(map, points, table, p);
}
#endif

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
  const pixel_pose p = pose_in_pixels(map, x_m, y_m, heading_cos, heading_sin);
  const float most_column = (float)(map.padded_columns() - 1), most_row = (float)(map.padded_rows() - 1);
  int32_t sum = 0;
  for (int k = 0, i = 0; k < kSigmaClasses; k++)
    for (; i < points.class_end[k]; i++) {
      const float x = points.x_m[i], y = points.y_m[i];
      float u = p.c0 + (p.c * x - p.s * y), v = p.r0 - (p.s * x + p.c * y);
      u = u > 0.0f ? u : 0.0f;
      v = v > 0.0f ? v : 0.0f;
      u = u < most_column ? u : most_column;
      v = v < most_row ? v : most_row;
      const int column = (int)u, row = (int)v;
      const uint32_t tile =
          map.tiles()[(row >> edge_map::kTileShift) << map.row_shift() | (column >> edge_map::kTileShift)];
      sum += table.value[k][map.distances()[tile + (uint32_t)edge_map::inside(column, row)]];
    }
  return sum;
}

int32_t score(const edge_map &map, const scan_points &points, const score_table &table, double x_m, double y_m,
              double heading_cos, double heading_sin) {
  const pixel_pose p = pose_in_pixels(map, x_m, y_m, heading_cos, heading_sin);
#if WM_HAS_WIDE
  if (wm_vectors_wide()) return score_wide(map, points, table, p);
#endif
  return score_by<4>(map, points, table, p);  // SSE2 and NEON have four everywhere
}

}  // namespace wm
