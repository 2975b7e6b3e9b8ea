// SPDX-License-Identifier: Apache-2.0
// Parts of the planar filter one by one: poses given from outside, covariances that are inflated and mixed, limits of
// states, rates without the steps of counts, states that come and go with the motion's kind, updates that are refused.
#include "filters/planar/past_pose.hpp"
#include "filters/planar/set_pose.hpp"
#include "math/se3.hpp"
#include "planar_fixture.hpp"
#include "waymark/random.h"

namespace {

using namespace planar;

constexpr int kMost = 24;

void begin(const wm_wheels &wheels, int model = WM_MOTION_AUTO) {
  params.model = model;
  params.states = states;
  planar::begin(wheels, {1, 2, 0.4}, 0.1);
}

// Driven for a while so that all is correlated.
void begin_busy() {
  wm_wheels wheels = make::no_wheels();
  wheels.track_m = 0.5;
  for (const int term : {WM_SPEED_SCALE, WM_YAW_RATE_SCALE, WM_YAW_RATE_BIAS, WM_TRACK_SCALE})
    states.sigma[term] = 0.05;
  begin(wheels);
  drive_swinging();
}

struct kept {
  double x[kMost], p[kMost][kMost];
  kept() {
    for (int i = 0; i < filter->states(); i++) {
      x[i] = filter->value(i);
      for (int j = 0; j < filter->states(); j++) p[i][j] = filter->covariance(i, j);
    }
  }
};

// ── poses from outside ──────────────────────────────────────────────────────────────────────────────────────────────

// The heading of a pose in space is that of the body's x axis seen from above, however it rolls and pitches.
TEST(test_a_pose_in_space_has_the_heading_of_its_x_axis) {
  wm_random random = {4, 1, 0};
  for (int i = 0; i < 200; i++) {
    double q[4], norm = 0.0;
    for (double &each : q) each = wm_random_next_normal(&random);
    for (const double each : q) norm += each * each;
    wm_event e = make::set_pose(0.0, 3.0, -4.0, 0.0, 0.2, 0.1);
    for (int k = 0; k < 4; k++) e.as.set_pose.pose_map_base.q_xyzw[k] = q[k] / std::sqrt(norm);
    wm::given_pose given;
    TEST_ASSERT_EQUAL(WM_OK, wm::read_set_pose(e, &given));
    const wm::vec3 ahead = wm::matrix_of(wm::quat_of(e.as.set_pose.pose_map_base.q_xyzw)) * wm::vec3{1, 0, 0};
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, wm::wrap(std::atan2(ahead.y, ahead.x) - given.pose.heading_rad));
    TEST_ASSERT_EQUAL_DOUBLE(3.0, given.pose.x_m);
    TEST_ASSERT_EQUAL_DOUBLE(-4.0, given.pose.y_m);
    TEST_ASSERT_EQUAL_DOUBLE(0.2, given.sigma_xy_m);
    TEST_ASSERT_EQUAL_DOUBLE(0.1, given.sigma_heading_rad);
  }
}

void expect_pose(double x, double y, double heading, double sigma_xy, double sigma_heading) {
  const double pose[3] = {x, y, heading}, sigma[3] = {sigma_xy, sigma_xy, sigma_heading};
  for (int i = 0; i < 3; i++) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, pose[i], filter->value(i));
    for (int j = 0; j < filter->states(); j++) {
      TEST_ASSERT_DOUBLE_WITHIN(1e-12 * sigma[i] * sigma[i], i == j ? sigma[i] * sigma[i] : 0.0,
                                filter->covariance(i, j));
      TEST_ASSERT_EQUAL_DOUBLE(filter->covariance(i, j), filter->covariance(j, i));
    }
  }
}

// A pose that is set has its own sigmas and nothing in common with the states; the calibration stays. One in the past
// is refused and changes nothing.
TEST(test_a_set_pose_replaces_pose_and_covariance) {
  begin_busy();
  const kept before;
  TEST_ASSERT_EQUAL(WM_TIME_RAN_BACK, wm::set_pose(*filter, make::set_pose(1.9, 5.0, 6.0, -2.0, 0.3, 0.2)));
  wm_event impossible = make::set_pose(2.5, 5.0, 6.0, -2.0, -0.3, 0.2);
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, wm::set_pose(*filter, impossible));
  TEST_ASSERT_EQUAL_INT64(make::at(2.0), filter->now_ns());
  TEST_ASSERT_EQUAL_DOUBLE(before.x[0], filter->value(0));
  TEST_ASSERT_EQUAL(WM_OK, wm::set_pose(*filter, make::set_pose(2.5, 5.0, 6.0, -2.0, 0.3, 0.2)));
  TEST_ASSERT_EQUAL_INT64(make::at(2.5), filter->now_ns());
  expect_pose(5.0, 6.0, -2.0, 0.3, 0.2);
  for (int i = 3; i < filter->states(); i++) TEST_ASSERT_EQUAL_DOUBLE(before.x[i], filter->value(i));
}

