// SPDX-License-Identifier: Apache-2.0
// A receiver by gpsd, of which the test is the server: positions and headings, absent, silent, without a fix, another
// fix, doubled, late, NaN, another clock, unplugged, back again.
#include <time.h>

#include "cli/doctor/doctor.h"
#include "live_source.h"

#define ORIGIN_DEG 48.0, 11.0

static wm_gpsd_device_config config;
static double ahead_m;

void setUp(void) {
  config = (wm_gpsd_device_config){
      .host = "127.0.0.1", .accuracy_scale = 1, .course_min_mps = 1, .sigma_deg = 1, .device = "/dev/ttyACM0"};
  ahead_m = (double)NAN;
  listen_at(&config.port);
}

void tearDown(void) {
  source_close();
  hang_up();
}

// Until the run has connected and asked.
static void welcome(void) {
  char asked[200] = "";
  accept_run();
  TEST_ASSERT_EQUAL(WM_AGAIN, next());
  TEST_ASSERT_GREATER_THAN(0, recv(client, asked, sizeof asked - 1, 0));
  TEST_ASSERT_EQUAL_STRING("?WATCH={\"enable\":true,\"json\":true,\"device\":\"/dev/ttyACM0\"};\n", asked);
}

static void begin(void) {
  static const double kOrigin[3] = {ORIGIN_DEG, 500};
  const wm_row_mountings none = {0};
  wm_row_device *device;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_gpsd_open(&config, kOrigin, ahead_m, &device, &err), err.text);
  source_open(device, &none);
}

static void begin_connected(void) {
  begin();
  welcome();
}

static wm_time_ns utc_ns(void) {
  struct timespec now;
  (void)clock_gettime(CLOCK_REALTIME, &now);
  return (wm_time_ns)now.tv_sec * WM_NS_PER_S + now.tv_nsec;
}

// A report of position at that time, with further members.
static void send_report(wm_time_ns t_ns, const char *members) {
  (void)usleep(2000);  // gpsd writes milliseconds: the next report has another stamp
  char text[600], stamp[40];
  const time_t seconds = (time_t)(t_ns / WM_NS_PER_S);
  struct tm calendar;
  (void)strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", gmtime_r(&seconds, &calendar));
  (void)snprintf(text, sizeof text, "{\"class\":\"TPV\",\"device\":\"/dev/ttyACM0\",\"time\":\"%s.%03dZ\",%s}\r\n",
                 stamp, (int)(t_ns / MS % 1000), members);
  say(text);
}

#define PLACE "\"lat\":48.0001,\"lon\":11.0,\"altHAE\":501.5,\"epx\":0.3,\"epy\":0.4,\"epv\":0.7"
#define FIX "\"mode\":3,\"status\":1," PLACE

static void report(wm_time_ns t_ns, const char *members, wm_status status) {
  send_report(t_ns, members);
  expect(status);
}

static void now(const char *members, wm_status status) { report(utc_ns(), members, status); }

TEST(a_position_is_in_the_map) {
  begin_connected();
  say("{\"class\":\"VERSION\",\"release\":\"3.22\"}\r\n{\"class\":\"DEVICES\",\"devices\":[{\"class\":\"DEVICE\"}]}"
      "\r\n");
  now(FIX, WM_OK);
  TEST_ASSERT_EQUAL(WM_EVENT_POSITION, event.kind);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, event.as.position.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 11.12, event.as.position.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(0.001, 1.5, event.as.position.p_m[2]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5 / sqrt(2), event.as.position.sigma_xy_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.7, event.as.position.sigma_z_m);
  TEST_ASSERT_INT64_WITHIN(100 * MS, wm_monotonic_ns(), event.t_ns);
  expect_device(WM_DEVICE_WORKS, "fix without corrections");
}

