// SPDX-License-Identifier: Apache-2.0
// Reports of gpsd, as gpsd 3.22 writes them, and positions in the map.
#include "gpsd_report.h"

#include "common/suite.h"
#include "waymark/local_frame.h"

static gpsd_report report;

static void expect(const char *line) {
  const char *why = gpsd_report_read(line, strlen(line), &report);
  TEST_ASSERT_NULL_MESSAGE(why, why);
}

TEST(positions_are_read) {
  expect(
      "{\"class\":\"TPV\",\"device\":\"/dev/ttyACM0\",\"status\":3,\"mode\":3,\"time\":\"2026-11-23T23:50:58.125Z\","
      "\"leapseconds\":18,\"ept\":0.005,\"lat\":48.123456789,\"lon\":-11.5,\"altHAE\":545.25,\"altMSL\":498.1,"
      "\"epx\":0.012,\"epy\":0.016,\"epv\":0.03,\"track\":271.5,\"speed\":1.25,\"climb\":-0.1,\"eps\":0.02,"
      "\"epc\":0.04,\"ecefx\":1,\"eph\":0.02,\"sep\":0.05,\"nested\":{\"a\":[1,\"}\",{}]},\"ok\":true}\r");
  TEST_ASSERT_EQUAL(GPSD_TPV, report.kind);
  TEST_ASSERT_EQUAL_STRING("/dev/ttyACM0", report.device);
  TEST_ASSERT_EQUAL_INT64(INT64_C(1795477858125000000), report.time_ns);
  TEST_ASSERT_EQUAL_DOUBLE(48.123456789, report.latitude_deg);
  TEST_ASSERT_EQUAL_DOUBLE(-11.5, report.longitude_deg);
  TEST_ASSERT_EQUAL_DOUBLE(545.25, report.ellipsoid_m);
  TEST_ASSERT_EQUAL_DOUBLE(0.012, report.east_m);
  TEST_ASSERT_EQUAL_DOUBLE(271.5, report.track_deg);
  TEST_ASSERT_EQUAL_DOUBLE(3, report.status);
  TEST_ASSERT_DOUBLE_IS_NAN(report.heading_deg);
  TEST_ASSERT_EQUAL_STRING("RTK fixed", gpsd_fix_name(3));
  TEST_ASSERT_EQUAL_STRING("fix", gpsd_fix_name(99));
}

TEST(other_reports_are_read) {
  expect("{\"class\":\"VERSION\",\"release\":\"3.22\",\"rev\":\"3.22\",\"proto_major\":3,\"proto_minor\":14}");
  TEST_ASSERT_EQUAL(GPSD_OTHER, report.kind);
  expect("{\"class\":\"TPV\",\"device\":\"/dev/pts/1\",\"mode\":1}");
  TEST_ASSERT_EQUAL(GPSD_TPV, report.kind);
  TEST_ASSERT_EQUAL_DOUBLE(1, report.mode);
  TEST_ASSERT_DOUBLE_IS_NAN(report.latitude_deg);
  TEST_ASSERT_EQUAL_INT64(WM_TIME_NONE, report.time_ns);
  expect("{\"class\":\"ATT\",\"device\":\"/dev/ttyACM0\",\"heading\":90.5,\"mag_st\":\"N\"}");
  TEST_ASSERT_EQUAL(GPSD_ATT, report.kind);
  TEST_ASSERT_EQUAL_DOUBLE(90.5, report.heading_deg);
  expect("{\"class\":\"DEVICE\",\"path\":\"/dev/ttyACM0\",\"activated\":0}");
  TEST_ASSERT_EQUAL(GPSD_DEVICE, report.kind);
  TEST_ASSERT_EQUAL_DOUBLE(0, report.activated);
  expect("{\"class\":\"DEVICE\",\"path\":\"/dev/ttyACM0\",\"activated\":\"2026-11-23T23:50:58.125Z\"}");
  TEST_ASSERT_DOUBLE_IS_NAN(report.activated);
  expect("{\"class\":\"ERROR\",\"message\":\"Unrecognized request '?'\"}");
  TEST_ASSERT_EQUAL_STRING("Unrecognized request '?'", report.message);
  expect("{\"class\":\"TPV\",\"lat\":nan,\"lon\":null,\"time\":\"yesterday\"}");
  TEST_ASSERT_DOUBLE_IS_NAN(report.latitude_deg);
  TEST_ASSERT_EQUAL_INT64(WM_TIME_NONE, report.time_ns);
  expect("{}");
}

