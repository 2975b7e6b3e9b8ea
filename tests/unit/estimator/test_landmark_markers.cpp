// SPDX-License-Identifier: Apache-2.0
// landmark_ekf with coded markers that the map has.
#include <tuple>

#include "world.hpp"

namespace {

using namespace world;

wm_event marker(double x, double y, uint16_t of = 0) {
  wm_event e = make::empty(1.0, WM_EVENT_MARKER);
  e.as.marker = {of, 1, 100, {x, y, 0.3}, 0.5, {}, 0.0, NAN, NAN, NAN};
  return e;
}

void stand(double t_s) { feed(make::twist(t_s, 0, 0)); }

// A filter that begins and stands.
void start() {
  begin();
  stand(1.0);
}

// The same pose as by its bearing and range, where its own noise is far below the sensor's.
TEST(test_a_marker_is_a_landmark) {
  start();
  feed(make::sighting(1.0, 100, std::atan2(1.0, 2.0), std::hypot(2.0, 1.0, 0.3)));
  const wm_estimate b = estimate();
  start();
  TEST_ASSERT_EQUAL(WM_FUSED, verdict_of(marker(2.0, 1.0)));
  TEST_ASSERT_EQUAL(2, count);
  TEST_ASSERT_EQUAL(100, records[0].landmark_id);
  const wm_estimate a = estimate();
  for (int i = 0; i < 2; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-6, b.pose_map_base.p_m[i], a.pose_map_base.p_m[i]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, b.heading_rad, a.heading_rad);
}

// A camera that looks straight up: its x axis is the vertical, and the marker hangs 2 m above it.
TEST(test_a_marker_on_the_ceiling) {
  sensor.mounting.rpy_rad[1] = -wm::kHalfPi;
  landmarks[0].p_m[2] = 2.0;
  start();
  wm_event seen = marker(0, 0);
  const double in_camera[3] = {2.0, 1.0, -2.0};  // ahead by 2 m is down in the picture, to the left by 1 m
  for (int i = 0; i < 3; i++) seen.as.marker.p_m[i] = in_camera[i];
  feed(seen);
  TEST_ASSERT_EQUAL(2, count);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::atan2(1.0, 2.0), records[0].observed);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 3.0, records[1].observed);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, std::atan2(1.02, 2.05), records[0].expected);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, std::hypot(2.05, 1.02, 2.0), records[1].expected);
}

// Nothing is known of the start. Three markers at a height of 2 m, whose slant ranges are up to twice the horizontal
// ones.
TEST(test_a_pose_is_found_below_a_ceiling) {
  put_on_map({{3, 3, 2}, {1, 4, 2}, {2.5, 1, 2}}, 100);
  without_a_start();
  start();
  for (int k = 0; k < 60; k++) {
    wm_event seen = marker(landmarks[k % 3].p_m[0] - 1.5, landmarks[k % 3].p_m[1] - 2.0);
    seen.as.marker.p_m[2] = 2.0;
    seen.as.marker.id = 100 + k % 3;
    seen.t_ns += k * INT64_C(50000000);
    (void)tell(seen);
  }
  const wm_estimate found = estimate();
  TEST_ASSERT_EQUAL(WM_STATE_TRACKING, found.state);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.5, found.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 2.0, found.pose_map_base.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.0, found.heading_rad);
}

// Seen where it is expected, but turned by 0.04 rad: so is the robot, the other way. Its heading was known to 0.05 rad,
// and is by the marker to 0.01 with the marker's own 0.01 on the map.
TEST(test_a_markers_heading_is_fused) {
  landmarks[0] = {100, {2.0, 1.0, 0}, 0.001, 1.0, {}, 0.01};
  make::markers.heading_sigma_rad = 0.01;
  setup.start.sigma_xy_m = 1e-4;
  sensor.bearing_sigma_rad = 1.0;  // tells nothing of the heading
  sensor.range_sigma_m = 1.0;
  start();
  wm_event seen = marker(2.0, 1.0);
  seen.as.marker.yaw_rad = 0.96;
  feed(seen);
  TEST_ASSERT_EQUAL(3, count);
  TEST_ASSERT_EQUAL(WM_RESIDUAL_HEADING, records[2].residual);
  TEST_ASSERT_EQUAL(WM_FUSED, records[2].verdict);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.96, records[2].observed);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, records[2].expected);
  const wm_estimate e = estimate();
  // The optimum of 0 with 0.05, and 0.04 with 0.01 of the marker and as much of the map.
  const double of_marker = 2 * 0.01 * 0.01, of_start = 0.05 * 0.05;
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.04 * of_start / (of_start + of_marker), e.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-5, of_start * of_marker / (of_start + of_marker), e.covariance[wm_cov_index(5, 5)]);
}

