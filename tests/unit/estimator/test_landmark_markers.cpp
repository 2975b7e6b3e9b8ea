// SPDX-License-Identifier: Apache-2.0
// landmark_ekf with coded markers that the map has.
#include <cmath>
#include <memory>
#include <numbers>
#include <tuple>

#include "common/suite.h"
#include "events.hpp"

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
    stand(1.0);
  }
  void stand(double t_s) {
    const wm_event stands = make::twist(t_s, 0, 0);
    TEST_ASSERT_EQUAL(WM_OK, ekf->predict(state.get(), &stands));
  }
  wm_status correct(const wm_event &e) { return ekf->correct(state.get(), &e, records, 4, &count); }
};

// The same pose as by its bearing and range, where its own noise is far below the sensor's.
TEST(test_a_marker_is_a_landmark) {
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
  for (int i = 0; i < 2; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-6, b.pose_map_base.p_m[i], a.pose_map_base.p_m[i]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, b.heading_rad, a.heading_rad);
}

// A camera that looks straight up: its x axis is the vertical, and the marker hangs 2 m above it.
TEST(test_a_marker_on_the_ceiling) {
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
TEST(test_a_pose_is_found_below_a_ceiling) {
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

// Seen where it is expected, but turned by 0.04 rad: so is the robot, the other way. Its heading was known to 0.05 rad,
// and is by the marker to 0.01 with the marker's own 0.01 on the map.
TEST(test_a_markers_heading_is_fused) {
  landmark = {100, {2.0, 1.0, 0}, 0.001, 1.0, {}, 0.01};
  make::markers.heading_sigma_rad = 0.01;
  setup.start.sigma_xy_m = 1e-4;
  sensor.bearing_sigma_rad = 1.0;  // tells nothing of the heading
  sensor.range_sigma_m = 1.0;
  Filter filter;
  wm_event seen = marker(2.0, 1.0);
  seen.as.marker.yaw_rad = 0.96;
  TEST_ASSERT_EQUAL(WM_OK, filter.correct(seen));
  TEST_ASSERT_EQUAL(3, filter.count);
  TEST_ASSERT_EQUAL(WM_RESIDUAL_HEADING, filter.records[2].residual);
  TEST_ASSERT_EQUAL(WM_FUSED, filter.records[2].verdict);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.96, filter.records[2].observed);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, filter.records[2].expected);
  wm_estimate e;
  ekf->estimate(filter.state.get(), &e);
  // The optimum of 0 with 0.05, and 0.04 with 0.01 of the marker and as much of the map.
  const double of_marker = 2 * 0.01 * 0.01, of_start = 0.05 * 0.05;
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.04 * of_start / (of_start + of_marker), e.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-5, of_start * of_marker / (of_start + of_marker), e.covariance[wm_cov_index(5, 5)]);
}

// Each view of one marker has the same error on the map: a hundred of them know the heading no better than that.
TEST(test_a_markers_direction_on_the_map_is_one_error) {
  landmark = {100, {2.0, 1.0, 0}, 0.001, 1.0, {}, 0.02};
  setup.start.sigma_xy_m = 1e-4;
  sensor.bearing_sigma_rad = sensor.range_sigma_m = 1.0;
  for (int32_t slots : {4, 0}) {
    make::sightings.map_slots = slots;
    Filter filter;
    for (int k = 0; k < 100; k++) {
      wm_event seen = marker(2.0, 1.0);
      seen.as.marker.yaw_rad = 1.0;
      filter.stand(1.0 + 0.05 * k);
      seen.t_ns = make::at(1.0 + 0.05 * k);
      TEST_ASSERT_EQUAL(WM_OK, filter.correct(seen));
    }
    wm_estimate e;
    ekf->estimate(filter.state.get(), &e);
    const double sigma = std::sqrt(e.covariance[wm_cov_index(5, 5)]);
    TEST_ASSERT_DOUBLE_WITHIN(0.004, 0.0186, sigma);  // of 0.02 and the start's 0.05
  }
}

// Where the map states no direction, and where the detector's is too vague, the place alone counts.
TEST(test_a_heading_that_says_nothing_is_left_out) {
  {
    Filter filter;
    TEST_ASSERT_EQUAL(WM_OK, filter.correct(marker(2.05, 1.02)));
    TEST_ASSERT_EQUAL(2, filter.count);
  }
  landmark.yaw_rad = 0.5;
  make::markers.heading_most_rad = 0.1;
  Filter filter;
  wm_event seen = marker(2.05, 1.02);
  seen.as.marker.yaw_sigma_rad = 0.2;
  TEST_ASSERT_EQUAL(WM_OK, filter.correct(seen));
  TEST_ASSERT_EQUAL(2, filter.count);
}

