// SPDX-License-Identifier: Apache-2.0
// landmark_ekf with coded markers that the map has.
#include <cmath>
#include <memory>
#include <numbers>

#include "events.hpp"
#include "unity.h"

namespace {

const wm_estimator *ekf;
wm_motion_params motion;
wm_landmark_ekf_params params;
wm_sensor sensor;
wm_landmark landmark;
wm_setup setup;

wm_event marker(double x, double y, uint16_t of = 0) {
  wm_event e = make::empty(1.0, WM_EVENT_MARKER);
  e.as.marker = {of, 1, 100, {x, y, 0.3}, 0.5, {}, 0.0, NAN, NAN, NAN};
  return e;
}

struct Filter {
  std::unique_ptr<void, void (*)(void *)> state{make::begun(*ekf, &params, setup), std::free};
  wm_innovation records[4];
  size_t count = 0;

  Filter() {
    TEST_ASSERT_NOT_NULL(state.get());
    const wm_event stands = make::twist(1.0, 0, 0);
    TEST_ASSERT_EQUAL(WM_OK, ekf->predict(state.get(), &stands));
  }
  wm_status correct(const wm_event &e) { return ekf->correct(state.get(), &e, records, 4, &count); }
};

// The same pose as by its bearing and range.
void test_a_marker_is_a_landmark(void) {
  Filter by_marker, by_sighting;
  TEST_ASSERT_EQUAL(WM_OK, by_marker.correct(marker(2.0, 1.0)));
  TEST_ASSERT_EQUAL(WM_OK,
                    by_sighting.correct(make::sighting(1.0, 100, std::atan2(1.0, 2.0), std::hypot(2.0, 1.0, 0.3))));
  TEST_ASSERT_EQUAL(2, by_marker.count);
  TEST_ASSERT_EQUAL(WM_FUSED, by_marker.records[0].verdict);
  TEST_ASSERT_EQUAL(100, by_marker.records[0].landmark_id);
  wm_estimate a, b;
  ekf->estimate(by_marker.state.get(), &a);
  ekf->estimate(by_sighting.state.get(), &b);
  for (int i = 0; i < 2; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-12, b.pose_map_base.p_m[i], a.pose_map_base.p_m[i]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, b.heading_rad, a.heading_rad);
}

// A camera that looks straight up: its x axis is the vertical, and the marker hangs 2 m above it.
void test_a_marker_on_the_ceiling(void) {
  sensor.mounting.rpy_rad[1] = -std::numbers::pi / 2;
  landmark.p_m[2] = 2.0;
  Filter filter;
  wm_event seen = marker(0, 0);
  const double in_camera[3] = {2.0, 1.0, -2.0};  // ahead by 2 m is down in the picture, to the left by 1 m
  for (int i = 0; i < 3; i++) seen.as.marker.p_m[i] = in_camera[i];
  TEST_ASSERT_EQUAL(WM_OK, filter.correct(seen));
  TEST_ASSERT_EQUAL(2, filter.count);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::atan2(1.0, 2.0), filter.records[0].observed);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 3.0, filter.records[1].observed);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, std::atan2(1.02, 2.05), filter.records[0].expected);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, std::hypot(2.05, 1.02, 2.0), filter.records[1].expected);
}

// Nothing is known of the start. Three markers at a height of 2 m, whose slant ranges are up to twice the horizontal
// ones.
void test_a_pose_is_found_below_a_ceiling(void) {
  wm_landmark ceiling[3] = {landmark, landmark, landmark};
  const double places[3][2] = {{3, 3}, {1, 4}, {2.5, 1}};
  for (int i = 0; i < 3; i++)
    ceiling[i].id = 100 + i, ceiling[i].p_m[0] = places[i][0], ceiling[i].p_m[1] = places[i][1];
  for (wm_landmark &one : ceiling) one.p_m[2] = 2.0;
  setup.landmarks = ceiling;
  setup.landmark_count = 3;
  setup.start = {WM_TIME_NONE, {NAN, NAN, NAN}, {NAN, NAN, NAN, NAN}, NAN, NAN, NAN};
  Filter filter;
  for (int k = 0; k < 60; k++) {
    wm_event seen = marker(places[k % 3][0] - 1.5, places[k % 3][1] - 2.0);
    seen.as.marker.p_m[2] = 2.0;
    seen.as.marker.id = 100 + k % 3;
    seen.t_ns += k * INT64_C(50000000);
    (void)filter.correct(seen);
  }
  wm_estimate found;
  ekf->estimate(filter.state.get(), &found);
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, found.state);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.5, found.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 2.0, found.pose_map_base.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.0, found.heading_rad);
}

void test_bad_markers_are_refused(void) {
  Filter filter;
  TEST_ASSERT_EQUAL(WM_NOT_FINITE, filter.correct(marker(NAN, 1.0)));
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, filter.correct(marker(2.0, 1.0, 99)));
}

}  // namespace

void setUp(void) {
  ekf = wm_estimator_find("landmark_ekf");
  make::exact_sensors(&motion);
  make::exact_map(&params);
  sensor = make::sensor("camera", 0.02, 0.05);
  landmark = {100, {2.05, 1.02, 0}, 0.0, NAN, {}, 0};
  setup = make::setup(motion, sensor);
  setup.landmarks = &landmark;
  setup.landmark_count = 1;
  setup.start = {WM_TIME_NONE, {0, 0, 0}, {0, 0, 0, 1}, 0.0, 0.05, 0.05};
}
void tearDown(void) {}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_a_marker_is_a_landmark);
  RUN_TEST(test_a_marker_on_the_ceiling);
  RUN_TEST(test_a_pose_is_found_below_a_ceiling);
  RUN_TEST(test_bad_markers_are_refused);
  return UNITY_END();
}
