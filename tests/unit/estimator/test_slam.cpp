// SPDX-License-Identifier: Apache-2.0
// SLAM in a simulated room whose landmarks nobody measured: it finds them, and absurd input is told, counted and
// survived. Scenarios are GIVEN / WHEN / THEN; all noise is drawn from fixed seeds.
#include "filters/slam/bearing_tracks.hpp"
#include "slam_room.hpp"

namespace {

using namespace room;

// GIVEN nothing but a start WHEN it looks around for 40 s THEN all landmarks and the robot are within so much of their
// places: by bearing and range, without identities, and by markers, of which one pose fits their corners, or two.
TEST(test_landmarks_are_found) {
  const struct {
    bool nameless, coded, two_poses;
    double landmarks_m, off_m;
  } rows[] = {{false, false, false, 0.1, 0.1},
              {true, false, false, 0.1, 0.1},
              {false, true, false, 0.05, 0.05},
              {false, true, true, 0.1, INFINITY}};
  for (const auto &row : rows) {
    make_room();
    nameless = row.nameless, coded = row.coded, two_poses = row.two_poses;
    if (nameless) params.associate_near_m = 2.0;
    make::markers.heading_sigma_rad = 0.01;
    begin();
    drive(40);
    expect_whole_map(row.landmarks_m);
    TEST_ASSERT_LESS_THAN_DOUBLE(row.off_m, off());
    for (const auto &[m, covariance] : map())
      if (two_poses) {  // a place, and no heading
        TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, covariance[3]);
      } else if (coded) {
        TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.0, wm::wrap(m.yaw_rad - 0.5 * (m.id - 10)));
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.2, m.p_m[2]);
      }
  }
}

TEST(test_landmarks_are_found_by_bearings_alone_whatever_the_method) {
  for (int method : {WM_SLAM_LINE_UNSCENTED, WM_SLAM_LINE_LINEAR, WM_SLAM_LINE_INVERSE_DISTANCE}) {
    make_room();
    params.line_method = method;
    begin();
    drive(60, false);
    size_t found;
    TEST_ASSERT_LESS_THAN_DOUBLE(0.3, worst_landmark(&found));
    TEST_ASSERT_GREATER_OR_EQUAL(kCount - 1, found);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.3, off());
  }
}

// Two identities that were out of sight for 5 s and fit again: no tracker's numbers. Then they are evidence for a pose.
TEST(test_identities_of_bearings_that_come_back_are_landmarks_own) {
  begin();
  drive(10, false);
  TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0.0, counted(WM_COUNTER_LANDMARKS_MERGED));  // listed: they may be a tracker's
  drive(50, false);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.0, counted(WM_COUNTER_LANDMARKS_MERGED));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.3, off());
}

TEST(test_the_first_marker_widens_a_map_of_points) {
  begin();
  drive(20);
  size_t found;
  const double worst = worst_landmark(&found);
  wm_event e = make::empty(now_s, WM_EVENT_MARKER);
  e.as.marker = marker(99, 2.0, 0.0, 1.0, 0.3);
  TEST_ASSERT_EQUAL(WM_FUSED, see(e));
  size_t still;
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, worst, worst_landmark(&still));
  TEST_ASSERT_EQUAL(found, still);
  drive(20);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&still));
}

// A rate that is measured while the robot stands is the gyro's bias; one of exactly 0 was set.
TEST(test_a_measured_twist_at_standstill_gives_the_bias) {
  for (const double rate : {0.0015, 0.0}) {
    make_room();
    motion.states.sigma[wm::kYawRateBias] = 0.02;
    begin();
    for (int i = 0; i < 100; i++) feed(make::twist(0.02 * i, 0.0, rate));
    const wm_calibration_value bias = calibrated("motion.yaw_rate_bias_radps");
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, rate, bias.value);
    TEST_ASSERT_TRUE(rate > 0.0 ? bias.sigma < 0.003 : bias.sigma > 0.019);
  }
}

TEST(test_absurd_markers_are_refused_and_change_nothing) {
  begin();
  drive(1);
  wm_event e = make::empty(now_s, WM_EVENT_MARKER);
  for (double bad : {kAbsent, HUGE_VAL, 1e9})
    for (const wm_marker &m : {marker(3, bad, 0, 1, 0), marker(3, 1, 0, 1, bad)}) {
      e.as.marker = m;
      TEST_ASSERT_EQUAL(std::isfinite(bad) ? WM_OUT_OF_RANGE : WM_NOT_FINITE, tell(e));
    }
  e.as.marker = marker(3, 1, 0, 1, 0);
  e.as.marker.sensor = 7;
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, tell(e));
  e.as.marker = marker(-1, 1, 0, 1, 0);
  TEST_ASSERT_EQUAL(WM_REJECTED_NO_ASSOCIATION, see(e));
}

