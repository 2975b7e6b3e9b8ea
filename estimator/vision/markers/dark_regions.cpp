// SPDX-License-Identifier: Apache-2.0
#include "vision/markers/dark_regions.hpp"

#include <cstring>

#include "waymark/internal/memory/layout.hpp"

namespace wm {

namespace {

constexpr int32_t kTile = 4;    // px, as in the paper
constexpr int32_t kLanes = 16;  // bytes of a vector
using bytes16 = uint8_t __attribute__((vector_size(kLanes)));

bytes16 load(const uint8_t *from) {
  bytes16 out;
  std::memcpy(&out, from, sizeof out);
  return out;
}
void store(uint8_t *to, const bytes16 &value) { std::memcpy(to, &value, sizeof value); }
bytes16 less_of(const bytes16 &a, const bytes16 &b) { return a < b ? a : b; }
bytes16 more_of(const bytes16 &a, const bytes16 &b) { return a > b ? a : b; }

int32_t tiles_of(int32_t px) { return (px + kTile - 1) / kTile; }
int32_t rounded(int32_t px) { return (px + kLanes - 1) / kLanes * kLanes; }

// Minimum and maximum of each column over `rows` rows, `count` columns.
void of_columns(const uint8_t *grey, size_t stride, int32_t rows, int32_t count, uint8_t *least, uint8_t *most) {
  int32_t u = 0;
  for (; u + kLanes <= count; u += kLanes) {
    bytes16 low = load(grey + u), high = low;
    for (int32_t i = 1; i < rows; i++) {
      const bytes16 row = load(grey + static_cast<size_t>(i) * stride + u);
      low = less_of(low, row);
      high = more_of(high, row);
    }
    store(least + u, low);
    store(most + u, high);
  }
  for (; u < count; u++) {
    least[u] = most[u] = grey[u];
    for (int32_t i = 1; i < rows; i++) {
      const uint8_t value = grey[static_cast<size_t>(i) * stride + static_cast<size_t>(u)];
      if (value < least[u]) least[u] = value;
      if (value > most[u]) most[u] = value;
    }
  }
}

// Minimum and maximum of each tile; the tile at (x, y) is at (y + 1) * across + x + 1. The rim is neutral.
void make_tiles(dark_work *work, const wm_frame &frame) {
  const int32_t columns = tiles_of(work->width), rows = tiles_of(work->height), across = columns + 2;
  const size_t all = static_cast<size_t>(across) * static_cast<size_t>(rows + 2);
  std::memset(work->least, 255, all);
  std::memset(work->most, 0, all);
  uint8_t *low = work->columns, *high = work->columns + rounded(work->width) + kLanes;
  for (int32_t y = 0; y < rows; y++) {
    const int32_t top = y * kTile, count = work->height - top < kTile ? work->height - top : kTile;
    of_columns(frame.grey + static_cast<size_t>(top) * frame.stride_bytes, frame.stride_bytes, count, work->width, low,
               high);
    for (int32_t u = work->width; u < columns * kTile; u++) low[u] = low[u - 1], high[u] = high[u - 1];
    uint8_t *least = work->least + (y + 1) * across + 1, *most = work->most + (y + 1) * across + 1;
    for (int32_t x = 0; x < columns; x++) {
      const uint8_t *a = low + x * kTile, *b = high + x * kTile;
      const uint8_t a0 = a[0] < a[1] ? a[0] : a[1], a1 = a[2] < a[3] ? a[2] : a[3];
      const uint8_t b0 = b[0] > b[1] ? b[0] : b[1], b1 = b[2] > b[3] ? b[2] : b[3];
      least[x] = a0 < a1 ? a0 : a1;
      most[x] = b0 > b1 ? b0 : b1;
    }
  }
}

// The threshold of each pixel of a row of tiles; `flat` where there is no contrast.
void make_threshold(dark_work *work, int32_t y, int contrast, int flat) {
  const int32_t columns = tiles_of(work->width), across = columns + 2;
  const uint8_t *least = work->least + y * across, *most = work->most + y * across;
  for (int32_t x = 0; x < columns; x++) {
    int low = 255, high = 0;
    for (int32_t i = 0; i < 3; i++)
      for (int32_t k = 0; k < 3; k++) {
        const int a = least[i * across + x + k], b = most[i * across + x + k];
        low = a < low ? a : low;
        high = b > high ? b : high;
      }
    const int middle = high - low < contrast ? flat : low + (high - low) / 2;
    std::memset(work->threshold + x * kTile, middle, kTile);
  }
}

// Pixels below the threshold, or above it. Without contrast no pixel is: the threshold is 0 or 255 there.
template <bool kIsLight>
void make_mask(dark_work *work, const wm_frame &frame, int contrast) {
  const int32_t rows = tiles_of(work->height);
  for (int32_t y = 0; y < rows; y++) {
    make_threshold(work, y, contrast, kIsLight ? 255 : 0);
    for (int32_t v = y * kTile; v < (y + 1) * kTile && v < work->height; v++) {
      const uint8_t *grey = frame.grey + static_cast<size_t>(v) * frame.stride_bytes;
      uint8_t *mask = work->mask + static_cast<size_t>(v + 1) * static_cast<size_t>(work->stride) + 1;
      int32_t u = 0;
      for (; u + kLanes <= work->width; u += kLanes) {
        const bytes16 here = load(grey + u), limit = load(work->threshold + u);
        store(mask + u, reinterpret_cast<bytes16>(kIsLight ? here > limit : here < limit));
      }
      for (; u < work->width; u++)
        mask[u] = (kIsLight ? grey[u] > work->threshold[u] : grey[u] < work->threshold[u]) ? 255 : 0;
    }
  }
}

uint32_t root_of(dark_run *runs, uint32_t i) {
  while (runs[i].parent != i) {
    runs[i].parent = runs[runs[i].parent].parent;
    i = runs[i].parent;
  }
  return i;
}

// Merges the later region into the earlier one.
void join(dark_run *runs, uint32_t a, uint32_t b) {
  a = root_of(runs, a);
  b = root_of(runs, b);
  if (a == b) return;
  if (b < a) {
    const uint32_t kept = a;
    a = b;
    b = kept;
  }
  runs[b].parent = a;
  if (runs[b].left < runs[a].left) runs[a].left = runs[b].left;
  if (runs[b].right > runs[a].right) runs[a].right = runs[b].right;
  if (runs[b].bottom > runs[a].bottom) runs[a].bottom = runs[b].bottom;
}

// Runs of a row: eight pixels at once where all are equal.
uint32_t runs_of_row(const uint8_t *mask, int32_t width, uint16_t row, uint32_t next, dark_run *runs) {
  int32_t u = 0;
  const auto skip = [&](uint8_t value) {
    for (;;) {
      uint64_t eight;
      while (u + 8 <= width) {
        std::memcpy(&eight, mask + u, sizeof eight);
        if (eight != (value ? ~UINT64_C(0) : 0)) break;
        u += 8;
      }
      while (u < width && mask[u] == value) u++;
      return;
    }
  };
  while (true) {
    skip(0);
    if (u >= width) return next;
    const auto begin = static_cast<uint16_t>(u);
    skip(255);
    const auto end = static_cast<uint16_t>(u);
    runs[next] = {begin, end, row, begin, static_cast<uint16_t>(end - 1), row, next};
    next++;
  }
}

// Joins runs of a row and the one above that touch, also over a corner.
void join_rows(dark_run *runs, uint32_t above, uint32_t here, uint32_t end) {
  for (uint32_t a = above, b = here; a < here && b < end;) {
    if (runs[a].begin <= runs[b].end && runs[b].begin <= runs[a].end) join(runs, a, b);
    if (runs[a].end < runs[b].end) {
      a++;
    } else {
      b++;
    }
  }
}

}  // namespace

size_t dark_work_lay_out(dark_work *out, uint32_t width, uint32_t height, uint8_t *memory) {
  memory_layout layout(memory, 0);
  *out = dark_work{};
  out->width = static_cast<int32_t>(width);
  out->height = static_cast<int32_t>(height);
  out->stride = out->width + 2;
  out->border_max = 4 * (out->width + out->height);
  const size_t tiles = static_cast<size_t>(tiles_of(out->width) + 2) * static_cast<size_t>(tiles_of(out->height) + 2);
  const size_t row = static_cast<size_t>(rounded(out->width)) + kLanes;
  const size_t mask_bytes = static_cast<size_t>(out->stride) * (height + 2);
  out->mask = layout.take<uint8_t>(mask_bytes);
  out->least = layout.take<uint8_t>(tiles);
  out->most = layout.take<uint8_t>(tiles);
  out->columns = layout.take<uint8_t>(2 * row);
  out->threshold = layout.take<uint8_t>(row);
  out->runs = layout.take<dark_run>((static_cast<size_t>(width) / 2 + 1) * height);
  out->first = layout.take<uint32_t>(static_cast<size_t>(height) + 1);
  out->border = layout.take<border_point>(static_cast<size_t>(out->border_max));
  if (memory) std::memset(out->mask, 0, mask_bytes);
  return layout.bytes();
}

void find_regions(dark_work *work, const wm_frame &frame, int contrast, bool is_light) {
  make_tiles(work, frame);
  is_light ? make_mask<true>(work, frame, contrast) : make_mask<false>(work, frame, contrast);
  uint32_t next = 0;
  for (int32_t v = 0; v < work->height; v++) {
    work->first[v] = next;
    const uint8_t *mask = work->mask + static_cast<size_t>(v + 1) * static_cast<size_t>(work->stride) + 1;
    next = runs_of_row(mask, work->width, static_cast<uint16_t>(v), next, work->runs);
    if (v > 0) join_rows(work->runs, work->first[v - 1], work->first[v], next);
  }
  work->first[work->height] = next;
}

int32_t trace_border(dark_work *work, uint32_t region) {
  // Eight neighbours: to the right, then clockwise, v pointing down.
  static constexpr int32_t kDu[8] = {1, 1, 0, -1, -1, -1, 0, 1}, kDv[8] = {0, 1, 1, 1, 0, -1, -1, -1};
  const dark_run &run = work->runs[region];
  const border_point start = {run.begin, run.row};
  ptrdiff_t step[8];
  for (int i = 0; i < 8; i++) step[i] = static_cast<ptrdiff_t>(kDv[i]) * work->stride + kDu[i];
  const uint8_t *at = work->mask + static_cast<ptrdiff_t>(start.v + 1) * work->stride + start.u + 1;
  const uint8_t *const begin = at;
  border_point p = start;
  int32_t count = 0;
  // There is nothing above and to the left: the search for the first neighbour begins at the lower left,
  // counterclockwise.
  int back = 4, first_direction = -1;
  do {
    int direction = -1;
    for (int i = 1; i <= 8 && direction < 0; i++) {
      const int next = (back - i + 8) & 7;
      if (at[step[next]]) direction = next;
    }
    if (direction < 0) return 0;  // a single pixel
    if (at == begin && direction == first_direction) break;
    if (first_direction < 0) first_direction = direction;
    if (count == work->border_max) return 0;
    work->border[count++] = p;
    at += step[direction];
    p = {p.u + kDu[direction], p.v + kDv[direction]};
    back = (direction + 4) & 7;
  } while (true);
  return count;
}

}  // namespace wm
