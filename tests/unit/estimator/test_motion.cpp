// SPDX-License-Identifier: Apache-2.0
// The motion front end: models and their derivatives, ticks as positions, signs by the gear, standstill, dead sensors.
#include "motion_fixture.hpp"

namespace {

// Each model, each calibration state: derivative by central differences, and scales' meaning at a turn.
TEST(test_every_derivative_of_every_model) {
  const int kCommand = -1;
  const int models[] = {WM_MOTION_TICKS, WM_MOTION_SPEED_YAW_RATE, WM_MOTION_ACKERMANN,
                        WM_MOTION_TWIST, WM_MOTION_INCREMENTS,     kCommand};
  int checked = 0;
  for (int model : models) {
    wm_wheels w = make::car();
    w.encoder_offset_m = 0.4;
    wm::motion_input input{};
    input.a = 1.3;
    input.b = model == WM_MOTION_TICKS ? 1.1 : 0.2;
    input.side_mps = 0.6;
    input.model = (uint8_t)(model == kCommand ? (int)WM_MOTION_TWIST : model);
    input.command = model == kCommand;
    const wm_motion_calibration c = {
        {1.05, 0.93, 0.02, 1.02, 0.97, 1.04, 0.03, 0.1, 0.07, 0.15, 0.04, 0.3, 1.06, 0.12}};
    const wm::drive_terms drive = {{0.4, -0.7}, 0.05};
    const wm::motion_twist t = wm::twist_of(input, c, w, drive);
    TEST_ASSERT_GREATER_THAN(1, t.count);
    TEST_ASSERT_EQUAL(0, t.missing);
    for (int state = 0; state < wm::kCalibrationCount; state++) {
      if (state == wm::kLag) continue;  // moves the ends of the interval, not the twist
      const double h = 1e-6;
      wm_motion_calibration up = c, down = c;
      up.value[state] += h;
      down.value[state] -= h;
      const wm::motion_twist a = wm::twist_of(input, up, w, drive), b = wm::twist_of(input, down, w, drive);
      double v_by = 0, u_by = 0, w_by = 0;
      for (int i = 0; i < t.count; i++)
        if (t.index[i] == state) v_by += t.v_by[i], u_by += t.u_by[i], w_by += t.w_by[i];
      TEST_ASSERT_DOUBLE_WITHIN(1e-8, (a.v - b.v) / (2 * h), v_by);
      TEST_ASSERT_DOUBLE_WITHIN(1e-8, (a.u - b.u) / (2 * h), u_by);
      TEST_ASSERT_DOUBLE_WITHIN(1e-8, (a.w - b.w) / (2 * h), w_by);
      checked += v_by != 0 || u_by != 0 || w_by != 0;
    }
  }
  TEST_ASSERT_EQUAL(4 + 5 + 3 + 8 + 5 + 12, checked);
}

TEST(test_a_derivative_without_room_is_counted) {
  wm::motion_twist t{};
  while (t.missing < 2 && t.count + t.missing < 100) t.add(0, 1.0, 2.0);
  TEST_ASSERT_EQUAL(wm::motion_twist::kMax + 2, t.count + t.missing);
}

TEST(test_ticks_make_exact_arcs) {
  start(make::two_wheels());
  ticks(0, 0, 0);
  ticks(1, 1000, 2000);  // a radius of 0.75 m
  const double l = 1000 * kTick, r = 2000 * kTick, turn = (r - l) / 0.5, radius = 0.5 * (l + r) / turn;
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, radius * sin(turn), pose.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, radius * (1 - cos(turn)), pose.y_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, turn, pose.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.25 * (l + r) * params.noise_ticks_per_sqrt_m * params.noise_ticks_per_sqrt_m,
                            way_var);
}

