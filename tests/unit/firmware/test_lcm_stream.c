// SPDX-License-Identifier: Apache-2.0
// Streams over LCM: their events, and what a sender does to them: absent, silent, late, doubled, NaN, another clock,
// too fast, back again.
#include "live/lcm_device.h"
#include "live_source.h"
#include "waymark/lcm_streams.h"

static lcm_t *lcm;

void tearDown(void) {
  source_close();
  if (lcm) lcm_destroy(lcm);
  lcm = NULL;
}

static void begin(wm_lcm_device_config config) {
  const wm_row_mountings upside_down = {.imu = {.rpy_rad = {M_PI, 0, 0.5}}};
  if (config.rate_max_hz == 0) config.rate_max_hz = 1000;
  lcm = lcm_create("memq://");
  wm_row_device *device;
  TEST_ASSERT_EQUAL(WM_OK, lcm_device_open(&config, "memq://", "T_", lcm, &device, &err));
  source_open(device, &upside_down);
}

static void begin_motion(void) { begin((wm_lcm_device_config){.stream = "motion", .channel = "MOTION"}); }

static void publish(const char *stream, const char *channel, wm_stream_row row) {
  uint8_t bytes[256];
  const size_t length = wm_lcm_row(stream, &row, bytes, sizeof bytes);
  TEST_ASSERT_GREATER_THAN(0, length);
  lcm_publish(lcm, channel, bytes, (unsigned)length);
}

static void send_motion(wm_time_ns t_ns, double v, double vy, double w) {
  publish("motion", "T_MOTION", (wm_stream_row){.t_ns = t_ns, .number = {v, vy, w}});
}

static void assert_refused(const char *why) {
  expect(WM_AGAIN);
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.malformed + source->counts.not_finite);
  expect_problem(why);
}

TEST(a_twist_is_an_event_of_motion) {
  begin_motion();
  TEST_ASSERT_TRUE(source->is_motion && source->is_live);
  const wm_time_ns now_ns = wm_monotonic_ns();
  send_motion(now_ns - 5 * MS, 0.5, 0.25, -0.125);
  expect(WM_OK);
  TEST_ASSERT_EQUAL(WM_EVENT_TWIST6, event.kind);
  TEST_ASSERT_EQUAL_INT64(now_ns - 5 * MS, event.t_ns);
  TEST_ASSERT_GREATER_OR_EQUAL_INT64(now_ns, event.arrival_ns);
  TEST_ASSERT_LESS_OR_EQUAL_INT64(wm_monotonic_ns(), event.arrival_ns);
  TEST_ASSERT_EQUAL_DOUBLE(0.25, event.as.twist6.v_mps[1]);
  TEST_ASSERT_EQUAL_DOUBLE(-0.125, event.as.twist6.w_radps[2]);
  TEST_ASSERT_EQUAL_UINT32(0, event.seq);
  send_motion(now_ns, 0.5, (double)NAN, -0.125);
  expect(WM_OK);
  TEST_ASSERT_EQUAL(WM_EVENT_TWIST2, event.kind);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, event.as.twist2.v_mps);
  TEST_ASSERT_EQUAL_UINT32(1, event.seq);
  TEST_ASSERT_EQUAL_INT64(now_ns, row_source_row(source)->t_ns);
  TEST_ASSERT_EQUAL_UINT64(2, source->counts.received);
}

