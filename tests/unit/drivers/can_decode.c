// SPDX-License-Identifier: Apache-2.0
// From frames to quantities: units, sums, gears, multiplexing, ticks that wrap, counters, and what is counted.
#include "common/suite.h"

#include "can_fixture.h"

#define PI 3.14159265358979323846

static fixture f;

void tearDown(void) { close_it(&f); }

// ── units ───────────────────────────────────────────────────────────────────────────────────────────────────────────

static double si_of(int quantity, const char *unit) {
  char dbc[256];
  (void)snprintf(dbc, sizeof dbc, "BO_ 291 M: 8 X\n SG_ S : 0|16@1- (0.5,1) [0|0] \"%s\" X\n", unit);
  open_one(&f, dbc, binding(quantity, "M", "S"));
  return value_of(&f, "can0 123#1200") / 10.0;  // 18 * 0.5 + 1 = 10
}

#define SPELLED_MOST 16

// Every spelling that is taken, by its dimension and its size in SI. Names of real files, and with blanks and capitals.
TEST(every_spelling_of_a_unit_has_its_size) {
  static const struct {
    int quantity;
    double si;
    const char *spelled[SPELLED_MOST];
  } rows[] = {
      {WM_Q_VEHICLE_SPEED,
       1,
       {"m/s", "mps", "m/sec", "meter/s", "meters/s", "Unit_MeterPerSecond", "Unit_MeterPerSecon"}},
      {WM_Q_WHEEL_SPEED_REAR_LEFT, 0.01, {"cm/s"}},
      {WM_Q_WHEEL_SPEED_FRONT_RIGHT, 0.001, {"mm/s"}},
      {WM_Q_VEHICLE_SPEED,
       1 / 3.6,
       {"km/h", "kmh", "KMH", "km / h", "kph", "kmph", "km/hr", "km/hour", "Unit_KiloMeterPerHour"}},
      {WM_Q_VEHICLE_SPEED, 0.44704, {"mph", "mi/h", "mile/h", "miles/h", "MilePerHour", "milesperhour"}},
      {WM_Q_VEHICLE_SPEED, 0.3048, {"ft/s"}},
      {WM_Q_YAW_RATE, 1, {"rad/s", "rad/sec", "rads", "radian/s", "radians/s"}},
      {WM_Q_YAW_RATE, 0.001, {"mrad/s"}},
      {WM_Q_YAW_RATE,
       PI / 180,
       {"deg/s", "deg/sec", "deg/sek", "degs", "dps", "degree/s", "\xB0 / s", "degree/sec", "degrees/sec", "degrees/s",
        "\xC2\xB0/s", "degpersecond", "\xB0Grad/s"}},
      {WM_Q_YAW_RATE, PI / 180, {"degreespersecond", "Unit_DegreeOfArcPerSecon", "Unit_DegreeOfArcPerSecond"}},
      {WM_Q_YAW_RATE, 2 * PI / 60, {"rpm", "1/min", "U/min", "umin", "upm", "r/min", "rev/min"}},
      {WM_Q_ROAD_WHEEL, 1, {"rad", "radian", "radians"}},
      {WM_Q_ROAD_WHEEL, 0.001, {"mrad"}},
      {WM_Q_STEERING_WHEEL, PI / 180, {"deg", "Degree", "degrees", "\xC2\xB0", "\xB0", "Unit_DegreeOfArc", "\xB0Grad"}},
      {WM_Q_STEERING_ACTUATOR, 1, {"m", "meter", "meters"}},
      {WM_Q_STEERING_ACTUATOR, 0.01, {"cm"}},
      {WM_Q_STEERING_ACTUATOR, 0.001, {"mm"}},
      {WM_Q_STEERING_ACTUATOR, 0.0254, {"in", "inch"}},
      {WM_Q_ACCELERATION_X, 1, {"m/s2", "m/s^2", "m/s/s", "mps2", "Unit_MeterPerSecondSquared"}},
      {WM_Q_ACCELERATION_Y, 9.80665, {"g"}},
      {WM_Q_ACCELERATION_Z, 0.00980665, {"mg"}},
  };
  for (size_t r = 0; r < sizeof rows / sizeof *rows; r++)
    for (size_t i = 0; i < SPELLED_MOST && rows[r].spelled[i]; i++)
      TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14 * rows[r].si, rows[r].si, si_of(rows[r].quantity, rows[r].spelled[i]),
                                        rows[r].spelled[i]);
}