// Of a start each part that is not known has the sigma of any; a sigma that is not stated is that of a mark by hand.
TEST(test_a_reset_pose_is_the_starts) {
  const double none = NAN;
  const struct {
    wm_start start;
    double x, y, heading, sigma_xy, sigma_heading;
  } rows[] = {{{0, {3, 4, 0}, {0, 0, 0, 1}, 0.5, 0.2, 0.1}, 3, 4, 0.5, 0.2, 0.1},
              {{0, {3, 4, 0}, {0, 0, 0, 1}, 0.5, none, none}, 3, 4, 0.5, 0.05, 0.05},
              {{0, {none, 4, 0}, {0, 0, 0, 1}, 0.5, 0.2, 0.1}, 0, 0, 0.5, 1000.0, 0.1},
              {{0, {3, none, 0}, {0, 0, 0, 1}, 0.5, 0.2, 0.1}, 0, 0, 0.5, 1000.0, 0.1},
              {{0, {3, 4, 0}, {0, 0, 0, 1}, none, 0.2, 0.1}, 3, 4, 0, 0.2, M_PI}};
  for (const auto &row : rows) {
    begin_busy();
    TEST_ASSERT_EQUAL(WM_OK, wm::reset_pose(*filter, row.start, make::at(2.5)));
    expect_pose(row.x, row.y, row.heading, row.sigma_xy, row.sigma_heading);
    TEST_ASSERT_EQUAL(WM_TIME_RAN_BACK, wm::reset_pose(*filter, row.start, make::at(2.4)));
  }
}

// The first pose: the start's, with the same defaults; a place that is not known is 0.
TEST(test_the_start_of_the_filter) {
  begin(make::no_wheels());
  expect_pose(1.0, 2.0, 0.4, 0.1, 0.1);
  setup.start = {WM_TIME_NONE, {NAN, NAN, 0}, {0, 0, 0, 1}, NAN, NAN, NAN};
  begin_again();
  expect_pose(0.0, 0.0, 0.0, 0.05, 0.05);
  setup.start.heading_rad = 4.0;
  begin_again();
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 4.0 - 2.0 * M_PI, filter->value(2));
}

// ── covariances ─────────────────────────────────────────────────────────────────────────────────────────────────────

TEST(test_inflated_mixed_and_scaled_covariances) {
  begin_busy();
  const kept a;
  const int n = filter->states();
  filter->inflate_pose(0.5, 0.2);
  const double more[3] = {0.5, 0.5, 0.2};
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++)
      TEST_ASSERT_DOUBLE_WITHIN(1e-15, a.p[i][j] + (i == j && i < 3 ? more[i] : 0.0), filter->covariance(i, j));
  const kept b;
  double off[kMost] = {};
  for (int i = 0; i < n; i++) off[i] = 0.3 * (i + 1);
  filter->add_chance(0.2, off);
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++)
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, b.p[i][j] + 0.2 * off[i] * off[j], filter->covariance(i, j));
  const kept c;
  filter->scale_pose_sigmas(3.0);
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++)
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, c.p[i][j] * (i < 3 ? 3.0 : 1.0) * (j < 3 ? 3.0 : 1.0), filter->covariance(i, j));
}

// A row without states has no effect. An innovation without a positive variance, or that is not finite, is refused.
TEST(test_updates_that_are_refused) {
  begin_busy();
  wm::planar_row nothing, row;
  row.add(0, 1.0);
  TEST_ASSERT_EQUAL_DOUBLE(0.0, filter->variance_of(nothing));
  const kept before;
  TEST_ASSERT_FALSE(filter->update(nothing, 0.1, 0.0));
  TEST_ASSERT_FALSE(filter->update(row, NAN, 0.1));
  TEST_ASSERT_FALSE(filter->update(row, 0.1, INFINITY));
  for (int i = 0; i < filter->states(); i++) TEST_ASSERT_EQUAL_DOUBLE(before.x[i], filter->value(i));
  TEST_ASSERT_TRUE(filter->update(nothing, 0.1, 0.1));  // of no effect
  for (int i = 0; i < filter->states(); i++) TEST_ASSERT_EQUAL_DOUBLE(before.x[i], filter->value(i));
}

