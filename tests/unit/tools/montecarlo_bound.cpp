// SPDX-License-Identifier: Apache-2.0
// The Cramér-Rao bound against cases that can be written down, and the statistics against numbers made by hand.
#include "montecarlo/bound.h"

#include "common/suite.h"
#include "montecarlo/montecarlo.h"
#include "simulate/angle.h"

using namespace wm;
using namespace wm::sim;
using montecarlo::bound;
using montecarlo::Bound;

namespace {

Scenario simple() {
  Scenario s;
  s.robot.wheels.radius_m = 0.25;
  s.robot.wheels.ticks_per_turn = 1024;
  s.robot.wheels.track_m = 1.2;
  s.robot.wheels.wheelbase_m = 1.8;
  s.errors.start_xy_m = 0.03;
  s.errors.start_heading_rad = 0.01;
  s.errors.yaw_rate_noise_radps = 1e9;  // the gyro has no information
  s.errors.yaw_rate_bias_radps = 1e-9;
  return s;
}

Drive planned(const Scenario &s) {
  Drive drive;
  wm_error err{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, Drive::plan(s.route, drive, &err), err.text);
  return drive;
}

// A straight of 20 m with wheels of equal unknown scale: the way is off by the mean of the radii, the heading turns the
// end sideways, and a difference of the radii bends the way.
TEST(test_a_straight_by_the_wheels_alone) {
  Scenario s = simple();
  s.errors.wheel_radius = 0.01;
  Leg leg;
  leg.kind = Leg::Kind::straight;
  leg.length_m = 20;
  leg.speed_mps = 2;
  s.route.legs = {leg};
  const Drive drive = planned(s);
  const Bound end = bound(s, drive, 0, {drive.duration_s()})[0];
  const double mean_var = 1e-4 / 2, difference_var = 2e-4;  // of (e_l + e_r)/2 and e_r - e_l
  const double bend_var = difference_var / (1.2 * 1.2);     // rad^2 per m^2
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0009 + 400 * mean_var, end.x_var_m2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1e-4 + 400 * bend_var, end.heading_var_rad2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0009 + 400 * 1e-4 + bend_var * 20.0 * 20 * 20 * 20 / 4, end.y_var_m2);
}

// Standing for 10 s with a gyro of 100 Hz and known wheels: nothing moves, so nothing is lost.
TEST(test_standing_still_loses_nothing) {
  Scenario s = simple();
  s.errors.yaw_rate_noise_radps = 0.003;
  s.errors.yaw_rate_bias_radps = 0.004;
  Leg leg;
  leg.stand_s = 10;
  s.route.legs = {leg};
  const Bound end = bound(s, planned(s), 0, {10.0})[0];
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0009, end.x_var_m2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0001, end.heading_var_rad2);
}

// One camera, one landmark straight ahead at 10 m, seen 50 times with 5 % outliers, map off by 2 cm: the bearing ties
// y + 10 heading - map_y together; by hand, information of one scalar measured n times.
TEST(test_one_landmark_ahead) {
  Scenario s = simple();
  s.errors.landmark_m = 0.02;
  wm_landmark landmark{};
  landmark.id = 1;
  landmark.p_m[0] = 10;
  s.landmarks = {landmark};
  Camera camera;
  camera.name = "front";
  camera.field_of_view_rad = kPi;
  camera.range_m = 30;
  camera.rate_hz = 10;
  camera.bearing_sigma_rad = 0.005;
  camera.outlier_fraction = 0.05;
  s.cameras = {camera};
  Leg leg;
  leg.stand_s = 4.95;
  s.route.legs = {leg};
  const Drive drive = planned(s);
  const Bound end = bound(s, drive, 1, {4.95})[0];
  // z = (map_y - y)/10 - heading + noise
  const double r = 0.005 * 0.005 / 0.95 / 50, py = 0.0009, ph = 1e-4, pm = 4e-4;
  const double innovation = py / 100 + ph + pm / 100 + r;
  TEST_ASSERT_DOUBLE_WITHIN(1e-10, py - py * py / 100 / innovation, end.y_var_m2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-10, ph - ph * ph / innovation, end.heading_var_rad2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-10, 0.0009, end.x_var_m2);
  // Without the landmark nothing is gained.
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, ph, bound(s, drive, 0, {4.95})[0].heading_var_rad2);
}

// The same landmark by a camera that is turned by an unknown angle, with bearings as a detector handed them on;
// standing, the clock's error has no information.
TEST(test_bearings_of_a_camera_that_is_turned) {
  Scenario s = simple();
  s.errors.landmark_m = 0.02;
  s.errors.camera_mounting_rad = 0.004;
  s.errors.camera_mounting_m = 0.01;
  s.faults.camera_clock_offset_s = 0.01;
  Leg leg;
  leg.stand_s = 5;
  s.route.legs = {leg};
  const Drive drive = planned(s);
  std::vector<montecarlo::SeenBearing> seen;
  for (int i = 0; i < 50; i++) seen.push_back({0.05 + 0.09 * i, 0, 0, {0, 0}, {10, 0}, 0.005});
  const Bound end = bound(s, [&drive](double t_s) { return drive.at(t_s); }, seen, 1, 1, {4.95})[0];
  // z = (map_y - y - mounting_y)/10 - heading - mounting_yaw + noise
  const double py = 0.0009, ph = 1e-4;
  const double innovation = (py + 4e-4 + 1e-4) / 100 + ph + 1.6e-5 + 0.005 * 0.005 / 50;
  TEST_ASSERT_DOUBLE_WITHIN(1e-10, py - py * py / 100 / innovation, end.y_var_m2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-10, ph - ph * ph / innovation, end.heading_var_rad2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-10, 0.0009, end.x_var_m2);
}

TEST(test_statistics_by_hand) {
  montecarlo::Statistics s;
  s.runs = 4;
  montecarlo::Step a, b;
  a.t_s = 0.1;
  a.runs = 4;
  a.position_sq_m2 = 4 * 0.09;
  a.nees = 4 * 3 * 1.1;
  a.nis = 10;
  a.nis_dof = 5;
  b = a;
  b.t_s = 0.2;
  b.position_sq_m2 = 4 * 0.16;
  b.nees = 4 * 3 * 1.3;
  b.nis_dof = 0;
  b.nis = 0;
  s.steps = {a, b};
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.4, s.position_end_m());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::sqrt(0.125), s.position_rms_m());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.3, s.position_m(0, 0.15));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.2, s.nees_mean());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5, s.nees_inside({0.8, 1.25}));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2, s.nis_mean());
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, s.nis_inside({0.8, 1.25}));  // the step without updates doesn't count
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1, s.nis_inside({0.8, 2.5}));
}

TEST(test_the_share_inside_a_band_has_its_ends_and_no_absent_means) {
  const double means[] = {0.7, 0.8, 1.0, 1.25, 1.3, std::nan("")};
  TEST_ASSERT_EQUAL_DOUBLE(0.6, wm::montecarlo::share_inside(means, {0.8, 1.25}, [](double mean) { return mean; }));
}

}  // namespace