TEST(floats) {
  const char *dbc =
      "BO_ 291 M: 8 X\n SG_ S : 0|32@1- (1,0) [0|0] \"m/s\" X\n SG_ D : 7|64@0- (1,0) [0|0] \"m/s\" X\n"
      "SIG_VALTYPE_ 291 S : 1;\nSIG_VALTYPE_ 291 D : 2;\n";
  open_one(&f, dbc, binding(WM_Q_VEHICLE_SPEED, "M", "S"));
  TEST_ASSERT_EQUAL_DOUBLE(1.5, value_of(&f, "can0 123#0000C03F00000000"));
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "can0 123#0000C07F00000000"));  // NaN
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "can0 123#0000807F00000000"));  // infinity
  TEST_ASSERT_EQUAL_UINT64(2, f.counts.not_finite);
  open_one(&f, dbc, binding(WM_Q_VEHICLE_SPEED, "M", "D"));
  TEST_ASSERT_EQUAL_DOUBLE(-2.5, value_of(&f, "can0 123#C004000000000000"));
}

// ── gears ───────────────────────────────────────────────────────────────────────────────────────────────────────────

#define GEAR_DBC "BO_ 956 G: 8 X\n SG_ GEAR : 13|6@0+ (1,0) [0|63] \"\" X\n"

TEST(gears_by_names) {
  open_one(&f, GEAR_DBC "VAL_ 956 GEAR 0 \"D\" 1 \"S\" 8 \"N\" 16 \"R\" 32 \"P\" 63 \"SNA\";\n",
           binding(WM_Q_GEAR, "G", "GEAR"));
  TEST_ASSERT_EQUAL_DOUBLE(1, value_of(&f, "can0 3BC#0000000000000000"));
  TEST_ASSERT_EQUAL_DOUBLE(1, value_of(&f, "can0 3BC#0001000000000000"));
  TEST_ASSERT_EQUAL_DOUBLE(0, value_of(&f, "can0 3BC#0008000000000000"));
  TEST_ASSERT_EQUAL_DOUBLE(-1, value_of(&f, "can0 3BC#0010000000000000"));
  TEST_ASSERT_EQUAL_DOUBLE(0, value_of(&f, "can0 3BC#0020000000000000"));
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "can0 3BC#003F000000000000"));  // SNA
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "can0 3BC#0002000000000000"));  // a value without a name
  TEST_ASSERT_EQUAL_UINT64(2, f.counts.not_finite);
}

TEST(gears_by_makers_words) {
  static const struct {
    const char *name;
    double direction;
  } rows[] = {{"DRIVE", 1},
              {"forward", 1},
              {"D1", 1},
              {"Gear 3 | Engaged", 1},
              {"2nd", 1},
              {"Sport", 1},
              {"Reverse gear", -1},
              {"Gang_R", -1},
              {"backward", -1},
              {"Neutral", 0},
              {"parking", 0},
              {"P (Park) | Disengaged", 0}};
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    char dbc[256];
    (void)snprintf(dbc, sizeof dbc, GEAR_DBC "VAL_ 956 GEAR 5 \"%s\" ;\n", rows[i].name);
    open_one(&f, dbc, binding(WM_Q_GEAR, "G", "GEAR"));
    TEST_ASSERT_EQUAL_DOUBLE(rows[i].direction, value_of(&f, "can0 3BC#0005000000000000"));
  }
}

