// SPDX-License-Identifier: Apache-2.0
#include "common/suite.h"
#include "waymark/text.h"

static wm_text_number f64(const char *text, double *out) { return wm_text_to_f64(text, strlen(text), out); }
static wm_text_number i64(const char *text, int64_t *out) { return wm_text_to_i64(text, strlen(text), out); }

TEST(numbers) {
  static const char *const kGood[] = {"0",   "-0.5", "+1",       ".5",  "5.",
                                      "1e3", "1E-3", "-1.25e+2", "0.1", "123456789012345678"};
  for (size_t i = 0; i < sizeof kGood / sizeof *kGood; i++) {
    double value = -1;
    TEST_ASSERT_EQUAL_MESSAGE(WM_TEXT_OK, f64(kGood[i], &value), kGood[i]);
    TEST_ASSERT_TRUE(value == strtod(kGood[i], NULL));
  }
  static const char *const kBad[] = {"",    "-",  ".",  "e5",    "1e",  "1e+",   "0x10",
                                     "1,5", "1 ", " 1", "1.2.3", "abc", "1_000", "nana"};
  for (size_t i = 0; i < sizeof kBad / sizeof *kBad; i++) {
    double value;
    TEST_ASSERT_EQUAL_MESSAGE(WM_TEXT_NOT_A_NUMBER, f64(kBad[i], &value), kBad[i]);
  }
  double value = 0;
  TEST_ASSERT_EQUAL(WM_TEXT_NOT_FINITE, f64("nan", &value));
  TEST_ASSERT_DOUBLE_IS_NAN(value);
  TEST_ASSERT_EQUAL(WM_TEXT_NOT_FINITE, f64("-.INF", &value));
  TEST_ASSERT_DOUBLE_IS_NEG_INF(value);
  TEST_ASSERT_EQUAL(WM_TEXT_TOO_LARGE, f64("1e999", &value));
  TEST_ASSERT_EQUAL(WM_TEXT_NOT_A_NUMBER, wm_text_to_f64("1\0", 2, &value));
}

TEST(whole_numbers) {
  int64_t value = 0;
  TEST_ASSERT_EQUAL(WM_TEXT_OK, i64("9223372036854775807", &value));
  TEST_ASSERT_EQUAL_INT64(INT64_MAX, value);
  TEST_ASSERT_EQUAL(WM_TEXT_OK, i64("-9223372036854775808", &value));
  TEST_ASSERT_EQUAL_INT64(INT64_MIN, value);
  TEST_ASSERT_EQUAL(WM_TEXT_TOO_LARGE, i64("9223372036854775808", &value));
  TEST_ASSERT_EQUAL(WM_TEXT_TOO_LARGE, i64("-9223372036854775809", &value));
  TEST_ASSERT_EQUAL(WM_TEXT_TOO_LARGE, i64("99999999999999999999999", &value));
  TEST_ASSERT_EQUAL(WM_TEXT_OK, i64("5614975783000001", &value));  // a double would hold it, 2^53 + 1 it would not
  TEST_ASSERT_EQUAL_INT64(INT64_C(5614975783000001), value);
  TEST_ASSERT_EQUAL(WM_TEXT_OK, i64("9007199254740993", &value));
  TEST_ASSERT_EQUAL_INT64(INT64_C(9007199254740993), value);
  TEST_ASSERT_EQUAL(WM_TEXT_NOT_A_NUMBER, i64("1.0", &value));
  TEST_ASSERT_EQUAL(WM_TEXT_NOT_A_NUMBER, i64("1e9", &value));
  TEST_ASSERT_EQUAL(WM_TEXT_NOT_A_NUMBER, i64("-", &value));
  TEST_ASSERT_EQUAL(WM_TEXT_NOT_A_NUMBER, i64("", &value));
}

TEST(nearest_word) {
  static const char *const kWords[] = {"gate", "horizon_ms", "rate_hz", NULL};
  TEST_ASSERT_EQUAL(0, wm_word_distance("gate", "gate"));
  TEST_ASSERT_EQUAL(1, wm_word_distance("gaet", "gate"));
  TEST_ASSERT_EQUAL(4, wm_word_distance("", "gate"));
  TEST_ASSERT_EQUAL_STRING("gate", wm_word_nearest("gaet", kWords));
  TEST_ASSERT_EQUAL_STRING("horizon_ms", wm_word_nearest("horison_m", kWords));
  TEST_ASSERT_NULL(wm_word_nearest("horizon", kWords));
  TEST_ASSERT_NULL(wm_word_nearest("", kWords));
  TEST_ASSERT_NULL(wm_word_nearest("ga", kWords));  // two of two letters is no likeness
}

TEST(shown_text) {
  char out[16];
  TEST_ASSERT_EQUAL_STRING("a?b", wm_show_text("a\nb", 3, out, sizeof out));
  TEST_ASSERT_EQUAL_STRING("\xC3\xBC?", wm_show_text("\xC3\xBC\xFF", 3, out, sizeof out));
  TEST_ASSERT_EQUAL_STRING("123456789012...", wm_show_text("1234567890123456", 16, out, sizeof out));
  TEST_ASSERT_EQUAL_STRING("12345678901...", wm_show_text("12345678901\xC3\xBC\xC3\xBC", 15, out, sizeof out));
}

TEST(files) {
  char *text;
  size_t length;
  wm_error err;
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_text_read_file("no/such/file", 10, &text, &length, &err));
  TEST_ASSERT_EQUAL_STRING("no/such/file: there is no such file", err.text);
  TEST_ASSERT_EQUAL(WM_IO, wm_text_read_file("/", 10, &text, &length, &err));
  TEST_ASSERT_EQUAL(WM_FULL, wm_text_read_file("LICENSE", 10, &text, &length, &err));
  TEST_ASSERT_EQUAL(WM_OK, wm_text_read_file("LICENSE", 1 << 20, &text, &length, &err));
  TEST_ASSERT_EQUAL(length, strlen(text));
  free(text);
}
