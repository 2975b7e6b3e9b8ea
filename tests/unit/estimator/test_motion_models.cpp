// SPDX-License-Identifier: Apache-2.0
// The choice of the motion's model: by the data that come, and by what is known to be there before the drive. Factors
// of its noise. Counts that come twice, and again after a silence.
#include "motion_fixture.hpp"

namespace {

// Data that a model needs and that don't come are named before the drive; with all of them it drives (tests above).
TEST(test_what_a_model_lacks) {
  const auto lacks = [](int model, const wm_wheels &w, uint32_t quantities, bool twists = false) {
    wm_params_defaults(&wm_motion_params_table, &params);
    params.model = model;
    const uint32_t kinds =
        (quantities ? WM_EVENT_BIT(WM_EVENT_QUANTITIES) : 0) | (twists ? WM_EVENT_BIT(WM_EVENT_TWIST2) : 0);
    const char *text = wm_motion_lacks(&params, &w, kinds, quantities);
    return text ? text : "nothing";
  };
  const auto bits = [](std::initializer_list<int> quantities) {
    uint32_t all = 0;
    for (int q : quantities) all |= 1u << q;
    return all;
  };
  const uint32_t ticks = bits({WM_Q_WHEEL_TICKS_LEFT, WM_Q_WHEEL_TICKS_RIGHT}), rate = bits({WM_Q_YAW_RATE});
  const uint32_t speed = bits({WM_Q_VEHICLE_SPEED}), actuator = bits({WM_Q_STEERING_ACTUATOR});
  wm_wheels unknown = {NAN, NAN, NAN, NAN, NAN, NAN, 0, {}, {}};

  TEST_ASSERT_EQUAL_STRING("nothing", lacks(WM_MOTION_TICKS, make::two_wheels(), ticks));
  TEST_ASSERT_EQUAL_STRING("both wheels' ticks (ticks.csv; over CAN wheel_ticks_left and wheel_ticks_right)",
                           lacks(WM_MOTION_TICKS, make::two_wheels(), bits({WM_Q_WHEEL_TICKS_LEFT}), true));
  TEST_ASSERT_EQUAL_STRING("wheels.radius_m and wheels.ticks_per_turn in calibration.yaml",
                           lacks(WM_MOTION_TICKS, unknown, ticks));
  TEST_ASSERT_EQUAL_STRING("nothing", lacks(WM_MOTION_SPEED_YAW_RATE, unknown, speed | rate));
  TEST_ASSERT_EQUAL_STRING("nothing", lacks(WM_MOTION_SPEED_YAW_RATE, make::two_wheels(), ticks | rate));
  TEST_ASSERT_EQUAL_STRING("a turn rate (imu.csv; over CAN yaw_rate)", lacks(WM_MOTION_SPEED_YAW_RATE, unknown, speed));
  TEST_ASSERT_EQUAL_STRING("nothing", lacks(WM_MOTION_ACKERMANN, make::car(), speed | actuator));
  TEST_ASSERT_EQUAL_STRING("wheels.wheelbase_m in calibration.yaml",
                           lacks(WM_MOTION_ACKERMANN, unknown, speed | actuator));
  unknown.wheelbase_m = 1;
  TEST_ASSERT_EQUAL_STRING("wheels.steering_table in calibration.yaml",
                           lacks(WM_MOTION_ACKERMANN, unknown, speed | actuator));
  TEST_ASSERT_EQUAL_STRING("motion.csv or motion6.csv", lacks(WM_MOTION_TWIST, make::car(), speed | rate));
  TEST_ASSERT_EQUAL_STRING("nothing", lacks(WM_MOTION_TWIST, make::car(), 0, true));
  TEST_ASSERT_EQUAL_STRING("increments.csv", lacks(WM_MOTION_INCREMENTS, make::car(), 0, true));
  TEST_ASSERT_EQUAL_STRING("nothing", lacks(WM_MOTION_AUTO, make::car(), speed, true));
  TEST_ASSERT_EQUAL_STRING("a turn rate (imu.csv; over CAN yaw_rate)", lacks(WM_MOTION_AUTO, make::car(), speed));
}

// Front wheels roll along the road wheels. By the angle or by the gyro it is the rear axle that moves; on the spot it
// stands, and turns. Wheels that do not steer are as they were.
TEST(test_the_speed_of_front_wheels) {
  const double angle = 0.9, front_mps = 0.7, wheelbase_m = make::car().wheelbase_m;
  const double turn_radps = front_mps * std::sin(angle) / wheelbase_m;
  const auto pose_after = [](double mps, std::pair<wm_quantity, double> turn, int drive) {
    start(make::car());
    params.states.drive = drive;
    front.init(&params, &wheels);
    for (int k = 0; k <= 200; k++) feed(make::quantities(0.02 * k, {{WM_Q_WHEEL_SPEED_FRONT_LEFT, mps}, turn}));
    return pose;
  };
  const auto is_at = [](const wm_pose2 &at, double v, double w) {
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, std::remainder(4 * w, 2 * M_PI), at.heading_rad);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, v / w * std::sin(4 * w), at.x_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, v / w * (1 - std::cos(4 * w)), at.y_m);
  };
  for (const double sign : {1.0, -1.0}) {
    is_at(pose_after(sign * front_mps, {WM_Q_ROAD_WHEEL, angle}, WM_DRIVE_ROLLING), sign * front_mps * std::cos(angle),
          sign * turn_radps);
    is_at(pose_after(sign * front_mps, {WM_Q_YAW_RATE, turn_radps}, WM_DRIVE_ROLLING),
          sign * front_mps * std::cos(angle), turn_radps);
  }
  is_at(pose_after(front_mps, {WM_Q_YAW_RATE, front_mps / wheelbase_m}, WM_DRIVE_ROLLING), 0, front_mps / wheelbase_m);
  is_at(pose_after(front_mps, {WM_Q_YAW_RATE, turn_radps}, WM_DRIVE_SKID_STEER), front_mps, turn_radps);
}