TEST(gears_by_values) {
  wm_can_binding b = binding(WM_Q_GEAR, "G", "GEAR");
  b.gear_count = 2;
  b.gear[0].raw = 4;
  b.gear[0].direction = 1;
  b.gear[1].raw = -1;
  b.gear[1].direction = -1;
  open_one(&f, "BO_ 956 G: 8 X\n SG_ GEAR : 0|4@1- (1,0) [-1|1] \"\" X\nVAL_ 956 GEAR 4 \"R\" ;\n", b);
  TEST_ASSERT_EQUAL_DOUBLE(1, value_of(&f, "can0 3BC#04"));  // the binding's word counts, not VAL_'s
  TEST_ASSERT_EQUAL_DOUBLE(-1, value_of(&f, "can0 3BC#0F"));
}

// ── multiplexing ────────────────────────────────────────────────────────────────────────────────────────────────────

TEST(only_when_the_multiplexer_fits) {
  open_one(&f,
           "BO_ 291 M: 8 X\n SG_ MUX M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ A m3 : 8|8@1+ (1,0) [0|0] \"m/s\" X\n"
           " SG_ B m4 : 8|56@1+ (1,0) [0|0] \"m/s\" X\n",
           binding(WM_Q_VEHICLE_SPEED, "M", "A"));
  TEST_ASSERT_EQUAL_DOUBLE(7, value_of(&f, "can0 123#0307"));  // a short frame: B isn't in it
  TEST_ASSERT_EQUAL(WM_AGAIN, feed(&f, "can0 123#0407060504030201"));
  TEST_ASSERT_EQUAL_UINT64(1, f.counts.ignored);
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "can0 123#03"));
  TEST_ASSERT_EQUAL_UINT64(1, f.counts.malformed);
}

TEST(multiplexers_above_each_other) {
  open_one(&f,
           "BO_ 2147483649 M: 8 X\n SG_ A M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ B m2M : 8|8@1+ (1,0) [0|0] \"\" X\n"
           " SG_ C m1 : 16|8@1+ (1,0) [0|0] \"m/s\" X\n"
           "SG_MUL_VAL_ 2147483649 B A 2-2;\nSG_MUL_VAL_ 2147483649 C B 1-1, 5-7;\n",
           binding(WM_Q_VEHICLE_SPEED, "M", "C"));
  TEST_ASSERT_EQUAL_DOUBLE(9, value_of(&f, "can0 00000001#020109"));
  TEST_ASSERT_EQUAL_DOUBLE(9, value_of(&f, "can0 00000001#020709"));
  TEST_ASSERT_EQUAL(WM_AGAIN, feed(&f, "can0 00000001#020809"));
  TEST_ASSERT_EQUAL(WM_AGAIN, feed(&f, "can0 00000001#010109"));
  TEST_ASSERT_EQUAL(WM_AGAIN, feed(&f, "can0 001#020109"));  // 11 bits: another message
}

// ── ticks ───────────────────────────────────────────────────────────────────────────────────────────────────────────

static void ticks_of(const char *bits, const char *const *frames, const double *want, size_t count) {
  char dbc[160];
  (void)snprintf(dbc, sizeof dbc, "BO_ 257 W: 8 X\n SG_ T : %s (1,0) [0|0] \"\" X\n", bits);
  open_one(&f, dbc, binding(WM_Q_WHEEL_TICKS_LEFT, "W", "T"));
  for (size_t i = 0; i < count; i++) TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(want[i], value_of(&f, frames[i]), frames[i]);
}

