// SPDX-License-Identifier: Apache-2.0
// A velocity log over TCP, of which the test is the server: velocities on the vehicle's axes, absent, silent, without
// bottom lock, repeated, other reports, half a line, another clock, its end, back again.
#include "cli/doctor/doctor.h"
#include "live_source.h"

#define TRANSIT_US 189319  // of the manual's example

static wm_dvl_device_config config;
static wm_row_mountings mountings;
static int64_t ahead_us;  // of the log's clock against the monotonic one

void setUp(void) {
  config = (wm_dvl_device_config){.host = "127.0.0.1"};
  mountings = (wm_row_mountings){0};
  ahead_us = INT64_C(1638191471000000);  // a clock of its own
  listen_at(&config.port);
}

void tearDown(void) {
  source_close();
  hang_up();
}

static void welcome(void) {
  accept_run();
  wait_for(WM_DEVICE_WORKS, "");
}

static void begin(void) {
  wm_row_device *device;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_dvl_open(&config, &device, &err), err.text);
  source_open(device, &mountings);
}

static void begin_connected(void) {
  begin();
  welcome();
}

static int64_t monotonic_us(void) { return wm_monotonic_ns() / 1000; }

// A report of an echo at that time of the monotonic clock, sent now.
static void report_of(int64_t echo_us, int is_valid, const char *speeds) {
  char text[800];
  (void)snprintf(text, sizeof text,
                 "{\"time\":100.5,%s,\"covariance\":[[1e-6,0,0],[0,1e-6,0],[0,0,1e-6]],\"altitude\":1.5,"
                 "\"velocity_valid\":%s,\"status\":0,\"format\":\"json_v3.1\",\"type\":\"velocity\","
                 "\"time_of_validity\":%lld,\"time_of_transmission\":%lld}\r\n",
                 speeds, is_valid ? "true" : "false", (long long)(echo_us + ahead_us),
                 (long long)(echo_us + TRANSIT_US + ahead_us));
  say(text);
}

#define SPEEDS "\"vx\":0.5,\"vy\":0.2,\"vz\":-0.1,\"fom\":0.003"

static void send_report(int is_valid, const char *speeds) {
  (void)usleep(2000);
  report_of(monotonic_us() - TRANSIT_US, is_valid, speeds);
}

static void report(int is_valid, const char *speeds, wm_status status) {
  send_report(is_valid, speeds);
  expect(status);
}

// The A50's y points to the right and its z down. The stamp is that of the echo.
TEST(a_velocity_is_on_the_vehicles_axes) {
  static const double kRight[] = {0.5, -0.2, 0.1};
  begin_connected();
  report(1, SPEEDS, WM_OK);
  TEST_ASSERT_EQUAL(WM_EVENT_TWIST6, event.kind);
  for (int i = 0; i < 3; i++) {
    TEST_ASSERT_EQUAL_DOUBLE(kRight[i], event.as.twist6.v_mps[i]);
    TEST_ASSERT_DOUBLE_IS_NAN(event.as.twist6.w_radps[i]);
    TEST_ASSERT_EQUAL_DOUBLE(0, event.as.twist6.arm_m[i]);
  }
  TEST_ASSERT_EQUAL_DOUBLE(0.003, event.as.twist6.v_sigma_mps);
  TEST_ASSERT_INT64_WITHIN(50 * MS, wm_monotonic_ns() - TRANSIT_US * 1000, event.t_ns);
  expect_device(WM_DEVICE_WORKS, "0 without bottom lock");
}

// It looks to the left and backwards, half a metre behind base_link.
TEST(its_mounting_is_calibration_yamls) {
  mountings.motion6 = (wm_mounting){.xyz_m = {-0.5, 0, -0.2}, .rpy_rad = {0, 0, M_PI_2}};
  begin_connected();
  report(1, SPEEDS, WM_OK);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.2, event.as.twist6.v_mps[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.5, event.as.twist6.v_mps[1]);
  TEST_ASSERT_EQUAL_DOUBLE(-0.5, event.as.twist6.arm_m[0]);
  TEST_ASSERT_EQUAL_DOUBLE(-0.2, event.as.twist6.arm_m[2]);
}

