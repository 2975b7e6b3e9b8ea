// SPDX-License-Identifier: Apache-2.0
#include "waymark/internal/maps/edge_map.hpp"

#include <bit>
#include <cstring>

#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr int kSideMax_px = 32768;  // of a map: rows and columns of tiles are counted on the stack
constexpr int kLineRadius_px = 6;   // a line is fitted to the edge pixels up to so far: 8 cm at 75 px/m; not swept
constexpr double kLineUnit_px = 1.0 / 32;  // of a line's offset, which is kept in a byte: up to 4 px
// Variance of edge pixels across their line: at most 1/6 for a line of one pixel, 0.67 for one of three; a corner has
// more.
constexpr double kLineVariance_px2 = 0.7;
constexpr double kLineLength_px2 = 1.0;  // least variance along it: about four pixels
constexpr int8_t kNoLine = -128;         // marks a pixel without a line
constexpr double kBeside_px = 2.0;       // from a line, where its sides are looked at: an edge is 1 px to 3 px wide
// A wall's near face is looked for from a place on its far face in so many steps: walls inside a building are 5 cm to
// 40 cm thick. Not swept.
constexpr double kFaceStep_m = 0.1;
constexpr int kFaceSteps = 4;

int tiles_along(uint32_t pixels) { return (int)((pixels + edge_map::kTile - 1) >> edge_map::kTileShift); }

int shift_for(int columns) {
  int shift = 0;
  while ((1 << shift) < columns) shift++;
  return shift;
}

int reach_of(const wm_raster &raster) {
  const double pixels = edge_map::kReach_m / raster.resolution_m;
  return pixels < 2.0 ? 2 : pixels > edge_map::kReachPixelsMax ? edge_map::kReachPixelsMax : (int)pixels;
}

// Calls visit(tile column, tile row) for every tile with an edge in it.
template <class Visit>
void each_tile_with_edges(const wm_raster &raster, Visit visit) {
  const int columns = tiles_along(raster.width_px), rows = tiles_along(raster.height_px);
  for (int row = 0; row < rows; row++)
    for (int column = 0; column < columns; column++) {
      const size_t x = (size_t)column << edge_map::kTileShift, y0 = (size_t)row << edge_map::kTileShift;
      const size_t width = raster.width_px - x < edge_map::kTile ? raster.width_px - x : edge_map::kTile;
      bool found = false;
      for (size_t y = y0; y < y0 + edge_map::kTile && y < raster.height_px && !found; y++) {
        const uint8_t *at = raster.edges + y * raster.width_px + x;
        size_t i = 0;
        uint64_t any = 0, eight;
        for (; i + 8 <= width; i += 8) {
          std::memcpy(&eight, at + i, 8);
          any |= eight;
        }
        for (; i < width; i++) any |= at[i];
        found = any != 0;
      }
      if (found) visit(column, row);
    }
}

// Calls mark(tile column, tile row) for every tile within reach of an edge, for most of them more than once.
template <class Mark>
void each_tile_in_reach(const wm_raster &raster, Mark mark) {
  const int columns = tiles_along(raster.width_px), rows = tiles_along(raster.height_px);
  const int neighbours = (reach_of(raster) + edge_map::kTile - 1) / edge_map::kTile;
  each_tile_with_edges(raster, [&](int column, int row) {
    for (int y = row - neighbours; y <= row + neighbours; y++)
      for (int x = column - neighbours; x <= column + neighbours; x++)
        if (x >= 0 && y >= 0 && x < columns && y < rows) mark(x, y);
  });
}

// The directory has a ring of tiles around the map; its rows are a power of two long.
size_t directory_size(const wm_raster &raster) {
  return (size_t)(tiles_along(raster.height_px) + 2) << shift_for(tiles_along(raster.width_px) + 2);
}

}  // namespace

