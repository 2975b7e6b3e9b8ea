// SPDX-License-Identifier: Apache-2.0
// SLAM with positions and headings: a map that began in a frame of its own is put where they say, and stays true.
#include "common/suite.h"
#include "slam_room.hpp"

namespace {

using namespace room;

const wm_pose2 kFrame = {4000.0, -2500.0, 2.1};  // where the room lies in the positions' frame

wm_pose2 there() { return wm::compose(kFrame, truth); }

wm_estimate published() {
  wm_estimate e;
  slam->estimate(state, &e);
  return e;
}

// Of place and heading, in the positions' frame.
double off_there() {
  const wm_estimate e = published();
  return std::hypot(e.pose_map_base.p_m[0] - there().x_m, e.pose_map_base.p_m[1] - there().y_m);
}
double turned_there() { return std::fabs(wm::wrap(published().heading_rad - there().heading_rad)); }

// Squared error of the place over its covariance, of two numbers.
double nees_there() {
  const wm_estimate e = published();
  const double dx = e.pose_map_base.p_m[0] - there().x_m, dy = e.pose_map_base.p_m[1] - there().y_m;
  const double xx = e.covariance[0], xy = e.covariance[1], yy = e.covariance[wm_cov_index(1, 1)];
  return (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
}

double worst_landmark_there() {
  wm_landmark l[64];
  double covariance[64][4], worst = 0.0;
  const size_t found = slam->landmarks(state, l, covariance, 64);
  for (size_t i = 0; i < found; i++) {
    const double *p = place[l[i].id - 10];
    const wm_pose2 at = wm::compose(kFrame, {p[0], p[1], 0.0});
    worst = std::fmax(worst, std::hypot(l[i].p_m[0] - at.x_m, l[i].p_m[1] - at.y_m));
  }
  TEST_ASSERT_GREATER_THAN(8, found);
  return worst;
}

void without_a_start() {
  setup.start.p_m[0] = setup.start.p_m[1] = setup.start.heading_rad = kAbsent;
  begin();
}

// Drives and gives a position a second, `jump_m` off to the east.
void drive_with_positions(int seconds, double sigma_m, double jump_m = 0.0) {
  for (int i = 0; i < seconds; i++) {
    drive(1.0);
    const wm_pose2 at = there();
    see(make::position(now_s, at.x_m + jump_m + gauss(sigma_m), at.y_m + gauss(sigma_m), sigma_m));
  }
}

TEST(test_a_map_of_its_own_is_put_where_positions_say) {
  without_a_start();
  drive(5);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  const wm_pose2 at = there();
  see(make::position(now_s, at.x_m, at.y_m, 0.02));
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());  // one position shows no heading
  TEST_ASSERT_EQUAL_DOUBLE(1.0, published().lost_probability);
  drive_with_positions(40, 0.02);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_EQUAL(2, published().resets);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off_there());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.03, turned_there());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, worst_landmark_there());
}

TEST(test_its_covariance_is_as_large_as_its_error) {
  double sum = 0.0;
  const int drives = 20;
  for (int seed = 0; seed < drives; seed++) {
    make_room();
    noise = {(uint64_t)(100 + seed), 1, 0};
    // The simulated receiver is in base_link, in time, and its errors do not last.
    make::positions.correlated_m = make::positions.antenna_sigma_m = make::positions.time_offset_sigma_s = 0.0;
    make::positions.sigma_factor = 1.0;
    without_a_start();
    drive_with_positions(25, 0.05);
    sum += nees_there();
  }
  // Mean NEES of two numbers; 20 drives have 40 degrees of freedom, of which 99 % are in [20.7, 66.8].
  TEST_ASSERT_LESS_THAN_DOUBLE(66.8, sum);
  TEST_ASSERT_GREATER_THAN_DOUBLE(20.7, sum);
}