// What the noise's adaption takes of a row beside the pose: its derivatives by a position's lasting error, each axis.
TEST(test_a_row_s_part_of_a_lasting_error) {
  begin_busy();
  const int error = filter->add_state(0.0, 0.3), other = filter->add_state(0.0, 0.3),
            behind = filter->add_state(0.0, 0.3);
  filter->set_correlated_position(error);
  wm::planar_row row;
  row.add(1, 0.4), row.add(3, 9.0), row.add(error, 0.7), row.add(other, -0.2), row.add(behind, 9.0);
  const double expected[wm::noise_adaption::kBlock] = {0.0, 0.4, 0.0, 0.7, -0.2};
  double by[wm::noise_adaption::kBlock];
  filter->put_adapted(row, by);
  TEST_ASSERT_EQUAL_DOUBLE_ARRAY(expected, by, wm::noise_adaption::kBlock);
}

// GIVEN twists whose turn has the wrong sign WHEN headings are seen THEN the factor -1 explains them; of a right turn,
// and of a velocity that is a state, none is listed.
TEST(test_the_turn_is_tested_by_what_is_seen) {
  for (int how = 0; how < 3; how++) {
    const int models[] = {WM_MOTION_TWIST, WM_MOTION_TWIST, WM_MOTION_CONSTANT_VELOCITY};
    begin(make::no_wheels(), models[how]);
    double listed = 0.0;
    for (int i = 0; i <= 200; i++) {
      const double w = 0.2 * sin(0.05 * i), heading = 0.4 + (how == 0 ? -1.0 : 1.0) * 4.0 * (1.0 - cos(0.05 * i)) * 0.1;
      if (how == 2)
        filter->move_to(make::at(0.1 * i));
      else
        filter->move(make::twist(0.1 * i, 0.5, w));
      wm::planar_row row;
      row.add(wm::kHeading, 1.0);
      TEST_ASSERT_TRUE(filter->update(row, wm::wrap(heading - filter->value(wm::kHeading)), 1e-4));
      wm_calibration_value value{};
      wm::calibration_list list(&value, 1);
      filter->turn_test().list(&list);
      if (list.count() > 0) listed = value.value;
    }
    TEST_ASSERT_EQUAL_DOUBLE(how == 0 ? -1.0 : 0.0, listed);
    begin_again();
    wm_calibration_value value{};
    wm::calibration_list list(&value, 1);
    filter->turn_test().list(&list);  // begun again, nothing is known of it
    TEST_ASSERT_EQUAL(0, list.count());
  }
}

// GIVEN an update that takes a state beyond its limit THEN it stays at it, and what is correlated with it moves along:
// the projection by the covariance.
TEST(test_a_state_beyond_its_limit_takes_the_others_along) {
  begin_busy();
  const kept before;
  const int scale = filter->motion_state(wm::kSpeedScale);
  wm::planar_row row;
  row.add(scale, 1.0);
  const double s = before.p[scale][scale] + 1e-4, innovation = 5.0;
  TEST_ASSERT_TRUE(filter->update(row, innovation, 1e-4));
  const double beyond = before.x[scale] + before.p[scale][scale] / s * innovation - 3.0;  // 3 is the most
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.5, beyond);
  TEST_ASSERT_EQUAL_DOUBLE(3.0, filter->value(scale));
  TEST_ASSERT_EQUAL_DOUBLE(3.0, filter->calibration().value[wm::kSpeedScale]);
  for (int i = 0; i < filter->states(); i++) {
    const double by = filter->covariance(scale, i) / filter->variance(scale);
    const double expected = before.x[i] + before.p[i][scale] / s * innovation - by * beyond;
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, i == 2 ? wm::wrap(expected) : expected, filter->value(i));
  }
}

// ── motion ──────────────────────────────────────────────────────────────────────────────────────────────────────────