TEST(ticks_wrap) {
  const char *frames16[] = {"c 101#F0FF", "c 101#0A00", "c 101#F0FF", "c 101#F07F", "c 101#EFFF"};
  const double want16[] = {65520, 65546, 65520, 32752, 65519};  // half a cycle down, then one short of half up
  ticks_of("0|16@1+", frames16, want16, 5);
  const char *frames8[] = {"c 101#FE", "c 101#01", "c 101#7F", "c 101#81", "c 101#FE"};
  const double want8[] = {254, 257, 383, 385, 510};
  ticks_of("0|8@1+", frames8, want8, 5);
  const char *signed16[] = {"c 101#7FFF", "c 101#8001", "c 101#7FFE"};
  const double want_signed16[] = {32767, 32769, 32766};
  ticks_of("7|16@0-", signed16, want_signed16, 3);
  const char *frames12[] = {"c 101#FF0F", "c 101#0200"};
  const double want12[] = {4095, 4098};
  ticks_of("0|12@1+", frames12, want12, 2);
  const char *frames64[] = {"c 101#FFFFFFFFFFFFFF7F", "c 101#FFFFFFFFFFFFFF7F"};
  const double want64[] = {9223372036854775807.0, 9223372036854775807.0};
  ticks_of("0|64@1+", frames64, want64, 2);
}

TEST(ticks_grow_without_end) {
  open_one(&f, "BO_ 257 W: 2 X\n SG_ T : 0|8@1+ (2,5) [0|0] \"\" X\n", binding(WM_Q_WHEEL_TICKS_RIGHT, "W", "T"));
  double last = 0;
  for (unsigned i = 0; i < 3000; i++) {
    char text[32];
    (void)snprintf(text, sizeof text, "c 101#%02X", (i * 100) & 0xFF);
    last = value_of(&f, text);
  }
  TEST_ASSERT_EQUAL_DOUBLE(2.0 * 2999 * 100 + 5, last);
}

// 16 bits, after 10 s at `per_s` a silence, then a frame that is `moved` ticks on. How far the value moved; NaN:
// unknown.
static double moved_in_silence(int per_s, double silence_s, long moved) {
  char text[32];
  double last = 0;
  open_one(&f, "BO_ 257 W: 2 X\n SG_ T : 0|16@1+ (1,0) [0|0] \"\" X\n", binding(WM_Q_WHEEL_TICKS_LEFT, "W", "T"));
  for (int i = 0; i <= 500; i++) {
    const unsigned raw = (unsigned)(i * per_s / 50) & 0xFFFF;
    (void)snprintf(text, sizeof text, "c 101#%02X%02X", raw & 0xFF, raw >> 8);
    TEST_ASSERT_EQUAL(WM_OK, feed_at(&f, 0.02 * i, text));
    TEST_ASSERT_EQUAL(0, f.got.doubt);
    last = f.got.value[0];
  }
  const unsigned raw = (unsigned)(10L * per_s + moved) & 0xFFFF;
  (void)snprintf(text, sizeof text, "c 101#%02X%02X", raw & 0xFF, raw >> 8);
  TEST_ASSERT_EQUAL(WM_OK, feed_at(&f, 10.0 + silence_s, text));
  return f.got.doubt & WM_DOUBT_COUNTS_WRAPPED ? (double)NAN : f.got.value[0] - last;
}

// At 1500 ticks a second half a cycle takes 22 s. Backwards a robot drives slower, so that 30 s are one number of
// cycles; in 60 s more are possible. A robot that stood may have driven at any speed.
TEST(ticks_after_a_silence) {
  TEST_ASSERT_EQUAL_DOUBLE(200, moved_in_silence(1500, 0.2, 200));
  TEST_ASSERT_EQUAL_DOUBLE(22000, moved_in_silence(1500, 20, 22000));
  TEST_ASSERT_EQUAL_DOUBLE(35000, moved_in_silence(1500, 25, 35000));  // beyond half a cycle
  TEST_ASSERT_EQUAL_DOUBLE(-15000, moved_in_silence(1500, 20, -15000));
  TEST_ASSERT_EQUAL_DOUBLE(-35000, moved_in_silence(-1500, 25, -35000));
  TEST_ASSERT_DOUBLE_IS_NAN(moved_in_silence(1500, 60, 89000));
  TEST_ASSERT_DOUBLE_IS_NAN(moved_in_silence(1500, 60, 464));
  TEST_ASSERT_EQUAL_DOUBLE(0, moved_in_silence(0, 60, 0));
  TEST_ASSERT_EQUAL_DOUBLE(3000, moved_in_silence(0, 60, 3000));  // the other way round is 20 times as far
  TEST_ASSERT_DOUBLE_IS_NAN(moved_in_silence(0, 60, 9000));
  TEST_ASSERT_EQUAL_DOUBLE(500, moved_in_silence(100, 3, 500));
}