// The blocks behind the directory, for so many tiles.
void edge_map::lay_out(memory_layout *layout, size_t tiles, edge_map *own) {
  auto *distances = layout->take<uint8_t>(tiles * kTilePixels);
  auto *offsets = layout->take<offset>(tiles * kTilePixels);
  auto *faces = layout->take<uint8_t>(tiles * kTilePixels / 4);
  if (own) own->distances_.set(distances), own->offsets_.set(offsets), own->faces_.set(faces);
}

size_t edge_map::bytes(const wm_raster &raster) {
  if (!raster.edges || raster.width_px == 0 || raster.height_px == 0 || raster.width_px > kSideMax_px ||
      raster.height_px > kSideMax_px || !(raster.resolution_m > 0.0))
    return 0;
  constexpr int kTilesAlong = kSideMax_px / kTile;
  uint64_t reached[kTilesAlong][kTilesAlong / 64] = {};  // a bit a tile: 32 kB
  each_tile_in_reach(raster, [&](int column, int row) { reached[row][column / 64] |= (uint64_t)1 << column % 64; });
  size_t count = 1;
  for (const auto &row : reached)
    for (const uint64_t tiles : row) count += (size_t)std::popcount(tiles);
  if (count > kTilesMax) return 0;
  memory_layout layout(nullptr, 0);
  layout.take<uint32_t>(directory_size(raster));
  lay_out(&layout, count, nullptr);
  layout.take<int32_t>((size_t)3 * raster.width_px);
  return layout.bytes();
}

size_t edge_map::bytes_or_reason(const wm_raster *raster, const char **why) {
  const size_t needed = raster && raster->edges ? bytes(*raster) : 0;
  if (!raster)
    *why = "there is no map: put map/map.yaml into the recording's folder, or name one by `map:`";
  else if (!raster->edges)
    *why = "the map has no layer `edges`; `waymark map make` makes one of a floor plan";
  else if (needed == 0)
    *why = "the map is too large: at most 32768 pixels along an edge, and 2 gigapixels within 0.6 m of edges";
  return needed;
}

void edge_map::init(const wm_raster &raster, void *memory) {
  raster_ = &raster;
  const sin_cos yaw = sincos(raster.origin_yaw_rad);
  cos_yaw_ = yaw.cos;
  sin_yaw_ = yaw.sin;
  for (int i = 0; i < 256; i++) {
    const sin_cos a = sincos(i * (kPi / 256.0));
    normal_[i] = {a.cos, a.sin};
  }
  pixels_a_metre_ = 1.0 / raster.resolution_m;
  reach_px_ = reach_of(raster);
  unit_m_ = reach_px_ * raster.resolution_m / (kFar - 1);
  tile_columns_ = tiles_along(raster.width_px);
  tile_rows_ = tiles_along(raster.height_px);
  row_shift_ = shift_for(tile_columns_ + 2);
  memory_layout layout(memory, 0);
  auto *tile = layout.take<uint32_t>(directory_size(raster));
  tiles_.set(tile);
  std::memset(tile, 0, directory_size(raster) * sizeof *tile);
  each_tile_in_reach(raster, [&](int column, int row) { tile[(row + 1) << row_shift_ | (column + 1)] = 1; });
  uint32_t count = 1;
  for (size_t i = 0; i < directory_size(raster); i++)
    if (tile[i]) tile[i] = count++ * kTilePixels;
  lay_out(&layout, count, this);
  std::memset(distances_.get(), kFar, (size_t)count * kTilePixels);
  std::memset(faces_.get(), 0, (size_t)count * kTilePixels / 4);
  auto *scratch = layout.take<int32_t>((size_t)3 * raster.width_px);
  sweep_columns();
  for (int row = 0; row < (int)raster.height_px; row++) sweep_row(row, scratch);
  fit_lines();
}

// First pass: to the nearest edge in the same column, in offset.y; reach + 1 where there is none.
void edge_map::sweep_columns() {
  for (int tx = 0; tx < tile_columns_; tx++) {
    sweep_tile_column(tx, true);
    sweep_tile_column(tx, false);
  }
}

