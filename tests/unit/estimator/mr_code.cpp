// SPDX-License-Identifier: Apache-2.0
// The MR code: identities and back, flipped modules, what is refused, patterns that mean nothing.
#include "waymark/mr_code.h"

#include <bit>

#include "common/suite.h"
#include "vision/markers/bch.hpp"
#include "waymark/random.h"

namespace {

uint64_t random_bits(uint64_t stream, uint64_t index) {
  return static_cast<uint64_t>(wm_random_uniform(5, stream, 2 * index) * 0x1p32) << 32 |
         static_cast<uint64_t>(wm_random_uniform(5, stream, 2 * index + 1) * 0x1p32);
}

// `count` modules flipped, others each time.
uint64_t flip(uint64_t modules, int count, uint64_t seed) {
  uint64_t flipped = 0;
  for (uint64_t i = 0; std::popcount(flipped) < count; i++)
    flipped |= UINT64_C(1) << static_cast<int>(64 * wm_random_uniform(seed, 17, i));
  return modules ^ flipped;
}

TEST(every_identity_comes_back) {
  for (uint32_t id = 0; id < WM_MR_IDS; id++) {
    uint32_t read = ~id;
    int wrong = -1;
    TEST_ASSERT_TRUE(wm_mr_decode(wm_mr_encode(id), &read, &wrong));
    TEST_ASSERT_EQUAL_UINT32(id, read);
    TEST_ASSERT_EQUAL(0, wrong);
  }
  TEST_ASSERT_EQUAL_UINT64(0, wm_mr_encode(WM_MR_IDS));
}

// Linear code: the smallest weight is the smallest distance.
TEST(the_distance_is_as_stated) {
  int least = 64;
  const uint64_t zero = wm_mr_encode(0);
  for (uint32_t id = 1; id < WM_MR_IDS; id++) {
    const int weight = std::popcount(wm_mr_encode(id) ^ zero);
    if (weight < least) least = weight;
  }
  TEST_ASSERT_EQUAL(WM_MR_DISTANCE, least);
}

TEST(flipped_modules_are_corrected_or_refused) {
  for (uint64_t trial = 0; trial < 20000; trial++) {
    const auto id = static_cast<uint32_t>(WM_MR_IDS * wm_random_uniform(9, 3, trial));
    const int flips = static_cast<int>(trial % (WM_MR_DISTANCE - WM_MR_CORRECTED));
    uint32_t read = 0;
    int wrong = 0;
    const int there = wm_mr_decode(flip(wm_mr_encode(id), flips, trial), &read, &wrong);
    TEST_ASSERT_EQUAL(flips <= WM_MR_CORRECTED, there);
    if (there) TEST_ASSERT_EQUAL_UINT32(id, read);
    if (there) TEST_ASSERT_EQUAL(flips, wrong);
  }
}

// Of all patterns 2^16 V(6) / 2^64 = 3.0e-7 are within 6 modules of an identity.
TEST(random_patterns_are_refused) {
  int accepted = 0;
  for (uint64_t i = 0; i < 1000000; i++) {
    uint32_t id;
    int wrong;
    accepted += wm_mr_decode(random_bits(1, i), &id, &wrong);
  }
  std::printf("mr code: %d of 1000000 random patterns accepted\n", accepted);
  TEST_ASSERT_LESS_OR_EQUAL(1, accepted);
}

TEST(regular_patterns_are_refused) {
  for (int dx = 1; dx <= 8; dx++)
    for (int dy = 1; dy <= 8; dy++)
      for (int shift = 0; shift < 16; shift++) {
        uint64_t stripes = 0, tiles = 0;
        for (int row = 0; row < 8; row++)
          for (int column = 0; column < 8; column++) {
            const uint64_t bit = UINT64_C(1) << (8 * row + column);
            if ((row / dy * (shift & 1) + column / dx * (shift >> 1 & 1) + (shift >> 2 & 1)) & 1) stripes |= bit;
            if ((row + shift / 4 < dy) ^ (column + shift % 4 < dx)) tiles |= bit;
          }
        const uint64_t patterns[] = {stripes, ~stripes, tiles, ~tiles};
        for (const uint64_t pattern : patterns) {
          uint32_t id;
          int wrong;
          TEST_ASSERT_FALSE(wm_mr_decode(pattern, &id, &wrong));
        }
      }
}

// The decoder alone, up to what its distance allows.
TEST(the_bch_code_corrects_eleven) {
  for (uint64_t trial = 0; trial < 2000; trial++) {
    const auto data = static_cast<uint32_t>(trial * 33);
    const int flips = static_cast<int>(trial % 12);
    const uint64_t word = wm::bch_encode(data);
    TEST_ASSERT_EQUAL_UINT32(data & 0xFFFF, word >> 47);
    uint64_t errors = 0;
    for (uint64_t i = 0; std::popcount(errors) < flips; i++)
      errors |= UINT64_C(1) << static_cast<int>(63 * wm_random_uniform(trial, 18, i));
    uint64_t read = word ^ errors;
    TEST_ASSERT_EQUAL(flips, wm::bch_correct(&read, 11));
    TEST_ASSERT_EQUAL_UINT64(word, read);
  }
}

// Whatever bits: an answer that says how far it is from the code word is that far from it.
TEST(any_bits_are_read_or_refused) {
  for (uint64_t i = 0; i < 100000; i++) {
    const uint64_t bits = i < 65536 ? i << (i % 48) : flip(wm_mr_encode(static_cast<uint32_t>(i)), 5, i);
    uint32_t id = 0;
    int wrong = 0;
    if (!wm_mr_decode(bits, &id, &wrong)) continue;
    TEST_ASSERT_LESS_THAN(WM_MR_IDS, id);
    TEST_ASSERT_EQUAL(wrong, std::popcount(wm_mr_encode(id) ^ bits));
  }
}

}  // namespace
