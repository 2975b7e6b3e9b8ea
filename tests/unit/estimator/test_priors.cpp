// SPDX-License-Identifier: Apache-2.0
// What the defaults leave open: calibration states with priors by the kind of the motion and by the sensor's own sigma,
// which keep these priors where the data cannot observe them.
#include <string>
#include <vector>

#include "filters/core/sensor_slots.hpp"
#include "motion/motion_kind.hpp"
#include "motion/step.hpp"
#include "world.hpp"

namespace {

using namespace world;

// A joystick's command each half second, or what wheels measure of it.
wm_event driven(int i, bool commands) {
  const double v = 0.3 + 0.1 * (i / 10 % 3), w = 0.4 * (i / 10 % 5) - 0.8;
  const auto noise = [i](uint64_t of) { return 0.01 * wm_random_normal(3, of, static_cast<uint64_t>(i)); };
  return make::twist(0.05 * i, commands ? v : v + noise(1), commands ? w : w + noise(2));
}

TEST(test_commands_are_told_by_rows_that_repeat) {
  for (const bool commands : {false, true}) {
    begin();
    TEST_ASSERT_DOUBLE_IS_NAN(sigma_of("motion.lag_s"));
    for (int i = 0; i < 200; i++) feed(driven(i, commands));
    TEST_ASSERT_FALSE(std::isnan(sigma_of("motion.speed_scale")));
    TEST_ASSERT_EQUAL(commands, !std::isnan(sigma_of("motion.lag_s")));
    TEST_ASSERT_EQUAL(commands, !std::isnan(sigma_of("motion.turn_slowdown_mps")));
  }
}

TEST(test_a_stated_kind_decides) {
  for (const bool commands : {false, true}) {
    motion.twist = commands ? WM_TWIST_COMMANDS : WM_TWIST_MEASURED;
    begin();
    for (int i = 0; i < 200; i++) feed(driven(i, !commands));
    TEST_ASSERT_EQUAL(commands, !std::isnan(sigma_of("motion.lag_s")));
  }
}

TEST(test_a_prior_is_a_multiple_of_the_sensors_own_sigma) {
  for (const double sigma_m : {0.03, 0.5}) {
    sensor.range_sigma_m = sigma_m;
    begin();
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5 * sigma_m, sigma_of("camera.range_bias_m"));
    make::sightings.states.sigma[WM_SENSOR_ROW_kRangeBias] = 0.2;
    begin();
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.2, sigma_of("camera.range_bias_m"));
    make::sightings.states.sigma[WM_SENSOR_ROW_kRangeBias] = -0.5;
  }
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.04, wm::correlated_bearing(make::sightings, 0.04));
  make::sightings.correlated_slots = 0;
  TEST_ASSERT_EQUAL_DOUBLE(0.0, wm::correlated_range(make::sightings, 0.1));
}

// All states of both tables are on. A robot that stands and sees bearings alone cannot observe any scale, delay or
// range; one that sees nothing cannot observe anything.
TEST(test_a_state_that_nothing_observes_keeps_its_prior) {
  for (double &sigma : make::sightings.states.sigma) sigma = sigma == 0.0 ? 0.02 : sigma;
  make::sightings.states.sigma[WM_SENSOR_ROW_kDepthAxis] = 0.02;
  for (double &sigma : motion.states.sigma) sigma = sigma < 0.0 ? -sigma : sigma;
  motion.noise_adapt_log_sigma = 0.0;
  motion.states.wheel_difference_sigma = 0.0;
  for (const bool stands : {true, false}) {
    begin();
    const auto before = calibration();
    TEST_ASSERT_EQUAL(wm::kSensorStates + wm::kCalibrationCount + 1, before.size());
    for (int i = 0; i < 600; i++) {
      feed(make::twist(0.1 * i, stands ? 0.0 : 0.4, stands ? 0.0 : 0.3 * (i / 50 % 3 - 1)));
      if (stands) feed(make::sighting(0.1 * i, i % 2, i % 2 ? 1.2 : 0.0, NAN));
    }
    const auto after = calibration();
    int kept = 0;
    for (size_t i = 0; i < before.size(); i++) {
      const std::string name = before[i].name;
      // The walk of a rate's bias is by the defaults; a bearing observes the mounting, once the pose is known.
      const bool walks = name == "motion.yaw_rate_bias_radps";
      const bool seen = stands && name.compare(0, 7, "camera.") == 0 && name != "camera.time_offset_s" &&
                        name != "camera.range_bias_m" && name != "camera.range_scale" &&
                        name != "camera.depth_axis_rad";
      if (walks || seen) continue;
      kept++;
      TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.01 * before[i].sigma, before[i].sigma, after[i].sigma, name.c_str());
    }
    TEST_ASSERT_TRUE(kept >= (stands ? 13 : 21));
  }
}

// The axis of depths is open where a sensor measures depths, and no state of a sensor of distances.
TEST(test_a_sensor_of_depths_has_an_axis) {
  for (const int depth : {0, 1}) {
    sensor.range_is_depth = depth;
    begin();
    const double sigma = sigma_of("camera.depth_axis_rad");
    TEST_ASSERT_EQUAL_DOUBLE(depth ? 0.02 : -1.0, std::isnan(sigma) ? -1.0 : sigma);
  }
}

