// SPDX-License-Identifier: Apache-2.0
#include "vision/edges_hough/hough.hpp"

#include <cstring>

#include "math/wide.hpp"
#include "waymark/vectors.h"

namespace wm {

namespace {

constexpr int kLanes = 16;  // bytes of a vector
typedef int16_t lanes __attribute__((vector_size(32), may_alias));
typedef int16_t lanes_anywhere __attribute__((vector_size(32), aligned(2), may_alias));
typedef uint32_t squares __attribute__((vector_size(32)));
typedef int16_t half_lanes __attribute__((vector_size(16)));

// Shift over `part` rows of a line that shifts by t columns over `whole` rows, rounded.
int part_of(int t, int part, int whole) { return whole > 1 ? (2 * t * (part - 1) + whole - 1) / (2 * (whole - 1)) : 0; }

// Plans the sums of rows first .. first + count - 1, slopes 0 .. count - 1, into the same rows of plane `to` (0 or 1);
// the halves' sums are made in the other one. A line of slope t begins at most t columns left of the window: the rest
// of a row is 0 in both planes.
void plan(hough_work *work, int to, int side, int first, int count) {
  if (count == 1) return;  // both planes begin with the window itself
  const int upper = count / 2, lower = count - upper;
  plan(work, 1 - to, side, first, upper);
  plan(work, 1 - to, side, first + upper, lower);
  const int begin = (side - count) / kLanes * kLanes, end = (2 * side - 1 + kLanes - 1) / kLanes * kLanes;
  constexpr int kPlane = kHoughSideMax * kHoughStride;
  for (int t = 0; t < count; t++) {
    const int above = part_of(t, upper, count), below = part_of(t, lower, count);
    const int into = to * kPlane + begin, from = (1 - to) * kPlane + begin;
    work->sum[work->sums++] = {static_cast<uint16_t>(into + (first + t) * kHoughStride),
                               static_cast<uint16_t>(from + (first + above) * kHoughStride),
                               static_cast<uint16_t>(from + (first + upper + below) * kHoughStride + t - below),
                               static_cast<uint16_t>((end - begin) / kLanes)};
  }
}

WM_KERNEL void add_rows(hough_work *work) {
  int16_t *values = work->a.sums;
  for (int i = 0; i < work->sums; i++) {
    const hough_sum s = work->sum[i];
    for (int k = 0; k < s.vectors * kLanes; k += kLanes)
      *reinterpret_cast<lanes *>(values + s.to + k) = *reinterpret_cast<const lanes *>(values + s.a + k) +
                                                      *reinterpret_cast<const lanes_anywhere *>(values + s.b + k);
  }
}

void add_rows_plain(hough_work *work) { add_rows(work); }
#if WM_HAS_WIDE
WM_WIDE void add_rows_wide(hough_work *work) { add_rows(work); }
#endif

void add_rows_scalar(hough_work *work) {
  int16_t *values = work->a.sums;
  for (int i = 0; i < work->sums; i++) {
    const hough_sum s = work->sum[i];
    for (int k = 0; k < s.vectors * kLanes; k++)
      values[s.to + k] = static_cast<int16_t>(values[s.a + k] + values[s.b + k]);
  }
}

// Sum of the squares of a row's sums. A lane holds at most 8 of the longest window's, 2.7e8 each.
WM_KERNEL uint64_t sum_of_squares(const int16_t *row, int vectors) {
  squares sum = {};
  for (int i = 0; i < vectors; i++) {
    half_lanes v;
    std::memcpy(&v, row + i * (kLanes / 2), sizeof v);
    const squares wide = __builtin_convertvector(v, squares);
    sum += wide * wide;
  }
  uint64_t total = 0;
  for (int k = 0; k < kLanes / 2; k++) total += sum[k];
  return total;
}

WM_KERNEL int most_varied(const hough_plane &plane, int side, uint64_t *most) {
  int best = 0;
  *most = 0;
  for (int t = 0; t < side; t++) {
    const uint64_t sum = sum_of_squares(plane.sums + t * kHoughStride, (2 * side + 6) / 8);
    if (sum > *most) {
      *most = sum;
      best = t;
    }
  }
  return best;
}

int most_varied_plain(const hough_plane &plane, int side, uint64_t *most) { return most_varied(plane, side, most); }
#if WM_HAS_WIDE
WM_WIDE int most_varied_wide(const hough_plane &plane, int side, uint64_t *most) {
  return most_varied(plane, side, most);
}
#endif

typedef uint8_t bytes __attribute__((vector_size(8)));

// A row of the window, from `from` on to the right or to the left.
void load_row(const uint8_t *from, int side, int column, int16_t *out) {
  int x = 0;
  for (; column == 1 && x + 8 <= side; x += 8) {
    bytes v;
    std::memcpy(&v, from + x, sizeof v);
    const half_lanes wide = __builtin_convertvector(v, half_lanes);
    std::memcpy(out + x, &wide, sizeof wide);
  }
  for (; column == -1 && x + 8 <= side; x += 8) {
    bytes v;
    std::memcpy(&v, from - x - 7, sizeof v);
    const half_lanes wide = __builtin_convertvector(v, half_lanes);
    const half_lanes turned = WM_SHUFFLE(wide, wide, 7, 6, 5, 4, 3, 2, 1, 0);
    std::memcpy(out + x, &turned, sizeof turned);
  }
  for (; x < side; x++) out[x] = from[x * column];
}

const hough_plane *run(const uint8_t *in, int side, int row, int column, void (*add)(hough_work *), hough_work *work) {
  static_assert(2 * kHoughSideMax * kHoughStride <= UINT16_MAX, "places of values fit 16 bits");
  if (work->planned != side) {
    work->planned = side;
    work->sums = 0;
    plan(work, 0, side, 0, side);
  }
  for (int y = 0; y < side; y++) {
    int16_t *a = work->a.sums + y * kHoughStride;
    std::memset(a, 0, static_cast<size_t>(side - 1) * sizeof *a);
    load_row(in + y * row, side, column, a + side - 1);
    std::memcpy(work->b.sums + y * kHoughStride, a, static_cast<size_t>(2 * side - 1) * sizeof *a);
  }
  add(work);
  return &work->a;
}

int line_column(int t, int count, int y) {
  if (count == 1) return 0;
  const int upper = count / 2, lower = count - upper;
  const int above = part_of(t, upper, count), below = part_of(t, lower, count);
  return y < upper ? line_column(above, upper, y) : t - below + line_column(below, lower, y - upper);
}

}  // namespace

const hough_plane *hough_transform(const uint8_t *in, int side, int row, int column, hough_work *work) {
#if WM_HAS_WIDE
  if (wm_vectors_wide()) return run(in, side, row, column, add_rows_wide, work);
#endif
  return run(in, side, row, column, add_rows_plain, work);
}

const hough_plane *hough_transform_scalar(const uint8_t *in, int side, int row, int column, hough_work *work) {
  return run(in, side, row, column, add_rows_scalar, work);
}

int hough_line(int side, int t, int y) { return line_column(t, side, y); }

// The sums of every slope add up to the whole window, so the squares alone order the variances.
hough_peak hough_find(const hough_plane &plane, int side) {
  uint64_t squares_sum;
#if WM_HAS_WIDE
  const int t =
      wm_vectors_wide() ? most_varied_wide(plane, side, &squares_sum) : most_varied_plain(plane, side, &squares_sum);
#else
  const int t = most_varied_plain(plane, side, &squares_sum);
#endif
  const int offsets = 2 * side - 1;
  const int16_t *row = plane.sums + t * kHoughStride;
  hough_peak best = {t, 0, 0, 0.0F};
  int64_t sum = 0;
  for (int o = 0; o < offsets; o++) {
    sum += row[o];
    if (row[o] <= best.sum) continue;
    best.sum = row[o];
    best.offset = o;
  }
  const double mean = static_cast<double>(sum) / offsets;
  best.variance = static_cast<float>(static_cast<double>(squares_sum) / offsets - mean * mean);
  return best;
}

}  // namespace wm
