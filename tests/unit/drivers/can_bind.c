// SPDX-License-Identifier: Apache-2.0
// Bindings that a program makes, which no can-signals.yaml can state, a DBC from a file, and limits of one message.
#include <unistd.h>
#include "common/suite.h"

#include "can_fixture.h"

static fixture f;

void tearDown(void) { close_it(&f); }

#define CAR                                                 \
  "BO_ 256 M: 8 X\n SG_ A : 0|8@1+ (1,0) [0|0] \"m/s\" X\n" \
  " SG_ B : 8|8@1- (1,0) [0|0] \"m/s\" X\n"                 \
  " SG_ G : 16|8@1+ (1,0) [0|0] \"\" X\n"                   \
  "BO_ 257 N: 8 X\n SG_ A : 0|8@1+ (1,0) [0|0] \"m/s\" X\n"

static void refused(const wm_can_binding *bindings, size_t count, const char *words) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_BAD_CONFIG, open_with(&f, CAR, bindings, count), words);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(f.err.text, words), f.err.text);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(f.err.text, "can-signals.yaml:3"), f.err.text);
  TEST_ASSERT_NULL(f.decoder);
}

TEST(numbers_that_are_none) {
  wm_can_binding b = binding(WM_Q_VEHICLE_SPEED, "M", "A");
  b.quantity = -1;
  refused(&b, 1, "-1 is not a quantity");
  b.quantity = WM_CAN_COUNT;
  refused(&b, 1, "is not a quantity");
  b = binding(WM_Q_VEHICLE_SPEED, "M", "A");
  b.signal_count = 0;
  refused(&b, 1, "0 signals; 1 to 4 can be summed");
  b.signal_count = WM_CAN_SUM_MAX + 1;
  refused(&b, 1, "5 signals; 1 to 4 can be summed");
  b = binding(WM_Q_VEHICLE_SPEED, "M", "A");
  b.scale = 0;
  refused(&b, 1, "scale");
  b.scale = 1, b.offset = INFINITY;
  refused(&b, 1, "offset");
}

TEST(one_raw_value_is_one_gear) {
  wm_can_binding b = binding(WM_Q_GEAR, "M", "G");
  b.gear_count = 2;
  b.gear[0].raw = b.gear[1].raw = 3;
  b.gear[0].direction = 1, b.gear[1].direction = -1;
  refused(&b, 1, "values: 3 appears twice");
  b.gear[1].raw = 4;
  open_one(&f, CAR, b);
  TEST_ASSERT_EQUAL_DOUBLE(1, value_of(&f, "can0 100#0000030000000000"));
  TEST_ASSERT_EQUAL_DOUBLE(-1, value_of(&f, "can0 100#0000040000000000"));
}

// A refusal lists the names of its own signal: none of the one that was refused before.
TEST(names_that_are_no_gears) {
  static const char kNamed[] =
      "BO_ 256 M: 8 X\n SG_ G : 16|8@1+ (1,0) [0|0] \"\" X\nVAL_ 256 G 0 \"open\" 1 \"closed\" ;\n";
  const wm_can_binding b = binding(WM_Q_GEAR, "M", "G");
  for (int round = 0; round < 2; round++) {
    TEST_ASSERT_EQUAL(WM_BAD_CONFIG, open_with(&f, kNamed, &b, 1));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(f.err.text, "none of the names in VAL_ (\"open\", \"closed\") is a gear"),
                                 f.err.text);
    refused(&b, 1, "the DBC has no VAL_ names for this signal; write");
  }
}

TEST(messages_that_are_not_there) {
  const wm_can_binding b = binding(WM_Q_VEHICLE_SPEED, "quite_another_name", "A");
  refused(&b, 1, "message 'quite_another_name' is not among the 2 messages of car.dbc");
  const wm_can_binding near = binding(WM_Q_VEHICLE_SPEED, "MM", "A");
  refused(&near, 1, "did you mean M?");
}

