// SPDX-License-Identifier: Apache-2.0
#include "cli/options.h"
#include "common/suite.h"

static const char *out_dir;
static uint64_t seed;
static double speed, from_s;
static option_texts cameras;
static int help;
static const char *words[2];
static size_t word_count;
static wm_error err;

static wm_status parse(int argc, char **argv) {
  static const option kOptions[] = {{"--out", OPTION_TEXT, &out_dir},     {"--seed", OPTION_U64, &seed},
                                    {"--speed", OPTION_F64, &speed},      {"--from", OPTION_F64_FROM_0, &from_s},
                                    {"--camera", OPTION_TEXTS, &cameras}, {"--help", OPTION_FLAG, &help}};
  return options_parse(argc, argv, kOptions, 6, words, 2, &word_count, &err);
}
#define PARSE(...) parse((int)(sizeof((char *[]){__VA_ARGS__}) / sizeof(char *)), (char *[]){__VA_ARGS__})

TEST(values_stand_behind_a_blank_or_an_equals_sign) {
  TEST_ASSERT_EQUAL(WM_OK, PARSE("rec", "--out", "run", "--seed=7", "--speed", "0.5", "--help", "--", "--strange"));
  TEST_ASSERT_EQUAL_STRING("run", out_dir);
  TEST_ASSERT_EQUAL_UINT64(7, seed);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, speed);
  TEST_ASSERT_EQUAL(1, help);
  TEST_ASSERT_EQUAL(2, word_count);
  TEST_ASSERT_EQUAL_STRING("--strange", words[1]);
}

TEST(an_option_may_be_given_several_times) {
  from_s = 1;
  TEST_ASSERT_EQUAL(WM_OK, PARSE("--camera", "left=/dev/video0", "--from", "0", "--camera=right=/dev/video1"));
  TEST_ASSERT_EQUAL(2, cameras.count);
  TEST_ASSERT_EQUAL_STRING("left=/dev/video0", cameras.text[0]);
  TEST_ASSERT_EQUAL_STRING("right=/dev/video1", cameras.text[1]);
  TEST_ASSERT_EQUAL_DOUBLE(0, from_s);
}

static void refuse(const char *message, wm_status status) {
  TEST_ASSERT_EQUAL(WM_BAD_USAGE, status);
  TEST_ASSERT_EQUAL_STRING(message, err.text);
}

TEST(mistakes_are_told) {
  refuse("option '--sed' is unknown; did you mean '--seed'?", PARSE("--sed", "7"));
  refuse("option '--sed' is unknown; did you mean '--seed'?", PARSE("--sed=7"));
  refuse("option '-x' is unknown", PARSE("-x"));
  refuse("--out: its value is missing", PARSE("--out"));
  refuse("--out: is empty", PARSE("--out="));
  refuse("--help: takes no value", PARSE("--help=1"));
  refuse("--seed: '-1' is not a whole number from 0 on, or is too large", PARSE("--seed", "-1"));
  refuse("--seed: '18446744073709551616' is not a whole number from 0 on, or is too large",
         PARSE("--seed", "18446744073709551616"));
  refuse("--speed: '0' is not a number above 0", PARSE("--speed", "0"));
  refuse("--speed: 'fast' is not a number above 0", PARSE("--speed", "fast"));
  refuse("--speed: 'nan' is not a number above 0", PARSE("--speed", "nan"));
  refuse("--from: '-1' is not a number from 0 on", PARSE("--from", "-1"));
  refuse("--camera: is empty", PARSE("--camera="));
  refuse("unexpected argument 'c'", PARSE("a", "b", "c"));
}
