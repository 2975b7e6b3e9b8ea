// SPDX-License-Identifier: Apache-2.0
// A symmetric matrix of which only the upper half is kept, for covariances of hundreds of states. Rows 2k and 2k + 1
// both begin at column 2k, so that every row begins at a pair of lanes; of each 2 x 2 block on the diagonal the lower
// element is kept, too, with the same bits. Kernels run on portable vectors of two doubles; no sum runs across lanes,
// so the scalar twins (namespace scalar) give the same bits on every machine.
#ifndef WAYMARK_ESTIMATOR_MATH_HALF_COVARIANCE_HPP
#define WAYMARK_ESTIMATOR_MATH_HALF_COVARIANCE_HPP

#include <cstddef>

#include "math/covariance.hpp"

namespace wm {

// A view: the memory belongs to who made it, 16-byte aligned, doubles(capacity) long. `capacity` is even.
struct half_covariance {
  double *data;
  int capacity;

  static constexpr size_t doubles(int capacity) {
    return static_cast<size_t>(capacity) * static_cast<size_t>(capacity) / 2 + static_cast<size_t>(capacity);
  }
  // row(i)[j] is the element (i, j) for j from first(i) on.
  static constexpr int first(int i) { return i & ~1; }
  double *row(int i) const {
    const std::ptrdiff_t k = i / 2;
    return data + 2 * k * (capacity - k + 1) + (i & 1) * (capacity - 2 * k) - 2 * k;
  }
  double at(int i, int j) const { return i <= j ? row(i)[j] : row(j)[i]; }
  void set(int i, int j, double value) const {
    if (first(i) <= first(j)) row(i)[j] = value;
    if (first(j) <= first(i)) row(j)[i] = value;
  }
};

// What one update does to the covariance: P - sum over k of w[k] w[k]' + e r' + r e'. `e` null: without the last two.
struct half_update {
  static constexpr int kRows = 3;  // at most: a bearing, a range and an elevation
  int rows;
  const double *w[kRows];
  const double *e, *r;
};

namespace vectors {

template <int kRows, bool kTransport>
inline void apply(const half_covariance &p, const half_update &u, int n) {
  constexpr int kSlots = kRows + (kRows == 0);  // no array of nothing
  const auto lanes = [](const double *v) { return reinterpret_cast<const pair *>(v); };
  for (int i = 0; i < n; i += 2) {
    pair *a = reinterpret_cast<pair *>(p.row(i) + i), *b = reinterpret_cast<pair *>(p.row(i + 1) + i);
    const pair *w[kSlots], *e = nullptr, *r = nullptr;
    pair wa[kSlots], wb[kSlots], ea{}, eb{}, ra{}, rb{};
    for (int k = 0; k < kRows; k++) {
      w[k] = lanes(u.w[k] + i);
      wa[k] = pair{u.w[k][i], u.w[k][i]};
      wb[k] = pair{u.w[k][i + 1], u.w[k][i + 1]};
    }
    if constexpr (kTransport) {
      e = lanes(u.e + i);
      r = lanes(u.r + i);
      ea = pair{u.e[i], u.e[i]};
      eb = pair{u.e[i + 1], u.e[i + 1]};
      ra = pair{u.r[i], u.r[i]};
      rb = pair{u.r[i + 1], u.r[i + 1]};
    }
    const int count = (n - i + 1) / 2;
    for (int j = 0; j < count; j++) {
      pair x = a[j], y = b[j];
      for (int k = 0; k < kRows; k++) {
        x -= wa[k] * w[k][j];
        y -= wb[k] * w[k][j];
      }
      if constexpr (kTransport) {
        x += ea * r[j] + ra * e[j];
        y += eb * r[j] + rb * e[j];
      }
      a[j] = x;
      b[j] = y;
    }
  }
}

inline void apply(const half_covariance &p, const half_update &u, int n) {
  switch (u.rows + (u.e ? 4 : 0)) {
    case 1: return apply<1, false>(p, u, n);
    case 2: return apply<2, false>(p, u, n);
    case 3: return apply<3, false>(p, u, n);
    case 4: return apply<0, true>(p, u, n);
    case 5: return apply<1, true>(p, u, n);
    case 6: return apply<2, true>(p, u, n);
    case 7: return apply<3, true>(p, u, n);
    default: return;
  }
}

}  // namespace vectors

namespace scalar {

inline void apply(const half_covariance &p, const half_update &u, int n) {
  for (int i = 0; i < even(n); i++)
    for (int j = half_covariance::first(i); j < even(n); j++) {
      double x = p.row(i)[j];
      for (int k = 0; k < u.rows; k++) x -= u.w[k][i] * u.w[k][j];
      if (u.e) x += u.e[i] * u.r[j] + u.r[i] * u.e[j];
      p.row(i)[j] = x;
    }
}

}  // namespace scalar

}  // namespace wm

#endif