TEST(sigmas_follow_the_fix) {
  static const struct {
    const char *members;
    double sigma_m;
  } kFixes[] = {{"\"mode\":3,\"status\":1,\"lat\":48,\"lon\":11", 5},
                {"\"mode\":3,\"status\":2,\"lat\":48,\"lon\":11", 2},
                {"\"mode\":3,\"status\":4,\"lat\":48,\"lon\":11", 0.5},
                {"\"mode\":3,\"status\":4,\"lat\":48,\"lon\":11,\"eph\":17.1", 0.5},
                {"\"mode\":3,\"status\":3,\"lat\":48,\"lon\":11", 0.05},
                {"\"mode\":3,\"status\":3,\"lat\":48,\"lon\":11,\"epx\":15,\"epy\":17", 0.05},
                {"\"mode\":3,\"status\":3,\"lat\":48,\"lon\":11,\"eph\":0.02", 0.04},
                {"\"mode\":3,\"status\":3,\"lat\":48,\"lon\":11,\"eph\":0.04", 0.05},
                {"\"mode\":3,\"status\":1,\"lat\":48,\"lon\":11,\"epx\":3,\"epy\":3", 6}};
  config.accuracy_scale = 2;
  begin_connected();
  for (size_t i = 0; i < sizeof kFixes / sizeof kFixes[0]; i++) {
    now(kFixes[i].members, WM_OK);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, kFixes[i].sigma_m, event.as.position.sigma_xy_m);
    TEST_ASSERT_DOUBLE_IS_NAN(event.as.position.p_m[2]);
    TEST_ASSERT_DOUBLE_IS_NAN(event.as.position.sigma_z_m);
  }
  TEST_ASSERT_EQUAL_UINT32(5, source->counts.news);  // each change of the type
  expect_device(WM_DEVICE_WORKS, "fix without corrections");
}

static void deviations(const char *lat_m) {
  char text[200];
  (void)snprintf(text, sizeof text, "{\"class\":\"GST\",\"lat\":%s,\"lon\":%s,\"alt\":0.03}\r\n", lat_m, lat_m);
  say(text);
}

// The receiver's own sigmas, and not beyond a change of the fix: the first position without corrections leaps.
TEST(a_receivers_deviations_are_of_its_fix) {
  config.accuracy_scale = 0.2;  // of gpsd's estimates alone
  begin_connected();
  now("\"mode\":3,\"status\":3," PLACE, WM_OK);
  deviations("0.02");
  now("\"mode\":3,\"status\":3," PLACE, WM_OK);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.02, event.as.position.sigma_xy_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.03, event.as.position.sigma_z_m);
  now("\"mode\":3,\"status\":1,\"lat\":48,\"lon\":11", WM_OK);
  TEST_ASSERT_EQUAL_DOUBLE(5, event.as.position.sigma_xy_m);
}

// Of a burst of sentences those come before the position.
TEST(deviations_before_the_first_fix_are_of_it) {
  begin_connected();
  deviations("0.02");
  now("\"mode\":3,\"status\":3," PLACE, WM_OK);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.02, event.as.position.sigma_xy_m);
  now("\"mode\":0", WM_AGAIN);
  now("\"mode\":3,\"status\":1,\"lat\":48,\"lon\":11", WM_OK);
  TEST_ASSERT_EQUAL_DOUBLE(5, event.as.position.sigma_xy_m);
}

TEST(a_course_is_a_heading) {
  config.from = WM_GPSD_COURSE;
  begin_connected();
  send_report(utc_ns(), FIX ",\"speed\":0.5,\"track\":90");  // too slow
  expect(WM_AGAIN);
  now(FIX ",\"speed\":2,\"track\":90", WM_OK);
  TEST_ASSERT_EQUAL(WM_EVENT_HEADING, event.kind);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, event.as.heading.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.05, event.as.heading.sigma_rad);
  report(utc_ns() + MS, FIX ",\"speed\":2,\"track\":350,\"epd\":5", WM_OK);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 100 * M_PI / 180, event.as.heading.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 5 * M_PI / 180, event.as.heading.sigma_rad);
}