// A robot with ticks whose right wheel is 4 % larger than its calibration, and a gyro that may fall silent.
int steps;
double left_ticks, right_ticks;

void begin(int model = WM_MOTION_AUTO) {
  start(make::two_wheels(), model);
  steps = 0;
  left_ticks = right_ticks = 0;
}

// At 0.5 m/s straight on; the right wheel's radius makes its counts a turn of 0.04 rad/s to the left.
void go(double seconds, bool has_gyro) {
  for (const int end = steps + (int)(50 * seconds); steps < end; steps++) {
    left_ticks += 0.01 / kTick, right_ticks += 0.0104 / kTick;
    ticks(0.02 * steps, left_ticks, right_ticks);
    if (has_gyro) gyro(0.02 * steps + 0.005, steps % 2 ? 1e-6 : -1e-6);
  }
}

// GIVEN ticks and a gyro WHEN no model is configured THEN the way is the ticks' and the turn the gyro's.
TEST(test_ticks_and_a_gyro_are_both_used) {
  begin();
  go(10, true);
  TEST_ASSERT_EQUAL(WM_MOTION_SPEED_YAW_RATE, front.model());
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.0, pose.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.5 * 10 * 1.02, pose.x_m);
  begin();
  go(10, false);
  TEST_ASSERT_EQUAL(WM_MOTION_TICKS, front.model());
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.0004 / 0.02 / 0.5 * 10, pose.heading_rad);
}

// GIVEN both WHEN the gyro falls silent THEN the wheels' difference turns on without a jump, and the gyro again later.
TEST(test_a_silent_gyro_yields_to_the_ticks) {
  begin();
  go(10, true);
  go(10, false);
  TEST_ASSERT_EQUAL(WM_MOTION_TICKS, front.model());
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.04 * (10 - 0.25), pose.heading_rad);  // 0.25 s until it is overdue
  const double way = std::sqrt(pose.x_m * pose.x_m + pose.y_m * pose.y_m);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.5 * 20 * 1.02, way);
  go(1, true);
  TEST_ASSERT_EQUAL(WM_MOTION_SPEED_YAW_RATE, front.model());
}

// A gyro that is stuck at a bias is left, but not where the configuration names the model.
TEST(test_a_stuck_gyro_yields_to_the_ticks) {
  for (int model : {WM_MOTION_AUTO, WM_MOTION_SPEED_YAW_RATE}) {
    begin(model);
    for (; steps < 50 * 60; steps++) {
      rolled(0.02 * steps, 0.012 * (steps + 1));
      gyro(0.02 * steps + 0.005, 0.01);
    }
    TEST_ASSERT_TRUE(has_health(WM_MOTION_HEALTH_YAW_RATE_STUCK));
    const double turned_s = model == WM_MOTION_AUTO ? 30.0 : 60.0;
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.01 * turned_s, pose.heading_rad);
  }
}

