// SPDX-License-Identifier: Apache-2.0
// SLAM on a map that is already there: frozen or extended, with gaps, wrong in a place, and begun without a pose.
#include "slam_room.hpp"

namespace {

using namespace room;

void test_a_marker_that_moved_is_told_on_a_frozen_map_too(void) {
  coded = true;
  params.markers = 1;
  params.map = WM_SLAM_MAP_FROZEN;
  for (int i = 0; i < kCount; i++) known[i].yaw_rad = wm::wrap(0.5 * i);
  place[0][0] += 1.5;
  begin();
  drive(60);
  TEST_ASSERT_EQUAL_DOUBLE(1, counted("map.moved"));
  TEST_ASSERT_EQUAL_DOUBLE(kCount, counted("map.landmarks"));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
}

void test_a_saved_map_frozen_or_extended_needs_no_first_lap(void) {
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
    TEST_ASSERT_EQUAL_DOUBLE(map == WM_SLAM_MAP_FROZEN ? kCount / 2 : kCount, counted("map.landmarks"));
    wm_landmark l[64];
    double covariance[64][4];
    slam->landmarks(state, l, covariance, 64);
    if (map == WM_SLAM_MAP_FROZEN) TEST_ASSERT_EQUAL_DOUBLE(known[0].p_m[0], l[0].p_m[0]);
  }
}

void test_started_lost_on_a_map_of_markers_it_finds_itself(void) {
  coded = true;
  params.markers = 1;
  params.map = WM_SLAM_MAP_FROZEN;
  for (int i = 0; i < kCount; i++) known[i].yaw_rad = wm::wrap(0.5 * i);
  setup.start.p_m[0] = setup.start.p_m[1] = setup.start.heading_rad = kAbsent;
  begin();
  wm_estimate e;
  slam->estimate(state, &e);
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, e.state);
  false_share = 0.3;  // wrong ones don't agree
  drive(3);
  slam->estimate(state, &e);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, e.state);
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

void start_lost_before_markers() {
  params.markers = 1;
  params.map = WM_SLAM_MAP_FROZEN;
  for (int i = 0; i < kCount; i++) known[i].yaw_rad = wm::wrap(0.5 * i);
  setup.start.p_m[0] = setup.start.p_m[1] = setup.start.heading_rad = kAbsent;
  begin();
  const wm_event e = make::twist(now_s, 0, 0);
  TEST_ASSERT_EQUAL(WM_OK, slam->predict(state, &e));
}

// How small prints are turned is hardly seen, where they are is.
void test_started_lost_it_finds_itself_by_the_places_of_two_markers_whose_turns_disagree(void) {
  start_lost_before_markers();
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see_from_start(1, 0, 0.2));
  TEST_ASSERT_EQUAL(WM_FUSED, see_from_start(3, 0, -0.2));
  wm_estimate e;
  slam->estimate(state, &e);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, e.state);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, off());
}

void test_started_lost_two_markers_are_not_believed_that_are_not_as_far_apart_as_on_the_map(void) {
  start_lost_before_markers();
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see_from_start(1, 0, 0));
  TEST_ASSERT_EQUAL(WM_REJECTED_SEARCHING, see_from_start(3, 0.6, 0));
  wm_estimate e;
  slam->estimate(state, &e);
  TEST_ASSERT_EQUAL(WM_STATE_SEARCHING, e.state);
}

void test_a_map_with_nan_loses_those_landmarks_alone(void) {
  params.map = WM_SLAM_MAP_EXTEND;
  known[3].p_m[1] = kAbsent;
  known[5].sigma_m = kAbsent;
  begin();
  TEST_ASSERT_EQUAL_DOUBLE(kCount - 1, counted("map.landmarks"));
  drive(30);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  TEST_ASSERT_EQUAL_DOUBLE(kCount, counted("map.landmarks"));
}

// A map of markers with NaN for a place, for a heading and for a sigma.
void test_a_frozen_map_of_markers_with_nan_locates_by_the_others(void) {
  coded = true;
  params.markers = 1;
  params.map = WM_SLAM_MAP_FROZEN;
  for (int i = 0; i < kCount; i++) known[i].yaw_rad = wm::wrap(0.5 * i);
  known[3].p_m[1] = kAbsent;
  known[5].yaw_rad = kAbsent;
  known[7].sigma_m = kAbsent;
  begin();
  for (int i = 0; i < 20; i++) {
    drive(1);
    TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
    TEST_ASSERT_LESS_THAN_DOUBLE(0.1, off());
  }
  TEST_ASSERT_TRUE(std::isfinite(sigma()));
}

}  // namespace

void setUp(void) { make_room(); }
void tearDown(void) { leave_room(); }

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_a_marker_that_moved_is_told_on_a_frozen_map_too);
  RUN_TEST(test_a_saved_map_frozen_or_extended_needs_no_first_lap);
  RUN_TEST(test_started_lost_on_a_map_of_markers_it_finds_itself);
  RUN_TEST(test_started_lost_it_finds_itself_by_the_places_of_two_markers_whose_turns_disagree);
  RUN_TEST(test_started_lost_two_markers_are_not_believed_that_are_not_as_far_apart_as_on_the_map);
  RUN_TEST(test_a_map_with_nan_loses_those_landmarks_alone);
  RUN_TEST(test_a_frozen_map_of_markers_with_nan_locates_by_the_others);
  return UNITY_END();
}