// GIVEN an observation between two counts WHEN the speed changes meanwhile THEN the total is that of the counts.
TEST(test_counts_are_positions_whatever_comes_between) {
  start(make::two_wheels());
  ticks(0, 0, 0);
  ticks(1, 1000, 1000);
  advance(1.4);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1400 * kTick, pose.x_m);  // the last speed carries on
  ticks(2, 1500, 1500);                                     // it was slower
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1500 * kTick, pose.x_m);
  advance(2.1);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1550 * kTick, pose.x_m);
  ticks(2.1, 1500, 1500);  // stopped, told at the very time already reached
  ticks(2.2, 1500, 1500);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1500 * kTick, pose.x_m);
}

// GIVEN counts each 20 ms, of wheels that jerk WHEN another event's stamp lies two nanoseconds before one of them THEN
// the way's 3 mm that the count still brings, at a million metres a second, leave the robot as sure of where it is
// sideways.
TEST(test_a_count_right_behind_another_event_is_no_doubt) {
  double plain = 0.0;
  for (bool behind : {false, true}) {
    start(make::two_wheels());
    for (int i = 0; i <= 50; i++) {
      const double stamp_s = 0.02 * i;
      if (behind && i == 40) advance(stamp_s - 2e-9);
      rolled(stamp_s, 0.01 * i - (i == 40 ? 0.003 : 0.0));
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5, pose.x_m);
    if (!behind) plain = side_var;
  }
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.0, plain);
  TEST_ASSERT_DOUBLE_WITHIN(0.5 * plain, plain, side_var);
}

// GIVEN counts each 20 ms WHEN one is late and the next comes right behind it THEN the speed between their stamps (50
// m/s, 400 m/s) is not carried on, and no way is lost.
TEST(test_a_late_count_and_the_next_right_behind_it) {
  for (const double behind_s : {0.0012, 0.00015}) {
    start(make::two_wheels());
    for (int i = 0; i <= 50; i++) rolled(0.02 * i, 0.06 * i);  // 3 m/s
    rolled(1.04 - behind_s, 51 * 0.06);
    rolled(1.04, 52 * 0.06);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.12, pose.x_m);
    advance(1.0599);
    TEST_ASSERT_DOUBLE_WITHIN(0.005, 3.0 * 1.0599, pose.x_m);
    rolled(1.06, 53 * 0.06);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.18, pose.x_m);
  }
}

// As two frames of a log whose stamps are in milliseconds.
TEST(test_counts_of_both_wheels_in_two_events_of_one_stamp) {
  start(make::two_wheels());
  for (int k = 0; k <= 100; k++) {
    const double t = 0.02 * k, way = k < 50 ? 20.0 * k : 1000.0 + 5.0 * (k - 50);  // it brakes in the middle
    feed(make::quantities(t, {{WM_Q_WHEEL_TICKS_LEFT, way}}));
    feed(make::quantities(t, {{WM_Q_WHEEL_TICKS_RIGHT, way}}));
  }
  advance(2.02);
  TEST_ASSERT_DOUBLE_WITHIN(1e-5, 1255 * kTick, pose.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, pose.heading_rad);
}

TEST(test_counts_of_both_wheels_may_come_one_after_the_other) {
  start(make::two_wheels());
  for (int i = 0; i <= 100; i++) {
    feed(make::quantities(0.01 * i, {{WM_Q_WHEEL_TICKS_LEFT, 10.0 * i}}));
    feed(make::quantities(0.01 * i + 0.003, {{WM_Q_WHEEL_TICKS_RIGHT, 12.0 * i}}));
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 200 * kTick / 0.5, pose.heading_rad);
  for (int i = 0; i < 2; i++) ticks(1.1 + i, 1000, 1200);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 200 * kTick / 0.5, pose.heading_rad);
}

TEST(test_an_unsigned_speed_takes_its_sign_from_the_gear) {
  start(make::car());
  feed(make::quantities(0, {{WM_Q_GEAR, -1}, {WM_Q_VEHICLE_SPEED, 1.0}, {WM_Q_YAW_RATE, 0.0}}));
  speed_and_gyro(1, 1.0, 0.0);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, -1.0, pose.x_m);
  feed(make::quantities(1, {{WM_Q_GEAR, 1}, {WM_Q_VEHICLE_SPEED, 1.0}}));
  speed(2, -1.0);  // so it has a sign of its own
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, pose.x_m);
  feed(make::quantities(2, {{WM_Q_GEAR, -1}}));
  speed(3, -1.0);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, -1.0, pose.x_m);
}