// Seconds of a robot whose wheels give this speed and turn rate, and whose gyro gives this number; true: found stuck.
bool is_found_stuck(double seconds, double speed_mps, double turn_radps, double gyro_radps) {
  begin();
  for (; steps < 50 * seconds; steps++) {
    left_ticks += 0.02 * (speed_mps - 0.5 * turn_radps * wheels.track_m) / kTick;
    right_ticks += 0.02 * (speed_mps + 0.5 * turn_radps * wheels.track_m) / kTick;
    ticks(0.02 * steps, std::floor(left_ticks), std::floor(right_ticks));  // a slow wheel stands in most of the periods
    gyro(0.02 * steps + 0.005, gyro_radps);
  }
  return has_health(WM_MOTION_HEALTH_YAW_RATE_STUCK);
}

TEST(test_a_slow_robots_stuck_gyro_is_found) {
  TEST_ASSERT_TRUE(is_found_stuck(5, 0.1, 0.2, 0.01));
  TEST_ASSERT_TRUE(is_found_stuck(5, 0.0, 0.2, 0.01));   // turns on the spot
  TEST_ASSERT_TRUE(is_found_stuck(200, 0.1, 0.0, 0.0));  // straight on for 15 m
}

// A coarse gyro may repeat its number while that is right, and while the robot stands.
TEST(test_repeated_numbers_that_are_right_are_no_fault) {
  TEST_ASSERT_FALSE(is_found_stuck(20, 0.1, 0.2, 0.21));
  TEST_ASSERT_FALSE(is_found_stuck(100, 0.1, 0.0, 0.0));
  TEST_ASSERT_FALSE(is_found_stuck(120, 0.0, 0.0, 0.02));
}

// Without motion data a robot may have braked, accelerated or turned for hold_max_s; then its heading walks by 0.3 rad
// per sqrt(s).
TEST(test_what_may_have_moved_unseen) {
  wm_params_defaults(&wm_motion_params_table, &params);
  params.hold_max_s = 2.0;
  params.noise_hold_mps2 = 0.6;
  params.noise_hold_radps2 = 0.4;
  const double walk = 0.3;
  const struct {
    double blind_s, xy_m, heading_rad;
  } rows[] = {{0.0, 0.0, 0.0},
              {1.0, 0.3, 0.2},
              {2.0, 1.2, 0.8},
              {5.0, 1.2 + 0.6 * 3.0, std::sqrt(0.64 + walk * walk * 3.0)},
              {102.0, 1.2 + 0.6 * 100.0, std::sqrt(0.64 + walk * walk * 100.0)}};
  for (const auto &row : rows) {
    double xy_m = -1, heading_rad = -1;
    wm_motion_unseen(&params, row.blind_s, &xy_m, &heading_rad);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, row.xy_m, xy_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, row.heading_rad, heading_rad);
  }
}

// Factors of the variances of way and turn leave the correlation of the two as it is.
TEST(test_factors_of_the_noise_keep_its_correlation) {
  wm_params_defaults(&wm_motion_params_table, &params);
  wheels = make::two_wheels();
  const wm_motion_calibration c = wm::kNeutralCalibration;
  const wm::stated_noise none = {NAN, NAN, NAN};
  wm::motion_input input{};
  input.model = WM_MOTION_TICKS;
  input.a = 1.0, input.b = 1.4;
  const wm::motion_twist twist = wm::twist_of(input, c, wheels, {});
  const wm::motion_noise plain = wm::noise_of(input, twist, 0.1, params, wheels, c, none, {1.0, 1.0}),
                         more = wm::noise_of(input, twist, 0.1, params, wheels, c, none, {4.0, 9.0});
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.0, plain.distance_rotation);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 4.0, more.distance_m2 / plain.distance_m2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 4.0, more.lateral_m2 / plain.lateral_m2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 9.0, more.rotation_rad2 / plain.rotation_rad2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 6.0, more.distance_rotation / plain.distance_rotation);
}