// By-default states come with the motion's kind and go with it: the lag of commands is none of measured twists.
TEST(test_states_come_and_go_with_the_kind_of_the_motion) {
  for (double &sigma : states.sigma) sigma = -0.05;
  params.twist = WM_TWIST_AUTO;
  begin(make::no_wheels());
  for (int i = 0; i < wm::kCalibrationCount; i++) TEST_ASSERT_EQUAL(-1, filter->motion_state(i));
  const auto drive = [&](double from_s, bool commands) {
    for (int i = 0; i < 200; i++) {
      const double v = 0.3 + 0.1 * (i / 10 % 3), off = commands ? 0.0 : 1e-3 * i;
      filter->move(make::twist(from_s + 0.05 * i, v + off, 0.2 + off));
    }
  };
  drive(0.0, true);
  TEST_ASSERT_GREATER_OR_EQUAL(0, filter->motion_state(wm::kLag));
  TEST_ASSERT_GREATER_OR_EQUAL(0, filter->motion_state(wm::kSpeedScale));
  TEST_ASSERT_EQUAL(-1, filter->motion_state(wm::kLeftScale));
  TEST_ASSERT_EQUAL(-1, filter->motion_state(wm::kSteeringOffset));
  filter->forget(filter->motion_state(wm::kLag), 0.2, 0.01);
  TEST_ASSERT_EQUAL_DOUBLE(0.2, filter->calibration().value[wm::kLag]);
  for (int k = 1; k < 12; k++) drive(10.0 * k, false);
  TEST_ASSERT_EQUAL(-1, filter->motion_state(wm::kLag));
  TEST_ASSERT_EQUAL_DOUBLE(0.0, filter->calibration().value[wm::kLag]);
  TEST_ASSERT_GREATER_OR_EQUAL(0, filter->motion_state(wm::kSpeedScale));
}

// More lag moves the pose back by the twist, on the axes on which it was predicted. Corrections of the heading since do
// not change that: else the lag and a sensor's time offset would not be observed as their sum alone.
TEST(test_corrections_of_the_heading_tell_nothing_of_the_lag) {
  for (double &sigma : states.sigma) sigma = 0.0;
  states.sigma[WM_LAG] = 0.2;
  params.twist = WM_TWIST_COMMANDS;
  begin(make::no_wheels());
  const int lag = filter->motion_state(wm::kLag);
  for (int i = 0; i <= 250; i++) {
    filter->move(make::twist(0.04 * i, i < 25 ? 0.0 : 0.5, 0.0));
    if (i % 25 != 0) continue;
    wm::planar_row row;
    row.add(wm::kHeading, 1.0);
    TEST_ASSERT_TRUE(filter->update(row, 0.1, 1e-4));
  }
  filter->move(make::twist(10.04, 0.5, 0.0));
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.7, filter->pose().heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.04, filter->variance(lag));
  const double v = filter->twist().v, heading_rad = filter->pose().heading_rad;
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, -v * std::cos(heading_rad), filter->covariance(wm::kX, lag) / 0.04);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, -v * std::sin(heading_rad), filter->covariance(wm::kY, lag) / 0.04);
  // A pose that is given is no correction: from there on the robot has moved by the twist on new axes.
  const double exact[3][3] = {{1e-6, 0, 0}, {0, 1e-6, 0}, {0, 0, 1e-8}};
  filter->set_pose({0, 0, -1.0}, exact);
  filter->move(make::twist(10.08, 0.5, 0.0));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, filter->covariance(wm::kX, lag));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, filter->covariance(wm::kY, lag));
}