// Rows since the last edge pixel, downwards; then upwards where that is less.
void edge_map::sweep_tile_column(int tx, bool down) {
  const int none = reach_px_ + 1, x0 = tx << kTileShift, rows = (int)raster_->height_px;
  const int width = (int)raster_->width_px - x0 < kTile ? (int)raster_->width_px - x0 : kTile;
  int since[kTile];
  for (int &s : since) s = none;
  for (int n = 0; n < rows; n++) {
    const int row = down ? n : rows - 1 - n;
    const uint32_t tile = tiles()[((row >> kTileShift) + 1) << row_shift_ | (tx + 1)];
    if (!tile) continue;  // out of reach: so is every edge passed before
    const uint8_t *edges = raster_->edges + (size_t)row * raster_->width_px + (size_t)x0;
    offset *to = offsets_.get() + tile + in_row(0, row);
    for (int i = 0; i < width; i++) {
      since[i] = edges[i] ? 0 : since[i] < none ? since[i] + 1 : none;
      if (down)
        to[i].y = (int8_t)-since[i];
      else if (since[i] < -to[i].y)
        to[i].y = (int8_t)since[i];
    }
  }
}

// Calls visit(column, index of the pixel) for the pixels of a row that are within reach of an edge.
template <class Visit>
void edge_map::each_pixel_in_reach(int row, Visit visit) const {
  const uint32_t *tile = tiles() + (((row >> kTileShift) + 1) << row_shift_) + 1;
  const int width = (int)raster_->width_px;
  for (int tx = 0; tx < tile_columns_; tx++) {
    if (!tile[tx]) continue;
    const int end = (tx + 1) << kTileShift < width ? (tx + 1) << kTileShift : width;
    for (int column = tx << kTileShift; column < end; column++) visit(column, tile[tx] + in_row(column, row));
  }
}

// `site`: work space for three numbers a column. Second pass: the lower envelope of the parabolas that stand over a
// row's columns, then each pixel's parabola.
void edge_map::sweep_row(int row, int32_t *site) {
  offset *edge_offset = offsets_.get();
  uint8_t *distance = distances_.get();
  const int width = (int)raster_->width_px, none = reach_px_ + 1;
  int32_t *site_y = site + width, *start = site_y + width;
  int count = 0;
  each_pixel_in_reach(row, [&](int column, uint32_t pixel) {
    const int y = +edge_offset[pixel].y;  // signed
    if (y == none || y == -none) return;
    int from = INT32_MIN;
    while (count > 0) {
      // From here on this one is the lower: (own - other)/(2 (column - other's)), rounded up.
      const int other = site[count - 1], twice = 2 * (column - other);
      const int difference = y * y + column * column - site_y[count - 1] * site_y[count - 1] - other * other;
      from = difference <= 0 ? -((-difference) / twice) : (difference + twice - 1) / twice;
      if (from > start[count - 1]) break;
      count--;
    }
    site[count] = column;
    site_y[count] = y;
    start[count] = count == 0 ? INT32_MIN : from;
    count++;
  });
  if (count == 0) return;
  int nearest = 0;
  each_pixel_in_reach(row, [&](int column, uint32_t pixel) {
    while (nearest + 1 < count && start[nearest + 1] <= column) nearest++;
    const int dx = site[nearest] - column, dy = site_y[nearest];
    const int square_px = dx * dx + dy * dy;
    if (square_px > reach_px_ * reach_px_) return;
    edge_offset[pixel] = {(int8_t)dx, (int8_t)dy};
    const double steps = std::sqrt((double)square_px) * raster_->resolution_m / unit_m_ + 0.5;
    distance[pixel] = steps < kFar ? (uint8_t)steps : (uint8_t)(kFar - 1);
  });
}

// Moments of edge pixels about one of them.
struct edge_map::moments {
  int n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
  void add(int x, int y) {
    n++;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
    syy += y * y;
  }
};