TEST(test_of_two_poses_the_one_is_taken_that_fits_the_map) {
  coded = true;
  make::markers.heading_sigma_rad = 0.01;
  begin();
  drive(20);
  two_poses = true;
  rejected = 0;
  drive(20);
  TEST_ASSERT_EQUAL(0, rejected);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  TEST_ASSERT_EQUAL(kCount, map().size());
  for (const auto &[m, covariance] : map())
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.0, wm::wrap(m.yaw_rad - 0.5 * (m.id - 10)));
}

TEST(test_a_landmark_seen_twice_in_a_frame_without_identity_is_fused_once) {
  nameless = twice = true;
  params.associate_near_m = 2.0;
  begin();
  drive(40);
  size_t found;
  worst_landmark(&found);
  TEST_ASSERT_EQUAL(kCount, found);  // the second sighting made no second landmark
  TEST_ASSERT_GREATER_THAN(taken / 2, rejected);
}

TEST(test_the_same_identity_twice_in_a_frame_at_two_places_keeps_one) {
  begin();
  drive(30);
  const double before = off();
  for (int i = 0; i < 100; i++) {  // a copy of the code hangs elsewhere
    drive(0.2);
    see(make::sighting(now_s, 10, 0.9, 1.5));
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, before);
}

TEST(test_a_marker_seen_twice_in_a_picture_is_fused_once_and_told) {
  coded = twice = true;
  begin();
  drive(40);
  TEST_ASSERT_EQUAL(taken, rejected);
  TEST_ASSERT_EQUAL_DOUBLE(rejected, counted(WM_COUNTER_IDENTITIES_AMBIGUOUS));
  expect_whole_map(0.05);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
}

TEST(test_two_markers_of_one_identity_are_told_and_left_alone) {
  coded = true;
  begin();
  drive(30);
  const double before[2] = {place[0][0], place[0][1]};
  for (int turn = 1; turn <= 3; turn++) {
    place[0][0] = before[0] + (turn % 2 ? 1.5 : 0.0);
    drive(40);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  }
  TEST_ASSERT_EQUAL_DOUBLE(2, counted(WM_COUNTER_LANDMARKS_MOVED));
  TEST_ASSERT_GREATER_THAN_DOUBLE(10, counted(WM_COUNTER_IDENTITIES_AMBIGUOUS));
  size_t found;
  worst_landmark(&found);
  TEST_ASSERT_EQUAL(kCount - 1, found);
}

TEST(test_two_markers_of_one_identity_on_opposite_sides_spoil_nothing) {
  coded = true;
  twin = 6;  // opposite
  begin();
  for (int turn = 0; turn < 8; turn++) {
    drive(20);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  }
  TEST_ASSERT_GREATER_THAN_DOUBLE(10, counted(WM_COUNTER_IDENTITIES_AMBIGUOUS));
  expect_whole_map(0.05, kCount - 1);
}

TEST(test_a_landmark_that_moved_leaves_is_counted_and_joins_anew) {
  begin();
  drive(30);
  TEST_ASSERT_EQUAL_DOUBLE(0, counted(WM_COUNTER_LANDMARKS_MOVED));
  place[0][0] += 1.5;
  drive(40);
  TEST_ASSERT_EQUAL_DOUBLE(1, counted(WM_COUNTER_LANDMARKS_MOVED));
  expect_whole_map(0.15);
}

TEST(test_a_marker_that_moved_is_told_and_pulls_nothing) {
  coded = true;
  begin();
  drive(30);
  place[2][0] += 0.6;
  for (int i = 0; i < 30; i++) {
    drive(1);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
    TEST_ASSERT_LESS_THAN_DOUBLE(4.0 * sigma(), off());
  }
  TEST_ASSERT_EQUAL_DOUBLE(1, counted(WM_COUNTER_LANDMARKS_MOVED));
  expect_whole_map(0.1);
}

// A robot that is turned while it drives, by a wheel that slips or by hand, sees all its markers elsewhere: they hang
// where they hung, and it finds back to them. No wheel and no gyro tells.
TEST(test_a_robot_that_was_turned_does_not_turn_its_map) {
  for (double turn_rad : {0.1, -0.4}) {
    make_room();
    coded = true;
    make::markers.heading_sigma_rad = 0.01;
    begin();
    drive(30.0);
    truth.heading_rad = wm::wrap(truth.heading_rad + turn_rad);
    drive(1.0);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
    drive(20.0);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
    expect_whole_map(0.06);
    TEST_ASSERT_EQUAL_DOUBLE(1, counted(WM_COUNTER_ROTATION_OUTLIERS));
    TEST_ASSERT_EQUAL_DOUBLE(0, counted(WM_COUNTER_LANDMARKS_MOVED));
  }
}