// Two poses fit its corners: the one that fits the map counts, and neither where the map can't tell.
TEST(test_the_pose_of_two_that_fits_the_map) {
  landmark.yaw_rad = 0.5;
  for (const auto &[first, second, rows] : {std::tuple{0.1, 0.5, 3}, {0.5, 0.1, 3}, {0.48, 0.52, 2}}) {
    Filter filter;
    wm_event seen = marker(2.05, 1.02);
    wm_marker &m = seen.as.marker;
    m.poses = 2;
    m.yaw_rad = first;
    for (int i = 0; i < 3; i++) m.other_p_m[i] = m.p_m[i];
    m.other_yaw_rad = second;
    TEST_ASSERT_EQUAL(WM_OK, filter.correct(seen));
    TEST_ASSERT_EQUAL(rows, filter.count);
    if (rows == 3) TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, filter.records[2].observed);
  }
}

// Nothing is known of the start, and the robot stands: one marker tells the whole pose, where its direction is on the
// map, and only a circle around it where it is not.
TEST(test_one_marker_finds_a_lost_robot) {
  setup.start = {WM_TIME_NONE, {NAN, NAN, NAN}, {NAN, NAN, NAN, NAN}, NAN, NAN, NAN};
  const double heading = 2.0, x = 1.5, y = -0.5;
  for (double yaw : {2.8, (double)NAN}) {
    landmark.yaw_rad = yaw;
    const double dx = landmark.p_m[0] - x, dy = landmark.p_m[1] - y;
    Filter filter;
    for (int k = 0; k < 60; k++) {
      wm_event seen =
          marker(std::cos(heading) * dx + std::sin(heading) * dy, std::cos(heading) * dy - std::sin(heading) * dx);
      seen.as.marker.p_m[2] = 0.0;
      seen.as.marker.yaw_rad = 2.8 - heading;
      seen.t_ns += k * INT64_C(50000000);
      filter.count = 0;
      (void)filter.correct(seen);
    }
    wm_estimate found;
    ekf->estimate(filter.state.get(), &found);
    TEST_ASSERT_EQUAL(std::isnan(yaw) ? WM_STATE_SEARCHING : WM_STATE_TRACKING, found.state);
    if (std::isnan(yaw)) continue;
    TEST_ASSERT_DOUBLE_WITHIN(0.05, x, found.pose_map_base.p_m[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, y, found.pose_map_base.p_m[1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, heading, found.heading_rad);
  }
}

// Five markers fit for ten seconds. Then somebody turns one by 1 rad: it contradicts for a minute, and the pose stays.
TEST(test_a_turned_marker_moves_no_robot) {
  const double places[5][2] = {{2.05, 1.02}, {3.0, -1.0}, {1.5, -2.0}, {-2.0, 0.5}, {0.5, 3.0}};
  wm_landmark five[5];
  for (int i = 0; i < 5; i++) {
    five[i] = {100 + i, {places[i][0], places[i][1], 0}, 0.0, 0.5, {}, NAN};
  }
  setup.landmarks = five;
  setup.landmark_count = 5;
  Filter filter;
  for (int k = 0; k < 700; k++) {
    const int which = k % 5;
    const bool turned = k >= 100 && which == 0;
    wm_event seen = marker(places[which][0], places[which][1]);
    seen.as.marker.id = 100 + which;
    seen.as.marker.yaw_rad = turned ? 1.5 : 0.5;
    seen.t_ns = make::at(1.0 + 0.1 * k);
    filter.stand(1.0 + 0.1 * k);
    filter.count = 0;
    TEST_ASSERT_EQUAL(WM_OK, filter.correct(seen));
    TEST_ASSERT_EQUAL(turned ? WM_REJECTED_GATE : WM_FUSED, filter.records[0].verdict);
  }
  wm_estimate e;
  ekf->estimate(filter.state.get(), &e);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0, e.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0, e.pose_map_base.p_m[0]);
}

TEST(test_bad_markers_are_refused) {
  Filter filter;
  TEST_ASSERT_EQUAL(WM_NOT_FINITE, filter.correct(marker(NAN, 1.0)));
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, filter.correct(marker(2.0, 1.0, 99)));
}

}  // namespace

void setUp(void) {
  ekf = wm_estimator_find("landmark_ekf");
  make::exact_sensors(&motion);
  make::exact_map(&params);
  make::markers.sigma_m = 1e-5;
  sensor = make::sensor("camera", 0.02, 0.05);
  landmark = {100, {2.05, 1.02, 0}, 0.0, NAN, {}, 0};
  setup = make::setup(motion, sensor);
  setup.landmarks = &landmark;
  setup.landmark_count = 1;
  setup.start = {WM_TIME_NONE, {0, 0, 0}, {0, 0, 0, 1}, 0.0, 0.05, 0.05};
}
