// SPDX-License-Identifier: Apache-2.0
#include "vision/markers/bch.hpp"

#include <bit>

namespace wm {

namespace {

constexpr int kOrder = 63;             // of the field's multiplicative group
constexpr uint32_t kPrimitive = 0x43;  // x^6 + x + 1
constexpr int kSyndromes = 2 * kBchErrors;

struct galois {
  uint8_t power[2 * kOrder], log[kOrder + 1];
};

constexpr galois make_field() {
  galois f = {};
  uint32_t x = 1;
  for (int i = 0; i < kOrder; i++) {
    f.power[i] = f.power[i + kOrder] = static_cast<uint8_t>(x);
    f.log[x] = static_cast<uint8_t>(i);
    x <<= 1;
    if (x & 64) x ^= kPrimitive;
  }
  return f;
}

constexpr galois kField = make_field();  // GF(64)

constexpr uint8_t times(uint8_t a, uint8_t b) { return a && b ? kField.power[kField.log[a] + kField.log[b]] : 0; }
constexpr uint8_t over(uint8_t a, uint8_t b) { return a ? kField.power[kField.log[a] + kOrder - kField.log[b]] : 0; }

// Product of (x - a^i) over the conjugates of a, a^3, ... a^21: has the roots a^1 to a^22, and coefficients 0 or 1.
constexpr uint64_t make_generator() {
  bool is_root[kOrder] = {};
  for (int i = 1; i < kSyndromes; i += 2)
    for (int k = 0, e = i; k < 6; k++, e = 2 * e % kOrder) is_root[e] = true;
  uint8_t product[kOrder + 1] = {1};
  int degree = 0;
  for (int e = 0; e < kOrder; e++) {
    if (!is_root[e]) continue;
    degree++;
    for (int k = degree; k > 0; k--)
      product[k] = static_cast<uint8_t>(product[k - 1] ^ times(product[k], kField.power[e]));
    product[0] = times(product[0], kField.power[e]);
  }
  uint64_t bits = 0;
  for (int k = 0; k <= degree; k++) bits |= static_cast<uint64_t>(product[k]) << k;
  return bits;
}

constexpr uint64_t kGenerator = make_generator();  // of degree 47
static_assert(std::bit_width(kGenerator) == kBchLength - kBchData + 1);

// Error locator by Berlekamp and Massey: the shortest linear recurrence of the syndromes, whose roots are the inverses
// of the error places. Returns its degree.
int locate(const uint8_t syndrome[kSyndromes], uint8_t locator[kSyndromes + 1]) {
  uint8_t before[kSyndromes + 1] = {1}, last = 1;
  locator[0] = 1;
  for (int i = 1; i <= kSyndromes; i++) locator[i] = 0;
  int degree = 0, gap = 1;
  for (int n = 0; n < kSyndromes; n++) {
    uint8_t miss = syndrome[n];
    for (int i = 1; i <= degree; i++) miss ^= times(locator[i], syndrome[n - i]);
    if (miss == 0) {
      gap++;
      continue;
    }
    uint8_t kept[kSyndromes + 1];
    for (int i = 0; i <= kSyndromes; i++) kept[i] = locator[i];
    const uint8_t factor = over(miss, last);
    for (int i = 0; i + gap <= kSyndromes; i++) locator[i + gap] ^= times(factor, before[i]);
    if (2 * degree > n) {
      gap++;
      continue;
    }
    degree = n + 1 - degree;
    for (int i = 0; i <= kSyndromes; i++) before[i] = kept[i];
    last = miss;
    gap = 1;
  }
  return degree;
}

}  // namespace

uint64_t bch_encode(uint32_t data) {
  const uint64_t shifted = static_cast<uint64_t>(data & 0xFFFF) << (kBchLength - kBchData);
  uint64_t rest = shifted;
  for (int i = kBchLength - 1; i >= kBchLength - kBchData; i--)
    if (rest >> i & 1) rest ^= kGenerator << (i - (kBchLength - kBchData));
  return shifted | rest;
}

int bch_correct(uint64_t *word, int errors_max) {
  uint8_t syndrome[kSyndromes] = {};
  uint8_t any = 0;
  for (int j = 0; j < kSyndromes; j++) {
    if (j % 2 == 1) {  // r(a^2j) = r(a^j)^2, the code being binary
      syndrome[j] = times(syndrome[j / 2], syndrome[j / 2]);
      continue;
    }
    for (uint64_t rest = *word & (~UINT64_C(0) >> 1); rest; rest &= rest - 1)
      syndrome[j] ^= kField.power[std::countr_zero(rest) * (j + 1) % kOrder];
    any |= syndrome[j];
  }
  if (any == 0) return 0;
  uint8_t locator[kSyndromes + 1];
  const int degree = locate(syndrome, locator);
  if (degree > errors_max) return -1;
  uint64_t errors = 0;
  for (int i = 0; i < kOrder; i++) {  // Chien's search: is a^-i a root?
    uint8_t value = 0;
    for (int k = 0; k <= degree; k++)
      if (locator[k]) value ^= kField.power[(kField.log[locator[k]] + (kOrder - i) * k) % kOrder];
    if (value == 0) errors |= UINT64_C(1) << i;
  }
  if (std::popcount(errors) != degree) return -1;
  *word ^= errors;
  return degree;
}

}  // namespace wm