// Twists without the steps of counts, of a robot by counts with and without a gyro: the low-pass of 0.1 s, of 0.3 s for
// turns, and with a dead band of a count's noise. Where counts give neither speed nor turn the twist is as it is.
TEST(test_rates_without_the_steps_of_counts) {
  constexpr double kTick_m = 2 * M_PI * 0.1 / 1000, kEach_s = 0.02;
  for (const int model : {WM_MOTION_TICKS, WM_MOTION_SPEED_YAW_RATE, WM_MOTION_TWIST}) {
    begin(make::two_wheels(), model);
    wm::steady_rate v{}, w{};
    double left = 0.0, right = 0.0;
    const double wheel_mps = kTick_m / (std::sqrt(6.0) * kEach_s);
    for (int i = 0; i <= 60; i++) {
      const double t_s = kEach_s * i;
      left += std::floor(20.0 + 9.0 * sin(0.4 * i)), right += std::floor(22.0 + 9.0 * cos(0.3 * i));
      if (model == WM_MOTION_TWIST) {
        filter->move(make::twist(t_s, 1.0, 0.2));
        continue;
      }
      if (model == WM_MOTION_SPEED_YAW_RATE)
        filter->move(make::quantities(
            t_s,
            {{WM_Q_YAW_RATE, 0.3 + 0.01 * (i % 3)}, {WM_Q_WHEEL_TICKS_LEFT, left}, {WM_Q_WHEEL_TICKS_RIGHT, right}}));
      else
        filter->move(make::quantities(t_s, {{WM_Q_WHEEL_TICKS_LEFT, left}, {WM_Q_WHEEL_TICKS_RIGHT, right}}));
      const double v_sigma = i < 2 ? 0.0 : wheel_mps / std::sqrt(2.0);
      if (i == 0) continue;
      v.step(filter->twist().v, kEach_s / (kEach_s + 0.1), v_sigma);
      w.step(filter->twist().w, kEach_s / (kEach_s + 0.3),
             model == WM_MOTION_TICKS ? wheel_mps * std::sqrt(2.0) / 0.5 * (i >= 2) : 0.0);
    }
    const wm::planar_twist given = {7.0, 8.0, 9.0}, low = filter->low_passed(given), band = filter->steady(given);
    const bool counts = model != WM_MOTION_TWIST, turns = model == WM_MOTION_TICKS;
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, counts ? v.smooth : 7.0, low.v);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, turns ? w.smooth : 9.0, low.w);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, counts ? v.banded : 7.0, band.v);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, turns ? w.banded : 9.0, band.w);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, turns ? 0.3 * (w.smooth - w.twice) : 0.0, filter->rounding_by_track());
    TEST_ASSERT_EQUAL_DOUBLE(8.0, low.u);
    TEST_ASSERT_EQUAL_DOUBLE(8.0, band.u);
    if (counts) TEST_ASSERT_GREATER_THAN_DOUBLE(1e-4, std::fabs(band.v - low.v));
  }
}

// A measurement ahead of the newest count has the errors of two: e1 + u (e1 - e0) after u periods.
TEST(test_the_variance_of_a_measurement_by_counts) {
  constexpr double kTick_m = 2 * M_PI * 0.1 / 1000, kEach_s = 0.02;
  begin(make::two_wheels(), WM_MOTION_TICKS);
  for (int i = 0; i <= 60; i++)
    filter->move(
        make::quantities(kEach_s * i, {{WM_Q_WHEEL_TICKS_LEFT, 30.0 * i}, {WM_Q_WHEEL_TICKS_RIGHT, 31.0 * i}}));
  const double way_m2 = kTick_m * kTick_m / 12.0, turn_rad2 = kTick_m * kTick_m / 3.0 / 0.25;
  for (const double periods : {-3.0, 0.0, 0.5, 1.0})
    for (const double heading : {0.0, 0.9, -2.0}) {
      const double by[3] = {0.4, -1.1, 0.8}, u = std::fmax(periods, 0.0);
      const double share = 0.5 * ((1.0 + u) * (1.0 + u) + u * u);
      const double along = by[0] * cos(heading) + by[1] * sin(heading);
      const double expected = share * (along * along * way_m2 + by[2] * by[2] * turn_rad2);
      TEST_ASSERT_DOUBLE_WITHIN(1e-6 * expected, expected,
                                filter->count_variance(make::at(kEach_s * (60 + periods)), by, heading));
    }
  begin(make::no_wheels(), WM_MOTION_TWIST);
  for (int i = 0; i < 10; i++) filter->move(make::twist(0.1 * i, 1.0, 0.2));
  const double by[3] = {1, 1, 1};
  TEST_ASSERT_EQUAL_DOUBLE(0.0, filter->count_variance(make::at(0.95), by, 0.3));
}

// GIVEN a velocity that is a state WHEN nothing is seen for long THEN the heading is as unsure as any heading, pi^2 /
// 3, and no more; below that its variance is what was added.
TEST(test_an_unseen_heading_is_as_unsure_as_any) {
  for (const double added : {0.5, 100.0}) {
    begin(make::no_wheels(), WM_MOTION_CONSTANT_VELOCITY);
    filter->move_to(0);
    filter->inflate_pose(0.0, added);
    const double heading = filter->value(2), place = filter->variance(0);
    filter->move_to(1);
    TEST_ASSERT_EQUAL_DOUBLE(heading, filter->value(2));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, std::fmin(0.01 + added, M_PI * M_PI / 3.0), filter->variance(2));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, place, filter->variance(0));
    filter->move_to(make::at(200.0));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, M_PI * M_PI / 3.0, filter->variance(2));
  }
}

