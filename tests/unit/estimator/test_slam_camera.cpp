// SPDX-License-Identifier: Apache-2.0
// A camera that sees coded markers and is not quite what calibration.yaml says.
#include "slam_room.hpp"

using namespace room;

namespace {

// Markers hang at two heights, and the camera leans by two degrees.
double worst_of_leaning(double sigma_rad) {
  coded = two_heights = true;
  leans[0] = 0.03;
  leans[1] = -0.04;
  make::sightings.states.sigma[WM_SENSOR_ROW_kRoll] = sigma_rad;
  begin();
  drive(60);
  size_t found = 0;
  const double worst = worst_landmark(&found);
  TEST_ASSERT_EQUAL(kCount, found);
  return worst;
}

TEST(test_a_camera_that_leans_is_found_by_how_high_markers_seem_to_hang) {
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, worst_of_leaning(0.05));
  TEST_ASSERT_DOUBLE_WITHIN(0.004, leans[0], value_of("camera.roll_rad"));
  TEST_ASSERT_DOUBLE_WITHIN(0.004, leans[1], value_of("camera.pitch_rad"));
}

TEST(test_a_second_camera_that_sees_the_same_markers_has_its_own_tilt) {
  wm_sensor both[2] = {sensor, sensor};
  std::strcpy(both[1].name, "other");
  both[1].mounting.xyz_m[2] += 1.0;
  setup.sensors = both;
  setup.sensor_count = 2;
  in_turn = true;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, worst_of_leaning(0.05));
  TEST_ASSERT_DOUBLE_WITHIN(0.01, leans[0], value_of("camera.roll_rad"));
  TEST_ASSERT_DOUBLE_WITHIN(0.01, leans[1], value_of("camera.pitch_rad"));
}

// A rotating laser whose angle encoder sits beside its axis: found while the map is built.
TEST(test_an_eccentric_turntable_is_found) {
  make::sightings.states.sigma[WM_SENSOR_ROW_kEccentricX] = 0.05;
  eccentric[0] = 0.04;
  eccentric[1] = -0.03;
  begin();
  drive(120);
  for (const auto &[name, want] : {std::pair{"camera.eccentric_x_rad", 0.04}, {"camera.eccentric_y_rad", -0.03}}) {
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3 * sigma_of(name), want, value_of(name), name);
    TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(0.02, sigma_of(name), name);
  }
}

TEST(test_taken_for_level_it_bends_the_map) { TEST_ASSERT_GREATER_THAN_DOUBLE(0.06, worst_of_leaning(0)); }

// Motion, bearings and ranges with sigmas of their own, by a camera that is turned by so much. States by default.
void drive_calibrated(double seconds, double camera_rad) {
  for (int k = 0; k < WM_SENSOR_ROWS; k++) make::sightings.states.sigma[k] = 0.0;
  make::sightings.states.sigma[WM_SENSOR_ROW_kYaw] = -0.05;
  make::sightings.states.sigma[WM_SENSOR_ROW_kTimeOffset] = -0.1;
  begin();
  const double dt = 0.1, covariance[6] = {1e-6, 0, 1e-6, 0, 0, 1e-6};
  const wm::arc step = wm::make_arc(0.5 * dt, 0.25 * dt);
  for (double until = now_s + seconds; now_s < until; now_s += dt) {
    truth = wm::compose(truth, {step.x_m, step.y_m, step.turn_rad});
    const wm_pose2 felt = {step.x_m + gauss(1e-3), step.y_m + gauss(1e-3), step.turn_rad + gauss(1e-3)};
    feed(make::increment(now_s, now_s + dt, felt, covariance));
    for (int i = 0; i < kCount; i++) {
      const auto [bearing, range] = seen(i, camera_rad);
      if (std::fabs(bearing) > 1.2) continue;
      wm_event e = make::sighting(now_s + dt, 10 + i, bearing + gauss(0.01), range + gauss(0.03));
      e.as.sighting.bearing_sigma_rad = 0.01;
      e.as.sighting.range_sigma_m = 0.03;
      see(e);
    }
  }
}

