// SPDX-License-Identifier: Apache-2.0
// SLAM on a map that is already there: frozen or extended, with gaps, wrong in a place, and begun without a pose.
#include "slam_room.hpp"

namespace {

using namespace room;

TEST(test_a_marker_that_moved_is_told_on_a_frozen_map_too) {
  coded = true;
  params.map = WM_SLAM_MAP_FROZEN;
  put_yaws_on_map();
  place[0][0] += 1.5;
  begin();
  drive(60);
  TEST_ASSERT_EQUAL_DOUBLE(1, counted(WM_COUNTER_LANDMARKS_MOVED));
  TEST_ASSERT_EQUAL_DOUBLE(kCount, counted(WM_COUNTER_LANDMARKS));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
}

TEST(test_a_saved_map_frozen_or_extended_needs_no_first_lap) {
  for (int map : {WM_SLAM_MAP_FROZEN, WM_SLAM_MAP_EXTEND}) {
    make_room();
    params.map = map;
    setup.landmark_count = kCount / 2;
    setup.start.sigma_xy_m = 0.3;
    setup.start.sigma_heading_rad = 0.2;
    truth.x_m += 0.2;
    truth.heading_rad += 0.1;
    begin();
    drive(30);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
    TEST_ASSERT_EQUAL_DOUBLE(map == WM_SLAM_MAP_FROZEN ? kCount / 2 : kCount, counted(WM_COUNTER_LANDMARKS));
    if (map == WM_SLAM_MAP_FROZEN) TEST_ASSERT_EQUAL_DOUBLE(landmarks[0].p_m[0], world::map()[0].landmark.p_m[0]);
  }
}

TEST(test_started_lost_on_a_map_of_markers_it_finds_itself) {
  coded = true;
  params.map = WM_SLAM_MAP_FROZEN;
  put_yaws_on_map();
  without_a_start();
  begin();
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
  false_share = 0.3;  // wrong ones don't agree
  drive(3);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  false_share = 0.0;
  drive(3);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
}

// Standing at {2, 0} and looking along y: marker number `i` as it is seen from there, so much too far and turned too
// much.
wm_verdict see_from_start(int i, double far_m, double turned_rad) {
  const double ahead = place[i][1] - 0.2, left = 2.0 - place[i][0];
  const double distance = std::sqrt(ahead * ahead + left * left), share = (distance + far_m) / distance;
  wm_event seen = make::empty(now_s, WM_EVENT_MARKER);
  seen.as.marker = marker(10 + i, share * ahead, share * left, 0, wm::wrap(0.5 * i - wm::kHalfPi + turned_rad));
  seen.as.marker.yaw_sigma_rad = 0.15;
  return see(seen);
}

void start_lost_before_markers(int map = WM_SLAM_MAP_FROZEN) {
  params.map = map;
  put_yaws_on_map();
  without_a_start();
  begin();
  feed(make::twist(now_s, 0, 0));
}

// How small prints are turned is hardly seen, where they are is.
TEST(test_started_lost_it_finds_itself_by_the_places_of_two_markers_whose_turns_disagree) {
  start_lost_before_markers();
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see_from_start(1, 0, 0.2));
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see_from_start(3, 0, -0.2));
  now_s += 0.25;  // the next search
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see_from_start(3, 0, -0.2));
  TEST_ASSERT_EQUAL(WM_FUSED, see_from_start(1, 0, 0.2));
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
}

// The pose that was just found is vague enough for it to pass the gate.
TEST(test_an_outlier_just_after_the_pose_was_found_is_refused_by_the_marker_s_place_before) {
  start_lost_before_markers();
  see_from_start(1, 0, 0.2);
  see_from_start(3, 0, -0.2);
  now_s += 0.25;
  see_from_start(3, 0, -0.2);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_EQUAL(WM_REJECTED_GATE, see_from_start(1, 0.4, 0.2));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  now_s += 0.1;
  TEST_ASSERT_EQUAL(WM_FUSED, see_from_start(1, 0, 0.2));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
}

TEST(test_started_lost_two_markers_are_not_believed_that_are_not_as_far_apart_as_on_the_map) {
  start_lost_before_markers();
  for (int i = 0; i < 8; i++, now_s += 0.3) {
    TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see_from_start(1, 0, 0));
    TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see_from_start(3, 0.6, 0));
  }
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
}

