// SPDX-License-Identifier: Apache-2.0
#include "vision/lines/votes.hpp"

#include <cstring>
#include <initializer_list>

namespace wm {

namespace {

constexpr int kGapMax_rows = 5;  // consecutive rows without a vote that end a run: a handle, a sign. Not swept

struct eight {
  static constexpr int kLanes = 8;  // numbers of 16 bits in a vector
  typedef int16_t lanes __attribute__((vector_size(16), may_alias));
  typedef int16_t lanes_anywhere __attribute__((vector_size(16), aligned(2), may_alias));
  static lanes load(const int16_t *p) { return *reinterpret_cast<const lanes *>(p); }
  static lanes load_anywhere(const int16_t *p) { return *reinterpret_cast<const lanes_anywhere *>(p); }
  static void store(int16_t *p, lanes v) { *reinterpret_cast<lanes *>(p) = v; }
  static lanes all(int v) { return lanes{} + static_cast<int16_t>(v); }
  static lanes choose(lanes mask, lanes a, lanes b) { return (mask & a) | (~mask & b); }
};

struct one {
  static constexpr int kLanes = 1;  // no vector
  typedef int16_t lanes;
  static lanes load(const int16_t *p) { return *p; }
  static lanes load_anywhere(const int16_t *p) { return *p; }
  static void store(int16_t *p, int v) { *p = static_cast<int16_t>(v); }
  static lanes all(int v) { return static_cast<int16_t>(v); }
  static lanes choose(bool condition, lanes a, lanes b) { return condition ? a : b; }
};

// Mean of `Half` columns from each column on minus that of those before it, in 1/kVoteScale of a grey level. Column c
// is the edge between c - 1 and c.
template <class V, int Half>
void slopes(const int16_t *grey, int columns, int16_t *out) {
  constexpr int kShift = (Half == 2 ? 1 : Half == 4 ? 2 : 3) + 2;  // kPolarScale / kVoteScale = 4
  static_assert(kPolarScale == 4 * kVoteScale && 255 * kPolarScale * 8 <= INT16_MAX);
  for (int c = 0; c < columns; c += V::kLanes) {
    typename V::lanes after = V::load_anywhere(grey + c), before = V::load_anywhere(grey + c - 1);
    for (int k = 1; k < Half; k++) {
      after = static_cast<typename V::lanes>(after + V::load_anywhere(grey + c + k));
      before = static_cast<typename V::lanes>(before + V::load_anywhere(grey + c - 1 - k));
    }
    V::store(out + c, (after - before) >> kShift);
  }
}

// The largest sum of consecutive rows, row by row (J. Kadane's algorithm, for all columns at once).
template <class V>
void add_row(const int16_t *slope, int columns, int row, int sign, int threshold, const running_votes &now,
             const votes &best) {
  using lanes = typename V::lanes;
  const lanes most = V::all(kVoteLimit * threshold), least = V::all(threshold), zero = V::all(0), one = V::all(1),
              gap_max = V::all(kGapMax_rows), here = V::all(row), next = V::all(row + 1);
  for (int c = 0; c < columns; c += V::kLanes) {
    lanes vote = V::load(slope + c);
    if (sign < 0) vote = static_cast<lanes>(-vote);
    vote = V::choose(vote > most, most, vote);
    lanes sum = static_cast<lanes>(V::load(now.sum + c) + vote - least), first = V::load(now.first + c);
    lanes against = static_cast<lanes>(V::load(now.against + c) + one);
    against = V::choose(vote > least, zero, against);
    V::store(now.against + c, against);
    const auto lost = (sum < zero) | (against > gap_max);
    sum = V::choose(lost, zero, sum);
    first = V::choose(lost, next, first);
    V::store(now.sum + c, sum);
    V::store(now.first + c, first);
    const lanes before = V::load(best.sum + c);
    const auto better = sum > before;
    V::store(best.sum + c, V::choose(better, sum, before));
    V::store(best.first + c, V::choose(better, first, V::load(best.first + c)));
    V::store(best.last + c, V::choose(better, here, V::load(best.last + c)));
  }
}

template <class V>
void count(const polar_view &view, int threshold, vote_work *work) {
  const size_t bytes = static_cast<size_t>(view.columns) * sizeof(int16_t);
  for (vote_side *side : {&work->rise, &work->fall})
    for (int16_t *numbers :
         {side->best.sum, side->best.first, side->best.last, side->now.sum, side->now.first, side->now.against})
      std::memset(numbers, 0, bytes);
  for (int r = 0; r < view.rows; r++) {
    switch (view.row[r].half) {
      case 2: slopes<V, 2>(view.line(r), view.columns, work->slope); break;
      case 4: slopes<V, 4>(view.line(r), view.columns, work->slope); break;
      default: slopes<V, 8>(view.line(r), view.columns, work->slope); break;
    }
    add_row<V>(work->slope, view.columns, r, 1, threshold, work->rise.now, work->rise.best);
    add_row<V>(work->slope, view.columns, r, -1, threshold, work->fall.now, work->fall.best);
  }
}

}  // namespace

void count_votes(const polar_view &view, int threshold, vote_work *work) { count<eight>(view, threshold, work); }
void count_votes_scalar(const polar_view &view, int threshold, vote_work *work) { count<one>(view, threshold, work); }

}  // namespace wm