// ── counters ────────────────────────────────────────────────────────────────────────────────────────────────────────

static void open_counted(const char *counter) {
  char dbc[200];
  (void)snprintf(dbc, sizeof dbc, "BO_ 257 W: 3 X\n SG_ V : 0|16@1+ (1,0) [0|0] \"m/s\" X\n SG_ %s X\n", counter);
  open_one(&f, dbc, binding(WM_Q_VEHICLE_SPEED, "W", "V"));
}

static wm_status count(unsigned value) {
  char text[32];
  (void)snprintf(text, sizeof text, "c 101#0100%02X", value);
  return feed(&f, text);
}

TEST(lost_by_the_counter) {
  open_counted("WS_ALIVE : 16|8@1+ (1,0) [0|255] \"\"");
  for (unsigned i = 250; i < 270; i++) TEST_ASSERT_EQUAL(WM_OK, count(i & 0xFF));
  TEST_ASSERT_EQUAL_UINT64(0, f.counts.lost);
  TEST_ASSERT_EQUAL(WM_OK, count(17));  // 14, 15, 16 are missing
  TEST_ASSERT_EQUAL_UINT64(3, f.counts.lost);
  TEST_ASSERT_EQUAL(3, f.got.lost_before);
  TEST_ASSERT_EQUAL(WM_OK, count(18));
  TEST_ASSERT_EQUAL(0, f.got.lost_before);
  TEST_ASSERT_EQUAL(WM_OK, count(10));  // 247 missing
  TEST_ASSERT_EQUAL_UINT64(250, f.counts.lost);
}

// Frames that overtook each other in a bridge are missing until they come.
TEST(late_by_the_counter) {
  open_counted("WS_ALIVE : 16|8@1+ (1,0) [0|255] \"\"");
  for (unsigned i = 250; i < 270; i++) TEST_ASSERT_EQUAL(WM_OK, count(i & 0xFF));
  const unsigned swapped[] = {15, 14, 16, 19, 17, 18, 20};
  const unsigned missing[] = {1, 0, 0, 2, 1, 0, 0};
  for (size_t i = 0; i < sizeof swapped / sizeof swapped[0]; i++) {
    TEST_ASSERT_EQUAL(WM_OK, count(swapped[i]));
    TEST_ASSERT_EQUAL_UINT64(missing[i], f.counts.lost);
    TEST_ASSERT_EQUAL(swapped[i] == 15 ? 1 : swapped[i] == 19 ? 2 : 0, f.got.lost_before);
  }
  TEST_ASSERT_EQUAL(WM_OK, count(22));  // 21 is missing, and doesn't come
  for (unsigned i = 23; i < 23 + 512; i++) TEST_ASSERT_EQUAL(WM_OK, count(i & 0xFF));
  TEST_ASSERT_EQUAL_UINT64(1, f.counts.lost);

  open_counted("COUNTER : 16|4@1+ (1,0) [0|14] \"\"");  // a short cycle: each second pair is swapped, for long
  for (unsigned i = 0; i < 30; i++) TEST_ASSERT_EQUAL(WM_OK, count(i % 15));
  for (unsigned i = 30; i < 630; i++)
    TEST_ASSERT_EQUAL(WM_OK, count((i % 4 == 2 ? i + 1 : i % 4 == 3 ? i - 1 : i) % 15));
  TEST_ASSERT_EQUAL_UINT64(0, f.counts.lost);
  TEST_ASSERT_EQUAL(WM_OK, count(7));  // after 14: 0 to 6 are missing
  TEST_ASSERT_EQUAL_UINT64(7, f.counts.lost);
}

