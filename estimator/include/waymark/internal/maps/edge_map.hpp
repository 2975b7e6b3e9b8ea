// SPDX-License-Identifier: Apache-2.0
// A raster map's edges made ready for looking up: from any pixel how far the nearest edge is, and where, and the line
// that the edge's pixels lie on, to a part of a pixel. Tiles of 64 x 64 pixels; those beyond the reach of any edge
// share one, so that memory goes by the length of the edges, not by the area. A distance takes a byte; a tile's
// are a page of memory, so that places that are close together are also near in memory.
#ifndef WAYMARK_INTERNAL_MAPS_EDGE_MAP_HPP
#define WAYMARK_INTERNAL_MAPS_EDGE_MAP_HPP

#include <cstddef>
#include <cstdint>

#include "waymark/frames.h"
#include "waymark/internal/memory/layout.hpp"
#include "waymark/setup.h"

namespace wm {

// Where the nearest edge is seen from a place, in map axes.
struct edge_line {
  double normal_x, normal_y;  // unit, towards either side
  double offset_m;            // normal . (line - place)
  double distance_m;          // to the nearest edge pixel
  bool found;                 // within reach
  int face;                   // 1: floor on the normal's side alone, -1: on the other alone, 0: on both or neither
};

class edge_map {
 public:
  // Pixels along a tile and in it: its distances fill a page of memory.
  static constexpr int kTileShift = 6, kTile = 1 << kTileShift, kTilePixels = kTile * kTile;
  static constexpr int kReachPixelsMax = 120;      // offsets are kept in a signed byte
  static constexpr double kReach_m = 0.6;          // farther edges are none: four gates of 0.15 m
  static constexpr int kFar = 255;                 // distance of what is out of reach
  static constexpr uint32_t kTilesMax = 1u << 19;  // 3.25 bytes a pixel: 7 GB

  // Bytes that init() needs for this raster, 0 where it has no edges layer. Linear in the pixels.
  static size_t bytes(const wm_raster &raster);
  // The same of a map that may be missing; where 0, *why is the reason.
  static size_t bytes_or_reason(const wm_raster *raster, const char **why);
  // Builds it in `memory` (64-byte aligned), which keeps its distance from this object when both are copied. The raster
  // outlives it. Linear in the pixels near edges. Exact Euclidean distances: P. Felzenszwalb, D. Huttenlocher,
  // "Distance transforms of sampled functions", 2012.
  void init(const wm_raster &raster, void *memory);

  // Place in the map to pixels: column and row of which whole numbers are pixels' corners, row from the top.
  void to_pixels(double x_m, double y_m, double *column, double *row) const;
  void to_map(double column, double row, double *x_m, double *y_m) const;
  bool inside_map(double column, double row) const;
  double unit_m() const { return unit_m_; }  // of a distance byte
  double pixel_m() const { return raster_->resolution_m; }
  double yaw_cos() const { return cos_yaw_; }
  double yaw_sin() const { return sin_yaw_; }
  const wm_raster &raster() const { return *raster_; }

  // For kernels. The directory has a ring of tiles around the map in which every edge is out of reach, so that with
  // kTile added and clamped to [0, padded_columns()), [0, padded_rows()) any pixel may be looked up: its byte is
  // distances()[tiles()[row / kTile << row_shift() | column / kTile] + inside].
  const uint8_t *distances() const { return distances_.get(); }
  const uint32_t *tiles() const { return tiles_.get(); }
  int padded_columns() const { return (tile_columns_ + 2) << kTileShift; }
  int padded_rows() const { return (tile_rows_ + 2) << kTileShift; }
  int row_shift() const { return row_shift_; }  // a row of tiles is 2^row_shift() of them
  static int inside(int column, int row) { return (row & (kTile - 1)) << kTileShift | (column & (kTile - 1)); }
  int distance_of(int column, int row) const {
    return distances()[tile_of(column, row) + (uint32_t)inside(column, row)];
  }

  // The distances of a row's part that begins at `column`, a multiple of kTile; NULL where all is out of reach.
  const uint8_t *tile_row(int column, int row) const {
    const uint32_t tile = tile_of(column, row);
    return tile ? distances() + tile + (uint32_t)inside(column, row) : nullptr;
  }

  edge_line nearest(double x_m, double y_m) const;
  // The same of edges that can be seen along a ray to the place: a wall hides its other face. The drivable layer has
  // the side on which the floor is; lines with floor on both sides or on neither are seen from either. O(1).
  edge_line nearest_seen(double x_m, double y_m, double ray_x_m, double ray_y_m) const;
  // Whether base_link may be there: by the drivable layer; outside of the map never, without the layer anywhere in it.
  bool drivable(double x_m, double y_m) const;

 private:
  struct offset {  // to the nearest edge pixel; of an edge's own pixel: its line
    int8_t x, y;   // or: normal in 1/256 of half a turn (unsigned), way along it to the line in 1/32 pixels
  };
  uint32_t tile_of(int column, int row) const {
    return tiles()[((row >> kTileShift) + 1) << row_shift_ | ((column >> kTileShift) + 1)];
  }
  static uint32_t in_row(int column, int row) { return (uint32_t)inside(column, row); }
  bool is_edge(int column, int row) const {
    return column >= 0 && row >= 0 && column < (int)raster_->width_px && row < (int)raster_->height_px &&
           raster_->edges[(size_t)row * raster_->width_px + (size_t)column];
  }
  static void lay_out(memory_layout *layout, size_t tiles, edge_map *own);
  void sweep_columns();
  void sweep_tile_column(int tx, bool down);
  template <class Visit>
  void each_pixel_in_reach(int row, Visit visit) const;
  void sweep_row(int row, int32_t *site);
  struct moments;
  void add_near(int column, int row, moments *out) const;
  void add_connected(int column, int row, moments *out) const;
  static bool fit_line(const moments &m, offset *out);
  int face_of(int column, int row, const offset &line) const;
  bool floor_at(double column, double row) const;
  void fit_lines();

  const wm_raster *raster_;
  struct unit_vector {
    double cos, sin;
  };
  unit_vector normal_[256];  // of a line, by the byte that is kept of it
  double cos_yaw_, sin_yaw_, unit_m_, pixels_a_metre_;
  int reach_px_, tile_columns_, tile_rows_, row_shift_;
  relative_array<uint32_t> tiles_;  // index of each tile's first pixel, 0 where it is out of reach
  relative_array<uint8_t> distances_;
  relative_array<offset> offsets_;
  relative_array<uint8_t> faces_;  // of edges, two bits a pixel: face + 1
};

}  // namespace wm

#endif