// A sensor's zero error, of either sign, is no sign of its own: the gear still gives it. Beyond it, it is.
TEST(test_a_zero_error_is_no_sign) {
  for (const double zero_mps : {0.05, -0.05, -0.2}) {
    start(make::car());
    feed(make::quantities(0, {{WM_Q_GEAR, 1}, {WM_Q_VEHICLE_SPEED, zero_mps}, {WM_Q_YAW_RATE, 0.0}}));
    feed(make::quantities(1, {{WM_Q_GEAR, -1}, {WM_Q_VEHICLE_SPEED, 1.0}}));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, zero_mps < -0.1 ? 1.0 : -1.0, speed_at(1));
  }
}

TEST(test_rear_wheels_are_preferred_and_a_silent_source_yields) {
  start(make::car());
  speed_and_gyro(0, 1.0, 0.0);
  TEST_ASSERT_FALSE(front.speed_source_changed());
  feed(make::quantities(0, {{WM_Q_WHEEL_SPEED_REAR_LEFT, 1.9}, {WM_Q_WHEEL_SPEED_REAR_RIGHT, 2.1}}));
  TEST_ASSERT_TRUE(front.speed_source_changed());
  TEST_ASSERT_FALSE(front.speed_source_changed());
  speed(1, 1.0);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.0, pose.x_m);
  for (int i = 11; i <= 100; i++) speed_and_gyro(0.1 * i, 1.0, 0.0);
  TEST_ASSERT_TRUE(front.speed_source_changed());
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, speed_at(10.0));
}

// A sampled speed changed at any time since the sample before it; counts are of the whole time, a command is obeyed
// from its stamp on.
TEST(test_a_change_between_samples_is_noise_of_its_moment) {
  for (const int model : {WM_MOTION_SPEED_YAW_RATE, WM_MOTION_TWIST}) {
    start(make::car(), model);
    without_noise_of_rates();
    params.twist = WM_TWIST_MEASURED;
    for (int i = 0; i <= 10; i++) {
      const double v = i < 5 ? 1.0 : 3.0, w = i < 7 ? 0.2 : -0.4;
      feed(model == WM_MOTION_TWIST ? make::twist(0.1 * i, v, w)
                                    : make::quantities(0.1 * i, {{WM_Q_VEHICLE_SPEED, v}, {WM_Q_YAW_RATE, w}}));
      advance(0.1 * i + 0.03);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.0 * 0.1 * 2.0 * 0.1 / 12.0, way_var);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.6 * 0.1 * 0.6 * 0.1 / 12.0, turn_var);
  }
  start(make::car(), WM_MOTION_SPEED_YAW_RATE);  // a slow speed beside a fast yaw rate: the speed's own period
  params.noise_speed_mps = params.noise_speed_rel = 0;
  for (int i = 0; i <= 100; i++) {
    feed(i % 50 ? make::quantities(0.01 * i, {{WM_Q_YAW_RATE, 0.0}})
                : make::quantities(0.01 * i, {{WM_Q_VEHICLE_SPEED, i < 50    ? 1.0
                                                                   : i < 100 ? 2.0
                                                                             : 3.0},
                                              {WM_Q_YAW_RATE, 0.0}}));
  }
  advance(1.001);
  // Its habit is not known before its second sample: overdue from 0.25 to 0.5 s.
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2.0 * 0.5 * 0.5 / 12.0 + 0.25 * 0.25 * 0.25 * 0.25 * 0.25, way_var);
}

// The counts of so many steps of 20 ms at 1 m/s.
double counts_of(int steps) { return 0.02 / kTick * steps; }

