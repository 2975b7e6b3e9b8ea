// SPDX-License-Identifier: Apache-2.0
// Scores of a cloud of particles: one look-up for every particle and point of a scan. A point's score is baked into the
// map: a layer of bytes for each class of sigma, in tiles of 256 x 256 pixels, within them cells of 8 x 8, a cache line
// each. An address is the tile's number behind the place in the tile, 16 bits each. Sums are of integers, so vectors of
// any width give the same bits.
#ifndef WAYMARK_ESTIMATOR_MAPS_SCORE_FIELD_HPP
#define WAYMARK_ESTIMATOR_MAPS_SCORE_FIELD_HPP

#include "maps/likelihood.hpp"

namespace wm {

// A scan in fixed point, 16 points of one class at a time.
struct packed_scan {
  // Points of a block: the widest vector of words. Blocks of a full scan, one in part for each class.
  static constexpr int kBlock = 16, kBlocksMax = WM_POINTS_MAX / kBlock + kSigmaClasses;
  int count;  // of points
  int blocks;
  int shift;  // 2^-shift pixels are the unit of a turned point; half of it of one that is not
  uint8_t layer[kBlocksMax];
  alignas(32) int16_t x[kBlocksMax * kBlock];     // ahead
  alignas(32) int16_t y[kBlocksMax * kBlock];     // to the left
  alignas(32) int16_t used[kBlocksMax * kBlock];  // -1; 0 where a block isn't full
};

// Where particles are, for the kernel: pixel of the field, the part of a pixel beyond it in the scan's unit, cosine and
// sine of the heading against the map's rows in 1/32767. Structure of arrays.
struct field_poses {
  int16_t *column, *row, *column_part, *row_part, *cosine, *sine;
};

class score_field {
 public:
  static constexpr size_t kBytesMax = (size_t)1 << 28;  // of all layers: 64 million pixels, a hall of 100 m
  static constexpr int kPixelsMax = 16000;              // along a side: a pixel and its fractions are 16 bits
  static constexpr int kReachPixels = 8000;             // farther points have no score: 107 m at 75 px/m

  // Bytes that init() needs for a map of this size; 0 where it is too large, and particles look at distances instead.
  static size_t bytes(const wm_raster &raster);
  // Bakes the table's values over the map's distances. A field of a map that is too large is not ready.
  void init(const edge_map &map, const score_table &table, void *memory);
  bool ready() const { return tile_columns_ > 0; }

  // A sum of look-ups times unit(), plus floor() a point, is what score() gives in kScoreUnit, rounded to bytes.
  double unit() const { return unit_; }
  double floor() const { return floor_; }

  void pack(const edge_map &map, const scan_points &points, packed_scan *out) const;
  // `count` poses in the map to pixels. Headings of at most 1e5 rad.
  void place(const edge_map &map, const packed_scan &scan, int count, const double *x_m, const double *y_m,
             const double *heading_rad, const field_poses &out) const;
  // sums[i] = sum over the points of what each counts seen from pose i. O(count * points).
  void score(const packed_scan &scan, const field_poses &poses, int count, int32_t *sums) const;

 private:
  void bake(const edge_map &map, const uint8_t *value, uint8_t *layer) const;

  int tile_columns_, tile_rows_;
  double unit_, floor_;
  relative_array<uint8_t> layers_;
};

}  // namespace wm

#endif