// What gpsdecode 3.22 prints for an HDT behind a GST: no valid JSON, and the deviations as accelerations.
TEST(headings_of_gpsd_322_are_read) {
  expect(
      "{\"class\":\"ATT\",\"device\":\"stdin\",,\"time\":\"2024-03-23T12:00:00.000Z\"\"heading\":123.400,\"dip\":0.022,"
      "\"acc_len\":0.020}");
  TEST_ASSERT_EQUAL(GPSD_ATT, report.kind);
  TEST_ASSERT_EQUAL_DOUBLE(123.4, report.heading_deg);
  TEST_ASSERT_EQUAL_INT64(1711195200 * WM_NS_PER_S, report.time_ns);
}

// A log batch of gpsd 3.22 to 3.25 has tAcc twice; no broken line, and nothing of it is a fix.
TEST(reports_that_nobody_reads_are_no_faults) {
  expect("{\"class\":\"LOG\",\"mode\":3,\"lat\":46.5,\"lon\":6.6,\"tAcc\":125,\"hAcc\":28,\"tAcc\":47}\r");
  TEST_ASSERT_EQUAL(GPSD_OTHER, report.kind);
  static const char kCut[] = "{\"class\":\"SKY\",\"satellites\":[{\"PRN\":1";
  TEST_ASSERT_NOT_NULL(gpsd_report_read(kCut, strlen(kCut), &report));
}

TEST(broken_lines_are_refused) {
  static const char *const kBroken[] = {
      "",         "[]",         "{",          "{\"class\"", "{\"class\":", "{\"class\":\"TPV", "{\"a\":[1,2",
      "{\"a\":1", "$GPGGA,1,2", "{\"a\":\"\\"};
  for (size_t i = 0; i < sizeof kBroken / sizeof kBroken[0]; i++)
    TEST_ASSERT_NOT_NULL_MESSAGE(gpsd_report_read(kBroken[i], strlen(kBroken[i]), &report), kBroken[i]);
}

// East, north and up by PROJ 9.1, +proj=topocentric +ellps=WGS84: `cct -d 4 +proj=pipeline +step +proj=cart +step
// +proj=topocentric +lon_0=11.5 +lat_0=48.1 +h_0=500`.
TEST(places_are_metres_about_the_origin) {
  static const double kOrigin[3] = {48.1, 11.5, 500};
  static const struct {
    double place[3], at_m[3];
  } kPlaces[] = {{{48.1, 11.5, 512.5}, {0, 0, 12.5}},
                 {{48.11, 11.51, 510}, {744.72519, 1112.06103, 9.85956}},
                 {{48.0, 11.4, 450}, {-7463.05710, -11115.06175, -64.05335}},
                 {{49.1, 12.5, 500}, {73027.19970, 111679.40707, -1396.10890}},
                 {{-48.1, -168.5, 0}, {0, 42526.86509, -12733097.53055}}};
  for (size_t i = 0; i < sizeof kPlaces / sizeof kPlaces[0]; i++) {
    double at_m[3];
    local_frame(kOrigin, kPlaces[i].place, at_m);
    for (int k = 0; k < 3; k++) TEST_ASSERT_DOUBLE_WITHIN(1e-4, kPlaces[i].at_m[k], at_m[k]);
  }
}
