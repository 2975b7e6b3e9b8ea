// SPDX-License-Identifier: Apache-2.0
// The map as a sweep over all of it sees it: cells of 0.1 m, a byte each for how well a point fits that falls there. So
// coarse, a building fits into the second level cache, and a point turned once for a heading is a fixed step in memory
// from every place: a look-up costs two loads and an addition (E. Olson, "Real-time correlative scan matching", 2009).
// Integers: the same bits everywhere.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_SEARCH_FIELD_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_SEARCH_FIELD_HPP

#include <cstddef>

#include "maps/edge_map.hpp"
#include "math/elementary.hpp"

namespace wm {

class search_field {
 public:
  static constexpr double kSigma_m = 0.2, kFloor = 0.1;  // of a point's likelihood: half a grid step is no miss
  static constexpr int kReachCells = 160;                // around the map, where nothing fits
  static constexpr size_t kBytesMax = (size_t)1 << 26;   // a larger map gets larger cells

  // Bytes that init() needs for this raster.
  static size_t bytes(const wm_raster &raster);
  // `memory` keeps its distance from this object when both are copied. Linear in the cells.
  void init(const edge_map &map, void *memory);

  double cell_m() const { return cell_m_; }
  double unit() const { return unit_; }  // logarithm of the likelihood that 1 of a sum stands for
  // The corner of cells `column`, `row` (from the map's left and upper border) as an index; it lies within the map.
  ptrdiff_t at(int64_t column, int64_t row) const {
    return (ptrdiff_t)(row + kReachCells) * stride_ + (ptrdiff_t)(column + kReachCells);
  }
  // What a point within reach_m() adds to the index of its robot's corner: metres to the right and down the map.
  int32_t step(double right_m, double down_m) const {
    return (int32_t)((ptrdiff_t)std::floor(down_m / cell_m_) * stride_ + (ptrdiff_t)std::floor(right_m / cell_m_));
  }
  double reach_m() const { return (kReachCells - 1) * cell_m_; }
  // Sum over the steps from that corner. O(count).
  int32_t sum(ptrdiff_t corner, const int32_t *steps, int count) const {
    const uint8_t *from = cells() + corner;
    int32_t out = 0;
    for (int i = 0; i < count; i++) out += from[steps[i]];
    return out;
  }

 private:
  const uint8_t *cells() const {
    return reinterpret_cast<const uint8_t *>(reinterpret_cast<uintptr_t>(this) + (uintptr_t)cells_at_);
  }

  double cell_m_, unit_;
  ptrdiff_t stride_, cells_at_;  // from this object on
};

}  // namespace wm

#endif