TEST(frozen_counter) {
  open_counted("MsgCounter : 16|4@1+ (1,0) [0|15] \"\"");
  for (unsigned i = 0; i < 20; i++) TEST_ASSERT_EQUAL(WM_OK, count(i & 15));
  TEST_ASSERT_EQUAL(WM_AGAIN, count(3));  // a repeated frame or two say nothing
  TEST_ASSERT_EQUAL(WM_AGAIN, count(3));
  for (int i = 0; i < 4; i++) {
    TEST_ASSERT_EQUAL(WM_OK, count(3));
    TEST_ASSERT_EQUAL(WM_DOUBT_FROZEN_COUNTER, f.got.doubt);
  }
  TEST_ASSERT_EQUAL_UINT64(6, f.counts.frozen);
  TEST_ASSERT_EQUAL(WM_OK, count(4));
  TEST_ASSERT_EQUAL(0, f.got.doubt);
  TEST_ASSERT_EQUAL_UINT64(0, f.counts.lost);
}

// AUTOSAR E2E profile 1 counts 0 to 14, others 1 to 15.
TEST(counters_that_leave_a_value_out) {
  open_counted("COUNTER : 16|4@1+ (1,0) [0|14] \"\"");
  for (unsigned i = 0; i < 60; i++) TEST_ASSERT_EQUAL(WM_OK, count(i % 15));
  TEST_ASSERT_EQUAL_UINT64(0, f.counts.lost);
  open_counted("COUNTER : 16|4@1+ (1,0) [0|14] \"\"");
  for (unsigned i = 0; i < 60; i++) TEST_ASSERT_EQUAL(WM_OK, count(i % 15 + 1));
  TEST_ASSERT_EQUAL_UINT64(0, f.counts.lost);
}

TEST(what_only_looks_like_a_counter) {
  open_counted("ERROR_COUNT : 16|8@1+ (1,0) [0|255] \"\"");  // never steps: no proof, no doubt
  for (unsigned i = 0; i < 50; i++) TEST_ASSERT_EQUAL(WM_OK, count(i / 10));
  TEST_ASSERT_EQUAL_UINT64(0, f.counts.lost + f.counts.frozen);
  open_counted("WHEEL_CNT_LEFT : 16|8@1+ (1,0) [0|255] \"\"");  // counts the way
  for (unsigned i = 0; i < 50; i++) TEST_ASSERT_EQUAL(WM_OK, count(i < 20 ? i : 20));
  TEST_ASSERT_EQUAL_UINT64(0, f.counts.frozen);
}

// A signal that is bound is none, whichever part of a sum it is: it may do what it wants.
TEST(a_bound_signal_is_no_counter) {
  for (int part = 0; part < 2; part++) {
    wm_can_binding b = binding(WM_Q_WHEEL_TICKS_LEFT, "W", part ? "V" : "ALIVE_COUNTER");
    b.signal_count = 2;
    (void)snprintf(b.signal[1], sizeof b.signal[1], "%s", part ? "ALIVE_COUNTER" : "V");
    open_one(&f,
             "BO_ 257 W: 3 X\n SG_ V : 0|16@1+ (1,0) [0|0] \"\" X\n"
             " SG_ ALIVE_COUNTER : 16|8@1+ (1,0) [0|255] \"\" X\n",
             b);
    for (unsigned i = 0; i < 60; i++) (void)count((i < 40 ? i : 40 + 7 * i) & 0xFF);
    TEST_ASSERT_EQUAL_UINT64(0, f.counts.lost + f.counts.frozen);
  }
}

// ── what is no value, what is no frame ──────────────────────────────────────────────────────────────────────────────

