// SPDX-License-Identifier: Apache-2.0
// A sensor of the motion that is silent while others go on: what stands in for it, how unsure what holds becomes, and
// what health states.
#include "motion_fixture.hpp"

namespace {

// A car of which the rear wheels, the gyro and the steering come at 50 Hz each, at 1 m/s with a turn rate.
struct car {
  bool dash, wheels, gyro, steering;
};
constexpr double kSpeed_mps = 1.0;

void drive(double from_s, double to_s, double turn_radps, const car &has) {
  for (int i = 0; from_s + 0.02 * i < to_s - 1e-9; i++) {
    const double t = from_s + 0.02 * i, half_mps = 0.5 * turn_radps * wheels.track_m;
    if (has.wheels)
      feed(make::quantities(t, {{WM_Q_WHEEL_SPEED_REAR_LEFT, kSpeed_mps - half_mps},
                                {WM_Q_WHEEL_SPEED_REAR_RIGHT, kSpeed_mps + half_mps}}));
    if (has.dash) speed(t, kSpeed_mps);
    if (has.gyro) gyro(t + 0.005, turn_radps + (i % 2 ? 1e-6 : -1e-6));
    if (has.steering)
      feed(make::quantities(t + 0.01, {{WM_Q_ROAD_WHEEL, std::atan(turn_radps * wheels.wheelbase_m / kSpeed_mps)}}));
  }
}

void begin(const car &has) {
  start(make::car());
  without_noise_of_rates();
  params.noise_yaw_rate_per_mps = params.noise_steering_rad = 0;
  drive(0, 2, 0, has);
  TEST_ASSERT_EQUAL(WM_MOTION_SPEED_YAW_RATE, front.model());
  TEST_ASSERT_EQUAL_HEX32(0, front.health());
}

// Where the gyro falls silent at 2 s and the robot turns from 2.3 s on, by 0.5 rad in one second.
void turn_without_gyro(car has) {
  begin(has);
  has.gyro = false;
  drive(2, 2.3, 0, has);
  drive(2.3, 3.3, 0.5, has);
  TEST_ASSERT_TRUE(has_health(WM_MOTION_HEALTH_TURN_SILENT));
  TEST_ASSERT_FALSE(has_health(WM_MOTION_HEALTH_SPEED_SILENT));
}

// GIVEN rear wheels, a gyro and steering WHEN the gyro falls silent THEN the steering gives the turn, and the gyro does
// again when it is back.
TEST(test_steering_stands_in_for_a_silent_gyro) {
  turn_without_gyro({false, true, true, true});
  TEST_ASSERT_EQUAL(WM_MOTION_ACKERMANN, front.model());
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.5, pose.heading_rad);
  drive(3.3, 3.4, 0.5, {false, true, true, true});
  TEST_ASSERT_EQUAL(WM_MOTION_SPEED_YAW_RATE, front.model());
  TEST_ASSERT_EQUAL_HEX32(0, front.health());
}

// Without steering, or where it is silent, too, the difference of the rear wheels' speeds does, with its own errors.
TEST(test_the_rear_wheels_stand_in_for_a_silent_gyro) {
  turn_without_gyro({false, true, true, false});
  TEST_ASSERT_EQUAL(WM_MOTION_SPEED_YAW_RATE, front.model());
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.5, pose.heading_rad);
  // 1.3 s less the time until it was overdue; 2 % of the turn.
  const double error_rad = 0.0141 * (1.3 - 0.25) / wheels.track_m + 0.02 * 0.5;
  TEST_ASSERT_DOUBLE_WITHIN(0.25 * error_rad, error_rad, std::sqrt(turn_var));
  begin({false, true, true, true});
  drive(2, 2.3, 0, {false, true, false, false});
  drive(2.3, 3.3, 0.5, {false, true, false, false});
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.5, pose.heading_rad);
}

// GIVEN a robot that stands WHEN its speed falls silent THEN the gyro's rate is no measure of its bias.
TEST(test_a_silent_speed_shows_no_standstill) {
  start(make::car());
  double rate;
  for (int i = 0; i < 100; i++) {
    speed(0.02 * i, 0.0);
    gyro(0.02 * i + 0.005, 0.01 + 1e-6 * (i % 2));
  }
  TEST_ASSERT_TRUE(front.standstill_yaw_rate(&rate));
  for (int i = 100; i < 120; i++) gyro(0.02 * i, 0.3 + 1e-6 * (i % 2));
  TEST_ASSERT_FALSE(front.standstill_yaw_rate(&rate));
  TEST_ASSERT_FALSE(front.stands(make::at(2.4)));
}

// GIVEN ticks and a gyro WHEN the counts are silent for 1 s and a half THEN the way is doubted meanwhile, and is the
// counted one afterwards, unless observations have corrected the pose meanwhile.
TEST(test_counts_that_fall_silent) {
  for (bool observed : {false, true}) {
    start(make::two_wheels());
    params.noise_speed_mps = params.noise_speed_rel = 0;
    double counted_m = 0;
    for (int i = 0; i <= 300; i++) {
      const double t = 0.02 * i;
      counted_m += t > 2.0 && t < 3.5 ? 0 : 0.01;  // it stands while its counts are silent
      if (t <= 2.0 || t >= 3.5) rolled(t, counted_m);
      gyro(t + 0.005, i % 2 ? 1e-6 : -1e-6);
      if (observed && t > 2.5 && t < 3.5) advance(t + 0.01);  // as a filter does for an observation
      if (i == 150) TEST_ASSERT_TRUE(has_health(WM_MOTION_HEALTH_SPEED_SILENT));
      if (i == 150) TEST_ASSERT_GREATER_THAN_DOUBLE(0.05, way_var);
    }
    TEST_ASSERT_EQUAL_HEX32(0, front.health());
    // A second and a half at the last speed, which the counts take back, or the observations had to.
    TEST_ASSERT_DOUBLE_WITHIN(0.03, counted_m + (observed ? 0.75 : 0.0), pose.x_m);
  }
}

// Steering that its sender gives when it changes is no silent sensor before hold_max.
TEST(test_steering_may_come_when_it_changes) {
  start(make::car());
  for (int i = 0; i < 50; i++) feed(make::quantities(0.02 * i, {{WM_Q_VEHICLE_SPEED, 1.0}, {WM_Q_ROAD_WHEEL, 0.1}}));
  const double before = turn_var;
  for (int i = 50; i < 140; i++) speed(0.02 * i, 1.0);
  TEST_ASSERT_EQUAL_HEX32(0, front.health());
  const double usual = turn_var - before;
  for (int i = 140; i < 230; i++) speed(0.02 * i, 1.0);
  TEST_ASSERT_TRUE(has_health(WM_MOTION_HEALTH_TURN_SILENT));
  TEST_ASSERT_GREATER_THAN_DOUBLE(3.0 * usual, turn_var - before - usual);
}

}  // namespace