// A second of driving straight on, by counts and a gyro.
void drive_a_second(int model) {
  start(make::two_wheels(), model);
  for (int i = 0; i <= 50; i++) {
    gyro(0.02 * i, 0.0);
    ticks(0.02 * i, counts_of(i), counts_of(i));
  }
}

// A second of silence. Nobody looked meanwhile: the counts bring all of the way at its end; only the gyro's turn is
// unknown. The pose went through it without them, corrected by what was seen: they don't move it once more.
TEST(test_counts_after_a_silence) {
  for (int model : {WM_MOTION_TICKS, WM_MOTION_SPEED_YAW_RATE})
    for (int looked = 0; looked < 2; looked++)
      for (int gyro_first = 0; gyro_first < 2; gyro_first++) {
        drive_a_second(model);
        const double still_var = turn_var;
        if (looked) advance(4.97);
        const double before_m = pose.x_m;
        if (looked) TEST_ASSERT_GREATER_THAN_DOUBLE(0.5, way_var);
        if (gyro_first) gyro(4.98, 0.0);
        for (int i = 250; i <= 300; i++) {
          ticks(0.02 * i, counts_of(i), counts_of(i));
          gyro(0.02 * i + 0.01, 0.0);
        }
        TEST_ASSERT_DOUBLE_WITHIN(looked ? 0.04 : 1e-9, looked ? before_m + 1.04 : 6.01, pose.x_m);
        if (looked || model != WM_MOTION_TICKS) TEST_ASSERT_GREATER_THAN_DOUBLE(0.25, turn_var - still_var);
        if (!looked && !gyro_first) TEST_ASSERT_LESS_THAN_DOUBLE(0.05, way_var);
      }
}

// Counts that may have wrapped in a silence of 10 s: the robot may be anywhere that it could have driven to. What
// follows counts as ever, and nothing of the silence comes with it.
TEST(test_counts_that_may_have_wrapped) {
  for (int model : {WM_MOTION_TICKS, WM_MOTION_SPEED_YAW_RATE})
    for (int looked = 0; looked < 2; looked++) {
      drive_a_second(model);
      if (looked) advance(10.97);
      wm_event e = make::quantities(11.0, {{WM_Q_WHEEL_TICKS_LEFT, 1234.0}, {WM_Q_WHEEL_TICKS_RIGHT, 9876.0}});
      e.as.quantities.doubt = WM_DOUBT_COUNTS_WRAPPED;
      feed(e);
      TEST_ASSERT_FALSE(front.counted());
      TEST_ASSERT_DOUBLE_WITHIN(0.05, 3.0, pose.x_m);  // held for 2 s, then it stands
      TEST_ASSERT_GREATER_THAN_DOUBLE(8.0 * 8.0, way_var);
      TEST_ASSERT_GREATER_THAN_DOUBLE(8.0 * 8.0, side_var);
      TEST_ASSERT_GREATER_THAN_DOUBLE(1.2, turn_var);
      const double x_m = pose.x_m, heading_rad = pose.heading_rad, before_m2 = way_var;
      for (int i = 1; i <= 50; i++) {
        ticks(11.0 + 0.02 * i, 1234.0 + counts_of(i), 9876.0 + counts_of(i));
        gyro(11.0 + 0.02 * i, 0.0);
      }
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, x_m + 1.0, pose.x_m);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, heading_rad, pose.heading_rad);
      TEST_ASSERT_LESS_THAN_DOUBLE(0.1, way_var - before_m2);
      TEST_ASSERT_EQUAL_UINT32(0, front.health());
    }
}

TEST(test_standing_still_shows_the_gyros_bias_and_holds_the_heading) {
  start(make::car());
  double rate;
  speed_and_gyro(0, 0.0, 0.01);
  TEST_ASSERT_FALSE(front.standstill_yaw_rate(&rate));
  speed_and_gyro(1, 0.0, 0.012);
  TEST_ASSERT_TRUE(front.standstill_yaw_rate(&rate));
  TEST_ASSERT_EQUAL_DOUBLE(0.012, rate);
  const double heading = pose.heading_rad;
  speed_and_gyro(2, 0.0, 0.01);
  TEST_ASSERT_EQUAL_DOUBLE(heading, pose.heading_rad);
  speed_and_gyro(2.1, 0.5, 0.01);
  TEST_ASSERT_FALSE(front.standstill_yaw_rate(&rate));
}