// GIVEN a bus on which a frame may come twice with one stamp WHEN the robot drives THEN each count counts once, and is
// as exact as one of its period.
TEST(test_a_count_that_comes_twice_counts_once) {
  begin();
  for (int i = 0; i <= 50; i++)
    for (int twice = 0; twice < 2; twice++) rolled(0.02 * i, 0.02 * i);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, pose.x_m);
  TEST_ASSERT_EQUAL_UINT32(0, front.health());
  double speed_mps, turn_radps;
  front.count_noise(&speed_mps, &turn_radps);
  const double expected = kTick / (0.02 * std::sqrt(12.0));
  TEST_ASSERT_DOUBLE_WITHIN(0.01 * expected, expected, speed_mps);
}

// GIVEN a robot in reverse gear WHEN its counts rise THEN it drives backwards: they have no sign. Where they have
// fallen before, they have one, and the gear is of no effect.
TEST(test_counts_without_a_sign_take_it_from_the_gear) {
  for (const bool has_sign : {false, true}) {
    begin();
    double way_m = 0.0;
    const auto roll = [&](double from_s, double each_m) {
      for (int i = 1; i <= 50; i++) rolled(from_s + 0.02 * i, way_m += each_m);
    };
    roll(0.0, has_sign ? -0.02 : 0.02);
    const double before_m = pose.x_m;
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, has_sign ? -0.98 : 0.98, before_m);
    feed(make::quantities(1.0, {{WM_Q_GEAR, -1.0}}));
    roll(1.0, 0.02);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, has_sign ? 1.0 : -1.0, pose.x_m - before_m);
  }
}

// GIVEN two seconds without counts, in which observations corrected the pose WHEN counts come again THEN from the first
// one on the way is the counted one, whatever the speed and however often the pose is asked for between two counts.
TEST(test_the_way_is_counted_again_after_a_silence) {
  begin();
  for (int i = 0; i <= 50; i++) rolled(0.02 * i, 0.02 * i);
  advance(3.0);
  rolled(3.02, 3.02);
  const double before_m = pose.x_m;
  double way_m = 3.02;
  for (int i = 1; i <= 50; i++) {
    advance(3.02 + 0.02 * i - 0.01);
    way_m += i % 3 ? 0.03 : 0.01;
    rolled(3.02 + 0.02 * i, way_m);
  }
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, way_m - 3.02, pose.x_m - before_m);
}

// A count after 0.7 periods has a speed of its own; one after 0.4 is one of a burst, whose speed is that since the
// count before the last one.
TEST(test_the_speed_of_an_early_count) {
  for (const double share : {0.7, 0.4}) {
    begin(WM_MOTION_TICKS);
    for (int i = 0; i <= 50; i++) rolled(0.02 * i, 0.02 * i);
    const double early_s = 0.02 * share;
    rolled(1.0 + early_s, 1.0 + 2.0 * early_s);  // at 2 m/s
    const double expected = share > 0.5 ? 2.0 : (0.02 + 2.0 * early_s) / (0.02 + early_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected, speed_at(1.0 + early_s));
  }
}

// GIVEN wheels whose speed was refused and that then fall silent WHEN another speed goes on THEN the refusal is over
// after hold_max_s: the way is as sure as without it.
TEST(test_a_refusal_ends_with_its_sensor) {
  double grown_m2[2];
  for (const bool refused : {false, true}) {
    start(make::car(), WM_MOTION_SPEED_YAW_RATE);
    double before_m2 = 0.0;
    for (int i = 0; i <= 300; i++) {
      const double t_s = 0.02 * i;
      const double wheels_mps = refused && i == 50 ? 120.0 : 2.0;
      if (i < 50 || (refused && i == 50))
        feed(make::quantities(t_s,
                              {{WM_Q_WHEEL_SPEED_REAR_LEFT, wheels_mps}, {WM_Q_WHEEL_SPEED_REAR_RIGHT, wheels_mps}}));
      speed(t_s + 0.002, 2.0);
      gyro(t_s + 0.005, 1e-3 * (i % 3));
      if (i == 250) before_m2 = way_var;
    }
    grown_m2[refused] = way_var - before_m2;
  }
  TEST_ASSERT_DOUBLE_WITHIN(1e-9 + 1e-6 * grown_m2[0], grown_m2[0], grown_m2[1]);
}

}  // namespace