TEST(a_gyro_is_a_turn_rate_by_its_mounting) {
  begin((wm_lcm_device_config){.stream = "imu", .channel = "GYRO"});
  wm_stream_row row = {.t_ns = wm_monotonic_ns(), .number = {0.5, -0.25, -0.125, 0, 0, -9.8}};
  publish("imu", "T_GYRO", row);
  expect(WM_OK);
  TEST_ASSERT_EQUAL(WM_EVENT_QUANTITIES, event.kind);
  const wm_quantities *q = &event.as.quantities;
  TEST_ASSERT_EQUAL(6, q->count);
  TEST_ASSERT_EQUAL(WM_Q_YAW_RATE, q->id[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.125, q->value[0]);
  TEST_ASSERT_EQUAL(WM_Q_ACCELERATION_Z, q->id[5]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 9.8, q->value[5]);
  // Rates of a turn are the same length in any axes.
  const double turn2 = q->value[0] * q->value[0] + q->value[1] * q->value[1] + q->value[2] * q->value[2];
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5 * 0.5 + 0.25 * 0.25 + 0.125 * 0.125, turn2);
  TEST_ASSERT_DOUBLE_IS_NAN(row_source_row(source)->number[6]);  // a sigma of 0 is not given
  row.t_ns = wm_monotonic_ns();
  row.number[4] = (double)NAN;  // no force: the rates alone
  publish("imu", "T_GYRO", row);
  expect(WM_OK);
  TEST_ASSERT_EQUAL(3, event.as.quantities.count);
  row.number[4] = 0;
  row.t_ns = wm_monotonic_ns();
  row.number[6] = -1;
  publish("imu", "T_GYRO", row);
  assert_refused("T_GYRO: sigma_wx_radps: -1 is outside of what can be");
}

// Rows of the other streams.
static void begin_row(const char *stream, const double number[6]) {
  wm_lcm_device_config config = {.channel = "IT"};
  (void)snprintf(config.stream, sizeof config.stream, "%s", stream);
  begin(config);
  wm_stream_row row = {.t_ns = wm_monotonic_ns()};
  memcpy(row.number, number, 6 * sizeof number[0]);
  publish(stream, "T_IT", row);
  expect(WM_OK);
  TEST_ASSERT_TRUE(source->kinds & WM_EVENT_BIT(event.kind));
}

TEST(a_twist_in_six_degrees) {
  begin_row("motion6", (const double[6]){1, 2, 3, 4, 5, 6});
  TEST_ASSERT_EQUAL(WM_EVENT_TWIST6, event.kind);
  TEST_ASSERT_EQUAL_DOUBLE(3, event.as.twist6.v_mps[2]);
  TEST_ASSERT_EQUAL_DOUBLE(6, event.as.twist6.w_radps[2]);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.twist6.v_sigma_mps);  // no number of the message
  tearDown();
  const double none = (double)NAN;
  begin_row("motion6", (const double[6]){1, 2, 3, none, none, none});
  TEST_ASSERT_EQUAL_DOUBLE(3, event.as.twist6.v_mps[2]);
  TEST_ASSERT_DOUBLE_IS_NAN(event.as.twist6.w_radps[2]);
}

TEST(wheels_and_steering_are_quantities) {
  static const struct {
    const char *stream;
    wm_quantity first, second;
  } kEach[] = {{"ticks", WM_Q_WHEEL_TICKS_LEFT, WM_Q_WHEEL_TICKS_RIGHT},
               {"speeds", WM_Q_WHEEL_SPEED_REAR_LEFT, WM_Q_WHEEL_SPEED_REAR_RIGHT},
               {"steering", WM_Q_VEHICLE_SPEED, WM_Q_ROAD_WHEEL}};
  for (size_t i = 0; i < sizeof kEach / sizeof kEach[0]; i++) {
    begin_row(kEach[i].stream, (const double[6]){0.5, -0.25});
    const wm_quantities *q = &event.as.quantities;
    TEST_ASSERT_TRUE(source->is_motion);
    TEST_ASSERT_EQUAL(WM_EVENT_QUANTITIES, event.kind);
    TEST_ASSERT_EQUAL(2, q->count);
    TEST_ASSERT_EQUAL(kEach[i].first, q->id[0]);
    TEST_ASSERT_EQUAL(kEach[i].second, q->id[1]);
    TEST_ASSERT_EQUAL_DOUBLE(0.5, q->value[0]);
    TEST_ASSERT_EQUAL_DOUBLE(-0.25, q->value[1]);
    tearDown();
  }
}

