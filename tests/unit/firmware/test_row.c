// SPDX-License-Identifier: Apache-2.0
#include "common/suite.h"
#include "output/csv_row.h"

static wm_row row;
static const char *text(void) {
  row.bytes[row.length] = '\0';
  row.length = 0;
  return row.bytes;
}

TEST(numbers_are_written_the_same_everywhere) {
  wm_row_fixed(&row, -1.5, 3);
  TEST_ASSERT_EQUAL_STRING("-1.500", text());
  wm_row_fixed(&row, 0.0005, 3);
  TEST_ASSERT_EQUAL_STRING("0.001", text());
  wm_row_fixed(&row, -0.0004, 3);
  TEST_ASSERT_EQUAL_STRING("0.000", text());  // no negative zero
  wm_row_fixed(&row, 123456789.987654321, 9);
  TEST_ASSERT_EQUAL_STRING_LEN("123456789.9876543", text(), 17);
  wm_row_fixed(&row, 3.7, 0);
  TEST_ASSERT_EQUAL_STRING("4", text());
  wm_row_fixed(&row, 1e12, 9);
  TEST_ASSERT_EQUAL_STRING("1e+12", text());
  wm_row_fixed(&row, NAN, 9);
  TEST_ASSERT_EQUAL_STRING("", text());
  wm_row_int(&row, INT64_MIN);
  TEST_ASSERT_EQUAL_STRING("-9223372036854775808", text());
  wm_row_seconds(&row, 1234567890);
  TEST_ASSERT_EQUAL_STRING("1.234567890", text());
  wm_row_seconds(&row, -1);
  TEST_ASSERT_EQUAL_STRING("-0.000000001", text());
}

TEST(exact_numbers_keep_every_bit) {
  uint64_t z = 1;
  for (int i = 0; i < 100000; i++) {
    z = z * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    double value;
    memcpy(&value, &z, sizeof value);
    if (!isfinite(value)) continue;
    wm_row_exact(&row, value);
    double back = strtod(text(), NULL);
    TEST_ASSERT_EQUAL_MEMORY(&value, &back, sizeof value);
  }
}

TEST(a_row_that_is_too_long_is_cut_and_nothing_else) {
  for (int i = 0; i < 3000; i++) wm_row_text(&row, "abc");
  TEST_ASSERT_LESS_OR_EQUAL(sizeof row.bytes, row.length);
  row.length = 0;
}