// A velocity that is the estimator's state holds without an end; each second has the noise of its walk alone.
TEST(test_a_velocity_as_a_state_is_never_overdue) {
  start(make::no_wheels(), WM_MOTION_CONSTANT_VELOCITY);
  front.set_now(0);
  front.set_velocity({0.5, 0.0, 0.0});
  for (int i = 1; i <= 30; i++) advance(i);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 15.0, pose.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, params.velocity_speed_walk * params.velocity_speed_walk * 30 / 3.0, way_var);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, params.velocity_turn_walk * params.velocity_turn_walk * 30 / 3.0, turn_var);
}

TEST(test_a_dead_encoder_is_noticed_and_not_taken_for_a_turn) {
  start(make::car());
  const double metre = 1000 / (2 * M_PI * 0.3);
  for (int i = 0; i <= 50; i++) ticks(0.1 * i, 0.2 * metre * i, 0.2 * metre * i);
  TEST_ASSERT_EQUAL_UINT32(0, front.health());
  for (int i = 51; i <= 100; i++) ticks(0.1 * i, 0.2 * metre * 50, 0.2 * metre * i);
  TEST_ASSERT_EQUAL_UINT32(WM_MOTION_HEALTH_ENCODER_LEFT_DEAD, front.health());
  const double heading = pose.heading_rad, x = pose.x_m;
  const double before = turn_var;
  for (int i = 101; i <= 150; i++) ticks(0.1 * i, 0.2 * metre * 50, 0.2 * metre * i);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, heading, pose.heading_rad);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.1, turn_var - before);
  TEST_ASSERT_GREATER_THAN_DOUBLE(x + 5, x + 10 * cos(heading) + 1);
  for (int i = 151; i <= 160; i++) ticks(0.1 * i, 0.2 * metre * (i - 100), 0.2 * metre * i);
  TEST_ASSERT_EQUAL_UINT32(0, front.health());
}

TEST(test_a_frozen_counter_is_doubt_not_standstill) {
  start(make::car());
  double rate;
  for (int i = 0; i < 10; i++) speed_and_gyro(0.1 * i, 5.0, 0.0);
  const double before = way_var;
  for (int i = 10; i < 20; i++) {
    wm_event e = make::quantities(0.1 * i, {{WM_Q_VEHICLE_SPEED, 0.0}, {WM_Q_YAW_RATE, 0.0}});
    e.as.quantities.doubt = WM_DOUBT_FROZEN_COUNTER;
    feed(e);
    TEST_ASSERT_FALSE(front.standstill_yaw_rate(&rate));
  }
  TEST_ASSERT_TRUE(has_health(WM_MOTION_HEALTH_COUNTER_FROZEN));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 5.0 * 1.9, pose.x_m);
  TEST_ASSERT_GREATER_THAN_DOUBLE(10.0, way_var - before);
  speed_and_gyro(2.0, 5.0, 0.0);
  TEST_ASSERT_EQUAL_UINT32(0, front.health());
}