TEST(headings_depths_and_positions_are_observations) {
  begin_row("heading", (const double[6]){3.5, 0.01});
  TEST_ASSERT_FALSE(source->is_motion);
  TEST_ASSERT_EQUAL_DOUBLE(3.5 - 2 * M_PI, event.as.heading.heading_rad);
  tearDown();
  begin_row("depth", (const double[6]){12.5, 0.125});
  const wm_position *p = &event.as.position;
  TEST_ASSERT_DOUBLE_IS_NAN(p->p_m[0]);
  TEST_ASSERT_EQUAL_DOUBLE(-12.5, p->p_m[2]);
  TEST_ASSERT_EQUAL_DOUBLE(0.125, p->sigma_z_m);
  tearDown();
  begin_row("gnss", (const double[6]){1, 2, NAN, 0.5, 0});
  TEST_ASSERT_EQUAL_DOUBLE(2, p->p_m[1]);
  TEST_ASSERT_DOUBLE_IS_NAN(p->p_m[2]);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, p->sigma_xy_m);
  TEST_ASSERT_DOUBLE_IS_NAN(p->sigma_z_m);
}

TEST(an_absent_sender_is_said) {
  begin_motion();
  expect(WM_AGAIN);
  expect_device(WM_DEVICE_ABSENT, "no usable motion_t on T_MOTION yet");
}

TEST(a_silent_sender_is_said_and_its_return) {
  begin_motion();
  send_motion(wm_monotonic_ns(), 1, 0, 0);
  expect(WM_OK);
  TEST_ASSERT_EQUAL(WM_DEVICE_WORKS, source->counts.device);
  wait_for(WM_DEVICE_STALLED, "");
  send_motion(wm_monotonic_ns(), 1, 0, 0);
  expect(WM_OK);
  TEST_ASSERT_EQUAL(WM_DEVICE_WORKS, source->counts.device);
  TEST_ASSERT_EQUAL_STRING("motion_t comes on T_MOTION", source->counts.device_note);
}

TEST(the_same_and_older_stamps_are_counted) {
  begin_motion();
  const wm_time_ns t_ns = wm_monotonic_ns();
  const wm_time_ns stamps[] = {t_ns, t_ns, t_ns - 300 * MS};
  for (size_t i = 0; i < 3; i++) {
    send_motion(stamps[i], 1, 0, 0);
    TEST_ASSERT_EQUAL(i == 0 ? WM_OK : WM_AGAIN, next());
  }
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.ignored);
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.out_of_order);
}

// A measurement that is sent again is ignored; a stamp that stands still for longer than a period of silence is frozen.
TEST(a_stamp_that_stands_still_is_frozen) {
  begin_motion();
  const wm_time_ns t_ns = wm_monotonic_ns(), until_ns = t_ns + 10 * WM_NS_PER_S;
  send_motion(t_ns, 1, 0, 0);
  expect(WM_OK);
  while (source->counts.frozen == 0 && wm_monotonic_ns() < until_ns) {
    send_motion(t_ns, 1, 0, 0);
    expect(WM_AGAIN);
    if (source->counts.frozen > 0) TEST_ASSERT_GREATER_THAN_INT64(2 * WM_NS_PER_S, wm_monotonic_ns() - t_ns);
  }
  TEST_ASSERT_GREATER_THAN_UINT64(0, source->counts.frozen);
}

TEST(numbers_that_cannot_be_are_refused) {
  const struct {
    double number[3];
    const char *why;
  } wrong[] = {{{NAN, 0, 0}, "v_mps is not a finite number"},
               {{0, 0, INFINITY}, "w_radps is not a finite number"},
               {{0, 2000, 0}, "vy_mps: 2000 is outside of what can be (-1000 to 1000)"}};
  for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
    begin_motion();
    send_motion(wm_monotonic_ns(), wrong[i].number[0], wrong[i].number[1], wrong[i].number[2]);
    assert_refused(wrong[i].why);
    TEST_ASSERT_EQUAL_UINT64(1, source->counts.not_finite);
    TEST_ASSERT_EQUAL(WM_DEVICE_ABSENT, source->counts.device);  // nothing usable
    tearDown();
  }
}