// All edge pixels near by.
void edge_map::add_near(int column, int row, moments *out) const {
  for (int y = -kLineRadius_px; y <= kLineRadius_px; y++)
    for (int x = -kLineRadius_px; x <= kLineRadius_px; x++)
      if (is_edge(column + x, row + y)) out->add(x, y);
}

// Those of them that are connected with it: one face of a wall that is thinner than the radius.
void edge_map::add_connected(int column, int row, moments *out) const {
  constexpr int kSide = 2 * kLineRadius_px + 1;
  bool seen[kSide][kSide] = {};
  int8_t queue[kSide * kSide][2];
  int count = 0;
  const auto visit = [&](int x, int y) {
    if (x < -kLineRadius_px || x > kLineRadius_px || y < -kLineRadius_px || y > kLineRadius_px) return;
    bool &been = seen[y + kLineRadius_px][x + kLineRadius_px];
    if (been || !is_edge(column + x, row + y)) return;
    been = true;
    queue[count][0] = (int8_t)x;
    queue[count++][1] = (int8_t)y;
    out->add(x, y);
  };
  visit(0, 0);
  for (int next = 0; next < count; next++)
    for (int y = -1; y <= 1; y++)
      for (int x = -1; x <= 1; x++) visit(queue[next][0] + x, queue[next][1] + y);
}

// A line's normal and offset as they are kept; false where the pixels lie on none (corners, ends of three walls).
bool edge_map::fit_line(const moments &m, offset *out) {
  const double mean_x = (double)m.sx / m.n, mean_y = (double)m.sy / m.n;
  const double xx = (double)m.sxx / m.n - mean_x * mean_x, yy = (double)m.syy / m.n - mean_y * mean_y;
  const double xy = (double)m.sxy / m.n - mean_x * mean_y;
  const double half = 0.5 * (xx + yy), spread = std::sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy);
  if (half - spread > kLineVariance_px2 || half + spread < kLineLength_px2) return false;
  const double normal = 0.5 * atan2(2.0 * xy, xx - yy) + kHalfPi;  // (0, pi]
  const int turn = (int)(normal * (256.0 / kPi) + 0.5) & 255;
  const sin_cos a = sincos(turn * (kPi / 256.0));
  const double way = (a.cos * mean_x + a.sin * mean_y) / kLineUnit_px;
  *out = {(int8_t)(uint8_t)turn, (int8_t)(int)std::floor(way + 0.5)};
  return true;
}

// The line through an edge's pixels near by: mean and principal axis; through those connected with it where all
// together lie on none.
void edge_map::fit_lines() {
  for (int row = 0; row < (int)raster_->height_px; row++)
    for (int column = 0; column < (int)raster_->width_px; column++) {
      if (!tile_of(column, row)) {
        column |= kTile - 1;
        continue;
      }
      if (!is_edge(column, row)) continue;
      offset &to = offsets_[tile_of(column, row) + in_row(column, row)];
      moments all, connected;
      add_near(column, row, &all);
      if (!fit_line(all, &to)) {
        add_connected(column, row, &connected);
        if (!fit_line(connected, &to)) {
          to = {0, kNoLine};
          continue;
        }
      }
      const uint32_t pixel = tile_of(column, row) + in_row(column, row);
      faces_[pixel >> 2] = (uint8_t)(faces_[pixel >> 2] | (face_of(column, row, to) + 1) << 2 * (pixel & 3));
    }
}

bool edge_map::floor_at(double column, double row) const {
  return inside_map(column, row) && raster_->drivable[(size_t)(int)row * raster_->width_px + (size_t)(int)column];
}

int edge_map::face_of(int column, int row, const offset &line) const {
  if (!raster_->drivable) return 0;
  const unit_vector &a = normal_[(uint8_t)line.x];
  const auto beside = [&](double off_px) {
    return floor_at(column + 0.5 + off_px * a.cos, row + 0.5 + off_px * a.sin);
  };
  const double way = line.y * kLineUnit_px;
  return (int)beside(way + kBeside_px) - (int)beside(way - kBeside_px);
}