// A small figure of merit is no precision where there is no lock.
TEST(without_bottom_lock_nothing_is_measured) {
  begin_connected();
  report(1, SPEEDS, WM_OK);
  for (int i = 0; i < 5; i++) {
    report(0, "\"vx\":0.56,\"vy\":-0.02,\"vz\":0.003,\"fom\":0.0002", WM_AGAIN);
  }
  TEST_ASSERT_EQUAL_UINT64(5, source->counts.ignored);
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.received);
  expect_device(WM_DEVICE_WORKS, "5 without bottom lock");
  const wm_time_ns until_ns = wm_monotonic_ns() + 5 * WM_NS_PER_S;
  while (source->counts.device == WM_DEVICE_WORKS && wm_monotonic_ns() < until_ns) {
    send_report(0, "\"vx\":0,\"vy\":0,\"vz\":0,\"fom\":2.66");
    (void)next();
    (void)usleep(20000);
  }
  expect_device(WM_DEVICE_DOWN, "has no lock on the bottom");
  send_report(1, SPEEDS);
  while (next() != WM_OK) {
  }
  expect_device(WM_DEVICE_WORKS, "without bottom lock");
}

TEST(repeats_of_a_report_are_one) {
  static const char *const kFirst =
      "{\"time\":120.7,\"vx\":0.1,\"vy\":0,\"vz\":0,\"fom\":0.001,\"altitude\":1.5,"
      "\"velocity_valid\":true,\"status\":0,\"format\":\"json_v1\"}\n";
  begin_connected();
  const int64_t echo_us = monotonic_us() - TRANSIT_US;
  for (int i = 0; i < 5; i++) {
    report_of(echo_us, 1, SPEEDS);
    expect(i == 0 ? WM_OK : WM_AGAIN);
  }
  for (int i = 0; i < 5; i++) {
    say(kFirst);  // without times: the whole report is the same
    (void)usleep(2000);
    expect(i == 0 ? WM_OK : WM_AGAIN);
  }
  TEST_ASSERT_EQUAL_UINT64(2, source->counts.received);
  TEST_ASSERT_EQUAL_UINT64(8, source->counts.ignored);
  TEST_ASSERT_EQUAL_UINT64(0, source->counts.out_of_order);
  TEST_ASSERT_GREATER_OR_EQUAL(200 * MS, source->counts.stamp_uncertainty_ns);
}

TEST(other_reports_are_counted_by_name) {
  begin_connected();
  say("{\"ts\":1.5,\"x\":1,\"y\":2,\"z\":3,\"std\":0.1,\"roll\":0,\"pitch\":0,\"yaw\":0,\"type\":\"position_local\","
      "\"status\":0,\"format\":\"json_v3.1\"}\n{\"response_to\":\"get_config\",\"success\":true,\"type\":\"response\"}"
      "\n"
      "{\"vx\":9,\"vy\":9,\"vz\":9,\"fom\":0.1,\"velocity_valid\":true,\"type\":\"velocity_water\"}\n");
  expect(WM_AGAIN);
  report(1, SPEEDS, WM_OK);
  TEST_ASSERT_EQUAL_DOUBLE(0.5, event.as.twist6.v_mps[0]);
  TEST_ASSERT_EQUAL_UINT64(3, source->counts.ignored);
  TEST_ASSERT_EQUAL_UINT64(0, source->counts.malformed);
  expect_device(WM_DEVICE_WORKS, "1 velocity_water, 1 position_local");
}

