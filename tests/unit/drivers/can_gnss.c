// SPDX-License-Identifier: Apache-2.0
// Positions from a receiver on the bus, against lengths of a degree on WGS84 and figures of PROJ, and lines of a log
// that are read again as they were written.
#include "common/suite.h"
#include "waymark/can.h"

#define DEGREE (M_PI / 180.0)
// A degree at latitude 45: of the parallel and of the meridian.
#define EAST_45_M 78846.835
#define NORTH_45_M 111131.777

static wm_can_gnss gnss;
static wm_position at;

static void begin(double latitude, double longitude, double altitude_m) {
  wm_can_gnss_init(&gnss, (double[]){latitude, longitude, altitude_m});
}

static int take(size_t count, const uint8_t *id, const double *value) {
  wm_quantities values = {.count = (uint8_t)count};
  for (size_t i = 0; i < count; i++) {
    values.id[i] = id[i];
    values.value[i] = value[i];
  }
  memset(&at, 0x55, sizeof at);
  return wm_can_gnss_take(&gnss, &values, &at);
}

static int fix(double latitude, double longitude) {
  return take(2, (uint8_t[]){WM_CAN_LATITUDE, WM_CAN_LONGITUDE}, (double[]){latitude * DEGREE, longitude * DEGREE});
}

static int value(uint8_t id, double v) { return take(1, &id, &v); }

TEST(lengths_of_a_degree) {
  begin(45, 10, (double)NAN);
  TEST_ASSERT_EQUAL(1, fix(45, 10.002));
  TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.002 * EAST_45_M, at.p_m[0]);
  TEST_ASSERT_EQUAL(1, fix(45.002, 10));
  TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.002 * NORTH_45_M, at.p_m[1]);
  begin(0, 0, (double)NAN);
  TEST_ASSERT_EQUAL(1, fix(-0.01, -0.01));
  TEST_ASSERT_DOUBLE_WITHIN(0.01, -1113.195, at.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, -1105.743, at.p_m[1]);
  begin(60, 179.99, (double)NAN);  // over the date line
  TEST_ASSERT_EQUAL(1, fix(60, -179.99));
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.02 * 55800.0, at.p_m[0]);
}

// On a plateau a degree is longer by altitude over radius.
TEST(altitude_of_the_map) {
  begin(45, 10, 4000);
  (void)value(WM_CAN_ALTITUDE, 4010.5);
  TEST_ASSERT_EQUAL(1, fix(45.0, 10.001));
  TEST_ASSERT_DOUBLE_WITHIN(0.001, 0.001 * (EAST_45_M + 4010.5 * DEGREE * cos(45 * DEGREE)), at.p_m[0]);
  TEST_ASSERT_EQUAL(1, fix(45, 10));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 10.5, at.p_m[2]);
}

TEST(first_fix_is_the_origin) {
  begin((double)NAN, (double)NAN, (double)NAN);
  (void)value(WM_CAN_ALTITUDE, 250);
  TEST_ASSERT_EQUAL(1, fix(45, 10));
  for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, at.p_m[i]);
  (void)value(WM_CAN_ALTITUDE, 252);
  TEST_ASSERT_EQUAL(1, fix(45.001, 10));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, at.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.001 * NORTH_45_M, at.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(0.002, 2.0, at.p_m[2]);  // less what the earth falls away in 111 m
}

TEST(both_coordinates_make_a_position) {
  begin(45, 10, (double)NAN);
  TEST_ASSERT_EQUAL(0, value(WM_CAN_LATITUDE, 45 * DEGREE));
  TEST_ASSERT_EQUAL(0, value(WM_CAN_SIGMA_XY, 1.5));
  TEST_ASSERT_EQUAL(1, value(WM_CAN_LONGITUDE, 10 * DEGREE));
  TEST_ASSERT_EQUAL_DOUBLE(1.5, at.sigma_xy_m);
  TEST_ASSERT_EQUAL(0, value(WM_CAN_LONGITUDE, 10 * DEGREE));  // each position needs both anew
  TEST_ASSERT_EQUAL(1, value(WM_CAN_LATITUDE, 45 * DEGREE));
  TEST_ASSERT_EQUAL(0, value(WM_Q_YAW_RATE, 1.0));
  TEST_ASSERT_EQUAL(0, value(WM_CAN_COUNT, 1.0));
}