// Two markers are rejected by the same angle: the robot was turned. A bearing of the same stamp, which comes last, is
// one of another kind and needs others like it.
TEST(test_bearings_beside_markers_do_not_hide_that_the_robot_was_turned) {
  for (const bool with_bearing : {false, true}) {
    make_room();
    coded = true;
    make::markers.heading_sigma_rad = 0.01;
    begin();
    drive(30.0);
    truth.heading_rad = wm::wrap(truth.heading_rad + 0.3);
    int markers = 0;
    for (int i = 0; i < kCount && markers < 2; i++) {
      const auto [bearing, r] = seen(i);
      if (std::fabs(bearing) > 1.0) continue;
      wm_event e = make::empty(now_s, WM_EVENT_MARKER);
      e.as.marker =
          marker(10 + i, r * wm::cos(bearing), r * wm::sin(bearing), 2.2, wm::wrap(0.5 * i - truth.heading_rad));
      TEST_ASSERT_EQUAL(WM_REJECTED_GATE, see(e));
      if (++markers == 2 && with_bearing) (void)see(make::sighting(now_s, 10 + i, bearing, kAbsent));
    }
    TEST_ASSERT_EQUAL(2, markers);
    now_s += 0.2;  // the next stamp ends the picture
    (void)see(make::sighting(now_s, 10, 0.0, kAbsent));
    TEST_ASSERT_EQUAL_DOUBLE(1, counted(WM_COUNTER_ROTATION_OUTLIERS));
  }
}

// Two markers of five or six in view are turned by somebody, alike: the others say that it wasn't the robot.
TEST(test_markers_that_were_turned_do_not_turn_the_robot) {
  coded = true;
  make::markers.heading_sigma_rad = 0.01;
  begin();
  drive(30.0);
  turned[4] = turned[5] = 0.3;
  drive(2.0);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  TEST_ASSERT_EQUAL_DOUBLE(0, counted(WM_COUNTER_ROTATION_OUTLIERS));
}

TEST(test_most_sightings_false_are_survived) {
  for (const bool of_markers : {false, true}) {
    make_room();
    coded = of_markers;
    begin();
    drive(30);
    false_share = 0.6;
    for (int i = 0; i < 30; i++) {
      drive(1);
      if (of_markers) TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
      if (of_markers) TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
    }
    TEST_ASSERT_LESS_THAN_DOUBLE(0.2, off());
    TEST_ASSERT_GREATER_THAN(100, rejected);
  }
}

TEST(test_half_a_minute_without_landmarks_is_said_and_mended) {
  for (const bool of_markers : {false, true}) {
    make_room();
    coded = of_markers;
    begin();
    drive(30);
    const double sure = sigma();
    hidden = true;
    drive(30);
    TEST_ASSERT_EQUAL(WM_STATE_DEAD_RECKONING, published_state());
    TEST_ASSERT_GREATER_THAN_DOUBLE(2.0 * sure, sigma());
    TEST_ASSERT_LESS_THAN_DOUBLE(4.0 * sigma(), off());
    hidden = false;
    drive(of_markers ? 5 : 10);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
    TEST_ASSERT_LESS_THAN_DOUBLE(of_markers ? 0.05 : 0.1, off());
  }
}

TEST(test_a_misread_code_after_a_while_without_landmarks_waits_for_a_second_one) {
  begin();
  drive(30);
  hidden = true;
  drive(30);
  const double before = off();
  const auto [bearing, range] = view_of(place[0][0], place[0][1]);
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see(make::sighting(now_s, 10, bearing + 0.15, range - 0.2)));
  TEST_ASSERT_DOUBLE_WITHIN(0.01, before, off());
  hidden = false;
  drive(10);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
}

TEST(test_a_misread_code_does_not_keep_its_landmark_away) {
  begin();
  see(make::sighting(now_s, 10, 2.5, 1.0));  // the first that is seen of it
  drive(30);
  expect_whole_map(0.1);
  TEST_ASSERT_EQUAL_DOUBLE(0, counted(WM_COUNTER_LANDMARKS_MOVED));
}

TEST(test_landmarks_that_are_never_seen_again_leave) {
  begin();
  drive(20);
  for (int i = 0; i < 30; i++) see(make::sighting(now_s, 1000 + i, 0.02 * i, 3.0));
  size_t found;
  worst_landmark(&found);
  TEST_ASSERT_LESS_OR_EQUAL(kCount, found);  // seen once is not a landmark yet
  const double joined = counted(WM_COUNTER_LANDMARKS);
  drive(20);
  TEST_ASSERT_EQUAL_DOUBLE(joined - 30, counted(WM_COUNTER_LANDMARKS));
  TEST_ASSERT_GREATER_OR_EQUAL(30, counted(WM_COUNTER_LANDMARKS_REMOVED));
}

TEST(test_a_full_map_goes_on_with_what_it_has) {
  params.landmark_capacity = 6;
  begin();
  drive(40);
  TEST_ASSERT_LESS_OR_EQUAL(6, counted(WM_COUNTER_LANDMARKS));
  TEST_ASSERT_GREATER_THAN(0, counted(WM_COUNTER_MAP_FULL));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, off());
}

}  // namespace

void setUp(void) { make_room(); }