// A frame is one datum: of its values that are absent it counts once, whether others are there or not.
TEST(absent_values_count_by_the_frame) {
  const wm_can_binding b[] = {binding(WM_Q_WHEEL_SPEED_REAR_LEFT, "W", "L"),
                              binding(WM_Q_WHEEL_SPEED_REAR_RIGHT, "W", "R")};
  TEST_ASSERT_EQUAL(WM_OK, open_with(&f,
                                     "BO_ 257 W: 4 X\n SG_ L : 0|16@1+ (0.01,0) [0|100] \"m/s\" X\n"
                                     " SG_ R : 16|16@1+ (0.01,0) [0|100] \"m/s\" X\n",
                                     b, 2));
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "c 101#FFFFFFFF"));
  TEST_ASSERT_EQUAL_UINT64(1, f.counts.not_finite);
  TEST_ASSERT_EQUAL(WM_OK, feed(&f, "c 101#6400FFFF"));
  TEST_ASSERT_EQUAL(1, f.got.count);
  TEST_ASSERT_EQUAL_UINT64(2, f.counts.not_finite);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(f.err.text, "a signal marks that it has no value"), f.err.text);
}

TEST(no_value) {
  open_one(&f,
           "BO_ 257 W: 3 X\n SG_ V : 0|16@1+ (0.01,0) [0|100] \"m/s\" X\n"
           "VAL_ 257 V 65534 \"Error\" 300 \"three\";\n",
           binding(WM_Q_VEHICLE_SPEED, "W", "V"));
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "c 101#FEFF"));  // VAL_ says so
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "c 101#FFFF"));  // all bits set, and outside of the range
  TEST_ASSERT_EQUAL_UINT64(2, f.counts.not_finite);
  TEST_ASSERT_NOT_NULL(strstr(f.err.text, "no value"));
  TEST_ASSERT_EQUAL_DOUBLE(3, value_of(&f, "c 101#2C01"));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 300,
                            value_of(&f, "c 101#3075"));  // outside of the range: makers' ranges are wrong too often
  open_one(&f,
           "BO_ 257 W: 3 X\n SG_ V : 0|16@1- (0.01,0) [0|0] \"m/s\" X\n"
           "VAL_ 257 V -2 \"Error\" -32768 \"Invalid\" -32769 \"SNA\";\n",
           binding(WM_Q_VEHICLE_SPEED, "W", "V"));
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "c 101#FEFF"));
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "c 101#0080"));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 327.67, value_of(&f, "c 101#FF7F"));  // -32769 has more bits
}

