// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/search_field.hpp"

#include <cstring>
namespace wm {
namespace {

constexpr double kFinest_m = 0.1;

struct extent {
  double cell_m;
  int64_t columns, rows;     // that lie in the map, the last ones in part
  int64_t stride, all_rows;  // with what is around them
};

extent extent_of(const wm_raster &raster) {
  for (double cell = kFinest_m;; cell *= 2.0) {
    const double cells_a_pixel = raster.resolution_m / cell;
    const double columns = raster.width_px * cells_a_pixel, rows = raster.height_px * cells_a_pixel;
    const double around = 2.0 * search_field::kReachCells + 1.0;
    if ((columns + around) * (rows + around) > (double)search_field::kBytesMax) continue;
    extent e = {cell, (int64_t)columns + 1, (int64_t)rows + 1, 0, 0};
    e.stride = e.columns + (int64_t)2 * search_field::kReachCells;
    e.all_rows = e.rows + (int64_t)2 * search_field::kReachCells;
    return e;
  }
}

}  // namespace

size_t search_field::bytes(const wm_raster &raster) {
  const extent e = extent_of(raster);
  return (size_t)e.stride * (size_t)e.all_rows;
}

void search_field::init(const edge_map &map, void *memory) {
  const wm_raster &raster = map.raster();
  const extent e = extent_of(raster);
  cell_m_ = e.cell_m;
  stride_ = (ptrdiff_t)e.stride;
  cells_at_ = (ptrdiff_t)(reinterpret_cast<uintptr_t>(memory) - reinterpret_cast<uintptr_t>(this));
  const double least = log(kFloor);
  unit_ = -least / 255.0;
  uint8_t value[256];
  for (int i = 0; i < 256; i++) {
    const double d = i * map.unit_m() / kSigma_m, hit = i == edge_map::kFar ? 0.0 : exp(-0.5 * d * d);
    value[i] = (uint8_t)((log((1.0 - kFloor) * hit + kFloor) - least) / unit_ + 0.5);
  }
  auto *to = static_cast<uint8_t *>(memory);
  std::memset(to, 0, (size_t)e.stride * (size_t)e.all_rows);
  const double pixels = cell_m_ / raster.resolution_m;
  for (int64_t r = 0; r < e.rows; r++)
    for (int64_t c = 0; c < e.columns; c++) {
      const double column = ((double)c + 0.5) * pixels, row = ((double)r + 0.5) * pixels;
      if (map.inside_map(column, row)) to[at(c, r)] = value[map.distance_of((int)column, (int)row)];
    }
}

}  // namespace wm
