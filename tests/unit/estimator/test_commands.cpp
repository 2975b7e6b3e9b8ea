// SPDX-License-Identifier: Apache-2.0
// Twists that are commands: response, onset, gentle turns, what a change leaves unsure.
#include "motion_fixture.hpp"

namespace {

// Commands: y' = (c - y) / response, however the time is cut.
void start_commands(double response_s, double delay_sigma_s) {
  start(make::no_wheels());
  without_noise_of_rates();
  params.noise_hold_mps2 = params.noise_hold_radps2 = 0;
  params.twist = WM_TWIST_COMMANDS;
  params.commands_response_s = response_s;
  params.commands_delay_sigma_s = delay_sigma_s;
  front.init(&params, &wheels);
}

TEST(test_a_command_is_obeyed_with_a_response) {
  for (int cuts : {1, 7}) {
    start_commands(0.2, 0.0);
    feed(make::twist(0, 0.1, 0.0));
    feed(make::twist(1, 0.3, -0.4));
    for (int i = 1; i <= cuts; i++) advance(1.0 + 0.5 * i / cuts);
    feed(make::twist(1.5, 0.3, 0.0));
    for (int i = 1; i <= cuts; i++) advance(1.5 + 0.3 * i / cuts);
    const double left = exp(-2.5), turned = -0.4 * (0.5 - 0.2 * (1 - left));
    TEST_ASSERT_DOUBLE_WITHIN(1e-7, turned - 0.4 * (1 - left) * 0.2 * (1 - exp(-1.5)), pose.heading_rad);
  }
}

// The speed obeys as the turn does: from one command to the next it goes on from where it was.
TEST(test_the_speed_obeys_with_the_same_response) {
  for (int cuts : {1, 7}) {
    start_commands(0.4, 0.0);
    double speed = 0.2, way = 0.0;
    const double commands[] = {0.2, 0.6, -0.1, 0.3};
    for (int k = 0; k < 4; k++) {
      feed(make::twist(0.3 * k, commands[k], 0.0));
      for (int i = 1; i <= cuts; i++) advance(0.3 * k + 0.3 * i / cuts);
      const double left = std::exp(-0.75), gap = speed - commands[k];
      way += commands[k] * 0.3 + gap * 0.4 * (1.0 - left);
      speed = commands[k] + gap * left;
      TEST_ASSERT_DOUBLE_WITHIN(1e-7, way, pose.x_m);
      TEST_ASSERT_DOUBLE_WITHIN(1e-6, speed, front.twist_at(make::at(0.3 * (k + 1)), calibration).v);
    }
  }
}

// A turn slows the speed by slowdown w^2, to a stand, not beyond it; forwards and backwards.
TEST(test_a_turn_slows_down_to_a_stand) {
  wm_motion_calibration c = wm::kNeutralCalibration;
  c.value[WM_TURN_SLOWDOWN] = 0.5;
  for (const double v : {-0.4, -0.1, 0.0, 0.1, 0.4})
    for (const double w : {-0.6, 0.2}) {
      const wm::motion_twist t = wm::twist_of_command({v, 0.0, w}, {}, c, NAN);
      const double size = std::fmax(std::fabs(v) - 0.5 * w * w, 0.0);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, v < 0.0 ? -size : size, t.v);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, w, t.w);
      double by = 0.0;
      for (int i = 0; i < t.count; i++)
        if (t.index[i] == WM_TURN_SLOWDOWN) by += t.v_by[i];
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, size > 0.0 ? (v < 0.0 ? w * w : -w * w) : 0.0, by);
    }
}

// A rise is late, a fall is not: each pulse loses onset times its height. A turn to the other side falls, then rises.
TEST(test_short_turns_are_obeyed_in_part) {
  for (double before : {0.0, 0.3}) {
    double turned[2] = {};
    for (int with : {0, 1}) {
      start_commands(0.05, 0.0);
      calibration.value[WM_TURN_ONSET] = with ? 0.04 : 0.0;
      feed(make::twist(0, 0.1, before));
      for (int i = 1; i <= 20; i++) feed(make::twist(i, 0.1, i % 2 ? -0.4 : before));
      advance(21);
      turned[with] = pose.heading_rad;
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.04 * (0.4 - before) * 10, turned[1] - turned[0]);
  }
}