void edge_map::to_pixels(double x_m, double y_m, double *column, double *row) const {
  const double dx = x_m - raster_->origin_x_m, dy = y_m - raster_->origin_y_m;
  *column = (cos_yaw_ * dx + sin_yaw_ * dy) * pixels_a_metre_;
  *row = (double)raster_->height_px - (cos_yaw_ * dy - sin_yaw_ * dx) * pixels_a_metre_;
}

void edge_map::to_map(double column, double row, double *x_m, double *y_m) const {
  const double x = column * raster_->resolution_m;
  const double y = ((double)raster_->height_px - row) * raster_->resolution_m;
  *x_m = raster_->origin_x_m + cos_yaw_ * x - sin_yaw_ * y;
  *y_m = raster_->origin_y_m + sin_yaw_ * x + cos_yaw_ * y;
}

bool edge_map::inside_map(double column, double row) const {
  return column >= 0.0 && row >= 0.0 && column < raster_->width_px && row < raster_->height_px;
}

edge_line edge_map::nearest(double x_m, double y_m) const {
  edge_line out{};
  double u, v;
  to_pixels(x_m, y_m, &u, &v);
  if (!inside_map(u, v)) return out;
  int column = (int)u, row = (int)v;
  const int steps = distance_of(column, row);
  if (steps == kFar) return out;
  if (steps > 0) {
    const offset way = offsets_[tile_of(column, row) + in_row(column, row)];
    column += way.x;
    row += way.y;
  }
  const offset line = offsets_[tile_of(column, row) + in_row(column, row)];
  const double du = column + 0.5 - u, dv = row + 0.5 - v;
  out.distance_m = std::sqrt(du * du + dv * dv) * raster_->resolution_m;
  if (line.y == kNoLine) return out;
  const unit_vector &a = normal_[(uint8_t)line.x];
  out.offset_m = (a.cos * du + a.sin * dv + line.y * kLineUnit_px) * raster_->resolution_m;
  out.normal_x = cos_yaw_ * a.cos + sin_yaw_ * a.sin;  // rows grow downwards
  out.normal_y = sin_yaw_ * a.cos - cos_yaw_ * a.sin;
  const uint32_t pixel = tile_of(column, row) + in_row(column, row);
  out.face = (faces_[pixel >> 2] >> 2 * (pixel & 3) & 3) - 1;
  out.found = true;
  return out;
}

edge_line edge_map::nearest_seen(double x_m, double y_m, double ray_x_m, double ray_y_m) const {
  const auto away = [&](const edge_line &l) { return l.normal_x * ray_x_m + l.normal_y * ray_y_m < 0.0 ? -1 : 1; };
  const auto hidden = [&](const edge_line &l) { return l.face * away(l) > 0; };
  edge_line line = nearest(x_m, y_m);
  if (!line.found || !hidden(line)) return line;
  const double step_m = -away(line) * kFaceStep_m, step_x = step_m * line.normal_x, step_y = step_m * line.normal_y;
  for (int k = 1; k <= kFaceSteps; k++) {
    const double dx = k * step_x, dy = k * step_y;
    edge_line near = nearest(x_m + dx, y_m + dy);
    if (!near.found || hidden(near)) continue;
    near.offset_m += near.normal_x * dx + near.normal_y * dy;  // now from the place itself
    const edge_line foot = nearest(x_m + near.offset_m * near.normal_x, y_m + near.offset_m * near.normal_y);
    near.distance_m = std::sqrt(near.offset_m * near.offset_m + foot.distance_m * foot.distance_m);
    return near;
  }
  line.found = false;
  return line;
}

bool edge_map::drivable(double x_m, double y_m) const {
  double u, v;
  to_pixels(x_m, y_m, &u, &v);
  if (!inside_map(u, v)) return false;
  return !raster_->drivable || raster_->drivable[(size_t)(int)v * raster_->width_px + (size_t)(int)u];
}

}  // namespace wm
