// SPDX-License-Identifier: Apache-2.0
// Extraction of signals: by hand, and against a bit-by-bit twin for every start and length in both byte orders.
#include "can_signal.h"
#include "common/suite.h"

// Deterministic bytes, no two neighbours alike.
static void fill(uint8_t *bytes, size_t count, uint32_t seed) {
  for (size_t i = 0; i < count; i++) {
    seed = seed * 1664525u + 1013904223u;
    bytes[i] = (uint8_t)(seed >> 24);
  }
}

// DBC's definition, one bit after the other: Intel from the lowest bit up; Motorola from the highest bit down, each
// byte's bit 0 followed by the next byte's bit 7.
static uint64_t bit_by_bit(const signal_bits *s, const uint8_t *data) {
  uint64_t out = 0;
  unsigned bit = s->start;
  for (unsigned i = 0; i < s->length; i++) {
    uint64_t value = data[bit / 8] >> (bit % 8) & 1u;
    if (s->is_motorola) {
      out = out << 1 | value;
      bit = bit % 8 == 0 ? bit + 15 : bit - 1;
    } else {
      out |= value << i;
      bit++;
    }
  }
  return out;
}

TEST(every_place_and_length) {
  unsigned tried = 0;
  for (uint32_t seed = 1; seed <= 3; seed++) {
    uint8_t data[WM_CAN_DATA_MAX];
    fill(data, sizeof data, seed);
    payload p;
    payload_set(&p, data, sizeof data);
    for (unsigned motorola = 0; motorola < 2; motorola++)
      for (unsigned start = 0; start < 8 * WM_CAN_DATA_MAX; start++)
        for (unsigned length = 1; length <= 64; length++) {
          signal_bits s = {(uint16_t)start, (uint8_t)length, (uint8_t)motorola, SIGNAL_UNSIGNED};
          if (signal_bytes(&s) > WM_CAN_DATA_MAX) continue;
          TEST_ASSERT_EQUAL_HEX64(bit_by_bit(&s, data), signal_raw(&s, &p));
          tried++;
        }
  }
  TEST_ASSERT_GREATER_THAN(150000, tried);
}

TEST(by_hand) {
  static const struct {
    uint16_t start;
    uint8_t length, motorola;
    unsigned bytes;
    uint64_t raw;
  } rows[] = {
      {0, 8, 0, 1, 0x12},                 // one byte
      {7, 8, 1, 1, 0x12},                 // the same, named by its highest bit
      {0, 16, 0, 2, 0x3412},              // Intel: low byte first
      {7, 16, 1, 2, 0x1234},              // Motorola: high byte first
      {4, 8, 0, 2, 0x41},                 // across two bytes, Intel
      {3, 8, 1, 2, 0x23},                 // across two bytes, Motorola
      {8, 1, 0, 2, 0},                    // single bits of 0x34 = 0011 0100
      {10, 1, 0, 2, 1},                   //
      {13, 1, 1, 2, 1},                   //
      {0, 64, 0, 8, 0xF0DEBC9A78563412},  // all of it
      {7, 64, 1, 8, 0x123456789ABCDEF0},  //
      {4, 64, 0, 9, 0x1F0DEBC9A7856341},  // nine bytes
      {3, 64, 1, 9, 0x23456789ABCDEF01},  //
  };
  const uint8_t data[9] = {0x12, 0x34, 0x56, 0x78, 0x9A, 0xBC, 0xDE, 0xF0, 0x11};
  payload p;
  payload_set(&p, data, sizeof data);
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    signal_bits s = {rows[i].start, rows[i].length, rows[i].motorola, SIGNAL_UNSIGNED};
    TEST_ASSERT_EQUAL_UINT(rows[i].bytes, signal_bytes(&s));
    TEST_ASSERT_EQUAL_HEX64(rows[i].raw, signal_raw(&s, &p));
  }
}

TEST(signs) {
  TEST_ASSERT_EQUAL_INT64(-1, sign_extend(1, 1));
  TEST_ASSERT_EQUAL_INT64(0, sign_extend(0, 1));
  TEST_ASSERT_EQUAL_INT64(-8, sign_extend(8, 4));
  TEST_ASSERT_EQUAL_INT64(7, sign_extend(7, 4));
  TEST_ASSERT_EQUAL_INT64(-1, sign_extend(0xFFFF, 16));
  TEST_ASSERT_EQUAL_INT64(INT64_MIN, sign_extend(UINT64_C(1) << 63, 64));
  TEST_ASSERT_EQUAL_INT64(INT64_MAX, sign_extend(INT64_MAX, 64));
}

static double number(signal_kind kind, uint8_t length, uint64_t raw) {
  signal_bits s = {0, length, 0, (uint8_t)kind};
  return signal_number(&s, raw);
}

TEST(numbers) {
  TEST_ASSERT_EQUAL_DOUBLE(65535.0, number(SIGNAL_UNSIGNED, 16, 65535));
  TEST_ASSERT_EQUAL_DOUBLE(-1.0, number(SIGNAL_SIGNED, 16, 65535));
  TEST_ASSERT_EQUAL_DOUBLE(18446744073709551615.0, number(SIGNAL_UNSIGNED, 64, UINT64_MAX));
  TEST_ASSERT_EQUAL_DOUBLE(1.5, number(SIGNAL_FLOAT, 32, 0x3FC00000));
  TEST_ASSERT_EQUAL_DOUBLE(-2.0, number(SIGNAL_DOUBLE, 64, UINT64_C(0xC000000000000000)));
}

// What a short frame doesn't have reads as zero, never as what was there before.
TEST(short_frames) {
  const uint8_t data[2] = {0xFF, 0xFF};
  payload p;
  memset(&p, 0xAA, sizeof p);
  payload_set(&p, data, 1);
  signal_bits s = {0, 64, 0, SIGNAL_UNSIGNED};
  TEST_ASSERT_EQUAL_HEX64(0xFF, signal_raw(&s, &p));
}
