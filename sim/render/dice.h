// SPDX-License-Identifier: Apache-2.0
// Cheap random numbers by counting, for pixels: millions a frame. The mixing is splitmix64's (G. Steele, D. Lea,
// C. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014); a number depends on its key alone.
#pragma once

#include <cstdint>

namespace wm::render {

inline uint64_t dice(uint64_t key) {
  key += 0x9e3779b97f4a7c15ull;
  key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9ull;
  key = (key ^ (key >> 27)) * 0x94d049bb133111ebull;
  return key ^ (key >> 31);
}
// The key of a frame, to which the number of a pixel is added.
inline uint64_t dice_frame(uint64_t seed, uint64_t frame) { return dice(dice(seed) ^ (frame << 32 | 0x5u)); }

// [0, 1) from 16 of the bits (`which` 0..3).
inline float dice_part(uint64_t bits, int which) {
  return static_cast<float>(static_cast<int32_t>(bits >> (16 * which) & 0xffffu)) * (1.0f / 65536.0f);
}

}  // namespace wm::render
