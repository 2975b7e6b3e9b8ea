// SPDX-License-Identifier: Apache-2.0
// SLAM in a simulated room whose landmarks nobody measured: it finds them, and absurd input is told, counted and
// survived. Scenarios are GIVEN / WHEN / THEN; all noise is drawn from fixed seeds.
#include "common/suite.h"
#include "filters/slam/bearing_tracks.hpp"
#include "slam_room.hpp"

namespace {

using namespace room;

TEST(test_landmarks_are_found_by_bearing_and_range) {
  begin();
  drive(40);
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
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
    for (int i = 0; i < 100; i++) {
      const wm_event e = make::twist(0.02 * i, 0.0, rate);
      TEST_ASSERT_EQUAL(WM_OK, slam->predict(state, &e));
    }
    double sigma_radps;
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, rate, calibrated("motion.yaw_rate_bias_radps", &sigma_radps));
    TEST_ASSERT_TRUE(rate > 0.0 ? sigma_radps < 0.003 : sigma_radps > 0.019);
  }
}

TEST(test_coded_markers_give_place_and_heading_at_once) {
  coded = true;
  make::markers.heading_sigma_rad = 0.01;
  begin();
  drive(40);
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  wm_landmark l[kCount];
  double covariance[kCount][4];
  slam->landmarks(state, l, covariance, kCount);
  for (const wm_landmark &m : l) {
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.0, wm::wrap(m.yaw_rad - 0.5 * (m.id - 10)));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.2, m.p_m[2]);
  }
}

TEST(test_absurd_markers_are_refused_and_change_nothing) {
  begin();
  drive(1);
  wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX];
  size_t count = 0;
  for (double bad : {kAbsent, HUGE_VAL, 1e9}) {
    wm_event e = make::empty(now_s, WM_EVENT_MARKER);
    e.as.marker = marker(3, bad, 0, 1, 0);
    TEST_ASSERT_EQUAL(std::isfinite(bad) ? WM_OUT_OF_RANGE : WM_NOT_FINITE, slam->correct(state, &e, out, 8, &count));
    e.as.marker = marker(3, 1, 0, 1, bad);
    TEST_ASSERT_EQUAL(std::isfinite(bad) ? WM_OUT_OF_RANGE : WM_NOT_FINITE, slam->correct(state, &e, out, 8, &count));
  }
  wm_event e = make::empty(now_s, WM_EVENT_MARKER);
  e.as.marker = marker(3, 1, 0, 1, 0);
  e.as.marker.sensor = 7;
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, slam->correct(state, &e, out, 8, &count));
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
  wm_landmark l[kCount];
  double covariance[kCount][4];
  TEST_ASSERT_EQUAL(kCount, slam->landmarks(state, l, covariance, kCount));
  for (const wm_landmark &m : l) TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.0, wm::wrap(m.yaw_rad - 0.5 * (m.id - 10)));
}

TEST(test_markers_with_two_poses_from_the_start_have_a_place_and_no_heading) {
  coded = two_poses = true;
  begin();
  drive(40);
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
  wm_landmark l[kCount];
  double covariance[kCount][4];
  slam->landmarks(state, l, covariance, kCount);
  for (const auto &c : covariance) TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, c[3]);
}

TEST(test_landmarks_without_identity_are_told_apart) {
  nameless = true;
  params.associate_near_m = 2.0;
  begin();
  drive(40);
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
}

TEST(test_a_landmark_seen_twice_in_a_frame_without_identity_is_fused_once) {
  nameless = twice = true;
  params.associate_near_m = 2.0;
  begin();
  drive(40);
  size_t found;
  worst_landmark(&found);
  TEST_ASSERT_EQUAL(kCount, found);  // the second sighting made no second landmark
  TEST_ASSERT_GREATER_THAN(fused / 2, rejected);
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
  TEST_ASSERT_EQUAL(fused, rejected);
  TEST_ASSERT_EQUAL_DOUBLE(rejected, counted(WM_COUNTER_IDENTITIES_AMBIGUOUS));
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
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
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount - 1, found);
}

TEST(test_half_a_minute_without_markers_is_said_and_mended) {
  coded = true;
  begin();
  drive(30);
  const double sure = sigma();
  hidden = true;
  drive(30);
  TEST_ASSERT_EQUAL(WM_STATE_DEAD_RECKONING, published_state());
  TEST_ASSERT_GREATER_THAN_DOUBLE(2.0 * sure, sigma());
  TEST_ASSERT_LESS_THAN_DOUBLE(4.0 * sigma(), off());
  hidden = false;
  drive(5);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
}

TEST(test_a_landmark_that_moved_leaves_is_counted_and_joins_anew) {
  begin();
  drive(30);
  TEST_ASSERT_EQUAL_DOUBLE(0, counted(WM_COUNTER_LANDMARKS_MOVED));
  place[0][0] += 1.5;
  drive(40);
  TEST_ASSERT_EQUAL_DOUBLE(1, counted(WM_COUNTER_LANDMARKS_MOVED));
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
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
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
}

// A robot that is turned while it drives, by a wheel that slips or by hand, sees all its markers elsewhere: they hang
// where they hung, and it finds back to them. No wheel and no gyro tells.
TEST(test_a_robot_that_was_turned_does_not_turn_its_map) {
  for (double turn_rad : {0.1, -0.4}) {
    leave_room();
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
    size_t found = 0;
    TEST_ASSERT_LESS_THAN_DOUBLE(0.06, worst_landmark(&found));
    TEST_ASSERT_EQUAL(kCount, found);
    TEST_ASSERT_EQUAL_DOUBLE(1, counted(WM_COUNTER_ROTATION_OUTLIERS));
    TEST_ASSERT_EQUAL_DOUBLE(0, counted(WM_COUNTER_LANDMARKS_MOVED));
  }
}