// GIVEN a car at 3 m/s WHEN 138 m/s come for 0.2 s THEN its speed holds, with noise of what it may have done meanwhile.
TEST(test_a_speed_that_no_robot_reaches_is_refused) {
  start(make::no_wheels());
  for (int i = 0; i <= 40; i++) feed(make::twist(0.025 * i, 3.0, 0.1));
  TEST_ASSERT_EQUAL_UINT32(0, front.health());
  const double before = way_var;
  for (int i = 41; i <= 48; i++) feed(make::twist(0.025 * i, 138.0, 0.1));
  TEST_ASSERT_EQUAL_UINT32(WM_MOTION_HEALTH_IMPLAUSIBLE, front.health());
  for (int i = 49; i <= 80; i++) feed(make::twist(0.025 * i, 3.0, 0.1));
  const wm::arc a = wm::make_arc(6.0, 0.2);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, a.x_m, pose.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.2, pose.heading_rad);
  const double physical_m = 0.5 * 15.0 * 0.2 * 0.2 / std::sqrt(3.0);
  TEST_ASSERT_GREATER_THAN_DOUBLE(physical_m * physical_m, way_var - before);
  TEST_ASSERT_LESS_THAN_DOUBLE(4.0, way_var - before);
  for (int i = 81; i <= 300; i++) feed(make::twist(0.025 * i, 3.0, 0.1));
  TEST_ASSERT_EQUAL_UINT32(0, front.health());
}

// GIVEN a speed that was refused WHEN it falls silent while the gyro goes on THEN it is silent, as without the refusal:
// the noise of what the robot may have done since the last plausible sample has an end.
TEST(test_a_refused_speed_that_falls_silent_is_silent) {
  double held[2], grown[2];
  for (const bool wrong : {false, true}) {
    start(make::no_wheels());
    for (int i = 0; i <= 50; i++) speed_and_gyro(0.02 * i, 3.0, 0.1);
    if (wrong) speed(1.01, 138.0);
    double before = 0.0;
    for (int i = 51; i <= 300; i++) {
      gyro(0.02 * i, 0.1);
      if (i == 60) held[wrong] = way_var;
      if (i == 200) before = way_var;
    }
    grown[wrong] = way_var - before;
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.01, held[0]);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.5, held[1]);  // m2, after 0.2 s
  TEST_ASSERT_DOUBLE_WITHIN(1e-9 + 1e-6 * grown[0], grown[0], grown[1]);
}

// GIVEN a first sample that is wrong, or a sensor that stays at another level WHEN more samples agree THEN they are
// taken; with the limit off, at once.
TEST(test_samples_that_agree_replace_the_trusted_ones) {
  start(make::no_wheels());
  feed(make::twist(0.0, 138.0, 0.0));
  for (int i = 1; i <= 3; i++) feed(make::twist(0.025 * i, 3.0, 0.0));
  TEST_ASSERT_EQUAL_DOUBLE(3.0, speed_at(0.08));
  for (int i = 4; i <= 80; i++) feed(make::twist(0.025 * i, 3.0, 0.0));
  for (int i = 81; i <= 100; i++) feed(make::twist(0.025 * i, 30.0, 0.0));
  TEST_ASSERT_EQUAL_DOUBLE(3.0, speed_at(2.5));
  for (int i = 101; i <= 122; i++) feed(make::twist(0.025 * i, 30.0, 0.0));
  TEST_ASSERT_EQUAL_DOUBLE(30.0, speed_at(3.06));
  start(make::no_wheels());
  params.limits_mps2 = 0.0;
  feed(make::twist(0.0, 3.0, 0.0));
  feed(make::twist(0.1, 30.0, 0.0));
  TEST_ASSERT_EQUAL_DOUBLE(30.0, speed_at(0.1));
}

// A count is off by a step / sqrt(12): the mean of both wheels' differences over a period, and their difference over
// the track.
TEST(test_noise_of_counts) {
  double speed_mps, turn_radps;
  start(make::two_wheels());
  front.count_noise(&speed_mps, &turn_radps);
  TEST_ASSERT_EQUAL_DOUBLE(0.0, speed_mps);
  for (int i = 0; i <= 50; i++) rolled(0.02 * i, 0.02 * i);
  front.count_noise(&speed_mps, &turn_radps);
  const double expected = kTick / (0.02 * std::sqrt(12.0));
  TEST_ASSERT_DOUBLE_WITHIN(0.01 * expected, expected, speed_mps);
  TEST_ASSERT_DOUBLE_WITHIN(0.02 * expected / 0.5, 2.0 * expected / 0.5, turn_radps);
}