// Who states all sigmas has calibrated the mounting to 0.3 degrees and the clock to 20 ms: states of these sigmas. A
// yaw that is wrong by ten of them is found nevertheless.
TEST(test_a_calibrated_sensor_is_nearly_as_stated) {
  drive_calibrated(0.1, 0.0);
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.005, sigma_of("camera.yaw_rad"));
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.02, sigma_of("camera.time_offset_s"));
  make_room();
  drive_calibrated(120, 0.05);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.004, sigma_of("camera.yaw_rad"));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.019, sigma_of("camera.time_offset_s"));
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.05, value_of("camera.yaw_rad"));
  size_t found;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, worst_landmark(&found));
}

// A turn of 0.25 rad/s and a stamp that is off by 0.2 s: 0.05 rad.
TEST(test_stamps_that_scatter_matter_where_it_turns) {
  double variance[2];
  for (int i = 0; i < 2; i++) {
    make_room();
    coded = true;
    make::markers.stamp_sigma_s = 0.2 * i;
    begin();
    drive(0.5);
    TEST_ASSERT_EQUAL(WM_RESIDUAL_HEADING, last.residual);
    variance[i] = last.variance;
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.3 * 0.05 * 0.05, 0.05 * 0.05, variance[1] - variance[0]);
}

// GIVEN a look whose stamp is 0.1 s late in a turn of 0.25 rad/s THEN with its stamp error as a state the heading
// stays.
TEST(test_a_late_stamp_turns_all_bearings_alike) {
  double turned_rad[2];
  for (int i = 0; i < 2; i++) {
    make_room();
    params.sensor_stamp_sigma_s = 0.1 * i;
    begin();
    drive(20);
    const double before_rad = estimate().heading_rad;
    const wm::arc way = wm::make_arc(-0.05, -0.025);  // 0.1 s ago
    const wm_pose2 eye = wm::compose(wm::compose(truth, {way.x_m, way.y_m, way.turn_rad}), {0.2, 0, 0});
    for (int k = 0; k < kCount; k++) {
      const auto [bearing, range] = view_of(place[k][0], place[k][1], eye);
      if (std::fabs(bearing) < 1.2) see(make::sighting(now_s, 10 + k, bearing, range));
    }
    turned_rad[i] = std::fabs(wm::wrap(estimate().heading_rad - before_rad));
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.6 * turned_rad[0], turned_rad[1]);
}

// Each error of the mounting alone, on a map whose landmarks are known: a wrong sign in a Jacobian would drive it away.
TEST(test_each_error_of_the_mounting_is_found) {
  const struct {
    int row;
    const char *name;
    double yaw_rad, x_m, y_m;  // beyond calibration.yaml
  } cases[] = {{WM_SENSOR_ROW_kYaw, "camera.yaw_rad", 0.05, 0, 0},
               {WM_SENSOR_ROW_kMountX, "camera.x_m", 0, 0.08, 0},
               {WM_SENSOR_ROW_kMountX, "camera.y_m", 0, 0, -0.06}};
  for (bool of_markers : {true, false})
    for (const auto &c : cases) {
      make_room();
      coded = of_markers;
      params.map = WM_SLAM_MAP_FROZEN;
      put_yaws_on_map();
      sensor.mounting.xyz_m[0] -= c.x_m;
      sensor.mounting.xyz_m[1] -= c.y_m;
      sensor.mounting.rpy_rad[2] -= c.yaw_rad;
      make::sightings.states.sigma[c.row] = 0.1;
      begin();
      drive(40);
      TEST_ASSERT_DOUBLE_WITHIN(0.02, c.yaw_rad + c.x_m + c.y_m, value_of(c.name));
      TEST_ASSERT_LESS_THAN_DOUBLE(0.03, off());
    }
}

}  // namespace

void setUp(void) { make_room(); }