// The course of an antenna that is ahead of base_link is to the side of the heading in a turn.
TEST(the_course_is_the_antennas) {
  const double speed_mps = 5, turn_radps = -0.3;
  char members[400];
  config.from = WM_GPSD_COURSE;
  ahead_m = 1.5;
  begin_connected();
  const wm_time_ns begin_ns = utc_ns() - 7 * WM_NS_PER_S;
  for (int k = 0; k <= 60; k++) {
    const double heading = 0.1 * k * turn_radps, course = heading + atan2(turn_radps * ahead_m, speed_mps);
    (void)snprintf(members, sizeof members, FIX ",\"speed\":%.4f,\"track\":%.4f",
                   hypot(speed_mps, turn_radps * ahead_m), fmod(810 - course * 180 / M_PI, 360));
    report(begin_ns + k * 100 * MS, members, WM_OK);
    if (k >= 40) TEST_ASSERT_DOUBLE_WITHIN(0.004, 0, remainder(event.as.heading.heading_rad - heading, 2 * M_PI));
  }
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.02, event.as.heading.sigma_rad);
}

TEST(antennas_give_a_heading) {
  config.from = WM_GPSD_ANTENNAS;
  begin_connected();
  now(FIX ",\"speed\":2,\"track\":90", WM_AGAIN);
  say("{\"class\":\"ATT\",\"heading\":180.0}\r\n");
  expect(WM_OK);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -M_PI_2, event.as.heading.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, M_PI / 180, event.as.heading.sigma_rad);
}

TEST(without_a_fix_nothing_is_fused) {
  static const char *const kNone[] = {"\"mode\":1",
                                      ("\"mode\":0," PLACE),
                                      "\"mode\":3,\"lat\":0.0,\"lon\":0.0",
                                      "\"mode\":2,\"lat\":nan,\"lon\":nan",
                                      "\"mode\":3,\"lat\":91,\"lon\":0",
                                      "\"mode\":3,\"lat\":1e400,\"lon\":0"};
  begin_connected();
  for (size_t i = 0; i < sizeof kNone / sizeof kNone[0]; i++) {
    now(FIX, WM_OK);
    now(kNone[i], WM_AGAIN);
    expect_device(WM_DEVICE_DOWN, "no fix");
  }
  TEST_ASSERT_EQUAL_UINT64(6, source->counts.ignored);
}

// A receiver for time sends its stored place with status 7, and again without a status.
TEST(a_stored_place_is_no_fix) {
  begin_connected();
  now("\"mode\":3,\"status\":7," PLACE, WM_AGAIN);
  expect_device(WM_DEVICE_DOWN, "a stored place");
  now("\"mode\":3," PLACE, WM_AGAIN);
  now(FIX, WM_OK);
}

TEST(reports_of_one_epoch_are_one_row) {
  begin_connected();
  const wm_time_ns t_ns = utc_ns();
  report(t_ns, FIX, WM_OK);
  report(t_ns, FIX ",\"speed\":1", WM_AGAIN);
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.ignored);
  now(FIX, WM_OK);
}

TEST(rubbish_is_counted) {
  begin_connected();
  say("$GPGGA,1,2,3\r\n{\"class\":\"TPV\",\r\n");
  flood();
  send_report(utc_ns(), FIX);
  for (int i = 0; i < 10 && next() != WM_OK; i++) {
  }
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.received);
  TEST_ASSERT_EQUAL_UINT64(3, source->counts.malformed);
  expect_problem("is not a JSON object");
}

TEST(an_accuracy_that_cannot_be_is_refused) {
  begin_connected();
  now("\"mode\":3,\"lat\":48,\"lon\":11,\"eph\":1e9", WM_AGAIN);
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.not_finite);
}

// gpsd may report a fix once for each of the receiver's sentences.
TEST(doubled_and_older_reports_are_counted) {
  begin_connected();
  const wm_time_ns t_ns = utc_ns();
  for (int i = 0; i < 3; i++) send_report(t_ns, FIX);
  report(t_ns - 150 * MS, FIX, WM_OK);
  for (int i = 0; i < 3; i++) expect(WM_AGAIN);
  TEST_ASSERT_EQUAL_UINT64(2, source->counts.ignored);
  TEST_ASSERT_EQUAL_UINT64(0, source->counts.frozen);
  TEST_ASSERT_EQUAL_UINT64(1, source->counts.out_of_order);
}