// Two markers are rejected by the same angle: the robot was turned. A bearing of the same stamp, which comes last, is
// one of another kind and needs others like it.
TEST(test_bearings_beside_markers_do_not_hide_that_the_robot_was_turned) {
  for (const bool with_bearing : {false, true}) {
    leave_room();
    make_room();
    coded = true;
    make::markers.heading_sigma_rad = 0.01;
    begin();
    drive(30.0);
    truth.heading_rad = wm::wrap(truth.heading_rad + 0.3);
    int markers = 0;
    const wm_pose2 eye = wm::compose(truth, {0.2, 0, 0});
    double bearing[kCount];
    for (int i = 0; i < kCount; i++) {
      const double dx = place[i][0] - eye.x_m, dy = place[i][1] - eye.y_m;
      bearing[i] = wm::wrap(wm::atan2(dy, dx) - truth.heading_rad);
      if (std::fabs(bearing[i]) > 1.0 || markers == 2) continue;
      const double r = std::sqrt(dx * dx + dy * dy);
      wm_event seen = make::empty(now_s, WM_EVENT_MARKER);
      seen.as.marker =
          marker(10 + i, r * wm::cos(bearing[i]), r * wm::sin(bearing[i]), 2.2, wm::wrap(0.5 * i - truth.heading_rad));
      TEST_ASSERT_EQUAL(WM_REJECTED_GATE, see(seen));
      markers++;
      if (with_bearing && markers == 2) (void)see(make::sighting(now_s, 10 + i, bearing[i], kAbsent));
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

TEST(test_most_markers_seen_where_none_are_is_survived) {
  coded = true;
  begin();
  drive(30);
  false_share = 0.6;
  for (int i = 0; i < 30; i++) {
    drive(1);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  }
  TEST_ASSERT_GREATER_THAN(100, rejected);
}

TEST(test_most_sightings_false_are_survived) {
  begin();
  drive(30);
  false_share = 0.6;
  drive(30);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2, off());
  TEST_ASSERT_GREATER_THAN(100, rejected);
}

TEST(test_half_a_minute_without_landmarks_is_said_and_mended) {
  begin();
  drive(30);
  const double sure = sigma();
  hidden = true;
  drive(30);
  wm_estimate e;
  slam->estimate(state, &e);
  TEST_ASSERT_EQUAL(WM_STATE_DEAD_RECKONING, e.state);
  TEST_ASSERT_GREATER_THAN_DOUBLE(2.0 * sure, sigma());
  TEST_ASSERT_LESS_THAN_DOUBLE(4.0 * sigma(), off());
  hidden = false;
  drive(10);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
}

TEST(test_a_misread_code_after_a_while_without_landmarks_waits_for_a_second_one) {
  begin();
  drive(30);
  hidden = true;
  drive(30);
  const double before = off();
  const double dx = place[0][0] - truth.x_m, dy = place[0][1] - truth.y_m;
  const double bearing = wm::wrap(wm::atan2(dy, dx) - truth.heading_rad), range = std::sqrt(dx * dx + dy * dy) - 0.2;
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see(make::sighting(now_s, 10, bearing + 0.15, range)));
  TEST_ASSERT_DOUBLE_WITHIN(0.01, before, off());
  hidden = false;
  drive(10);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
}

TEST(test_a_misread_code_does_not_keep_its_landmark_away) {
  begin();
  see(make::sighting(now_s, 10, 2.5, 1.0));  // the first that is seen of it
  drive(30);
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&found));
  TEST_ASSERT_EQUAL(kCount, found);
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

// Lines from a row of poses to one place: found, with the true derivative by each pose.
TEST(test_a_line_is_found_and_keeps_its_ties_to_every_pose) {
  const double want[2] = {4.0, 3.0};
  for (bool unscented : {false, true}) {
    wm::line_bundle b{};
    b.count = 5;
    for (int i = 0; i < b.count; i++) {
      b.pose[i] = {1 + 0.3 * i, 2.0 - 0.2 * i, 0.1 * i};
      b.azimuth_rad[i] = wm::wrap(wm::atan2(want[1] - b.pose[i].y_m, want[0] - b.pose[i].x_m) - b.pose[i].heading_rad);
      b.sigma_rad[i] = 0.002;
      for (int k = 0; k < 3; k++) b.pose_covariance[3 * i + k][3 * i + k] = 1e-6;
    }
    const wm::line_landmark l = wm::find_line(b, unscented);
    TEST_ASSERT_TRUE(l.solved);
    for (int k = 0; k < 2; k++) TEST_ASSERT_DOUBLE_WITHIN(0.01, want[k], l.place_m[k]);
    // All poses moved alike move the place alike; turned about the first, they turn it.
    for (int k = 0; k < 2; k++)
      for (int c = 0; c < 2; c++) {
        double sum = 0.0;
        for (int i = 0; i < b.count; i++) sum += l.by_pose[k][3 * i + c];
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, k == c ? 1.0 : 0.0, sum);
      }
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.0, l.noise[0][0]);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.0, l.noise[1][1]);
    b.azimuth_rad[2] += 3.0;  // behind the pose
    TEST_ASSERT_FALSE(wm::find_line(b, unscented).solved);
  }
}

}  // namespace

void setUp(void) { make_room(); }
void tearDown(void) { leave_room(); }
