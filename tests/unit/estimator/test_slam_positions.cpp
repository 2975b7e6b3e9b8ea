// SPDX-License-Identifier: Apache-2.0
// SLAM with positions and headings: a map that began in a frame of its own is put where they say, and stays true.
#include "slam_room.hpp"

namespace {

using namespace room;

const wm_pose2 kFrame = {4000.0, -2500.0, 2.1};  // where the room lies in the positions' frame

wm_pose2 there() { return wm::compose(kFrame, truth); }

// Of place and heading, in the positions' frame.
double off_there() { return off_from(there()); }
double turned_there() { return turned_from(there()); }

double worst_landmark_there() {
  double worst = 0.0;
  for (const mapped &m : map()) {
    const double *p = place[m.landmark.id - 10];
    const wm_pose2 at = wm::compose(kFrame, {p[0], p[1], 0.0});
    worst = std::fmax(worst, std::hypot(m.landmark.p_m[0] - at.x_m, m.landmark.p_m[1] - at.y_m));
  }
  TEST_ASSERT_GREATER_THAN(8, map().size());
  return worst;
}

void begin_without_a_start() {
  without_a_start();
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
  begin_without_a_start();
  drive(5);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  const wm_pose2 at = there();
  see(make::position(now_s, at.x_m, at.y_m, 0.02));
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());  // one position shows no heading
  TEST_ASSERT_EQUAL_DOUBLE(1.0, estimate().lost_probability);
  drive_with_positions(40, 0.02);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_EQUAL(2, estimate().resets);
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
    begin_without_a_start();
    drive_with_positions(25, 0.05);
    sum += nees_from(there());
  }
  // Mean NEES of two numbers; 20 drives have 40 degrees of freedom, of which 99 % are in [20.7, 66.8].
  TEST_ASSERT_LESS_THAN_DOUBLE(66.8, sum);
  TEST_ASSERT_GREATER_THAN_DOUBLE(20.7, sum);
}

TEST(test_a_compass_turns_the_map_and_a_position_shifts_it) {
  begin_without_a_start();
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
  TEST_ASSERT_EQUAL(1, estimate().resets);
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
  const wm_calibration_value scale = calibrated("motion.speed_scale");
  TEST_ASSERT_LESS_THAN_DOUBLE(0.01, scale.sigma);
  TEST_ASSERT_DOUBLE_WITHIN(3.0 * scale.sigma, 1.0 / stretch, scale.value);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark_there());
}

TEST(test_a_standing_robot_waits_for_its_frame) {
  begin_without_a_start();
  for (int i = 0; i < 50; i++) {
    now_s += 0.1;
    feed(make::twist(now_s, 0.0, 0.0));
    const wm_pose2 at = there();
    see(make::position(now_s, at.x_m + gauss(0.02), at.y_m + gauss(0.02), 0.02));
  }
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, last.verdict);
}

TEST(test_a_receiver_that_jumps_moves_neither_pose_nor_map) {
  begin_without_a_start();
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
  TEST_ASSERT_EQUAL(WM_NOT_FINITE, tell(make::position(now_s, NAN, 0.0, 0.02)));
  make::positions.use_position = make::positions.use_heading = 0;
  begin();
  TEST_ASSERT_EQUAL(WM_REJECTED_BY_CONFIG, see(make::position(now_s, 0.0, 0.0, 0.02)));
  TEST_ASSERT_EQUAL(WM_REJECTED_BY_CONFIG, see(make::heading(now_s, 0.0, 0.02)));
}

// A robot that starts where positions are and drives into a hall without them keeps the map in their frame.
TEST(test_a_new_start_forgets_the_frame) {
  begin_without_a_start();
  drive_with_positions(30, 0.02);
  feed(make::empty(now_s, WM_EVENT_RESET));
  const wm_pose2 at = there();
  see(make::position(now_s, at.x_m, at.y_m, 0.02));
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
  drive_with_positions(40, 0.02);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off_there());
}

}  // namespace

void setUp(void) { make_room(); }