TEST(rubbish_and_other_types_are_refused) {
  begin_motion();
  lcm_publish(lcm, "T_MOTION", "rubbish", 7);
  assert_refused("T_MOTION: does not match motion_t of this version");
  publish("imu", "T_MOTION", (wm_stream_row){.t_ns = 1});
  expect(WM_AGAIN);
  TEST_ASSERT_EQUAL_UINT64(2, source->counts.malformed);
}

// Whole but for its end, as a sender makes it whose lists or names are too short.
TEST(a_short_message_is_called_short) {
  uint8_t message[200];
  begin_motion();
  const wm_stream_row row = {.t_ns = wm_monotonic_ns()};
  const size_t length = wm_lcm_row("motion", &row, message, sizeof message);
  TEST_ASSERT_GREATER_THAN_size_t(8, length);
  lcm_publish(lcm, "T_MOTION", message, (unsigned)length - 1);
  assert_refused("T_MOTION: is shorter than motion_t of this version: are all its numbers there?");
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(source->counts.device_note, "what comes is refused"), source->counts.device_note);
  TEST_ASSERT_EQUAL_UINT32(1, source->counts.news);  // said once
}

TEST(stamps_of_another_clock_are_refused) {
  static const struct {
    wm_time_ns off_ns;
    const char *why;
  } kOff[] = {{1700000000 * WM_NS_PER_S, "1.7e+09 s ahead of this computer's CLOCK_MONOTONIC"},
              {20 * MS, "0.02 s ahead of"},
              {-11 * WM_NS_PER_S, "11 s behind"}};
  for (size_t i = 0; i < sizeof kOff / sizeof kOff[0]; i++) {
    begin_motion();
    send_motion(wm_monotonic_ns() + kOff[i].off_ns, 1, 0, 0);
    assert_refused(kOff[i].why);
    tearDown();
  }
  begin_motion();
  send_motion(0, 1, 0, 0);
  assert_refused("t_ns is not above 0");
}

TEST(a_senders_clock_is_followed) {
  begin((wm_lcm_device_config){.stream = "motion", .channel = "MOTION", .clock = WM_LCM_CLOCK_SENDER});
  const wm_time_ns ahead_ns = 1000 * WM_NS_PER_S;
  for (int i = 0; i < 20; i++) {
    const wm_time_ns sent_ns = wm_monotonic_ns(), leap_ns = i < 10 ? 0 : -500 * WM_NS_PER_S;
    send_motion(sent_ns + ahead_ns + leap_ns, 1, 0, 0);
    const wm_status status = next();
    if (i >= 10 && status == WM_AGAIN) continue;  // a step back of the clock looks like a delay at first
    TEST_ASSERT_EQUAL(WM_OK, status);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(event.arrival_ns, event.t_ns);
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(sent_ns - MS, event.t_ns);
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(2 * MS, source->counts.stamp_uncertainty_ns);
  }
  TEST_ASSERT_GREATER_OR_EQUAL_UINT64(12, source->counts.received);
}

TEST(a_flood_is_bounded) {
  begin((wm_lcm_device_config){.stream = "motion", .channel = "MOTION", .rate_max_hz = 2});
  const wm_time_ns t_ns = wm_monotonic_ns() - WM_NS_PER_S;
  for (int i = 0; i < 20; i++) {
    send_motion(t_ns + i, 1, 0, 0);
    (void)next();
  }
  TEST_ASSERT_GREATER_OR_EQUAL_UINT64(15, source->counts.overflows);
  TEST_ASSERT_EQUAL_UINT64(20, source->counts.overflows + source->counts.received);
}
