// SPDX-License-Identifier: Apache-2.0
#include "math/half_covariance.hpp"

#include "math/wide.hpp"
#include "waymark/vectors.h"

namespace wm::vectors {
namespace {

// Lanes of a kernel; a row begins at a multiple of 16 bytes. A type alone, as template argument, would lose its
// alignment.
typedef double quad __attribute__((vector_size(32), may_alias, aligned(16)));
struct two_lanes {
  static constexpr int kWidth = 2;
  WM_KERNEL static const pair &load(const double *from) { return *reinterpret_cast<const pair *>(from); }
  WM_KERNEL static pair &at(double *to) { return *reinterpret_cast<pair *>(to); }
};
struct four_lanes {
  static constexpr int kWidth = 4;
  WM_KERNEL static const quad &load(const double *from) { return *reinterpret_cast<const quad *>(from); }
  WM_KERNEL static quad &at(double *to) { return *reinterpret_cast<quad *>(to); }
};

// The vectors' elements of two rows, i and i + 1, in registers: stores to P may alias them.
template <int kRows, int kTurns>
struct row_factors {
  double wa[kRows + 1], wb[kRows + 1], ea[kTurns + 1], eb[kTurns + 1], ra[kTurns + 1], rb[kTurns + 1];
};

// Columns j of these two rows.
template <class lanes, int kRows, int kTurns>
WM_KERNEL void add_at(double *a, double *b, const half_update &u, const row_factors<kRows, kTurns> &f, int j) {
  auto x = lanes::load(a + j), y = lanes::load(b + j);
#pragma GCC unroll 4
  for (int k = 0; k < kRows; k++) {
    const auto w = lanes::load(u.w[k] + j);
    x -= f.wa[k] * w;
    y -= f.wb[k] * w;
  }
#pragma GCC unroll 4
  for (int k = 0; k < kTurns; k++) {
    const auto e = lanes::load(u.e[k] + j), r = lanes::load(u.r[k] + j);
    x += f.ea[k] * r + f.ra[k] * e;
    y += f.eb[k] * r + f.rb[k] * e;
  }
  lanes::at(a + j) = x;
  lanes::at(b + j) = y;
}

template <int kRows, int kTurns>
WM_KERNEL void take_factors(const half_update &u, int i, row_factors<kRows, kTurns> *f) {
#pragma GCC unroll 4
  for (int k = 0; k < kRows; k++) f->wa[k] = u.w[k][i], f->wb[k] = u.w[k][i + 1];
#pragma GCC unroll 4
  for (int k = 0; k < kTurns; k++) {
    f->ea[k] = u.e[k][i], f->eb[k] = u.e[k][i + 1];
    f->ra[k] = u.r[k][i], f->rb[k] = u.r[k][i + 1];
  }
}

// Rows i and i + 1, from the diagonal on; i lies in span s.
template <class lanes, int kRows, int kTurns>
WM_KERNEL void pass_rows(const half_covariance &p, const half_update &u, const filled_states &of, int s, int i) {
  row_factors<kRows, kTurns> f;
  take_factors(u, i, &f);
  double *a = p.row(i), *b = p.row(i + 1);
  for (int t = s; t < of.count; t++) {
    const int to = of.span[t].to;
    int j = t == s ? i : of.span[t].from;
    for (; j + lanes::kWidth <= to; j += lanes::kWidth) add_at<lanes, kRows, kTurns>(a, b, u, f, j);
    if constexpr (lanes::kWidth > 2)
      if (j < to) add_at<two_lanes, kRows, kTurns>(a, b, u, f, j);
  }
}

template <class lanes, int kRows, int kTurns>
WM_KERNEL void pass(const half_covariance &p, const half_update &update, const filled_states &of) {
  const half_update u = update;
  for (int s = 0; s < of.count; s++)
    for (int i = of.span[s].from; i < of.span[s].to; i += 2) pass_rows<lanes, kRows, kTurns>(p, u, of, s, i);
}

template <int kRows, int kTurns>
void pass_plain(const half_covariance &p, const half_update &u, const filled_states &of) {
  pass<two_lanes, kRows, kTurns>(p, u, of);
}
#if WM_HAS_WIDE
template <int kRows, int kTurns>
WM_WIDE void pass_wide(const half_covariance &p, const half_update &u, const filled_states &of) {
  pass<four_lanes, kRows, kTurns>(p, u, of);
}
#endif

template <int kRows, int kTurns>
void pass_on(const half_covariance &p, const half_update &u, const filled_states &of) {
#if WM_HAS_WIDE
  if (wm_vectors_wide()) return pass_wide<kRows, kTurns>(p, u, of);
#endif
  pass_plain<kRows, kTurns>(p, u, of);
}

// In rows before its own a column is strided: row j + 2 begins 2 capacity - 2 j - 2 doubles behind row j.
template <class lanes>
WM_KERNEL void add_column(const half_view &p, int state, double factor, const filled_states &of, double *out) {
  const int own = half_view::first(state);
  for (int s = 0; s < of.count; s++) {
    int j = of.span[s].from;
    const int to = of.span[s].to, before = to < own ? to : own;
    if (j < before) {
      const double *a = p.row(j) + state;
      for (; j < before; j += 2) {
        out[j] += factor * a[0];
        out[j + 1] += factor * a[p.capacity - j];
        a += 2 * (p.capacity - j - 1);
      }
    }
    const double *row = p.row(state);
    for (; j + lanes::kWidth <= to; j += lanes::kWidth) lanes::at(out + j) += factor * lanes::load(row + j);
    if constexpr (lanes::kWidth > 2)
      if (j < to) two_lanes::at(out + j) += factor * two_lanes::load(row + j);
  }
}

void project_plain(const half_view &p, const int *state, const double *factor, int count, const filled_states &of,
                   double *out) {
  for (int k = 0; k < count; k++)
    if (factor[k] != 0.0) add_column<two_lanes>(p, state[k], factor[k], of, out);
}
#if WM_HAS_WIDE
WM_WIDE void project_wide(const half_view &p, const int *state, const double *factor, int count,
                          const filled_states &of, double *out) {
  for (int k = 0; k < count; k++)
    if (factor[k] != 0.0) add_column<four_lanes>(p, state[k], factor[k], of, out);
}
#endif

}  // namespace

void apply(const half_covariance &p, const half_update &u, const filled_states &of) {
  switch (u.rows + 5 * u.turns) {
    case 1: return pass_on<1, 0>(p, u, of);
    case 2: return pass_on<2, 0>(p, u, of);
    case 3: return pass_on<3, 0>(p, u, of);
    case 4: return pass_on<4, 0>(p, u, of);
    case 5: return pass_on<0, 1>(p, u, of);
    case 6: return pass_on<1, 1>(p, u, of);
    case 7: return pass_on<2, 1>(p, u, of);
    case 8: return pass_on<3, 1>(p, u, of);
    case 15: return pass_on<0, 3>(p, u, of);
    default: return;
  }
}

void project(const half_view &p, const int *state, const double *factor, int count, const filled_states &of,
             double *out) {
#if WM_HAS_WIDE
  if (wm_vectors_wide()) return project_wide(p, state, factor, count, of, out);
#endif
  project_plain(p, state, factor, count, of, out);
}

}  // namespace wm::vectors
