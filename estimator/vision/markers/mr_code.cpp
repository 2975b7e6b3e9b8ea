// SPDX-License-Identifier: Apache-2.0
#include "waymark/mr_code.h"

#include <bit>

#include "vision/markers/bch.hpp"

namespace {

// Added to each word, because the code is linear: without it an all-white print would be identity 0. The test mr_code
// checks that regular patterns are far from all identities.
constexpr uint64_t kMask = UINT64_C(0x9A3C5D0E71B6482F);
constexpr uint64_t kParity = UINT64_C(1) << 63;  // the module beyond the code's 63

uint64_t with_parity(uint64_t word) { return std::popcount(word) % 2 ? word | kParity : word; }

}  // namespace

void wm_mr_vertex(int vertex, double xy[2]) {
  constexpr double kSin36 = 0.58778525229247314, kCos36 = 0.80901699437494745;
  constexpr double kSin18 = 0.30901699437494745, kCos18 = 0.95105651629515353;
  constexpr double kUnit[5][2] = {{0, -1}, {kCos18, -kSin18}, {kSin36, kCos36}, {-kSin36, kCos36}, {-kCos18, -kSin18}};
  for (int k = 0; k < 2; k++) xy[k] = WM_MR_CIRCUMRADIUS * kUnit[(vertex % 5 + 5) % 5][k];
}

int wm_mr_ink(uint64_t modules, double x, double y) {
  constexpr double kApothem = WM_MR_CIRCUMRADIUS * 0.80901699437494745;
  double out = 0;  // distance along the normal of the nearest side, in apothems
  for (int i = 0; i < 5; i++) {
    double a[2], b[2];
    wm_mr_vertex(i, a);
    wm_mr_vertex(i + 1, b);
    const double along = (x * (a[0] + b[0]) + y * (a[1] + b[1])) / (2 * kApothem * kApothem);
    if (along > out) out = along;
  }
  if (out > 1) return out > 2 - WM_MR_INNER ? -1 : 0;
  if (out > WM_MR_INNER) return 1;
  constexpr double kHalf = 0.5 * WM_MR_MODULE;
  if (x > -kHalf && x < kHalf && y > WM_MR_TIP_Y - kHalf && y < WM_MR_TIP_Y + kHalf) return 1;
  const double column = (x - WM_MR_CODE_LEFT) / WM_MR_MODULE, row = (y - WM_MR_CODE_TOP) / WM_MR_MODULE;
  if (!(column >= 0 && column < 8 && row >= 0 && row < 8)) return 0;
  return static_cast<int>(modules >> (8 * static_cast<int>(row) + static_cast<int>(column)) & 1);
}

uint64_t wm_mr_encode(uint32_t id) { return id < WM_MR_IDS ? with_parity(wm::bch_encode(id)) ^ kMask : 0; }

int wm_mr_decode(uint64_t modules, uint32_t *id, int *wrong) {
  const uint64_t read = modules ^ kMask;
  uint64_t word = read & ~kParity;
  if (wm::bch_correct(&word, WM_MR_CORRECTED) < 0) return 0;
  const int flipped = std::popcount(with_parity(word) ^ read);
  if (flipped > WM_MR_CORRECTED) return 0;
  *id = static_cast<uint32_t>(word >> (wm::kBchLength - wm::kBchData));
  *wrong = flipped;
  return 1;
}