// A sigma is the noise of a sighting, in the sensor's calibration or in each sighting. Mounting, clock and scale are
// states either way.
TEST(test_sightings_with_sigmas_are_as_those_of_a_sensor_with_them) {
  std::vector<wm_calibration_value> by[2];
  wm_estimate end[2];
  for (const bool stated : {false, true}) {
    sensor.bearing_sigma_rad = stated ? 1.0 : 0.01;
    sensor.range_sigma_m = 0.1;
    begin();
    for (int i = 0; i < 100; i++) {
      wm_event e = make::sighting(0.1 * i, i % 2, i % 2 ? 1.25 : 0.06, i % 2 ? 5.385 : 5.0);
      if (stated) e.as.sighting.bearing_sigma_rad = 0.01, e.as.sighting.range_sigma_m = 0.1;
      feed(make::twist(0.1 * i, 0.1, 0.1));
      feed(e);
    }
    by[stated] = calibration();
    end[stated] = estimate();
  }
  TEST_ASSERT_EQUAL_size_t(by[0].size(), by[1].size());
  for (size_t i = 0; i < by[0].size(); i++) {
    TEST_ASSERT_EQUAL_STRING(by[0][i].name, by[1][i].name);
    TEST_ASSERT_EQUAL_DOUBLE(by[0][i].value, by[1][i].value);
    TEST_ASSERT_EQUAL_DOUBLE(by[0][i].sigma, by[1][i].sigma);
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.04, sigma_of("camera.yaw_rad"));  // the prior has 0.05
  TEST_ASSERT_EQUAL_DOUBLE(end[0].pose_map_base.p_m[0], end[1].pose_map_base.p_m[0]);
}

// The limit of a found place follows the positions that find it: a receiver of 10 m finds what one of 1 m does.
TEST(test_a_vague_receiver_finds_the_robot_too) {
  for (const double sigma_m : {1.0, 10.0}) {
    without_a_start();
    begin();
    int found = -1;
    for (int i = 0; i < 600 && found < 0; i++) {
      feed(make::twist(0.1 * i, 10.0, 0.0));
      if (i % 10 == 0) feed(make::position(0.1 * i, 1.0 * i, 0.0, sigma_m));
      if (published_state() == WM_STATE_TRACKING) found = i;
    }
    TEST_ASSERT_GREATER_THAN(0, found);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.01 * sigma_m * sigma_m, estimate().covariance[0]);
  }
}

// A gyro's data sheet states its scale better than a tape measure states a track; a stated sigma holds.
TEST(test_a_gyros_scale_is_known_from_its_data_sheet) {
  for (const bool stated : {false, true}) {
    motion.states.sigma[wm::kYawRateScale] = stated ? 0.08 : -0.04;
    begin();
    for (int i = 0; i < 5; i++) feed(make::quantities(0.1 * i, {{WM_Q_VEHICLE_SPEED, 1.0}, {WM_Q_YAW_RATE, 0.0}}));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, stated ? 0.08 : 0.015, sigma_of("motion.yaw_rate_scale"));
    begin();
    for (int i = 0; i < 5; i++) feed(make::twist(0.1 * i, 1.0, 0.01 * i));
    if (!stated) TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.04, sigma_of("motion.yaw_rate_scale"));
  }
}

// A receiver's first positions are 40 m off, as it states; soon it states 1 m. The error does not outlast its sigma.
TEST(test_a_receivers_lasting_error_falls_with_its_sigma) {
  setup.start.sigma_xy_m = 30.0;
  begin();
  for (int i = 0; i < 600; i++) {
    const double t_s = 0.1 * i;
    feed(make::twist(t_s, 10.0 + 0.001 * (i % 7), 0.0));
    if (i % 10 == 0) feed(make::position(t_s, 10.0 * t_s, t_s < 20.0 ? 40.0 : 0.0, t_s < 20.0 ? 30.0 : 1.0));
  }
  TEST_ASSERT_DOUBLE_WITHIN(2.0, 0.0, estimate().pose_map_base.p_m[1]);
}

// A compass is off by 4 degrees. Positions show it; without them it stays open, and so does the heading.
TEST(test_a_compass_deviation_is_found_or_stays_open) {
  for (const bool has_positions : {true, false}) {
    setup.start.sigma_heading_rad = 0.5;
    begin();
    for (int i = 0; i < 600; i++) {
      const double t_s = 0.1 * i, turned_rad = 0.1 * t_s;
      const auto noise = [i](uint64_t of) { return wm_random_normal(5, of, static_cast<uint64_t>(i)); };
      feed(make::twist(t_s, 1.0 + 0.01 * noise(0), 0.1 + 0.005 * noise(1)));
      if (i % 2 == 0) feed(make::heading(t_s, turned_rad + 0.07 + 0.02 * noise(2), 0.02));
      if (has_positions && i % 5 == 0)
        feed(make::position(t_s, 10 * std::sin(turned_rad) + 0.01 * noise(3),
                            10 - 10 * std::cos(turned_rad) + 0.01 * noise(4), 0.02));
    }
    const wm_estimate e = estimate();
    const double off_rad = std::remainder(e.heading_rad - 0.1 * 59.9, 2 * M_PI),
                 sigma_rad = std::sqrt(e.covariance[35]);
    TEST_ASSERT_LESS_THAN_DOUBLE(3.0, std::fabs(off_rad) / sigma_rad);
    if (!has_positions) {
      TEST_ASSERT_GREATER_THAN_DOUBLE(0.045, sigma_of("heading.bias_rad"));
      TEST_ASSERT_GREATER_THAN_DOUBLE(0.045, sigma_rad);
      continue;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.07, value_of("heading.bias_rad"));
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.0, off_rad);
  }
}

