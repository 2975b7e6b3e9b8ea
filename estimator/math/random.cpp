// SPDX-License-Identifier: Apache-2.0
#include "waymark/random.h"

#include "math/elementary.hpp"

namespace {

// The paper's constants: two odd multipliers and the increments of the key.
constexpr uint32_t kMultiplier0 = 0xD2511F53u, kMultiplier1 = 0xCD9E8D57u;
constexpr uint32_t kKeyStep0 = 0x9E3779B9u, kKeyStep1 = 0xBB67AE85u;
constexpr int kRounds = 10;  // the paper's Philox4x32-10

double uniform_from(uint32_t high, uint32_t low) {
  const uint64_t bits = ((uint64_t)high << 32 | low) >> 11;
  return (double)bits * 0x1p-53;
}

}  // namespace

void wm_random_block(uint64_t seed, uint64_t stream, uint64_t index, uint32_t out[4]) {
  uint32_t c0 = (uint32_t)index, c1 = (uint32_t)(index >> 32);
  uint32_t c2 = (uint32_t)stream, c3 = (uint32_t)(stream >> 32);
  uint32_t k0 = (uint32_t)seed, k1 = (uint32_t)(seed >> 32);
  for (int round = 0; round < kRounds; round++) {
    const uint64_t p0 = (uint64_t)kMultiplier0 * c0;
    const uint64_t p1 = (uint64_t)kMultiplier1 * c2;
    const uint32_t n0 = (uint32_t)(p1 >> 32) ^ c1 ^ k0;
    const uint32_t n2 = (uint32_t)(p0 >> 32) ^ c3 ^ k1;
    c1 = (uint32_t)p1;
    c3 = (uint32_t)p0;
    c0 = n0;
    c2 = n2;
    k0 += kKeyStep0;
    k1 += kKeyStep1;
  }
  out[0] = c0;
  out[1] = c1;
  out[2] = c2;
  out[3] = c3;
}

double wm_random_uniform(uint64_t seed, uint64_t stream, uint64_t index) {
  uint32_t block[4];
  wm_random_block(seed, stream, index, block);
  return uniform_from(block[0], block[1]);
}

double wm_random_normal(uint64_t seed, uint64_t stream, uint64_t index) {
  uint32_t block[4];
  wm_random_block(seed, stream, index, block);
  const double u = 1.0 - uniform_from(block[0], block[1]);  // (0, 1]: the logarithm is finite
  const double v = uniform_from(block[2], block[3]);
  return std::sqrt(-2.0 * wm::log(u)) * wm::cos(wm::kTwoPi * v);
}