// Odometry by the motion alone: the way with its sideways part, the turns of either sense, odom from its own origin.
TEST(test_odometry_counts_ways_and_turns) {
  begin(make::no_wheels(), WM_MOTION_TWIST);
  wm_pose2 odom = {};
  for (int i = 0; i <= 40; i++) {
    const double w = i < 20 ? 0.5 : -0.3;
    filter->move(make::twist6(0.1 * i, 0.3, -0.4, w));
    if (i == 40) break;
    const wm::arc a = wm::make_arc(0.03, -0.04, 0.1 * w);
    odom = wm::compose(odom, {a.x_m, a.y_m, a.turn_rad});
  }
  wm_estimate e;
  filter->estimate(&e);
  TEST_ASSERT_EQUAL_INT64(make::at(4.0), e.t_ns);
  TEST_ASSERT_EQUAL_DOUBLE(filter->value(2), e.heading_rad);
  TEST_ASSERT_EQUAL_DOUBLE(-0.4, e.v_mps[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.0, filter->travelled_m());
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.6, filter->turned_rad());
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, odom.x_m, filter->odom().x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, odom.y_m, filter->odom().y_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, odom.heading_rad, filter->odom().heading_rad);
}

// A motion that has been silent for a minute may have gone anywhere since the pose was last corrected, not since the
// silence began.
TEST(test_a_silence_adds_by_the_time_since_a_correction) {
  begin(make::no_wheels(), WM_MOTION_TWIST);
  for (int i = 0; i <= 10; i++) filter->move(make::twist(0.1 * i, 1.5, 0.0));
  double grown_m2[2];
  for (int i = 0; i < 2; i++) {
    filter->move_to(make::at(20.0 + 40.0 * i));
    const double exact[3][3] = {{1e-6, 0, 0}, {0, 1e-6, 0}, {0, 0, 1e-6}};
    filter->set_pose({}, exact);
    filter->move_to(make::at(20.25 + 40.0 * i));
    grown_m2[i] = filter->variance(0);
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.01 * grown_m2[0], grown_m2[0], grown_m2[1]);
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 1.5 * 0.25, std::sqrt(grown_m2[0]));
}

// Used memory is as good as new: a filter that is begun again is the same.
TEST(test_a_filter_that_is_begun_again_is_the_same) {
  begin_busy();
  const kept first;
  const double travelled = filter->travelled_m(), turned = filter->turned_rad();
  const wm_pose2 odom = filter->odom();
  begin_again();
  drive_swinging();
  for (int i = 0; i < filter->states(); i++) {
    TEST_ASSERT_EQUAL_DOUBLE(first.x[i], filter->value(i));
    for (int j = 0; j < filter->states(); j++) TEST_ASSERT_EQUAL_DOUBLE(first.p[i][j], filter->covariance(i, j));
  }
  TEST_ASSERT_EQUAL_DOUBLE(travelled, filter->travelled_m());
  TEST_ASSERT_EQUAL_DOUBLE(turned, filter->turned_rad());
  TEST_ASSERT_EQUAL_DOUBLE(odom.x_m, filter->odom().x_m);
}

// The path between two times in the past is that of the poses then.
TEST(test_a_past_path_is_that_between_the_poses) {
  begin(make::no_wheels(), WM_MOTION_TWIST);
  wm_pose2 pose[41];
  for (int i = 0; i <= 40; i++) {
    filter->move(make::twist6(0.1 * i, 0.8 + 0.01 * i, i < 20 ? 0.1 : -0.2, 0.5 * sin(0.3 * i)));
    pose[i] = filter->pose();
  }
  const int ends[][2] = {{3, 4}, {10, 30}, {25, 40}};
  for (const auto &end : ends) {
    wm::motion_twist twist{};
    const wm_pose2 path = filter->path(make::at(0.1 * end[0]), make::at(0.1 * end[1]), &twist);
    const wm_pose2 expected = wm::between(pose[end[0]], pose[end[1]]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected.x_m, path.x_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected.y_m, path.y_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected.heading_rad, path.heading_rad);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.8 + 0.01 * end[0], twist.v);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5 * sin(0.3 * end[0]), twist.w);
  }
}

}  // namespace

void setUp(void) { all_exact(); }