TEST(sums_keep_signs_and_units) {
  wm_can_binding b = binding(WM_Q_VEHICLE_SPEED, "M", "A");
  b.signal_count = 2;
  (void)snprintf(b.signal[1], sizeof b.signal[1], "B");
  b.scale = 0.5, b.offset = 10;
  open_one(&f, CAR, b);
  TEST_ASSERT_EQUAL_DOUBLE(10 + 0.5 * (7 - 2), value_of(&f, "can0 100#07FE000000000000"));
  TEST_ASSERT_EQUAL(WM_AGAIN, feed(&f, "can0 101#0700000000000000"));  // the other message of that signal's name
  TEST_ASSERT_EQUAL_UINT64(1, f.counts.ignored);
}

#define RANGED(signal) "BO_ 256 M: 8 X\n SG_ A : " signal " \"m/s\" X\n"

// The outermost raw values are no measurement where the range excludes them; others are taken, whatever the range.
TEST(outermost_values_are_no_measurement) {
  open_one(&f, RANGED("0|16@1- (1,0) [-32000|32000]"), binding(WM_Q_VEHICLE_SPEED, "M", "A"));
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "can0 100#0080000000000000"));
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "can0 100#FF7F000000000000"));
  TEST_ASSERT_EQUAL_DOUBLE(-32767, value_of(&f, "can0 100#0180000000000000"));
  TEST_ASSERT_EQUAL_DOUBLE(32766, value_of(&f, "can0 100#FE7F000000000000"));
  TEST_ASSERT_EQUAL_DOUBLE(1, value_of(&f, "can0 100#0100000000000000"));
  open_one(&f, RANGED("0|16@1- (1,0) [-32768|32767]"), binding(WM_Q_VEHICLE_SPEED, "M", "A"));
  TEST_ASSERT_EQUAL_DOUBLE(-32768, value_of(&f, "can0 100#0080000000000000"));
  TEST_ASSERT_EQUAL_DOUBLE(32767, value_of(&f, "can0 100#FF7F000000000000"));
  open_one(&f, RANGED("0|16@1+ (1,0) [0|60000]"), binding(WM_Q_VEHICLE_SPEED, "M", "A"));
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "can0 100#FFFF000000000000"));
  TEST_ASSERT_EQUAL_DOUBLE(65534, value_of(&f, "can0 100#FEFF000000000000"));
  open_one(&f, RANGED("0|16@1+ (1,0) [0|0]"), binding(WM_Q_VEHICLE_SPEED, "M", "A"));  // no range
  TEST_ASSERT_EQUAL_DOUBLE(65535, value_of(&f, "can0 100#FFFF000000000000"));
}

TEST(a_dbc_from_a_file) {
  char path[] = "/tmp/wm-dbc-XXXXXX";
  const int fd = mkstemp(path);
  TEST_ASSERT_GREATER_OR_EQUAL(0, fd);
  TEST_ASSERT_EQUAL((int)strlen(CAR), (int)write(fd, CAR, strlen(CAR)));
  (void)close(fd);
  wm_dbc *dbc = NULL;
  wm_error err;
  TEST_ASSERT_EQUAL(WM_OK, wm_dbc_load(path, &dbc, &err));
  TEST_ASSERT_NOT_NULL(dbc);
  wm_dbc_free(dbc);
  TEST_ASSERT_EQUAL(0, unlink(path));
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_dbc_load(path, &dbc, &err));
  TEST_ASSERT_NULL(dbc);
  TEST_ASSERT_NOT_NULL(strstr(err.text, "cannot be opened"));
  TEST_ASSERT_EQUAL(WM_IO, wm_dbc_load("/proc/self", &dbc, &err));  // a folder
  TEST_ASSERT_NULL(dbc);
  TEST_ASSERT_NOT_NULL(strstr(err.text, "cannot be read"));
}