// Drives as fast and sees marker number `i` alone, ten times a second: what is upright so surely turned, or its mirror
// image about the line of sight; what is level (no sigma of its own) has none.
void pass_by(int i, double speed_mps, double seconds, double yaw_sigma_rad, bool mirrored) {
  const double dt = 0.02, until = now_s + seconds;
  for (int step = 0; now_s < until; step++) {
    feed(make::twist(now_s, speed_mps, 0));
    if (step % 5 == 0) {
      const wm_pose2 at = wm::between(wm::compose(truth, {0.2, 0, 0}), {place[i][0], place[i][1], 0.5 * i});
      const double yaw = mirrored ? 2.0 * wm::atan2(at.y_m, at.x_m) + wm::kPi - at.heading_rad : at.heading_rad;
      wm_event seen = make::empty(now_s, WM_EVENT_MARKER);
      seen.as.marker = marker(10 + i, at.x_m, at.y_m, 0, wm::wrap(yaw));
      seen.as.marker.yaw_sigma_rad = yaw_sigma_rad;
      see(seen);
    }
    go_on(speed_mps, 0, dt);
  }
  feed(make::twist(now_s, speed_mps, 0));
}

TEST(test_started_lost_it_finds_itself_by_one_marker_that_it_drives_past) {
  start_lost_before_markers();
  pass_by(1, 0.5, 0.05, 0.01, false);
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
  pass_by(1, 0.5, 0.95, 0.01, false);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.03, off());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, sigma());
}

TEST(test_started_lost_a_mirror_image_of_one_marker_is_not_believed) {
  start_lost_before_markers();
  for (int i = 0; i < 20; i++) {
    pass_by(1, 0.5, 0.1, 0.01, true);
    TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
  }
}

TEST(test_started_lost_one_marker_whose_turn_is_hardly_seen_does_not_do) {
  start_lost_before_markers();
  pass_by(1, 0.5, 2, 0.15, false);
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
}

// A marker that was moved would spoil the map.
TEST(test_started_lost_on_a_map_that_grows_it_takes_two_markers) {
  start_lost_before_markers(WM_SLAM_MAP_EXTEND);
  pass_by(1, 0.5, 2, 0.01, false);
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, published_state());
  pass_by(3, 0.5, 0.5, 0.01, false);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
}

// An upright marker that is seen from one place may be the mirror image of what it seems. A level one is not.
TEST(test_started_lost_and_standing_it_finds_itself_by_one_marker_that_is_level) {
  for (double yaw_sigma_rad : {0.01, static_cast<double>(NAN)}) {
    make_room();
    start_lost_before_markers();
    pass_by(1, 0, 1, yaw_sigma_rad, false);
    TEST_ASSERT_EQUAL(yaw_sigma_rad > 0.0 ? WM_STATE_SEARCHING : WM_STATE_TRACKING, published_state());
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.03, off());
}

TEST(test_a_start_by_one_marker_that_was_moved_is_taken_back_when_others_are_seen) {
  start_lost_before_markers();
  place[1][0] += 0.5;
  place[1][1] -= 1.5;
  pass_by(1, 0.5, 1, 0.01, false);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  pass_by(3, 0.5, 0.6, 0.01, false);
  TEST_ASSERT_EQUAL(WM_STATE_LOST, published_state());
  pass_by(1, 0.5, 1, 0.01, false);  // not again
  TEST_ASSERT_EQUAL(WM_STATE_LOST, published_state());
  for (int i = 0; i < 5; i++) {
    pass_by(3, 0.2, 0.1, 0.01, false);
    pass_by(2, 0.2, 0.1, 0.01, false);
  }
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
}

TEST(test_a_map_with_nan_loses_those_landmarks_alone) {
  params.map = WM_SLAM_MAP_EXTEND;
  landmarks[3].p_m[1] = kAbsent;
  landmarks[5].sigma_m = kAbsent;
  begin();
  TEST_ASSERT_EQUAL_DOUBLE(kCount - 1, counted(WM_COUNTER_LANDMARKS));
  drive(30);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  TEST_ASSERT_EQUAL_DOUBLE(kCount, counted(WM_COUNTER_LANDMARKS));
}

// A map of markers with NaN for a place, for a heading and for a sigma.
TEST(test_a_frozen_map_of_markers_with_nan_locates_by_the_others) {
  coded = true;
  params.map = WM_SLAM_MAP_FROZEN;
  put_yaws_on_map();
  landmarks[3].p_m[1] = kAbsent;
  landmarks[5].yaw_rad = kAbsent;
  landmarks[7].sigma_m = kAbsent;
  begin();
  for (int i = 0; i < 20; i++) {
    drive(1);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  }
  TEST_ASSERT_DOUBLE_IS_DETERMINATE(sigma());
}

}  // namespace

void setUp(void) { make_room(); }
