// SPDX-License-Identifier: Apache-2.0
// A twist's speeds with a gyro's turn rate: of any drive, sideways, too; a gyro that is silent or stuck; standstill.
#include "motion_fixture.hpp"
#include "waymark/random.h"

namespace {

void begin(int twist = WM_TWIST_MEASURED) {
  start(make::no_wheels());
  params.twist = twist;
  front.init(&params, &wheels);
}

// Twists at 50 Hz and a gyro at 100 Hz with a little noise, as sensors have it.
template <class Rate>
void drive(double from_s, double to_s, double v, double u, double w, Rate gyro_rate) {
  for (int i = 0; i < static_cast<int>(std::lround((to_s - from_s) * 100)); i++) {
    const double t = from_s + 0.01 * i, rate = gyro_rate(i);
    if (std::isfinite(rate)) gyro(t, rate);
    if (i % 2 == 0) feed(make::twist6(t, v, u, w));
  }
}

double noise(int i) { return i % 2 ? 1e-6 : -1e-6; }
constexpr double kNone = NAN;

TEST(test_the_turn_is_the_gyros_and_the_way_the_twists) {
  begin();
  drive(0, 2, 0.0, 0.5, 0.1, [](int i) { return 0.25 + noise(i); });
  TEST_ASSERT_EQUAL(WM_MOTION_SPEED_YAW_RATE, front.model());
  TEST_ASSERT_EQUAL(wm::kKindGyro, front.kind());
  const double turned = 0.25 * 1.99;
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, turned, pose.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, -2.0 * (1.0 - std::cos(turned)), pose.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-3, 2.0 * std::sin(turned), pose.y_m);
}

// 138 m/s are refused beside a gyro, too: the speed before holds with the noise of what the robot may have done, and
// the health has it for five seconds.
TEST(test_a_speed_that_no_robot_reaches_is_refused_beside_a_gyro) {
  const auto rate = [](int i) { return noise(i); };
  begin();
  drive(0, 1, 0.5, 0.0, 0.0, rate);
  TEST_ASSERT_EQUAL_HEX32(0, front.health());
  const double before_m2 = way_var;
  drive(1, 1.2, 138.0, 0.0, 0.0, rate);
  TEST_ASSERT_EQUAL_HEX32(WM_MOTION_HEALTH_IMPLAUSIBLE, front.health());
  drive(1.2, 1.4, 0.5, 0.0, 0.0, rate);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.5 * 1.39, pose.x_m);
  const double physical_m = 0.5 * 15.0 * 0.2 * 0.2 / std::sqrt(3.0);  // 15 m/s2 either way
  TEST_ASSERT_GREATER_THAN_DOUBLE(physical_m * physical_m, way_var - before_m2);
  drive(1.4, 6.5, 0.5, 0.0, 0.0, rate);
  TEST_ASSERT_EQUAL_HEX32(0, front.health());
}

// The learnt bias is the gyro's: the twist's turn rate has none.
TEST(test_a_silent_gyro_is_replaced_and_taken_up_again) {
  begin();
  calibration.value[WM_YAW_RATE_BIAS] = 0.05;
  drive(0, 1, 0.5, 0.0, 0.1, [](int i) { return 0.25 + noise(i); });
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.2 * 0.99, pose.heading_rad);
  drive(1, 2, 0.5, 0.0, 0.1, [](int) { return kNone; });
  TEST_ASSERT_EQUAL(WM_MOTION_TWIST, front.model());
  const double before = pose.heading_rad;
  drive(2, 3, 0.5, 0.0, 0.1, [](int) { return kNone; });
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.1, pose.heading_rad - before);
  drive(3, 3.1, 0.5, 0.0, 0.1, [](int i) { return 0.25 + noise(i); });
  TEST_ASSERT_EQUAL(WM_MOTION_SPEED_YAW_RATE, front.model());
}

// GIVEN a twist that drives alone, at first or while the gyro is silent WHEN the gyro comes THEN the newest twist is no
// silent speed.
TEST(test_the_twist_is_no_silent_speed_when_a_gyro_comes) {
  for (const bool had_gyro : {false, true}) {
    begin();
    drive(0, 1, 0.5, 0.0, 0.1, [had_gyro](int i) { return had_gyro ? 0.1 + noise(i) : kNone; });
    drive(1, 3, 0.5, 0.0, 0.1, [](int) { return kNone; });
    front.feed(make::quantities(2.995, {{WM_Q_YAW_RATE, 0.1}}));
    TEST_ASSERT_EQUAL(WM_MOTION_SPEED_YAW_RATE, front.model());
    TEST_ASSERT_EQUAL_HEX32(0, front.health());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, speed_at(2.996));
  }
}

TEST(test_a_stuck_gyro_is_replaced) {
  begin();
  drive(0, 1, 0.3, 0.0, 0.0, [](int i) { return noise(i); });
  drive(1, 5, 0.3, 0.0, 0.2, [](int) { return 0.01; });  // the robot turns, the gyro's number stands
  TEST_ASSERT_TRUE(has_health(WM_MOTION_HEALTH_YAW_RATE_STUCK));
  TEST_ASSERT_EQUAL(WM_MOTION_TWIST, front.model());
  drive(5, 5.1, 0.3, 0.0, 0.2, [](int i) { return 0.2 + noise(i); });
  TEST_ASSERT_FALSE(has_health(WM_MOTION_HEALTH_YAW_RATE_STUCK));
  TEST_ASSERT_EQUAL(WM_MOTION_SPEED_YAW_RATE, front.model());
}

