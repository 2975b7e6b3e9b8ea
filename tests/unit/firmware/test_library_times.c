// SPDX-License-Identifier: Apache-2.0
// The C interface: times far ahead, behind, before the first datum and after a pause; and data that are of no use.
#include <string.h>

#include "library_robot.h"

static waymark_session *started;
static uint32_t motion, eye, increments;
static wm_event event;
static wm_published pose;
static wm_health health;

void setUp(void) {
  robot_write();
  started = open_session();
  ok(waymark_add_source(started, "motion", &motion, &err));
  ok(waymark_start(started, &err));
  for (int i = 0; i <= 50; i++) ok(row(started, motion, i * 0.02, 0.5, NANV, 0));
}

void tearDown(void) {
  ok(waymark_close(started, &err));
  folder_remove();
}

static char noted[512];
static int notes;
static void take_note(void *context, const char *text) {
  (void)context, notes++;
  (void)snprintf(noted, sizeof noted, "%s", text);
}

// What is of use is known only when its turn comes: the push is ok, and what became of it is said once, and counted.
TEST(test_a_landmark_that_no_map_has_is_said) {
  waymark_session *session = NULL;
  const waymark_options options = {
      .bytes = sizeof options, .config = config, .site = dir, .note = take_note, .seed = 1};
  ok(waymark_open(&options, &session, &err));
  ok(waymark_add_source(session, "motion", &motion, &err));
  ok(waymark_add_source(session, "sightings:eye", &eye, &err));
  ok(waymark_add_source(session, "increments", &increments, &err));
  ok(waymark_start(session, &err));
  notes = 0;
  event = (wm_event){.kind = WM_EVENT_SIGHTING, .as.sighting = wm_sighting_without_numbers()};
  event.as.sighting.landmark_id = 99, event.as.sighting.bearing_rad = 0.1, event.as.sighting.range_m = 5;
  for (int i = 0; i <= 50; i++) {
    ok(row(session, motion, i * 0.02, 0.5, NANV, 0));
    event.t_ns = NS(i * 0.02), event.arrival_ns = WM_TIME_NONE;
    ok(waymark_push_event(session, eye, &event, sizeof event, &err));
  }
  ok(waymark_advance(session, NS(2), &err));
  TEST_ASSERT_EQUAL_INT(1, notes);
  TEST_ASSERT_EQUAL_STRING(
      "sightings:eye: landmark 99, seen at 0.000 s, is not in the map: is it the map of this place, with the numbers "
      "that the sensor gives?",
      noted);
  ok(waymark_health(session, &health, sizeof health, &err));
  TEST_ASSERT_EQUAL_UINT64(51, health.sources[1].rejected[WM_REJECTED_UNKNOWN_ID]);
  TEST_ASSERT_EQUAL_STRING(noted, health.refused_because[1]);
  // What numbers alone can't tell, the estimator does: 100 m in 0.1 s.
  event = (wm_event){.kind = WM_EVENT_INCREMENT, .as.increment = {.from_ns = NS(1.9), .dx_m = 100}};
  event.as.increment.covariance[0] = NANV;
  event.t_ns = NS(2), event.arrival_ns = WM_TIME_NONE;
  ok(waymark_push_event(session, increments, &event, sizeof event, &err));
  ok(waymark_close(session, &err));
  TEST_ASSERT_EQUAL_INT(2, notes);
  TEST_ASSERT_EQUAL_STRING(
      "increments: the estimator can't use the datum of 2.000 s: out of range: look at its numbers, their sigmas and "
      "units",
      noted);
}

TEST(test_one_stamp_far_ahead_makes_nothing_late) {
  for (int i = 51; i < 250; i++) {
    if (i % 10 == 0) TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, row(started, motion, i * 0.02 + 60, 0.5, NANV, 0));
    if (i % 10 == 5) TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, waymark_advance(started, NS(i * 0.02 + 3600), &err));
    ok(row(started, motion, i * 0.02, 0.5, NANV, 0));
  }
  ok(waymark_health(started, &health, sizeof health, &err));
  TEST_ASSERT_EQUAL_UINT64(0, health.sources[0].late);
  TEST_ASSERT_EQUAL_UINT64(19, health.sources[0].future);  // none is left out without a count
  TEST_ASSERT_EQUAL_UINT64(0, health.sources[0].malformed + health.sources[0].not_finite);
  TEST_ASSERT_EQUAL_UINT64(51 + 199 + 19, health.sources[0].received);
  TEST_ASSERT_NOT_NULL_MESSAGE(strstr(health.refused_because[0], "60.0"), health.refused_because[0]);
  TEST_ASSERT_EQUAL(WM_TIME_RAN_BACK, row(started, motion, -3600, 0.5, NANV, 0));
  TEST_ASSERT_EQUAL(WM_TIME_RAN_BACK,
                    waymark_push_row(started, motion, NS(5), NS(-3600), (double[3]){0.5, NANV, 0}, 3, &err));
  ok(waymark_health(started, &health, sizeof health, &err));
  TEST_ASSERT_EQUAL_UINT64(2, health.sources[0].late);
  TEST_ASSERT_EQUAL_UINT64(19, health.sources[0].future);
}

// Before the first datum the session has no clock.
TEST(test_a_time_before_the_first_datum_makes_nothing_late) {
  waymark_session *session = open_session();
  ok(waymark_add_source(session, "motion", &motion, &err));
  ok(waymark_start(session, &err));
  ok(waymark_advance(session, NS(3600), &err));
  TEST_ASSERT_EQUAL(WM_AGAIN, waymark_pose(session, NS(1.7e9), &pose, sizeof pose, &err));
  for (int i = 0; i < 50; i++) ok(row(session, motion, i * 0.02, 0.5, NANV, 0));
  ok(waymark_pose(session, NS(1), &pose, sizeof pose, &err));
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.5, pose.now.pose_map_base.p_m[0]);
  ok(waymark_close(session, &err));
}

TEST(test_after_a_pause_data_are_taken_again) {
  int refused = 0, taken = 0;
  for (int i = 0; i < 100; i++) {
    const wm_status status = row(started, motion, 600 + i * 0.02, 0.5, NANV, 0);
    TEST_ASSERT_TRUE(status == WM_OK || status == WM_OUT_OF_RANGE);
    status == WM_OK ? taken++ : refused++;
  }
  TEST_ASSERT_EQUAL(50, refused);  // one second of them
  TEST_ASSERT_EQUAL(50, taken);
}
