// SPDX-License-Identifier: Apache-2.0
// A coarse likelihood field for sweeps over the whole map [Olson2009]: cells of 0.1 m, a byte each. A point that is
// rotated once for a heading is a fixed step in memory from every place: a look-up is two loads and an addition.
// A sweep's grid is every second cell. 16 places of a row are scored at a time, since a point's cells lie side by side.
// Integers: the same bits everywhere.
#ifndef WAYMARK_ESTIMATOR_MAPS_SEARCH_FIELD_HPP
#define WAYMARK_ESTIMATOR_MAPS_SEARCH_FIELD_HPP

#include <cstddef>

#include "math/elementary.hpp"
#include "waymark/internal/maps/edge_map.hpp"

namespace wm {

class search_field {
 public:
  // Of a point's likelihood: sigma, so that half a grid step is no misfit, and least value, for outliers. Not swept.
  static constexpr double kSigma_m = 0.2, kFloor = 0.1;
  static constexpr int kReachCells = 160;  // empty border: points up to 16 m from a robot at the map's edge
  static constexpr size_t kBytesMax = (size_t)1 << 26;  // 64 MB; a larger map has larger cells
  static constexpr int kGridCells = 2;                  // of 0.1 m: a grid of 0.2 m, the likelihood's sigma
  static constexpr int kRun = 16;                       // places of a vector

  // Bytes that init() needs for this raster.
  static size_t bytes(const wm_raster &raster);
  // `memory` keeps its distance from this object when both are copied. Linear in the cells.
  void init(const edge_map &map, void *memory);

  double cell_m() const { return cell_m_; }
  double unit() const { return unit_; }  // nats of 1 in a sum
  // The corner of cells `column`, `row` (from the map's left and upper border) as an index; it lies within the map.
  ptrdiff_t at(int64_t column, int64_t row) const {
    return (ptrdiff_t)(row + kReachCells) * stride_ + (ptrdiff_t)(column + kReachCells);
  }
  // From the index of the robot's corner to a point's, within reach_m(): metres to the right and down the map.
  int32_t step(double right_m, double down_m) const {
    return (int32_t)((ptrdiff_t)std::floor(down_m / cell_m_) * stride_ + (ptrdiff_t)std::floor(right_m / cell_m_));
  }
  double reach_m() const { return (kReachCells - 1) * cell_m_; }
  // The corner nearest to a place, which may lie outside of the map.
  ptrdiff_t nearest(const edge_map &map, double x_m, double y_m) const;
  // Sum over the steps from that corner. O(count).
  int32_t sum(ptrdiff_t corner, const int32_t *steps, int count) const {
    const uint8_t *from = cells_.get() + corner;
    int32_t out = 0;
    for (int i = 0; i < count; i++) out += from[steps[i]];
    return out;
  }

  // The sweep's grid: run `run` of a row is its places from kRun * run on.
  int64_t runs() const { return runs_; }
  int64_t rows() const { return rows_; }
  // Bit i: a robot may stand at place i of the run.
  uint32_t standing(int64_t run, int64_t row) const { return standing_[(size_t)(row * runs_ + run)]; }
  ptrdiff_t corner_of(int64_t run, int64_t row) const {
    return at(kGridCells * kRun * run + kGridCells / 2, kGridCells * row + kGridCells / 2);
  }
  void place_of(const edge_map &map, int64_t run, int64_t row, int i, double *x_m, double *y_m) const;
  // sums[h][i]: over `count` steps (at most 257) from place i of the run, those of heading h being steps[h * stride]
  // and on. reached[h]: one of them comes to more than `least`. O(headings * count).
  void sum_run(ptrdiff_t corner, const int32_t *steps, int stride, int headings, int count, int least,
               uint16_t (*sums)[kRun], bool *reached) const;

 private:
  double cell_m_, unit_;
  int64_t runs_, rows_;
  ptrdiff_t stride_;
  relative_array<uint16_t> standing_;
  relative_array<uint8_t> cells_;
};

}  // namespace wm

#endif
