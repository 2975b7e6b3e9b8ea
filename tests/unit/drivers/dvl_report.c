// SPDX-License-Identifier: Apache-2.0
// Reports of a velocity log: of json_v3.1 and of json_v1, as the manual and an A50 have them, and other reports.
#include "dvl_report.h"

#include "common/suite.h"

#define BEAMS                                                                                                       \
  "\"transducers\":[{\"id\":0,\"velocity\":0.00010825289791682735,\"distance\":0.5568000078201294,\"rssi\":-30.49," \
  "\"nsd\":-88.7,\"beam_valid\":true},{\"id\":1,\"velocity\":-1.4e-05,\"distance\":-1,\"rssi\":-31,\"nsd\":-89,"    \
  "\"beam_valid\":false}]"
#define COVARIANCE "\"covariance\":[[2.4e-08,-3.4e-09,-1.7e-09],[-3.4e-09,1.5e-08,4e-10],[-1.7e-09,4e-10,1.6e-09]]"
#define SPEEDS "\"time\":106.39,\"vx\":-0.25,\"vy\":5.7e-05,\"vz\":0.125,\"fom\":0.0016,"

static dvl_report report;

static void expect(dvl_kind kind, const char *line) {
  const char *why = dvl_report_read(line, strlen(line), &report);
  TEST_ASSERT_NULL_MESSAGE(why, why);
  TEST_ASSERT_EQUAL_MESSAGE(kind, report.kind, line);
}

TEST(a_velocity_is_read) {
  expect(DVL_VELOCITY, "{" SPEEDS COVARIANCE ",\"altitude\":0.49," BEAMS
                       ",\"velocity_valid\":true,\"status\":1,\"format\":\"json_v3.1\",\"type\":\"velocity\","
                       "\"time_of_validity\":1638191471563017,\"time_of_transmission\":1638191471752336}\r");
  TEST_ASSERT_EQUAL_DOUBLE(-0.25, report.v_mps[0]);
  TEST_ASSERT_EQUAL_DOUBLE(5.7e-5, report.v_mps[1]);
  TEST_ASSERT_EQUAL_DOUBLE(0.125, report.v_mps[2]);
  TEST_ASSERT_EQUAL_DOUBLE(0.0016, report.sigma_mps);
  TEST_ASSERT_EQUAL_DOUBLE(106.39, report.since_ms);
  TEST_ASSERT_EQUAL(1, report.is_valid);
  TEST_ASSERT_EQUAL(1, report.is_hot);
  TEST_ASSERT_EQUAL_INT64(INT64_C(1638191471563017), report.validity_us);
  TEST_ASSERT_EQUAL_INT64(INT64_C(1638191471752336), report.transmission_us);
}

TEST(the_first_format_has_no_times) {
  expect(DVL_VELOCITY, "{" SPEEDS "\"altitude\":1.5," BEAMS
                       ",\"velocity_valid\":true,\"status\":0,"
                       "\"format\":\"json_v1\"}");
  TEST_ASSERT_EQUAL(0, report.is_hot);
  TEST_ASSERT_EQUAL_INT64(DVL_NO_TIME, report.validity_us);
  TEST_ASSERT_EQUAL_INT64(DVL_NO_TIME, report.transmission_us);
}

TEST(a_report_without_lock_needs_no_numbers) {
  expect(DVL_VELOCITY, "{" SPEEDS "\"velocity_valid\":false,\"type\":\"velocity\"}");
  TEST_ASSERT_EQUAL(0, report.is_valid);
  expect(DVL_VELOCITY, "{\"vx\":null,\"vy\":null,\"vz\":null,\"fom\":null,\"velocity_valid\":false}");
  TEST_ASSERT_EQUAL(0, report.is_valid);
}

TEST(other_reports_are_named) {
  expect(DVL_WATER, "{" SPEEDS "\"velocity_valid\":true,\"type\":\"velocity_water\"}");
  expect(DVL_WATER, "{" SPEEDS "\"velocity_valid\":true,\"type\":\"velocity\",\"tracking_mode\":\"water\"}");
  expect(DVL_VELOCITY, "{" SPEEDS "\"velocity_valid\":true,\"type\":\"velocity\",\"tracking_mode\":\"bottom\"}");
  expect(DVL_POSITION,
         "{\"ts\":49056.809,\"x\":12.4,\"y\":64.6,\"z\":1.8,\"std\":0.002,\"roll\":0.6,\"pitch\":0.6,"
         "\"yaw\":0.6,\"type\":\"position_local\",\"status\":0,\"format\":\"json_v3.1\"}");
  expect(DVL_RESPONSE,
         "{\"response_to\":\"reset_dead_reckoning\",\"success\":true,\"error_message\":\"\","
         "\"result\":null,\"format\":\"json_v3.1\",\"type\":\"response\"}");
  expect(DVL_OTHER, "{\"type\":\"something_new\"}");
  expect(DVL_OTHER, "{}");
}