// An antenna 0.4 m ahead and 0.2 m to the left, whose mounting is stated or not: turns to both sides show it.
TEST(test_the_antennas_place_is_found_by_turns) {
  wm_rig rig;
  wm_rig_init(&rig);
  setup.rig = &rig;
  for (const bool stated : {false, true}) {
    if (stated) rig.antenna_m[0] = 0.4, rig.antenna_m[1] = 0.2, rig.antenna_m[2] = 1;
    begin();
    TEST_ASSERT_DOUBLE_IS_NAN(sigma_of("gnss.antenna_x_m"));  // nothing of a receiver before its first position
    truth = {};
    for (int i = 0; i < 600; i++) {
      const double t_s = 0.1 * i, v = 1 + 0.3 * std::sin(0.7 * t_s), w = 0.3 * std::sin(0.4 * t_s);
      const auto noise = [i](uint64_t of) { return wm_random_normal(6, of, static_cast<uint64_t>(i)); };
      feed(make::twist(t_s, v + 0.01 * noise(0), w + 0.005 * noise(1)));
      const wm_pose2 antenna = wm::compose(truth, {0.4, 0.2, 0});
      if (i % 2 == 0) feed(make::position(t_s, antenna.x_m + 0.01 * noise(3), antenna.y_m + 0.01 * noise(4), 0.02));
      if (stated && i == 0) TEST_ASSERT_LESS_THAN_DOUBLE(0.0201, sigma_of("gnss.antenna_x_m"));
      if (i == 599) break;
      go_on(v, w, 0.1);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.04, truth.x_m, estimate().pose_map_base.p_m[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.04, truth.y_m, estimate().pose_map_base.p_m[1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.4, value_of("gnss.antenna_x_m"));
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.2, value_of("gnss.antenna_y_m"));
  }
}

// A robot that stands sees landmark k at `t_s`, `off_rad` beside it.
void see(double t_s, int k, double off_rad) {
  feed(make::twist(t_s, 0.0, 0.0));
  feed(make::sighting(t_s, k, std::atan2(landmarks[k].p_m[1], landmarks[k].p_m[0]) + off_rad, NAN));
}

// A robot whose place and heading are known; the camera's yaw is open by 0.05 rad.
void begin_known() {
  setup.start.sigma_xy_m = setup.start.sigma_heading_rad = 0.005;
  begin();
}

// The first one fits the yaw's prior, and decides the yaw; the good ones agree with each other.
TEST(test_an_outlier_among_the_first_sightings_does_not_keep_the_yaw) {
  for (const double off_rad : {-0.12, 0.12}) {
    begin_known();
    see(0.0, 0, off_rad);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, -off_rad, value_of("camera.yaw_rad"));
    for (int i = 1; i < 20; i++) {
      see(0.1 * i, i % 2, 0.0);
      TEST_ASSERT_EQUAL(WM_STATE_TRACKING, published_state());
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.0, value_of("camera.yaw_rad"));
    TEST_ASSERT_LESS_THAN_DOUBLE(0.02, sigma_of("camera.yaw_rad"));
  }
}

// With one landmark alone, that landmark has moved as well; outliers that scatter agree with nothing.
TEST(test_what_agrees_by_one_landmark_or_not_at_all_leaves_the_yaw) {
  for (const bool scatter : {false, true}) {
    begin_known();
    see(0.0, 1, 0.0);
    for (int i = 1; i < 9; i++) see(0.1 * i, scatter ? i % 2 : 0, scatter && i % 4 < 2 ? -0.12 : 0.12);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.02, sigma_of("camera.yaw_rad"));
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.0, value_of("camera.yaw_rad"));
  }
}

// What many sightings have shown is not forgotten for a few.
TEST(test_a_yaw_that_many_sightings_confirm_is_kept) {
  begin_known();
  for (int i = 0; i < 40; i++) see(0.1 * i, i % 2, 0.0);
  for (int i = 40; i < 60; i++) {
    see(0.1 * i, i % 2, 0.12);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.02, sigma_of("camera.yaw_rad"));
  }
}

}  // namespace

void setUp() {
  prepare_ekf(make::sensor("camera", 0.01, 0.1));
  all_by_default();
  put_on_map({{5, 0}, {2, 5}}, 0);
}
