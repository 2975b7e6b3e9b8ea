// SPDX-License-Identifier: Apache-2.0
#include "maps/score_field.hpp"

#include <cstring>

#include "math/lanes.hpp"
#include "waymark/vectors.h"

namespace wm {
namespace {

constexpr int kTileShift = 8;  // of pixels along a tile: a place in a tile is 16 bits
constexpr int kTile = 1 << kTileShift, kTileArea = kTile * kTile;
// Within a tile cells of 8 x 8 pixels, a cache line each: from the places of one point seen by all particles few are
// far.
constexpr int kCellShift = 3;
constexpr int16_t kLow = (1 << kCellShift) - 1, kMiddle = (kTile - 1) & ~kLow;
constexpr int kRing = 1;            // pixels around the map that count as far from any edge: where clamped points go
constexpr int kUnitShiftMax = 6;    // a turned point is rounded to 1/64 pixel at best
constexpr double kUnity = 32767.0;  // of a cosine in 16 bits

int tiles_for(uint32_t pixels) { return ((int)pixels + 2 * kRing + kTile - 1) >> kTileShift; }

int16_t rounded(double value) { return (int16_t)std::floor(value + 0.5); }

// The scores of a block of points, added to the sum of every pose. Vectors of kLanes points; a vector's address words
// are interleaved as the machine does it best, which puts the points in another order.
struct block_view {
  const int16_t *x, *y, *used;
  const uint8_t *layer;
  int shift, tile_columns, last_column, last_row;
};

template <int kLanes>
struct lanes_of {
  typedef int16_t words __attribute__((vector_size(2 * kLanes), may_alias));
};

// The upper half of a product, which all machines have as one instruction.
template <int kLanes, class Words>
WM_KERNEL void multiply_high(const Words &a, int16_t b, Words *out) {
  for (int k = 0; k < kLanes; k++) (*out)[k] = (int16_t)((a[k] * b) >> 16);
}

template <int kLanes>
WM_KERNEL void add_block(const block_view &block, const field_poses &poses, int count, int32_t *sums) {
  using words = typename lanes_of<kLanes>::words;
  constexpr int kVectors = packed_scan::kBlock / kLanes;
  const words zero = {}, last_column = zero + (int16_t)block.last_column, last_row = zero + (int16_t)block.last_row;
  const words tile_columns = zero + (int16_t)block.tile_columns;
  words x[kVectors], y[kVectors], used[kVectors];
  std::memcpy(x, block.x, sizeof x);
  std::memcpy(y, block.y, sizeof y);
  std::memcpy(used, block.used, sizeof used);
  const auto shift = (int16_t)block.shift;
  const uint8_t *layer = block.layer;
  for (int i = 0; i < count; i++) {
    alignas(32) uint64_t at[packed_scan::kBlock / 2];  // two addresses each
    for (int k = 0; k < kVectors; k++) {
      words cx, sx, cy, sy;
      multiply_high<kLanes>(x[k], poses.cosine[i], &cx);
      multiply_high<kLanes>(x[k], poses.sine[i], &sx);
      multiply_high<kLanes>(y[k], poses.cosine[i], &cy);
      multiply_high<kLanes>(y[k], poses.sine[i], &sy);
      words column = ((cx - sy + poses.column_part[i]) >> shift) + poses.column[i];
      words row = ((poses.row_part[i] - (sx + cy)) >> shift) + poses.row[i];
      column = column > zero ? column : zero;
      column = column < last_column ? column : last_column;
      row = row > zero ? row : zero;
      row = row < last_row ? row : last_row;
      column &= used[k];  // what fills a block up looks at the ring's corner, where nothing is
      row &= used[k];
      const words inside = ((row & ~kLow) << kTileShift) | ((row & kLow) << kCellShift) |
                           ((column & kMiddle) << kCellShift) | (column & kLow);
      const words tile = (row >> kTileShift) * tile_columns + (column >> kTileShift);
      words low, high;
      if constexpr (kLanes == 16) {
        low = WM_SHUFFLE(inside, tile, 0, 16, 1, 17, 2, 18, 3, 19, 8, 24, 9, 25, 10, 26, 11, 27);
        high = WM_SHUFFLE(inside, tile, 4, 20, 5, 21, 6, 22, 7, 23, 12, 28, 13, 29, 14, 30, 15, 31);
      } else {
        low = WM_SHUFFLE(inside, tile, 0, 8, 1, 9, 2, 10, 3, 11);
        high = WM_SHUFFLE(inside, tile, 4, 12, 5, 13, 6, 14, 7, 15);
      }
      std::memcpy(at + k * kLanes / 2, &low, sizeof low);
      std::memcpy(at + k * kLanes / 2 + kLanes / 4, &high, sizeof high);
    }
    int32_t even = 0, odd = 0;
#pragma GCC unroll 8
    for (const uint64_t two : at) {
      even += layer[(uint32_t)two];
      odd += layer[two >> 32];
    }
    sums[i] += even + odd;
  }
}

// The map's frame, its axes in pixels a metre.
struct map_frame {
  double x_m, y_m, yaw_rad, cos, sin, width, height, parts;
};

// A pose outside of the map is put into its corner: it isn't drivable.
WM_KERNEL void place_four(const map_frame &frame, const double *x_m, const double *y_m, const double *heading_rad,
                          int count, const field_poses &out) {
  typedef int32_t ints __attribute__((vector_size(16)));
  typedef int16_t shorts __attribute__((vector_size(8)));
  const auto put = [](const lanes4 &value, int bytes, int16_t *to) __attribute__((always_inline)) {
    const shorts narrow = __builtin_convertvector(__builtin_convertvector(value, ints), shorts);
    std::memcpy(to, &narrow, (size_t)bytes);
  };
  for (int i = 0; i < count; i += 4) {
    const int some = count - i < 4 ? count - i : 4, size = some * (int)sizeof(double);
    lanes4 x = {}, y = {}, heading = {}, sine, cosine;
    std::memcpy(&x, x_m + i, (size_t)size);
    std::memcpy(&y, y_m + i, (size_t)size);
    std::memcpy(&heading, heading_rad + i, (size_t)size);
    x -= frame.x_m;
    y -= frame.y_m;
    lanes4 u = frame.cos * x + frame.sin * y, v = frame.height + frame.sin * x - frame.cos * y;
    const mask4 is_inside = (u >= 0.0) & (v >= 0.0) & (u < frame.width) & (v < frame.height);
    u = is_inside ? u : lanes4{};
    v = is_inside ? v : lanes4{};
    sincos4(heading - frame.yaw_rad, &sine, &cosine);
    const lanes4 column = __builtin_convertvector(__builtin_convertvector(u, ints), lanes4),
                 row = __builtin_convertvector(__builtin_convertvector(v, ints), lanes4);
    const int bytes = some * (int)sizeof(int16_t);
    put(column + (double)kRing, bytes, out.column + i);
    put(row + (double)kRing, bytes, out.row + i);
    put((u - column) * frame.parts, bytes, out.column_part + i);
    put((v - row) * frame.parts, bytes, out.row_part + i);
    put(cosine * kUnity, bytes, out.cosine + i);
    put(sine * kUnity, bytes, out.sine + i);
  }
}

void place_four_plain(const map_frame &frame, const double *x_m, const double *y_m, const double *heading_rad,
                      int count, const field_poses &out) {
  place_four(frame, x_m, y_m, heading_rad, count, out);
}

void add_block_plain(const block_view &block, const field_poses &poses, int count, int32_t *sums) {
  add_block<8>(block, poses, count, sums);
}

#if WM_HAS_WIDE
WM_WIDE void place_four_wide(const map_frame &frame, const double *x_m, const double *y_m, const double *heading_rad,
                             int count, const field_poses &out) {
  place_four(frame, x_m, y_m, heading_rad, count, out);
}

WM_WIDE void add_block_wide(const block_view &block, const field_poses &poses, int count, int32_t *sums) {
  add_block<16>(block, poses, count, sums);
}
#endif

}  // namespace

size_t score_field::bytes(const wm_raster &raster) {
  if (raster.width_px > (uint32_t)kPixelsMax || raster.height_px > (uint32_t)kPixelsMax) return 0;
  const size_t all = (size_t)tiles_for(raster.width_px) * (size_t)tiles_for(raster.height_px) * kTileArea;
  return kSigmaClasses * all <= kBytesMax ? kSigmaClasses * all : 0;
}

void score_field::init(const edge_map &map, const score_table &table, void *memory) {
  if (bytes(map.raster()) == 0) {
    tile_columns_ = tile_rows_ = 0;
    return;
  }
  tile_columns_ = tiles_for(map.raster().width_px);
  tile_rows_ = tiles_for(map.raster().height_px);
  auto *layer = static_cast<uint8_t *>(memory);
  layers_.set(layer);
  std::memset(layer, 0, bytes(map.raster()));
  const int32_t least = table.value[0][edge_map::kFar];
  int32_t most = least + 1;
  for (const auto &values : table.value)
    for (const int32_t value : values) most = value > most ? value : most;
  unit_ = kScoreUnit * (most - least) / 255.0;
  floor_ = kScoreUnit * least;
  for (const auto &values : table.value) {
    uint8_t value[256];
    for (int i = 0; i < 256; i++)
      value[i] = (uint8_t)(((values[i] - least) * 510 + (most - least)) / (2 * (most - least)));
    bake(map, value, layer);
    layer += (size_t)tile_columns_ * (size_t)tile_rows_ * kTileArea;
  }
}

// A row's pieces that lie in one tile of the map and in one of the field.
void score_field::bake(const edge_map &map, const uint8_t *value, uint8_t *layer) const {
  const int width = (int)map.raster().width_px, height = (int)map.raster().height_px;
  for (int row = 0; row < height; row++) {
    const int to_row = row + kRing;
    uint8_t *to = layer + (size_t)(to_row >> kTileShift) * (size_t)tile_columns_ * kTileArea +
                  (size_t)((to_row & kMiddle) << kTileShift | (to_row & kLow) << kCellShift);
    for (int column = 0; column < width; column += edge_map::kTile) {
      const uint8_t *from = map.tile_row(column, row);
      if (!from) continue;
      const int end = column + edge_map::kTile < width ? edge_map::kTile : width - column;
      for (int i = 0; i < end; i++) {
        const int to_column = column + i + kRing;
        to[(size_t)(to_column >> kTileShift) * kTileArea +
           (size_t)((to_column & kMiddle) << kCellShift | (to_column & kLow))] = value[from[i]];
      }
    }
  }
}

void score_field::pack(const edge_map &map, const scan_points &points, packed_scan *out) const {
  const double inverse = 1.0 / map.pixel_m();
  double reach = (double)points.reach_m * inverse;
  if (!(reach < kReachPixels)) reach = kReachPixels;
  out->shift = kUnitShiftMax;
  while (out->shift > 0 && reach * (double)(2 << out->shift) > kUnity) out->shift--;
  const double scale = inverse * (double)(2 << out->shift);
  out->count = points.count;
  int next = 0;
  for (int k = 0, i = 0; k < kSigmaClasses; k++) {
    for (; i < points.class_end[k]; i++) {
      const double x = (double)points.x_m[i] * scale, y = (double)points.y_m[i] * scale;
      if (!(x * x + y * y <= kUnity * kUnity)) continue;
      out->layer[next / packed_scan::kBlock] = (uint8_t)k;
      out->x[next] = rounded(x);
      out->y[next] = rounded(y);
      out->used[next++] = -1;
    }
    for (; next % packed_scan::kBlock != 0; next++) out->x[next] = out->y[next] = out->used[next] = 0;
  }
  out->blocks = next / packed_scan::kBlock;
}

void score_field::place(const edge_map &map, const packed_scan &scan, int count, const double *x_m, const double *y_m,
                        const double *heading_rad, const field_poses &out) const {
  const wm_raster &r = map.raster();
  const double inverse = 1.0 / map.pixel_m();
  const map_frame frame = {r.origin_x_m,
                           r.origin_y_m,
                           r.origin_yaw_rad,
                           map.yaw_cos() * inverse,
                           map.yaw_sin() * inverse,
                           (double)r.width_px,
                           (double)r.height_px,
                           (double)(1 << scan.shift)};
  auto *four = place_four_plain;
#if WM_HAS_WIDE
  if (wm_vectors_wide()) four = place_four_wide;
#endif
  four(frame, x_m, y_m, heading_rad, count, out);
}

void score_field::score(const packed_scan &scan, const field_poses &poses, int count, int32_t *sums) const {
  auto *add = add_block_plain;
#if WM_HAS_WIDE
  if (wm_vectors_wide()) add = add_block_wide;
#endif
  std::memset(sums, 0, (size_t)count * sizeof *sums);
  const size_t area = (size_t)tile_columns_ * (size_t)tile_rows_ * kTileArea;
  for (int b = 0; b < scan.blocks; b++) {
    const size_t first = (size_t)b * packed_scan::kBlock;
    const block_view block = {scan.x + first,
                              scan.y + first,
                              scan.used + first,
                              layers_.get() + scan.layer[b] * area,
                              scan.shift,
                              tile_columns_,
                              (tile_columns_ << kTileShift) - 1,
                              (tile_rows_ << kTileShift) - 1};
    add(block, poses, count, sums);
  }
}

}  // namespace wm