TEST(test_a_compass_turns_the_map_and_a_position_shifts_it) {
  without_a_start();
  drive(10);
  see(make::heading(now_s, there().heading_rad, 0.01));
  const wm_pose2 at = there();
  see(make::position(now_s, at.x_m, at.y_m, 0.02));
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(1e-6, off_there());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, turned_there());
  drive_with_positions(30, 0.02);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off_there());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, worst_landmark_there());
}

TEST(test_from_a_stated_start_positions_hold_the_map) {
  const wm_pose2 at = there();
  setup.start = {WM_TIME_NONE, {at.x_m, at.y_m, 0}, {0, 0, 0, 1}, at.heading_rad, 0.05, 0.02};
  begin();
  drive_with_positions(40, 0.02);
  TEST_ASSERT_EQUAL(1, published().resets);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off_there());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark_there());
}

// Speeds and ranges are a tenth too long, and both scales are states: the map alone may have any size.
TEST(test_positions_measure_the_size_of_a_map_with_a_stated_start) {
  const wm_pose2 at = there();
  setup.start = {WM_TIME_NONE, {at.x_m, at.y_m, 0}, {0, 0, 0, 1}, at.heading_rad, 0.05, 0.02};
  stretch = 1.1;
  motion.states.sigma[WM_SPEED_SCALE] = make::sightings.states.sigma[WM_SENSOR_ROW_kRangeScale] = 0.1;
  make::positions.time_offset_sigma_s = make::positions.antenna_sigma_m = make::positions.correlated_m = 0.0;
  begin();
  drive_with_positions(60, 0.02);
  double sigma;
  const double scale = calibrated("motion.speed_scale", &sigma);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.01, sigma);
  TEST_ASSERT_DOUBLE_WITHIN(3.0 * sigma, 1.0 / stretch, scale);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark_there());
}

TEST(test_a_standing_robot_waits_for_its_frame) {
  without_a_start();
  for (int i = 0; i < 50; i++) {
    now_s += 0.1;
    const wm_event still = make::twist(now_s, 0.0, 0.0);
    TEST_ASSERT_EQUAL(WM_OK, slam->predict(state, &still));
    const wm_pose2 at = there();
    see(make::position(now_s, at.x_m + gauss(0.02), at.y_m + gauss(0.02), 0.02));
  }
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, last.verdict);
}

TEST(test_a_receiver_that_jumps_moves_neither_pose_nor_map) {
  without_a_start();
  drive_with_positions(40, 0.02);
  const double before_m = worst_landmark_there();
  drive_with_positions(3, 0.02, 5.0);
  TEST_ASSERT_EQUAL(WM_REJECTED_GATE, last.verdict);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off_there());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(before_m + 0.03, worst_landmark_there());
}

TEST(test_a_position_that_is_no_number_or_not_wanted_is_refused) {
  begin();
  wm_event bad = make::position(now_s, NAN, 0.0, 0.02);
  wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX];
  size_t count = 0;
  TEST_ASSERT_EQUAL(WM_NOT_FINITE, slam->correct(state, &bad, out, WM_INNOVATIONS_PER_EVENT_MAX, &count));
  make::positions.use_position = make::positions.use_heading = 0;
  begin();
  TEST_ASSERT_EQUAL(WM_REJECTED_BY_CONFIG, see(make::position(now_s, 0.0, 0.0, 0.02)));
  TEST_ASSERT_EQUAL(WM_REJECTED_BY_CONFIG, see(make::heading(now_s, 0.0, 0.02)));
}

// A robot that starts where positions are and drives into a hall without them keeps the map in their frame.
TEST(test_a_new_start_forgets_the_frame) {
  without_a_start();
  drive_with_positions(30, 0.02);
  wm_event reset = make::empty(now_s, WM_EVENT_RESET);
  size_t count = 0;
  TEST_ASSERT_EQUAL(WM_OK, slam->correct(state, &reset, nullptr, 0, &count));
  const wm_pose2 at = there();
  see(make::position(now_s, at.x_m, at.y_m, 0.02));
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
  drive_with_positions(40, 0.02);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off_there());
}

}  // namespace

void setUp(void) { make_room(); }
void tearDown(void) { leave_room(); }
