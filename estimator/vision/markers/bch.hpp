// SPDX-License-Identifier: Apache-2.0
// The binary BCH code (63, 16) over GF(64): corrects 11 errors, d = 23. Words are bits of a uint64_t, bit i the
// coefficient of x^i. Source: [Lin2004, chapter 6]; the decoder
// [Massey1969].
#ifndef WAYMARK_ESTIMATOR_VISION_BCH_HPP
#define WAYMARK_ESTIMATOR_VISION_BCH_HPP

#include <cstdint>

namespace wm {

inline constexpr int kBchLength = 63, kBchData = 16, kBchErrors = 11;  // bits

// Code word whose upper 16 bits are `data`.
uint64_t bch_encode(uint32_t data);

// Corrects up to `errors_max` (at most 11) flipped bits. Returns their number, or -1 where no code word is that near;
// *word is unchanged then.
int bch_correct(uint64_t *word, int errors_max);

}  // namespace wm

#endif
