// SPDX-License-Identifier: Apache-2.0
// What the monitor counts: shares of refused sightings, means of several landmarks, contradictions that last, and what
// makes up for them.
#include "common/suite.h"
#include "lone_monitor.hpp"

namespace {

// Agreement that lasts ten times as long makes up for a contradiction: a fault after it counts as the first one did.
TEST(what_was_contradicted_is_forgiven_in_time) {
  for (const bool once : {false, true}) {
    lone robot(true);
    if (once) (void)robot.drive(30, WM_REJECTED_GATE);
    (void)robot.drive(1200, WM_FUSED);
    TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, robot.drive(8, WM_REJECTED_GATE).state);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, robot.drive(60, WM_FUSED).state);
  }
}

// Sightings of landmarks that the map lacks are no evidence for the pose: they do not lower the doubt.
TEST(unknown_landmarks_do_not_lower_the_doubt) {
  lone robot(true);
  (void)robot.drive(20, WM_FUSED);
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, robot.drive(8, WM_REJECTED_GATE).state);
  TEST_ASSERT_NOT_EQUAL(WM_STATE_TRACKING, robot.drive(300, WM_REJECTED_UNKNOWN_ID).state);
}

// The state after a minute of which so many of ten sightings are refused; `half`: of their ranges alone.
uint8_t state_of_refused(int of_ten, bool half) {
  return lone(true)
      .observe(60, WM_EVENT_SIGHTING,
               [&](int step, auto take) {
                 const wm_innovation fused = record_of(WM_FUSED, step % 2 ? 0.8 : -0.8);
                 const wm_innovation all = step * of_ten % 10 < of_ten ? record_of(WM_REJECTED_GATE, 5.0) : fused;
                 take({half ? fused : all, all});
               })
      .state;
}

// Binomial, of 33 slots with 20 % false detections: 40 % are refused by chance with 3e-2 (exp(-n D) of Chernoff), 60 %
// with 3e-6, below an alarm's 1e-4. A sighting of which one of two numbers is refused is half a one.
TEST(refused_sightings_are_doubt_beyond_what_chance_gives) {
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, state_of_refused(1, false));
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, state_of_refused(4, false));
  TEST_ASSERT_NOT_EQUAL(WM_STATE_TRACKING, state_of_refused(6, false));
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, state_of_refused(8, true));
}

// Of the mean square of 33 slots 1.5 is as stated, and chi-square exceeds 2 times that with less than 1e-4.
TEST(innovations_larger_than_stated_are_inconsistent) {
  for (const double sigmas : {1.2, 2.2}) {
    lone robot(true);
    const wm_estimate out = robot.observe(
        20, WM_EVENT_SIGHTING, [&](int step, auto take) { take({record_of(WM_FUSED, step % 2 ? sigmas : -sigmas)}); });
    TEST_ASSERT_EQUAL(sigmas < 2.0 ? WM_CAUSE_NONE : WM_CAUSE_INCONSISTENT, out.cause);
    TEST_ASSERT_EQUAL(sigmas < 2.0, out.state == WM_STATE_TRACKING);
  }
}

// The state after 20 s of so many landmarks in each picture, all off by so many sigmas.
uint8_t state_of_pictures(int landmarks, double sigmas) {
  return lone(true)
      .observe(20, WM_EVENT_SIGHTING,
               [&](int, auto take) {
                 wm_innovation record = record_of(WM_FUSED, sigmas);
                 record.landmark_id = -1;
                 for (int i = 0; i < landmarks; i++) take({record});
               })
      .state;
}

// In 33 slots a mean of m observations has the sigma sqrt(1.5 / 33 / m), and 3.9 of these are an alarm: 0.83 sigmas of
// one landmark, 0.41 of four. They share errors of their picture, so that eight are no more than four.
TEST(landmarks_of_one_picture_count_as_four_at_most) {
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, state_of_pictures(1, 0.6));
  TEST_ASSERT_NOT_EQUAL(WM_STATE_TRACKING, state_of_pictures(4, 0.6));
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, state_of_pictures(8, 0.35));
}