// Each view of one marker has the same error on the map: a hundred of them know the heading no better than that.
TEST(test_a_markers_direction_on_the_map_is_one_error) {
  landmarks[0] = {100, {2.0, 1.0, 0}, 0.001, 1.0, {}, 0.02};
  setup.start.sigma_xy_m = 1e-4;
  sensor.bearing_sigma_rad = sensor.range_sigma_m = 1.0;
  for (int32_t slots : {4, 0}) {
    make::sightings.map_slots = slots;
    start();
    for (int k = 0; k < 100; k++) {
      wm_event seen = marker(2.0, 1.0);
      seen.as.marker.yaw_rad = 1.0;
      stand(1.0 + 0.05 * k);
      seen.t_ns = make::at(1.0 + 0.05 * k);
      feed(seen);
    }
    const wm_estimate e = estimate();
    const double sigma = std::sqrt(e.covariance[wm_cov_index(5, 5)]);
    TEST_ASSERT_DOUBLE_WITHIN(0.004, 0.0186, sigma);  // of 0.02 and the start's 0.05
  }
}

// Where the map states no direction, and where the detector's is too vague, the place alone counts.
TEST(test_a_heading_that_says_nothing_is_left_out) {
  start();
  feed(marker(2.05, 1.02));
  TEST_ASSERT_EQUAL(2, count);
  landmarks[0].yaw_rad = 0.5;
  make::markers.heading_most_rad = 0.1;
  start();
  wm_event seen = marker(2.05, 1.02);
  seen.as.marker.yaw_sigma_rad = 0.2;
  feed(seen);
  TEST_ASSERT_EQUAL(2, count);
}

// Two poses fit its corners: the one that fits the map counts, and neither where the map can't tell.
TEST(test_the_pose_of_two_that_fits_the_map) {
  landmarks[0].yaw_rad = 0.5;
  for (const auto &[first, second, rows] : {std::tuple{0.1, 0.5, 3}, {0.5, 0.1, 3}, {0.48, 0.52, 2}}) {
    start();
    wm_event seen = marker(2.05, 1.02);
    wm_marker &m = seen.as.marker;
    m.poses = 2;
    m.yaw_rad = first;
    for (int i = 0; i < 3; i++) m.other_p_m[i] = m.p_m[i];
    m.other_yaw_rad = second;
    feed(seen);
    TEST_ASSERT_EQUAL(rows, count);
    if (rows == 3) TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, records[2].observed);
  }
}

// Nothing is known of the start, and the robot stands: one marker tells the whole pose, where its direction is on the
// map, and only a circle around it where it is not.
TEST(test_one_marker_finds_a_lost_robot) {
  without_a_start();
  const double heading = 2.0, x = 1.5, y = -0.5;
  for (double yaw : {2.8, (double)NAN}) {
    landmarks[0].yaw_rad = yaw;
    const double dx = landmarks[0].p_m[0] - x, dy = landmarks[0].p_m[1] - y;
    start();
    for (int k = 0; k < 60; k++) {
      wm_event seen =
          marker(std::cos(heading) * dx + std::sin(heading) * dy, std::cos(heading) * dy - std::sin(heading) * dx);
      seen.as.marker.p_m[2] = 0.0;
      seen.as.marker.yaw_rad = 2.8 - heading;
      seen.t_ns += k * INT64_C(50000000);
      (void)tell(seen);
    }
    const wm_estimate found = estimate();
    TEST_ASSERT_EQUAL(std::isnan(yaw) ? WM_STATE_SEARCHING : WM_STATE_TRACKING, found.state);
    if (std::isnan(yaw)) continue;
    TEST_ASSERT_DOUBLE_WITHIN(0.05, x, found.pose_map_base.p_m[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, y, found.pose_map_base.p_m[1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, heading, found.heading_rad);
  }
}

// Five markers fit for ten seconds. Then somebody turns one by 1 rad: it contradicts for a minute, and the pose stays.
TEST(test_a_turned_marker_moves_no_robot) {
  put_on_map({{2.05, 1.02}, {3.0, -1.0}, {1.5, -2.0}, {-2.0, 0.5}, {0.5, 3.0}}, 100);
  for (wm_landmark &l : landmarks) l.yaw_rad = 0.5;
  start();
  for (int k = 0; k < 700; k++) {
    const int which = k % 5;
    const bool turned = k >= 100 && which == 0;
    wm_event seen = marker(landmarks[which].p_m[0], landmarks[which].p_m[1]);
    seen.as.marker.id = 100 + which;
    seen.as.marker.yaw_rad = turned ? 1.5 : 0.5;
    seen.t_ns = make::at(1.0 + 0.1 * k);
    stand(1.0 + 0.1 * k);
    feed(seen);
    TEST_ASSERT_EQUAL(turned ? WM_REJECTED_GATE : WM_FUSED, records[0].verdict);
  }
  const wm_estimate e = estimate();
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0, e.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0, e.pose_map_base.p_m[0]);
}

TEST(test_bad_markers_are_refused) {
  start();
  TEST_ASSERT_EQUAL(WM_NOT_FINITE, tell(marker(NAN, 1.0)));
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, tell(marker(2.0, 1.0, 99)));
}

}  // namespace

void setUp(void) {
  prepare_ekf(make::sensor("camera", 0.02, 0.05));
  put_on_map({{2.05, 1.02}}, 100);
  make::markers.sigma_m = 1e-5;
}