// SAE J1939-71: FB00 and above is no value of two bytes, where the range leaves it out.
TEST(no_value_of_j1939) {
  static const char kLater[] =
      " SG_ V : 0|16@1+ (0.00390625,0) [0|%s] \"km/h\" X\nBA_DEF_ BO_ \"VFrameFormat\" ENUM \"%s\";\n"
      "BA_DEF_DEF_ \"VFrameFormat\" \"%s\";\n";
  static const struct {
    const char *most, *format;
    int is_value;
  } kKinds[] = {{"250.996", "J1939PG", 0}, {"255.997", "J1939PG", 1}, {"250.996", "ExtendedCAN", 1}};
  for (size_t i = 0; i < sizeof kKinds / sizeof kKinds[0]; i++) {
    char dbc[512] = "BO_ 2566844672 W: 8 X\n";
    (void)snprintf(dbc + strlen(dbc), sizeof dbc - strlen(dbc), kLater, kKinds[i].most, kKinds[i].format,
                   kKinds[i].format);
    open_one(&f, dbc, binding(WM_Q_VEHICLE_SPEED, "W", "V"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 250.99609375 / 3.6, value_of(&f, "c 18FEF100#FFFA"));
    TEST_ASSERT_EQUAL_MESSAGE(kKinds[i].is_value ? WM_OK : WM_BAD_DATA, feed(&f, "c 18FEF100#00FE"), kKinds[i].format);
    TEST_ASSERT_EQUAL_MESSAGE(kKinds[i].is_value ? WM_OK : WM_BAD_DATA, feed(&f, "c 18FEF100#00FB"), kKinds[i].format);
  }
}

TEST(what_is_not_decoded) {
  wm_can_binding b = binding(WM_Q_VEHICLE_SPEED, "W", "V");
  (void)snprintf(b.bus, sizeof b.bus, "can1");
  open_one(&f, "BO_ 257 W: 3 X\n SG_ V : 0|16@1+ (1,0) [0|0] \"m/s\" X\n", b);
  TEST_ASSERT_EQUAL(WM_AGAIN, feed(&f, "can0 101#0100"));  // another bus
  TEST_ASSERT_EQUAL(WM_AGAIN, feed(&f, "can1 102#0100"));  // another id
  TEST_ASSERT_EQUAL(WM_AGAIN, feed(&f, "can1 101#R2"));
  TEST_ASSERT_EQUAL_UINT64(3, f.counts.ignored);
  TEST_ASSERT_EQUAL(WM_AGAIN, feed(&f, "can1 20000101#0100"));
  TEST_ASSERT_EQUAL_UINT64(1, f.counts.bus_errors);
  TEST_ASSERT_EQUAL(WM_BAD_DATA, feed(&f, "can1 101#01"));
  TEST_ASSERT_EQUAL_UINT64(1, f.counts.malformed);
  TEST_ASSERT_EQUAL_STRING("can1: W (id 101, 1 bytes): the frame is shorter than the signals that are bound",
                           f.err.text);
  TEST_ASSERT_EQUAL_DOUBLE(1, value_of(&f, "can1 101#0100"));
}

TEST(several_quantities_and_ids) {
  const wm_can_binding b[] = {binding(WM_Q_WHEEL_TICKS_LEFT, "W", "L"), binding(WM_Q_YAW_RATE, "Y", "R"),
                              binding(WM_Q_WHEEL_TICKS_RIGHT, "W", "R")};
  wm_status status = open_with(&f,
                               "BO_ 2147483905 W: 4 X\n SG_ L : 0|16@1+ (1,0) [0|0] \"\" X\n"
                               " SG_ R : 16|16@1+ (1,0) [0|0] \"\" X\nBO_ 16 Y: 2 X\n"
                               " SG_ R : 0|16@1- (1,0) [0|0] \"rad/s\" X\n",
                               b, 3);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, f.err.text);
  TEST_ASSERT_EQUAL(WM_OK, feed(&f, "can0 00000101#01000200"));
  TEST_ASSERT_EQUAL(2, f.got.count);
  TEST_ASSERT_EQUAL(WM_Q_WHEEL_TICKS_LEFT, f.got.id[0]);
  TEST_ASSERT_EQUAL(WM_Q_WHEEL_TICKS_RIGHT, f.got.id[1]);
  TEST_ASSERT_EQUAL_DOUBLE(2, f.got.value[1]);
  wm_can_match matches[4];
  TEST_ASSERT_EQUAL(2, wm_can_decoder_matches(f.decoder, matches, 4));
  TEST_ASSERT_EQUAL_HEX32(16, matches[0].id);
  TEST_ASSERT_EQUAL_HEX32(0x7FF, matches[0].mask);
  TEST_ASSERT_EQUAL(0, matches[0].is_extended);
  TEST_ASSERT_EQUAL_HEX32(0x101, matches[1].id);
  TEST_ASSERT_EQUAL_HEX32(0x1FFFFFFF, matches[1].mask);
  TEST_ASSERT_EQUAL(1, matches[1].is_extended);
  TEST_ASSERT_EQUAL(2, wm_can_decoder_matches(f.decoder, matches, 0));
  TEST_ASSERT_EQUAL_HEX32(1u << WM_Q_WHEEL_TICKS_LEFT | 1u << WM_Q_WHEEL_TICKS_RIGHT | 1u << WM_Q_YAW_RATE,
                          wm_can_decoder_quantities(f.decoder));
}