TEST(rubbish_is_counted) {
  begin_connected();
  say("HTTP/1.1 400 Bad Request\r\n");
  expect(WM_AGAIN);
  expect_problem("is it a velocity log's port");
  say("ocity_valid\":true,\"status\":0}\n{\"vx\":0.1,\"velocity_valid\":true,\"type\":\"velocity\"}\n");
  expect(WM_AGAIN);
  TEST_ASSERT_EQUAL_UINT64(3, source->counts.malformed);
  flood();
  send_report(1, SPEEDS);
  for (int i = 0; i < 10 && next() != WM_OK; i++) {
  }
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.received);
  TEST_ASSERT_EQUAL_UINT64(4, source->counts.malformed);
}

TEST(numbers_that_cannot_be_are_refused) {
  begin_connected();
  report(1, "\"vx\":5000,\"vy\":0,\"vz\":0,\"fom\":0.001", WM_AGAIN);
  report(1, "\"vx\":1e999,\"vy\":0,\"vz\":0,\"fom\":0.001", WM_AGAIN);
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.not_finite);
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.malformed);
  report(1, "\"vx\":0.1,\"vy\":0,\"vz\":0,\"fom\":0", WM_OK);
  TEST_ASSERT_EQUAL_DOUBLE(1e-4, event.as.twist6.v_sigma_mps);  // the log's resolution
}

// A transmission before the echo, or long after it, is a clock that was set between.
TEST(times_that_contradict_each_other_are_refused) {
  begin_connected();
  for (int i = 0; i < 2; i++) {
    char text[300];
    (void)snprintf(text, sizeof text,
                   "{" SPEEDS
                   ",\"velocity_valid\":true,\"type\":\"velocity\",\"time_of_validity\":%d,"
                   "\"time_of_transmission\":%d}\n",
                   5000000 + i, i ? 4999999 : 7000001);
    say(text);
    expect(WM_AGAIN);
  }
  TEST_ASSERT_EQUAL_UINT64(2, source->counts.malformed);
  expect_problem("was the log's clock set");
}

// Its clock is set by an hour in either direction: stamps go on as those of before after some reports.
TEST(a_clock_that_is_set_is_followed) {
  for (int back = 0; back < 2; back++) {
    tearDown();
    setUp();
    begin_connected();
    for (int i = 0; i < 40; i++) {
      if (i == 10) ahead_us += back ? -INT64_C(3600000000) : INT64_C(3600000000);
      send_report(1, SPEEDS);
      const wm_status status = next();
      if (i >= 10 && i < 20) continue;
      TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, source->counts.first_problem);
      TEST_ASSERT_INT64_WITHIN(50 * MS, wm_monotonic_ns() - TRANSIT_US * 1000, event.t_ns);
    }
  }
}

TEST(it_may_come_go_and_come_back) {
  hang_up();
  begin();
  wait_for(WM_DEVICE_ABSENT, "no velocity log answers at 127.0.0.1:");
  listen_at(&config.port);
  welcome();
  report(1, SPEEDS, WM_OK);
  say("{\"time\":120.7,\"vx\":0.1,\"vy\":0");  // the connection ends within a line
  expect(WM_AGAIN);
  hang_up();
  wait_for(WM_DEVICE_ABSENT, "");
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.malformed);
  expect_problem("ended within a line");
  listen_at(&config.port);
  welcome();
  report(1, SPEEDS, WM_OK);
  TEST_ASSERT_EQUAL_UINT64(2, source->counts.received);
}

TEST(silence_is_reported) {
  begin_connected();
  report(1, SPEEDS, WM_OK);
  wait_for(WM_DEVICE_STALLED, "sends no velocity over ground");
}

TEST(doctor_judges_it) {
  static wm_config whole;
  static wm_findings found;
  doctor_dvl(&whole, 0.2, &found);
  TEST_ASSERT_EQUAL(0, found.count);
  hang_up();
  whole.devices.dvl = config;
  doctor_dvl(&whole, 0.2, &found);
  TEST_ASSERT_EQUAL(1, found.count);
  TEST_ASSERT_EQUAL(WM_FOUND_VELOCITY_LOG, found.at[0].id);
  TEST_ASSERT_EQUAL(WM_SEVERITY_BAD, found.at[0].severity);
}
