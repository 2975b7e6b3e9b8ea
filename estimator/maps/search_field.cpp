// SPDX-License-Identifier: Apache-2.0
#include "maps/search_field.hpp"

#include <bit>
#include <cstring>

#include "math/wide.hpp"
#include "waymark/vectors.h"

namespace wm {
namespace {

constexpr double kFinest_m = 0.1;  // cell: a building of 100 m takes 1 MB, the second level cache; not swept

struct extent {
  double cell_m;
  int64_t columns, rows;     // that lie in the map, the last ones in part
  int64_t stride, all_rows;  // with what is around them
  int64_t runs, grid_rows;   // of the sweep's grid
};

extent extent_of(const wm_raster &raster) {
  for (double cell = kFinest_m;; cell *= 2.0) {
    const double cells_a_pixel = raster.resolution_m / cell;
    const double columns = raster.width_px * cells_a_pixel, rows = raster.height_px * cells_a_pixel;
    const double around = 2.0 * search_field::kReachCells + 1.0;
    if ((columns + around) * (rows + around) > (double)search_field::kBytesMax) continue;
    extent e = {cell, (int64_t)columns + 1, (int64_t)rows + 1, 0, 0, 0, 0};
    e.stride = e.columns + (int64_t)2 * search_field::kReachCells;
    e.all_rows = e.rows + (int64_t)2 * search_field::kReachCells;
    e.runs = (int64_t)(columns / search_field::kGridCells) / search_field::kRun + 1;
    e.grid_rows = (int64_t)(rows / search_field::kGridCells) + 1;
    return e;
  }
}

// Sums by vectors of kLanes words; the cells of a run's places are the lower bytes of words side by side.
template <int kLanes>
WM_KERNEL void sum_lists(const uint8_t *from, const int32_t *steps, int stride, int headings, int count, int least,
                         uint16_t (*sums)[search_field::kRun], bool *reached) {
  static_assert(std::endian::native == std::endian::little);
  typedef uint16_t words __attribute__((vector_size(2 * kLanes)));
  constexpr int kVectors = search_field::kRun / kLanes;
  for (int h = 0; h < headings; h++, steps += stride) {
    words sum[kVectors] = {};
    for (int i = 0; i < count; i++) {
      words cells[kVectors];
      std::memcpy(cells, from + steps[i], sizeof cells);
      for (int k = 0; k < kVectors; k++) sum[k] += cells[k] & 0xff;
    }
    uint64_t over = 0, part[kLanes / 4];
    for (int k = 0; k < kVectors; k++) {
      const auto more = sum[k] > (uint16_t)least;
      std::memcpy(part, &more, sizeof part);
      for (const uint64_t p : part) over |= p;
    }
    reached[h] = over != 0;
    std::memcpy(sums[h], sum, sizeof sum);
  }
}

void sum_lists_plain(const uint8_t *from, const int32_t *steps, int stride, int headings, int count, int least,
                     uint16_t (*sums)[search_field::kRun], bool *reached) {
  sum_lists<8>(from, steps, stride, headings, count, least, sums, reached);
}

#if WM_HAS_WIDE
WM_WIDE void sum_lists_wide(const uint8_t *from, const int32_t *steps, int stride, int headings, int count, int least,
                            uint16_t (*sums)[search_field::kRun], bool *reached) {
  sum_lists<16>(from, steps, stride, headings, count, least, sums, reached);
}
#endif

}  // namespace

size_t search_field::bytes(const wm_raster &raster) {
  const extent e = extent_of(raster);
  memory_layout layout(nullptr, 0);
  layout.take<uint16_t>((size_t)(e.runs * e.grid_rows));
  layout.take<uint8_t>((size_t)e.stride * (size_t)e.all_rows);
  return layout.bytes();
}

void search_field::sum_run(ptrdiff_t corner, const int32_t *steps, int stride, int headings, int count, int least,
                           uint16_t (*sums)[kRun], bool *reached) const {
  auto *sum = sum_lists_plain;
#if WM_HAS_WIDE
  if (wm_vectors_wide()) sum = sum_lists_wide;
#endif
  sum(cells_.get() + corner, steps, stride, headings, count, least, sums, reached);
}

void search_field::place_of(const edge_map &map, int64_t run, int64_t row, int i, double *x_m, double *y_m) const {
  const double grid_px = kGridCells * cell_m_ / map.raster().resolution_m;
  map.to_map(((double)(kRun * run + i) + 0.5) * grid_px, ((double)row + 0.5) * grid_px, x_m, y_m);
}

ptrdiff_t search_field::nearest(const edge_map &map, double x_m, double y_m) const {
  const wm_raster &r = map.raster();
  double column, row;
  map.to_pixels(x_m, y_m, &column, &row);
  column = column > 0.0 ? column < r.width_px ? column : r.width_px : 0.0;
  row = row > 0.0 ? row < r.height_px ? row : r.height_px : 0.0;
  const double cells_a_pixel = r.resolution_m / cell_m_;
  return at((int64_t)(column * cells_a_pixel + 0.5), (int64_t)(row * cells_a_pixel + 0.5));
}

void search_field::init(const edge_map &map, void *memory) {
  const wm_raster &raster = map.raster();
  const extent e = extent_of(raster);
  cell_m_ = e.cell_m;
  stride_ = (ptrdiff_t)e.stride;
  runs_ = e.runs;
  rows_ = e.grid_rows;
  memory_layout layout(memory, 0);
  auto *standing = layout.take<uint16_t>((size_t)(e.runs * e.grid_rows));
  standing_.set(standing);
  auto *to = layout.take<uint8_t>((size_t)e.stride * (size_t)e.all_rows);
  cells_.set(to);
  const double least = log(kFloor);
  unit_ = -least / 255.0;
  uint8_t value[256];
  for (int i = 0; i < 256; i++) {
    const double d = i * map.unit_m() / kSigma_m, hit = i == edge_map::kFar ? 0.0 : exp(-0.5 * d * d);
    value[i] = (uint8_t)((log((1.0 - kFloor) * hit + kFloor) - least) / unit_ + 0.5);
  }
  for (int64_t row = 0; row < rows_; row++)
    for (int64_t run = 0; run < runs_; run++) {
      uint32_t bits = 0;
      for (int i = 0; i < kRun; i++) {
        double x, y;
        place_of(map, run, row, i, &x, &y);
        bits |= (uint32_t)map.drivable(x, y) << i;
      }
      *standing++ = (uint16_t)bits;
    }
  std::memset(to, 0, (size_t)e.stride * (size_t)e.all_rows);
  const double pixels = cell_m_ / raster.resolution_m;
  for (int64_t r = 0; r < e.rows; r++)
    for (int64_t c = 0; c < e.columns; c++) {
      const double column = ((double)c + 0.5) * pixels, row = ((double)r + 0.5) * pixels;
      if (map.inside_map(column, row)) to[at(c, r)] = value[map.distance_of((int)column, (int)row)];
    }
}

}  // namespace wm