// Errors of positions that are 5 s apart are independent: six that are off by two sigmas to one side are an alarm.
TEST(positions_five_seconds_apart_count_each) {
  lone robot(true);
  const auto east = [](int step, auto take) {
    wm_innovation record = record_of(WM_FUSED, 2.0);
    record.landmark_id = -1;
    record.residual = WM_RESIDUAL_X;
    if (step % 50 == 0) take({record});
  };
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, robot.observe(28, WM_EVENT_POSITION, east).state);
  TEST_ASSERT_NOT_EQUAL(WM_STATE_TRACKING, robot.observe(17, WM_EVENT_POSITION, east).state);
}

// A robot that no position reaches has no mirror image: its covariance is the filter's, wherever it is.
TEST(without_positions_nothing_is_mirrored) {
  lone robot(true);
  robot.estimate.pose_map_base.p_m[0] = 100.0;
  robot.estimate.heading_rad = 1.0;
  const wm_estimate out = robot.drive(1, WM_FUSED);
  for (int axis : {0, 1, 5}) TEST_ASSERT_EQUAL_DOUBLE(0.01, out.covariance[wm_cov_index(axis, axis)]);
}

// A contradiction of all sources is none of the one that was refused before.
TEST(a_contradicted_calibration_names_no_source) {
  lone robot(true);
  (void)robot.drive(20, WM_FUSED);
  TEST_ASSERT_EQUAL(0, robot.drive(8, WM_REJECTED_GATE).cause_source);
  robot.alarm = {WM_ALARM_LASTING_ERROR, 0, 5.0};
  robot.has_alarm = true;
  const wm_estimate out = robot.drive(20, WM_FUSED);
  TEST_ASSERT_EQUAL(WM_CAUSE_INCONSISTENT, out.cause);
  TEST_ASSERT_EQUAL(-1, out.cause_source);
}

// The state a second after a search has found a pose for a robot that was lost for a second.
uint8_t state_of_found(lone *robot) {
  robot->estimate.state = WM_STATE_LOST;
  (void)robot->drive(1, WM_REJECTED_GATE);
  robot->estimate.state = WM_STATE_TRACKING;
  robot->estimate.resets++;
  return robot->drive(1, WM_FUSED).state;
}

// A found pose that is lost within a minute was a wrong one: the next has to fit for longer.
TEST(a_pose_that_is_found_again_soon_is_on_probation) {
  for (const double fits_s : {10.0, 70.0}) {
    lone robot(true);
    robot.estimate.v_mps[0] = 0.5;
    (void)robot.drive(60, WM_FUSED);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, state_of_found(&robot));
    (void)robot.drive(fits_s, WM_FUSED);
    TEST_ASSERT_EQUAL(fits_s < 60.0 ? WM_STATE_DEGRADED : WM_STATE_TRACKING, state_of_found(&robot));
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, robot.drive(20, WM_FUSED).state);
  }
}

// GIVEN innovations of one sign, smaller than their sigma, WHEN they last for a minute THEN on a given map the pose is
// lost, and on a map that the filter makes it is degraded, with a place that is known to some metres. One that was lost
// by larger ones is degraded again when these are all that is left.
TEST(a_bias_on_a_map_of_its_own_degrades) {
  const auto biased = [](lone *robot, double sigmas) {
    return robot->observe(60, WM_EVENT_SIGHTING, [&](int, auto take) { take({record_of(WM_FUSED, sigmas)}); });
  };
  lone given(true), own(false);
  TEST_ASSERT_EQUAL(WM_STATE_LOST, biased(&given, 0.9).state);
  const wm_estimate bent = biased(&own, 0.9);
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, bent.state);
  TEST_ASSERT_EQUAL(WM_CAUSE_BIASED, bent.cause);
  TEST_ASSERT_LESS_THAN_DOUBLE(9.0, bent.covariance[0]);
  TEST_ASSERT_EQUAL(WM_STATE_LOST, biased(&own, 3.0).state);
  (void)biased(&own, 0.9);
  TEST_ASSERT_EQUAL(WM_STATE_DEGRADED, biased(&own, 0.9).state);
}

}  // namespace