// A clock of the receiver that is 19.6 years off (its week number has overflown) and leaps.
TEST(a_receivers_clock_is_followed) {
  config.latency_ms = 80;
  begin_connected();
  const wm_time_ns off_ns = -INT64_C(1024) * 7 * 86400 * WM_NS_PER_S;
  for (int i = 0; i < 20; i++) {
    send_report(utc_ns() + off_ns + (i < 10 ? 0 : -30 * WM_NS_PER_S), FIX);
    const wm_status status = next();
    if (i < 10) TEST_ASSERT_EQUAL(WM_OK, status);
    if (status == WM_OK) TEST_ASSERT_INT64_WITHIN(70 * MS, wm_monotonic_ns() - 80 * MS, event.t_ns);
  }
  TEST_ASSERT_GREATER_OR_EQUAL_UINT64(12, source->counts.received);
  TEST_ASSERT_GREATER_OR_EQUAL_INT64(50 * MS, source->counts.stamp_uncertainty_ns);
}

TEST(by_utc_the_clocks_must_agree) {
  config.clock = WM_GPSD_CLOCK_UTC;
  begin_connected();
  send_report(utc_ns() - 300 * MS, FIX);  // late, and fused at its stamp
  expect(WM_OK);
  TEST_ASSERT_INT64_WITHIN(100 * MS, wm_monotonic_ns() - 300 * MS, event.t_ns);
  report(utc_ns() + 2000 * MS, FIX, WM_AGAIN);
  report(utc_ns() - 20000 * MS, FIX, WM_AGAIN);
  TEST_ASSERT_EQUAL_UINT64(2, source->counts.malformed);
  expect_problem("this computer's clock are apart");
}

TEST(absent_and_back) {
  hang_up();
  begin();
  expect(WM_AGAIN);
  expect(WM_AGAIN);
  expect_device(WM_DEVICE_ABSENT, "no gpsd answers at 127.0.0.1:");
  listen_at(&config.port);
  welcome();
  now(FIX, WM_OK);
  hang_up();
  wait_for(WM_DEVICE_ABSENT, "");
  listen_at(&config.port);
  welcome();
  now(FIX, WM_OK);
  expect_device(WM_DEVICE_WORKS, "fix");
}

TEST(unplugged_silent_and_back) {
  begin_connected();
  now(FIX, WM_OK);
  wait_for(WM_DEVICE_STALLED, "is its receiver plugged in?");
  say("{\"class\":\"DEVICE\",\"path\":\"/dev/ttyACM0\",\"activated\":0}\r\n");
  expect(WM_AGAIN);
  expect_device(WM_DEVICE_DOWN, "its receiver was unplugged");
  now(FIX, WM_OK);
  expect_device(WM_DEVICE_WORKS, "fix");
  say("{\"class\":\"ERROR\",\"message\":\"no such device\"}\r\n");
  expect(WM_AGAIN);
  expect_device(WM_DEVICE_DOWN, "no such device");
}

TEST(the_maps_origin_is_needed) {
  static const double kNone[3] = {NAN, NAN, NAN};
  wm_row_device *device;
  TEST_ASSERT_EQUAL(WM_BAD_CONFIG, wm_gpsd_open(&config, kNone, ahead_m, &device, &err));
  TEST_ASSERT_NOT_NULL(strstr(err.text, "calibration.yaml has no `gnss: {origin:"));
}

TEST(the_doctor_finds_it_absent) {
  static wm_findings found;
  wm_config whole = {.devices = {.gpsd = {config}, .gpsd_count = 1}};
  hang_up();
  doctor_gnss(&whole, 0.2, &found);
  TEST_ASSERT_EQUAL(1, found.count);
  TEST_ASSERT_EQUAL(WM_FOUND_GNSS_RECEIVER, found.at[0].id);
  TEST_ASSERT_EQUAL(WM_SEVERITY_BAD, found.at[0].severity);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(found.at[0].text, "no gpsd answers"), found.at[0].text);
}