// A drive by speed and radius turns gentle turns with its largest radius; as asked, where they are tighter.
TEST(test_gentle_turns_have_the_largest_radius) {
  for (double rate : {0.02, 0.1}) {
    start_commands(0.05, 0.0);
    calibration.value[WM_GENTLE_TURNS] = 0.75;
    feed(make::twist(0, 0.1, rate));
    feed(make::twist(1, 0.1, rate));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, rate < 0.05 ? 0.25 * rate + 0.75 * 0.05 : rate, pose.heading_rad);
  }
}

// The dead time differs from change to change: the way and the turn are unsure by it times the change, however the
// time is cut, and by less for a slow change.
TEST(test_a_change_of_command_is_doubted) {
  for (int cuts : {1, 8}) {
    start_commands(0.1, 0.08);
    feed(make::twist(0, 0.1, 0.0));
    feed(make::twist(0.2, 0.2, -0.4));
    for (int i = 1; i <= cuts; i++) advance(0.2 + 1.8 * i / cuts);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.08 * 0.08 * 0.1 * 0.1, way_var);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.08 * 0.08 * 0.4 * 0.4, turn_var);
  }
  start_commands(0.1, 0.08);
  for (int i = 0; i <= 100; i++) feed(make::twist(0.02 * i, 0.1, -0.004 * i));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.2 * 0.08 * 0.08 * 0.4 * 0.4, turn_var);
}

// GIVEN a drive that takes speed and radius WHEN a wider turn is commanded THEN it drives the widest that it knows.
TEST(test_a_drive_knows_no_wider_radius) {
  start_commands(0.01, 0.0);
  params.twist = WM_TWIST_AUTO;
  front.init(&params, &wheels);
  const auto driven = [](double v, double w) {
    static double t_s = 0;
    feed(make::twist(t_s += 1, v, w));
    return front.twist_at(make::at(t_s + 0.9), calibration).w;
  };
  TEST_ASSERT_EQUAL_DOUBLE(0.001, driven(0.1, 0.001));  // by default, any turn is driven as asked
  params.commands_radius_max_m = 2.0;
  front.init(&params, &wheels);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.05, driven(0.1, 0.001));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.05, driven(0.1, -0.001));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.05, driven(-0.1, 0.001));  // backwards
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.05, driven(-0.1, -0.001));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.06, driven(0.1, 0.06));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.4, driven(-0.1, -0.4));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, driven(0.1, 0.0));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.3, driven(0.0, 0.3));  // on the spot
  params.commands_radius_overflow_m = 12.0;
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.05, driven(0.1, 0.01));    // 10 m
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.05, driven(0.1, 0.005));  // 20 m
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.05, driven(0.1, -0.005));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.05, driven(0.1, 1e-300));
}

// A drive can't overflow at a radius that it obeys; 0 is off for either.
TEST(test_an_overflow_lies_beyond_what_is_obeyed) {
  const auto wrong = [](double radius_max_m, double overflow_m) {
    wm_params_defaults(&wm_motion_params_table, &params);
    params.commands_radius_max_m = radius_max_m;
    params.commands_radius_overflow_m = overflow_m;
    const char *key = "none";
    const bool clash = wm_motion_params_clash(&params, &key) != nullptr;
    TEST_ASSERT_EQUAL_STRING(clash ? "commands.radius_overflow_m" : "none", key);
    return clash;
  };
  TEST_ASSERT_FALSE(wrong(0, 0));
  TEST_ASSERT_FALSE(wrong(2, 0));
  TEST_ASSERT_FALSE(wrong(0, 1));
  TEST_ASSERT_FALSE(wrong(2, 12));
  TEST_ASSERT_FALSE(wrong(2, 2));
  TEST_ASSERT_TRUE(wrong(2, 1.999));
  TEST_ASSERT_TRUE(wrong(2, 1e-6));
}

}  // namespace