// GIVEN counts each 20 ms WHEN one message's are 0.7 m off THEN they are refused with noise, and nothing of the way is
// lost; so, too, with a gyro. A jump of one wheel refuses the message's other one.
TEST(test_a_wrong_count_is_refused) {
  for (bool has_gyro : {false, true}) {
    start(make::two_wheels());
    double before = 0.0;
    for (int i = 0; i <= 50; i++) {
      if (has_gyro) gyro(0.02 * i - 1e-3, 0.0);
      if (i == 40) before = way_var;
      ticks(0.02 * i, counts_of(i), counts_of(i) + (i == 40 ? 0.7 / kTick : 0.0));
      if (i == 40) TEST_ASSERT_EQUAL_UINT32(WM_MOTION_HEALTH_IMPLAUSIBLE, front.health());
      if (i > 30) TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.02 * i, pose.x_m);
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, pose.heading_rad);
    }
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.05 * 0.05, way_var - before);
  }
}

// GIVEN a controller that restarts WHEN its counts go on from elsewhere THEN these are taken after a tenth of a second,
// and the robot drove on meanwhile.
TEST(test_counts_that_go_on_from_elsewhere_are_a_new_start) {
  start(make::two_wheels());
  for (int i = 0; i <= 100; i++) rolled(0.02 * i, 0.02 * (i - (i >= 50 ? 50 : 0)));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 2.0, pose.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.0, speed_at(2.0));
}

// GIVEN counts each 20 ms WHEN a message's counter claims that frames were lost THEN its jump of 6 cm is
// refused where it comes too early for that. A bus that hands on every other frame is no doubt, nor is a good count
// whose stamp is late.
TEST(test_a_counter_that_contradicts_the_stamp_is_doubt) {
  const auto count_at = [](double t_s, double way_m, int lost) {  // both wheels
    wm_event e =
        make::quantities(t_s, {{WM_Q_WHEEL_TICKS_LEFT, way_m / kTick}, {WM_Q_WHEEL_TICKS_RIGHT, way_m / kTick}});
    e.as.quantities.lost_before = (uint16_t)lost;
    feed(e);
  };
  for (int lost : {0, 1, 99}) {
    start(make::two_wheels());
    for (int i = 0; i <= 50; i++) {
      count_at(0.02 * i, 0.02 * i + (i == 40 ? 0.06 : 0.0), i == 40 ? lost : 0);
      if (i == 40) TEST_ASSERT_DOUBLE_WITHIN(1e-6, lost ? 0.8 : 0.86, pose.x_m);
      if (i == 40) TEST_ASSERT_EQUAL_UINT32(lost ? WM_MOTION_HEALTH_IMPLAUSIBLE : 0u, front.health());
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.0, pose.x_m);
  }
  start(make::two_wheels());
  for (int i = 0; i <= 50; i++) count_at(0.04 * i, 0.04 * i, i > 0);
  TEST_ASSERT_EQUAL_UINT32(0, front.health());
  start(make::two_wheels());
  for (int i = 0; i <= 41; i++)  // the frame before 41 is lost, and the one before that came late
    if (i != 40) count_at(0.02 * (i == 39 ? 39.7 : i), 0.02 * i, i == 41);
  TEST_ASSERT_EQUAL_UINT32(0, front.health());
}

TEST(test_a_stuck_yaw_rate_is_noticed_where_the_steering_turns) {
  start(make::car());
  for (int i = 0; i <= 60; i++)
    feed(make::quantities(0.1 * i, {{WM_Q_VEHICLE_SPEED, 5.0}, {WM_Q_YAW_RATE, 0.01}, {WM_Q_ROAD_WHEEL, 0.004 * i}}));
  TEST_ASSERT_TRUE(has_health(WM_MOTION_HEALTH_YAW_RATE_STUCK));
  speed_and_gyro(6.1, 5.0, 0.3);
  TEST_ASSERT_EQUAL_UINT32(0, front.health());
}

}  // namespace