// The twist turned by 0.3 rad more than the gyro until that was found.
TEST(test_what_a_stuck_gyro_missed_is_uncertain) {
  begin();
  drive(0, 1, 0.3, 0.0, 0.0, [](int i) { return noise(i); });
  const double before = turn_var;
  drive(1, 5, 0.3, 0.0, 0.2, [](int) { return 0.01; });
  TEST_ASSERT_DOUBLE_WITHIN(0.15, 0.45, std::sqrt(turn_var - before));
}

// Samples with the noise that the parameters state: what is integrated has that noise and hardly more.
TEST(test_noise_of_a_holonomic_twist_is_counted_once) {
  begin();
  params.states.drive = WM_DRIVE_HOLONOMIC;
  params.noise_speed_rel = params.noise_sideways_rel = params.noise_side_rel = params.noise_yaw_rate_rel = 0;
  constexpr double kRate_hz = 50, kSeconds = 40;
  const double each = std::sqrt(kRate_hz);
  for (int i = 0; i < kRate_hz * kSeconds; i++) {
    const auto draw = [i](uint64_t axis) { return wm_random_normal(5, axis, static_cast<uint64_t>(i)); };
    feed(make::twist6(i / kRate_hz, 0.3 + 0.02 * each * draw(0), 0.3 + 0.02 * each * draw(1), 0.01 * each * draw(2)));
  }
  // Speeds of 0.02 m/s per sqrt(s) on both axes and 0.01 rad/s per sqrt(s), by the defaults.
  TEST_ASSERT_DOUBLE_WITHIN(0.08, 1.04, way_var / (0.02 * 0.02 * kSeconds));
  TEST_ASSERT_DOUBLE_WITHIN(0.08, 1.04, side_var / (0.02 * 0.02 * kSeconds));
  TEST_ASSERT_DOUBLE_WITHIN(0.08, 1.04, turn_var / (0.01 * 0.01 * kSeconds));
}

TEST(test_a_turn_on_the_spot_is_no_standstill) {
  double rate = 0;
  begin();
  drive(0, 2, 0.0, 0.0, 0.3, [](int i) { return 0.3 + noise(i); });
  TEST_ASSERT_FALSE(front.standstill_yaw_rate(&rate));
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.3 * 1.99, pose.heading_rad);
  drive(2, 3, 0.0, 0.0, 0.0, [](int i) { return 0.02 + noise(i); });
  gyro(3, 0.02);
  TEST_ASSERT_TRUE(front.standstill_yaw_rate(&rate));
  TEST_ASSERT_EQUAL_DOUBLE(0.02, rate);
}

TEST(test_commands_keep_their_own_turn_rate) {
  begin(WM_TWIST_COMMANDS);
  drive(0, 1, 0.5, 0.0, 0.1, [](int i) { return 0.25 + noise(i); });
  TEST_ASSERT_EQUAL(WM_MOTION_TWIST, front.model());
}

// Speeds of a log that measures no turn, at a place of its own.
wm_event log_of(double t_s, double v, double u, double arm_x = 0, double arm_y = 0) {
  wm_event e = make::twist6(t_s, v, u, kNone);
  e.as.twist6.w_radps[0] = e.as.twist6.w_radps[1] = kNone;
  e.as.twist6.arm_m[0] = arm_x, e.as.twist6.arm_m[1] = arm_y;
  return e;
}

// The gyro falls silent: its rate holds with growing noise, since the log has none that could stand in.
TEST(test_a_log_without_rates_and_a_silent_gyro) {
  begin();
  const auto go = [](int from, int to, bool has_gyro) {
    for (int i = from; i < to; i++) {
      if (has_gyro) gyro(0.01 * i, 0.25 + noise(i));
      if (i % 2 == 0) feed(log_of(0.01 * i, 0.5, 0));
    }
  };
  go(0, 200, true);
  const double before_rad2 = turn_var;
  go(200, 700, false);
  TEST_ASSERT_EQUAL(WM_MOTION_SPEED_YAW_RATE, front.model());
  TEST_ASSERT_EQUAL_HEX32(WM_MOTION_HEALTH_TURN_SILENT, front.health());
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.25, turn_var - before_rad2);
}

// Without any gyro the way is measured and the turn is not: 0.3 rad per sqrt(s). Standing is no standstill either.
TEST(test_a_log_without_rates_alone) {
  for (const double v : {0.5, 0.0}) {
    begin();
    for (int i = 0; i <= 100; i++) feed(log_of(0.02 * i, v, 0));
    TEST_ASSERT_EQUAL(WM_MOTION_TWIST, front.model());
    TEST_ASSERT_EQUAL_HEX32(WM_MOTION_HEALTH_TURN_SILENT, front.health());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2 * v, pose.x_m);
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.99 * 0.09 * 2, turn_var);
    TEST_ASSERT_FALSE(front.stands(wm_ns_from_seconds(2)));
  }
}

TEST(test_a_part_of_the_rates_is_refused) {
  begin();
  wm_event e = make::twist6(0, 0.5, 0, 0.1);
  e.as.twist6.w_radps[0] = kNone;
  TEST_ASSERT_EQUAL(WM_NOT_FINITE, front.check(e));
  TEST_ASSERT_EQUAL(WM_OK, front.check(log_of(0, 0.5, 0)));
}

}  // namespace