TEST(accuracy) {
  begin(45, 10, 0);
  TEST_ASSERT_EQUAL(1, fix(45, 10));
  TEST_ASSERT_EQUAL_DOUBLE(5.0, at.sigma_xy_m);  // stated by none
  TEST_ASSERT_DOUBLE_IS_NAN(at.sigma_z_m);       // without an altitude
  TEST_ASSERT_DOUBLE_IS_NAN(at.p_m[2]);
  (void)value(WM_CAN_ALTITUDE, 3);
  (void)value(WM_CAN_SIGMA_XY, 0.8);
  TEST_ASSERT_EQUAL(1, fix(45, 10));
  TEST_ASSERT_EQUAL_DOUBLE(0.8, at.sigma_xy_m);
  TEST_ASSERT_EQUAL_DOUBLE(1.6, at.sigma_z_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 3.0, at.p_m[2]);
  (void)value(WM_CAN_SIGMA_Z, 2.5);
  TEST_ASSERT_EQUAL(1, fix(45, 10));
  TEST_ASSERT_EQUAL_DOUBLE(2.5, at.sigma_z_m);
  (void)value(WM_CAN_ALTITUDE_VALID, 0);
  TEST_ASSERT_EQUAL(1, fix(45, 10));
  TEST_ASSERT_DOUBLE_IS_NAN(at.sigma_z_m);
}

TEST(without_a_fix) {
  begin(45, 10, 0);
  TEST_ASSERT_EQUAL(0, fix(0, 0));
  TEST_ASSERT_EQUAL(1, fix(0, 0.001));  // a fix on the equator
  TEST_ASSERT_EQUAL(1, fix(0.001, 0));
  TEST_ASSERT_EQUAL(0, fix(90, 10));
  TEST_ASSERT_EQUAL(0, fix(45, 181));
  TEST_ASSERT_EQUAL(1, fix(45, -180));
  (void)value(WM_CAN_VALID, 0);
  TEST_ASSERT_EQUAL(0, fix(45, 10));
  (void)value(WM_CAN_VALID, 1);
  TEST_ASSERT_EQUAL(1, fix(45, 10));
}

TEST(names_of_quantities) {
  TEST_ASSERT_EQUAL_STRING("yaw_rate", wm_can_quantity_name(WM_Q_YAW_RATE));
  TEST_ASSERT_EQUAL_STRING("acceleration_z", wm_can_quantity_name(WM_Q_COUNT - 1));
  TEST_ASSERT_EQUAL_STRING("gnss_latitude", wm_can_quantity_name(WM_CAN_LATITUDE));
  TEST_ASSERT_EQUAL_STRING("gnss_altitude_valid", wm_can_quantity_name(WM_CAN_COUNT - 1));
  TEST_ASSERT_EQUAL_STRING("?", wm_can_quantity_name(WM_CAN_COUNT));
}

TEST(written_lines_are_read_again) {
  const char *const lines[] = {"(1700000000.000001) can0 123#",
                               "(0.000000) can0 7FF#0011223344556677",
                               "(1.500000) vcan1 00000123#DE",
                               "(1.500000) can0 123#R",
                               "(1.500000) can0 123#R8",
                               "(1.500000) can0 123##B12C20304",
                               "(1.500000) can0 20000004#0004000000000000"};
  char out[400];
  for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
    wm_can_frame frame;
    wm_error err;
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_candump_parse(lines[i], strlen(lines[i]), &frame, &err), err.text);
    const size_t length = wm_candump_write(&frame, out, sizeof out);
    TEST_ASSERT_EQUAL(strlen(lines[i]) + 1, length);
    TEST_ASSERT_EQUAL('\n', out[length - 1]);
    TEST_ASSERT_EQUAL('\0', out[length]);
    TEST_ASSERT_EQUAL_STRING_LEN(lines[i], out, length - 1);
  }
}

TEST(lines_before_the_epoch_and_without_room) {
  wm_can_frame frame = {.t_ns = -1500000000, .id = 0x12, .length = 8};
  char out[64];
  strcpy(frame.iface, "can0");
  const size_t length = wm_candump_write(&frame, out, sizeof out);
  TEST_ASSERT_EQUAL_STRING("(-1.500000) can0 012#0000000000000000\n", out);
  for (size_t room = 1; room < sizeof out; room++) {
    memset(out, 0x7e, sizeof out);
    const size_t written = wm_candump_write(&frame, out, room);
    TEST_ASSERT(written == 0 || written == length);
    TEST_ASSERT_LESS_THAN(room, written);
    if (room < sizeof out) TEST_ASSERT_EQUAL_HEX8(0x7e, out[room]);
  }
}
