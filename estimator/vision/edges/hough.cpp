// SPDX-License-Identifier: Apache-2.0
#include "vision/edges/hough.hpp"

#include <cstring>

namespace wm {

namespace {

constexpr int kLanes = 8;
typedef int16_t lanes __attribute__((vector_size(16)));
typedef int16_t lanes_anywhere __attribute__((vector_size(16), aligned(2), may_alias));
typedef float floats __attribute__((vector_size(16)));
typedef int32_t ints __attribute__((vector_size(16)));
typedef int16_t quarter __attribute__((vector_size(8)));

// out[o] = a[o] + b[o + shift] for o from `begin` to before `end`, multiples of the lanes.
struct add_vectors {
  static void rows(const int16_t *a, const int16_t *b, int begin, int end, int16_t *out) {
    for (int o = begin; o < end; o += kLanes)
      *reinterpret_cast<lanes *>(out + o) =
          *reinterpret_cast<const lanes *>(a + o) + *reinterpret_cast<const lanes_anywhere *>(b + o);
  }
};

struct add_scalars {
  static void rows(const int16_t *a, const int16_t *b, int begin, int end, int16_t *out) {
    for (int o = begin; o < end; o++) out[o] = static_cast<int16_t>(a[o] + b[o]);
  }
};

// The way of a part of `part` rows on a line that goes over t columns in `whole` rows, to the nearest.
int part_of(int t, int part, int whole) { return whole > 1 ? (2 * t * (part - 1) + whole - 1) / (2 * (whole - 1)) : 0; }

// Sums of rows first .. first + count - 1, slopes 0 .. count - 1, into plane rows first .. of `to`; `spare` is the
// other plane, where the halves' sums are made. A line of slope t begins at most t columns left of the window: the rest
// of a row is 0 in both planes.
template <class Add>
void transform(hough_plane *to, hough_plane *spare, int side, int first, int count) {
  if (count == 1) return;  // both planes begin with the window itself
  const int upper = count / 2, lower = count - upper;
  transform<Add>(spare, to, side, first, upper);
  transform<Add>(spare, to, side, first + upper, lower);
  const int begin = (side - count) / kLanes * kLanes, end = (2 * side - 1 + kLanes - 1) / kLanes * kLanes;
  for (int t = 0; t < count; t++) {
    const int above = part_of(t, upper, count), below = part_of(t, lower, count);
    const int16_t *a = spare->sums + (first + above) * kHoughStride;
    const int16_t *b = spare->sums + (first + upper + below) * kHoughStride;
    Add::rows(a, b + (t - below), begin, end, to->sums + (first + t) * kHoughStride);
  }
}

typedef uint8_t bytes __attribute__((vector_size(kLanes)));

// A row of the window, from `from` on to the right or to the left.
void load_row(const uint8_t *from, int side, int column, int16_t *out) {
  int x = 0;
  for (; column == 1 && x + kLanes <= side; x += kLanes) {
    bytes v;
    std::memcpy(&v, from + x, sizeof v);
    const lanes wide = __builtin_convertvector(v, lanes);
    std::memcpy(out + x, &wide, sizeof wide);
  }
  for (; column == -1 && x + kLanes <= side; x += kLanes) {
    bytes v;
    std::memcpy(&v, from - x - (kLanes - 1), sizeof v);
    const lanes wide = __builtin_convertvector(v, lanes);
    const lanes turned = __builtin_shufflevector(wide, wide, 7, 6, 5, 4, 3, 2, 1, 0);
    std::memcpy(out + x, &turned, sizeof turned);
  }
  for (; x < side; x++) out[x] = from[x * column];
}

template <class Add>
const hough_plane *run(const uint8_t *in, int side, int row, int column, hough_work *work) {
  for (int y = 0; y < side; y++) {
    auto *a = reinterpret_cast<lanes *>(work->a.sums + y * kHoughStride);
    auto *b = reinterpret_cast<lanes *>(work->b.sums + y * kHoughStride);
    for (int i = 0; i * kLanes < side - 1; i++) a[i] = lanes{};
    load_row(in + y * row, side, column, work->a.sums + y * kHoughStride + side - 1);
    for (int i = 0; i * kLanes < 2 * side - 1; i++) b[i] = a[i];
  }
  transform<Add>(&work->a, &work->b, side, 0, side);
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
  return run<add_vectors>(in, side, row, column, work);
}

const hough_plane *hough_transform_scalar(const uint8_t *in, int side, int row, int column, hough_work *work) {
  return run<add_scalars>(in, side, row, column, work);
}

int hough_line(int side, int t, int y) { return line_column(t, side, y); }

hough_peak hough_find(const hough_plane &plane, int side) {
  hough_peak best = {0, 0, 0, -1.0F};
  const int offsets = 2 * side - 1, vectors = (offsets + 3) / 4;  // the fill behind them is 0
  for (int t = 0; t < side; t++) {
    const int16_t *row = plane.sums + t * kHoughStride;
    floats sum = {0, 0, 0, 0}, squares = {0, 0, 0, 0};
    for (int i = 0; i < vectors; i++) {
      quarter p;
      std::memcpy(&p, row + 4 * i, sizeof p);
      const floats v = __builtin_convertvector(__builtin_convertvector(p, ints), floats);
      sum += v;
      squares += v * v;
    }
    const float s = (sum[0] + sum[1]) + (sum[2] + sum[3]), q = (squares[0] + squares[1]) + (squares[2] + squares[3]);
    const auto n = static_cast<float>(offsets);
    const float variance = q / n - (s / n) * (s / n);
    if (variance > best.variance) best = {t, 0, 0, variance};
  }
  const int16_t *row = plane.sums + best.t * kHoughStride;
  for (int o = 0; o < offsets; o++)
    if (row[o] > best.sum) {
      best.sum = row[o];
      best.offset = o;
    }
  return best;
}

}  // namespace wm
