// SPDX-License-Identifier: Apache-2.0
// The motion front end's bounds and choices, gone through as tables: the limit of every quantity, which part of the
// motion a refused sensor leaves open, which source gives the speed, the steering's table, how far off the plane is
// off, which samples follow others.
#include <vector>

#include "motion/event_time.hpp"
#include "motion/plausibility.hpp"
#include "motion_fixture.hpp"

namespace {

double just_beyond(double value) { return value * (1.0 + 1e-12); }

// Each value up to its limit, of either sign, is taken; beyond it, or where it is no number, it is not.
TEST(test_every_quantity_has_its_limit) {
  const struct {
    std::vector<wm_quantity> of;
    double limit;
  } rows[] = {{{WM_Q_WHEEL_TICKS_LEFT, WM_Q_WHEEL_TICKS_RIGHT}, 1e15},
              {{WM_Q_ROLL_RATE, WM_Q_PITCH_RATE, WM_Q_YAW_RATE}, 50.0},
              {{WM_Q_ACCELERATION_X, WM_Q_ACCELERATION_Y, WM_Q_ACCELERATION_Z}, 2000.0},
              {{WM_Q_STEERING_WHEEL, WM_Q_ROAD_WHEEL}, 200.0},
              {{WM_Q_STEERING_ACTUATOR}, 10.0},
              {{WM_Q_GEAR}, 1.0},
              {{WM_Q_VEHICLE_SPEED, WM_Q_WHEEL_SPEED_FRONT_LEFT, WM_Q_WHEEL_SPEED_FRONT_RIGHT,
                WM_Q_WHEEL_SPEED_REAR_LEFT, WM_Q_WHEEL_SPEED_REAR_RIGHT},
               150.0}};
  start(make::car());
  int checked = 0;
  for (const auto &row : rows)
    for (const wm_quantity id : row.of) {
      for (const double sign : {-1.0, 1.0}) {
        TEST_ASSERT_EQUAL(WM_OK, front.check(make::quantities(0, {{id, sign * row.limit}})));
        TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, front.check(make::quantities(0, {{id, sign * just_beyond(row.limit)}})));
      }
      TEST_ASSERT_EQUAL(WM_NOT_FINITE, front.check(make::quantities(0, {{WM_Q_GEAR, 0.0}, {id, NAN}})));
      TEST_ASSERT_EQUAL(WM_NOT_FINITE, front.check(make::quantities(0, {{id, INFINITY}, {WM_Q_GEAR, 0.0}})));
      checked++;
    }
  TEST_ASSERT_EQUAL(WM_Q_COUNT, checked);
  wm_event unknown = make::quantities(0, {{WM_Q_GEAR, 0.0}});
  unknown.as.quantities.id[0] = WM_Q_COUNT;
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, front.check(unknown));
  unknown.as.quantities.count = WM_QUANTITIES_MAX + 1;
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, front.check(unknown));
}

TEST(test_every_part_of_a_twist_has_its_limit) {
  start(make::no_wheels());
  for (const double sign : {-1.0, 1.0}) {
    TEST_ASSERT_EQUAL(WM_OK, front.check(make::twist(0, sign * 150.0, -sign * 50.0)));
    TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, front.check(make::twist(0, sign * just_beyond(150.0), 0)));
    TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, front.check(make::twist(0, 0, sign * just_beyond(50.0))));
  }
  for (int part = 0; part < 6; part++) {
    wm_event e = make::twist6(0, 0, 0, 0);
    double &value = part < 3 ? e.as.twist6.v_mps[part] : e.as.twist6.w_radps[part - 3];
    const double limit = part < 3 ? 150.0 : 50.0;
    value = -limit;
    TEST_ASSERT_EQUAL(WM_OK, front.check(e));
    value = just_beyond(limit);
    TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, front.check(e));
    value = NAN;
    TEST_ASSERT_EQUAL(WM_NOT_FINITE, front.check(e));
  }
}

// Stamps beyond 2^62 ns are absurd; before the present time they run back; an increment lasts.
TEST(test_stamps_and_increments_that_can_not_be) {
  start(make::no_wheels());
  wm_event e = make::twist(0, 0, 0);
  for (const wm_time_ns sign : {-1, 1}) {
    e.t_ns = sign * wm::kMaxTime;
    TEST_ASSERT_EQUAL(WM_OK, front.check(e));
    e.t_ns += sign;
    TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, front.check(e));
  }
  const double exact[6] = {1e-4, 0, 1e-4, 0, 0, 1e-4};
  wm_event step = make::increment(1.0, 2.0, {0.1, 0.2, 0.3}, exact);
  step.as.increment.from_ns = step.t_ns - 1;
  step.as.increment.dx_m = step.as.increment.dy_m = 0.0;
  TEST_ASSERT_EQUAL(WM_OK, front.check(step));
  step.as.increment.from_ns = step.t_ns;
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, front.check(step));
  step.as.increment.from_ns = -wm::kMaxTime - 1;
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, front.check(step));
  const double c = 90.0, s = 120.0;  // 150 m in a second
  TEST_ASSERT_EQUAL(WM_OK, front.check(make::increment(1.0, 2.0, {c, -s, -3.14159}, exact)));
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, front.check(make::increment(1.0, 2.0, {c, 1.001 * s, 0.0}, exact)));
  TEST_ASSERT_EQUAL(WM_OUT_OF_RANGE, front.check(make::increment(1.0, 2.0, {0, 0, -3.1416}, exact)));
  for (int i = 0; i < 6; i++) {
    double bad[6] = {1e-4, 0, 1e-4, 0, 0, 1e-4};
    bad[i] = i ? static_cast<double>(NAN) : static_cast<double>(INFINITY);
    TEST_ASSERT_EQUAL(WM_NOT_FINITE, front.check(make::increment(1.0, 2.0, {0.1, 0, 0}, bad)));
  }
  feed(make::twist(3.0, 0, 0));
  TEST_ASSERT_EQUAL(WM_OK, front.check(make::twist(3.0, 0, 0)));
  TEST_ASSERT_EQUAL(WM_TIME_RAN_BACK, front.check(make::twist(2.999, 0, 0)));
}

// The variance that half a second with refused samples of a sensor adds to way and turn, and health.
struct opened {
  double way, turn;
};
template <class Good, class Bad>
void check_refusal(const char *what, int model, const wm_wheels &w, Good good, Bad bad, bool opens_way,
                   bool opens_turn) {
  opened by[2];
  for (const bool refused : {false, true}) {
    start(w, model);
    const auto feed_all = [](const std::vector<wm_event> &events) {
      for (const wm_event &e : events) feed(e);
    };
    for (int i = 0; i <= 100; i++) feed_all(good(0.02 * i, i));
    const opened before = {way_var, turn_var};
    for (int i = 101; i <= 110; i++) feed_all(refused ? bad(0.02 * i, i) : good(0.02 * i, i));
    by[refused] = {way_var - before.way, turn_var - before.turn};
    TEST_ASSERT_EQUAL_MESSAGE(refused, has_health(WM_MOTION_HEALTH_IMPLAUSIBLE), what);
    // From the first good sample on the noise is that of a good drive again.
    feed_all(good(0.02 * 111, 111));
    const opened again = {way_var, turn_var};
    for (int i = 112; i <= 121; i++) feed_all(good(0.02 * i, i));
    if (refused) {
      TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(2.0 * by[0].way + 1e-9, way_var - again.way, what);
      TEST_ASSERT_LESS_THAN_DOUBLE_MESSAGE(2.0 * by[0].turn + 1e-9, turn_var - again.turn, what);
    }
  }
  TEST_ASSERT_EQUAL_MESSAGE(opens_way, by[1].way > by[0].way + 1e-3, what);
  TEST_ASSERT_EQUAL_MESSAGE(opens_turn, by[1].turn > by[0].turn + 1e-3, what);
}

// GIVEN a sensor whose samples jump WHEN they are refused THEN the part of the motion that it measures is open until
// the next good one, and no other part.
TEST(test_a_refused_sensor_leaves_its_own_part_open) {
  const auto car = [](double v, double w) {
    return [v, w](double t_s, int i) {
      return std::vector<wm_event>{make::quantities(t_s, {{WM_Q_VEHICLE_SPEED, v}}),
                                   make::quantities(t_s + 0.005, {{WM_Q_YAW_RATE, w + (i % 2 ? 1e-4 : 0.0)}})};
    };
  };
  check_refusal("speed", WM_MOTION_SPEED_YAW_RATE, make::car(), car(2.0, 0.1), car(90.0, 0.1), true, false);
  check_refusal("yaw rate", WM_MOTION_SPEED_YAW_RATE, make::car(), car(2.0, 0.1), car(2.0, 40.0), false, true);
  const auto twist = [](double v, double w) {
    return [v, w](double t_s, int i) { return std::vector<wm_event>{make::twist(t_s, v + (i % 2 ? 1e-3 : 0.0), w)}; };
  };
  check_refusal("twist's speed", WM_MOTION_TWIST, make::no_wheels(), twist(1.0, 0.1), twist(90.0, 0.1), true, true);
  check_refusal("twist's turn", WM_MOTION_TWIST, make::no_wheels(), twist(1.0, 0.1), twist(1.0, 40.0), true, true);
  const auto counts = [](double jump_m) {
    return [jump_m](double t_s, int i) {
      const double way_m = 0.02 * i + (i % 2 ? jump_m : -jump_m);
      return std::vector<wm_event>{
          make::quantities(t_s, {{WM_Q_WHEEL_TICKS_LEFT, way_m / kTick}, {WM_Q_WHEEL_TICKS_RIGHT, 0.02 * i / kTick}})};
    };
  };
  check_refusal("counts", WM_MOTION_TICKS, make::two_wheels(), counts(0.0), counts(3.0), true, true);
}

// GIVEN a good sample half a second ago WHEN the next one differs by a little less than a robot can change in that
// time, or by a little more THEN it is taken, or refused: 3 m/s and 15 m/s2, 6 rad/s and 30 rad/s2, for each sensor.
TEST(test_each_sensor_follows_within_its_limits) {
  const auto of = [](int sensor, double t_s, double value) {
    if (sensor == 0) return make::quantities(t_s, {{WM_Q_VEHICLE_SPEED, value}, {WM_Q_YAW_RATE, 0.0}});
    if (sensor == 1) return make::quantities(t_s, {{WM_Q_VEHICLE_SPEED, 0.0}, {WM_Q_YAW_RATE, value}});
    if (sensor == 2) return make::twist(t_s, value, 0.0);
    if (sensor == 3) return make::twist(t_s, 0.0, value);
    return make::twist6(t_s, 0.0, value, 0.0);
  };
  for (int sensor = 0; sensor < 5; sensor++)
    for (const double share : {0.99, -0.99, 1.01, -1.01}) {
      start(make::car(), sensor < 2 ? int{WM_MOTION_SPEED_YAW_RATE} : int{WM_MOTION_TWIST});
      const bool turns = sensor == 1 || sensor == 3;
      const double limit = turns ? 6.0 + 30.0 * 0.5 : 3.0 + 15.0 * 0.5;
      feed(of(sensor, 0.0, 0.0));
      feed(of(sensor, 0.5, 0.0));
      feed(of(sensor, 1.0, share * limit));
      TEST_ASSERT_EQUAL(std::fabs(share) > 1.0, has_health(WM_MOTION_HEALTH_IMPLAUSIBLE));
    }
}

// While samples are refused the robot may have accelerated since the last good one: 15 m/s2, evenly distributed,
// (15^2 / 12) t^4, and the speed itself is not known.
TEST(test_a_refusal_counts_from_the_last_good_sample) {
  for (const bool refused : {false, true}) {
    start(make::car(), WM_MOTION_SPEED_YAW_RATE);
    params.noise_speed_mps = params.noise_speed_rel = 0.0;
    for (int i = 0; i <= 10; i++) speed_and_gyro(0.1 * i, 2.0, 0.0);
    const double before = way_var;
    for (int i = 11; i <= 13; i++) speed_and_gyro(0.1 * i, refused ? 120.0 : 2.0, 0.0);
    // The first refusal is known at its stamp, 0.1 s after the good one; until 0.3 s the noise is open.
    const double expected = 225.0 / 12.0 * (std::pow(0.3, 4) - std::pow(0.1, 4)) + 4.0 * 0.2;
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, refused ? expected : 0.0, way_var - before);
  }
}

// The counter shows a lost frame. The next one comes after two periods: counter and stamp agree, and its jump of 6 cm
// is accepted. After one period it is refused.
TEST(test_a_lost_frame_is_no_doubt_where_the_stamp_agrees) {
  for (const bool agrees : {true, false}) {
    start(make::two_wheels());
    for (int i = 0; i <= 45; i++) {
      if (agrees && i == 40) continue;
      const double count = (0.02 * i + (i > 40 ? 0.06 : 0.0)) / kTick;
      wm_event e = make::quantities(0.02 * i, {{WM_Q_WHEEL_TICKS_LEFT, count}, {WM_Q_WHEEL_TICKS_RIGHT, count}});
      e.as.quantities.lost_before = i == 41;
      feed(e);
      if (i == 41) TEST_ASSERT_EQUAL(!agrees, has_health(WM_MOTION_HEALTH_IMPLAUSIBLE));
    }
  }
}

// Beside a gyro and beside a steering the counts give the distance, too: as positions, whatever comes between them.
TEST(test_counts_beside_a_gyro_or_a_steering_are_positions) {
  constexpr double kCarTick_m = 2 * M_PI * 0.3 / 1000;
  const int models[] = {WM_MOTION_SPEED_YAW_RATE, WM_MOTION_ACKERMANN};
  for (const int model : models) {
    start(make::car(), model);
    double way_m = 0.0;
    for (int i = 0; i <= 100; i++) {
      if (i % 3 == 1) advance(0.02 * i - 0.007);
      if (i > 0) way_m += 0.01 + 0.008 * std::sin(i);
      feed(make::quantities(0.02 * i, {{WM_Q_ROAD_WHEEL, 0.0},
                                       {WM_Q_YAW_RATE, 1e-9 * (i % 2)},
                                       {WM_Q_WHEEL_TICKS_LEFT, way_m / kCarTick_m},
                                       {WM_Q_WHEEL_TICKS_RIGHT, way_m / kCarTick_m}}));
    }
    TEST_ASSERT_EQUAL(model, front.model());
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, way_m, pose.x_m);
  }
}

// A silent part is reported for sources that have parts. Increments and a velocity as a state have none.
TEST(test_which_models_can_be_silent) {
  const double exact[6] = {1e-4, 0, 1e-4, 0, 0, 1e-4};
  const int models[] = {WM_MOTION_AUTO, WM_MOTION_INCREMENTS, WM_MOTION_CONSTANT_VELOCITY, WM_MOTION_SPEED_YAW_RATE};
  for (const int model : models) {
    start(make::no_wheels(), model);
    for (int i = 0; i <= 50; i++) speed_and_gyro(0.02 * i, 1.0, 0.0);
    for (int i = 1; i <= 10; i++) feed(make::increment(0.9 + 0.2 * i, 1.1 + 0.2 * i, {0.2, 0, 0}, exact));
    if (model == WM_MOTION_AUTO) TEST_ASSERT_EQUAL(WM_MOTION_INCREMENTS, front.model());
    const bool has_parts = model == WM_MOTION_SPEED_YAW_RATE;
    TEST_ASSERT_EQUAL(has_parts, has_health(WM_MOTION_HEALTH_TURN_SILENT));
    TEST_ASSERT_EQUAL(has_parts, has_health(WM_MOTION_HEALTH_SPEED_SILENT));
  }
}

// Without limits nothing is refused.
TEST(test_without_limits_nothing_is_refused) {
  start(make::two_wheels());
  params.limits_mps2 = params.limits_radps2 = 0.0;
  for (int i = 0; i <= 50; i++) {
    rolled(0.02 * i, 0.02 * i + (i == 40 ? 0.7 : 0.0));
    TEST_ASSERT_EQUAL_UINT32(0, front.health());
  }
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.0, pose.x_m);
}

// A base that stands shows the bias of its twists' turn rate; one that turns on the spot, or creeps, does not stand.
TEST(test_when_twists_stand) {
  const struct {
    double v, u, w;
    bool stands;
  } rows[] = {{0.0, 0.0, 0.4, true},
              {0.4, 0.0, 0.4, true},
              {0.0, 0.0, 1.5, false},
              {1.5, 0.0, 0.4, false},
              {0.0, 1.5, 0.4, false}};
  for (const auto &row : rows) {
    start(make::no_wheels(), WM_MOTION_TWIST);
    params.twist = WM_TWIST_MEASURED;
    double rate = 0.0;
    for (int i = 0; i <= 50; i++)
      feed(make::twist6(0.1 * i, row.v * params.standstill_speed_mps, row.u * params.standstill_speed_mps,
                        row.w * params.standstill_yaw_rate_radps));
    TEST_ASSERT_EQUAL(row.stands, front.standstill_yaw_rate(&rate));
    if (row.stands) TEST_ASSERT_EQUAL_DOUBLE(row.w * params.standstill_yaw_rate_radps, rate);
  }
}

// The wheel of a dead encoder rolls like the other one, from the last count on, too.
TEST(test_a_dead_encoders_wheel_rolls_like_the_other_one) {
  for (const bool left_is_dead : {false, true}) {
    start(make::two_wheels(), WM_MOTION_TICKS);
    for (int i = 0; i <= 1000; i++) {
      const double count = 0.02 * i / kTick, dead = 0.02 * std::fmin(i, 100.0) / kTick;
      ticks(0.02 * i, left_is_dead ? dead : count, left_is_dead ? count : dead);
    }
    TEST_ASSERT_EQUAL_UINT32(left_is_dead ? WM_MOTION_HEALTH_ENCODER_LEFT_DEAD : WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD,
                             front.health());
    const wm::motion_twist t = front.twist_at(make::at(20.0), calibration);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.0, t.v);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, t.w);
  }
}

// ── sample_check ────────────────────────────────────────────────────────────────────────────────────────────────────

using wm::plausibility;

// A level may step by so much, and by so much more for each second since the sample before.
TEST(test_levels_follow_within_step_and_rate) {
  for (const double sign : {-1.0, 1.0})
    for (const double dt_s : {0.01, 0.5, 2.0})
      for (const double share : {0.999, 1.001}) {
        wm::sample_check check{};
        TEST_ASSERT_EQUAL(plausibility::plausible, check.check_level(0, 5.0, 3.0, 15.0));
        const double to = 5.0 + sign * share * (3.0 + 15.0 * dt_s);
        TEST_ASSERT_EQUAL(share < 1.0 ? plausibility::plausible : plausibility::refused,
                          check.check_level(make::at(dt_s), to, 3.0, 15.0));
      }
}

// Another level is taken after a second of three samples that follow each other; at once, if they are more than those
// that were trusted. A sample that follows the trusted ones, or none, ends it.
TEST(test_another_level_replaces_the_trusted_one) {
  const auto until_taken = [](int trusted, double each_s, bool interrupted, bool scattered) {
    wm::sample_check check{};
    for (int i = 0; i < trusted; i++) (void)check.check_level(make::at(0.01 * i), 0.0, 3.0, 0.0);
    for (int i = 1; i < 100; i++) {
      const wm_time_ns t_ns = make::at(10.0 + each_s * i);
      if (interrupted && i == 5) TEST_ASSERT_EQUAL(plausibility::plausible, check.check_level(t_ns, 0.1, 3.0, 0.0));
      const plausibility out = check.check_level(t_ns, scattered ? 50.0 * i : 50.0, 3.0, 0.0);
      if (out == plausibility::refused) continue;
      TEST_ASSERT_EQUAL(plausibility::new_run, out);
      TEST_ASSERT_EQUAL(plausibility::plausible, check.check_level(t_ns, scattered ? 50.0 * i : 50.0, 3.0, 0.0));
      return i;
    }
    return 0;
  };
  TEST_ASSERT_EQUAL(11, until_taken(50, 0.1, false, false));  // a second since the first of them
  TEST_ASSERT_EQUAL(3, until_taken(50, 0.6, false, false));   // three samples
  TEST_ASSERT_EQUAL(15, until_taken(50, 0.1, true, false));   // from the fifth on anew
  TEST_ASSERT_EQUAL(0, until_taken(50, 0.1, false, true));
  TEST_ASSERT_EQUAL(5, until_taken(4, 0.001, false, false));  // five against four
  TEST_ASSERT_EQUAL(2, until_taken(1, 0.001, false, false));
}

// A count goes on by its speed so far; from one period to the next it may differ by (3 m/s + 15 m/s2 dt) dt, by a
// period's error of the stamps, and by two ticks. The second count may be anywhere that 150 m/s reach.
TEST(test_positions_follow_their_speed) {
  for (const double sign : {-1.0, 1.0})
    for (const double bound : {1.0, 0.2})
      for (const double share : {0.999, 1.001}) {
        const double period_s = 0.02, tick_m = 0.001, speed_mps = 4.0;
        wm::sample_check check{};
        const auto count = [&](double t_s, double m) {
          return check.check_position(make::at(t_s), m, 15.0, period_s, tick_m, bound);
        };
        TEST_ASSERT_EQUAL(plausibility::plausible, count(0.0, 1.0));
        TEST_ASSERT_EQUAL(plausibility::plausible, count(0.02, 1.0 + speed_mps * 0.02));
        const double beyond_m = bound * (3.0 + 15.0 * 0.02) * 0.02 + period_s * speed_mps + 2.0 * tick_m;
        TEST_ASSERT_EQUAL(share < 1.0 ? plausibility::plausible : plausibility::refused,
                          count(0.04, 1.0 + speed_mps * 0.04 + sign * share * beyond_m));
        wm::sample_check second{};
        (void)second.check_position(0, 1.0, 15.0, period_s, tick_m, bound);
        TEST_ASSERT_EQUAL(
            share < 1.0 ? plausibility::plausible : plausibility::refused,
            second.check_position(make::at(0.02), 1.0 + sign * share * 3.0, 15.0, period_s, tick_m, bound));
        // In a burst a count has the time of a period: the speed of its own stamp would be 40 m/s.
        wm::sample_check burst{};
        (void)burst.check_position(0, 0.0, 15.0, period_s, tick_m, bound);
        (void)burst.check_position(make::at(0.02), 0.08, 15.0, period_s, tick_m, bound);
        (void)burst.check_position(make::at(0.022), 0.16, 15.0, period_s, tick_m, bound);
        TEST_ASSERT_EQUAL(plausibility::plausible,
                          burst.check_position(make::at(0.042), 0.24, 15.0, period_s, tick_m, bound));
      }
}

// Counts that go on from elsewhere are taken after a tenth of a second.
TEST(test_positions_from_elsewhere_are_a_new_run) {
  wm::sample_check check{};
  int taken = 0;
  for (int i = 0; i < 100 && taken == 0; i++) {
    const double m = 0.02 * i + (i >= 50 ? 700.0 : 0.0);
    const plausibility out = check.check_position(make::at(0.02 * i), m, 15.0, 0.02, 0.001, 1.0);
    TEST_ASSERT_EQUAL(i < 50, out == plausibility::plausible);
    if (out == plausibility::new_run) taken = i;
  }
  TEST_ASSERT_EQUAL(55, taken);
}

// ── choices ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// The rear wheels' mean, then the dashboard's, then the front wheels'; one wheel alone stands for both.
TEST(test_the_source_of_the_speed) {
  const std::pair<wm_quantity, double> rear_left = {WM_Q_WHEEL_SPEED_REAR_LEFT, 1.0},
                                       rear_right = {WM_Q_WHEEL_SPEED_REAR_RIGHT, 2.0},
                                       dash = {WM_Q_VEHICLE_SPEED, 4.0}, left = {WM_Q_WHEEL_SPEED_FRONT_LEFT, 8.0},
                                       right = {WM_Q_WHEEL_SPEED_FRONT_RIGHT, 9.0}, yaw = {WM_Q_YAW_RATE, 0.0};
  const struct {
    std::initializer_list<std::pair<wm_quantity, double>> given;
    double speed;
  } rows[] = {{{yaw, rear_left, rear_right, dash, left, right}, 1.5},
              {{yaw, rear_left, dash, left}, 1.0},
              {{yaw, rear_right, dash, right}, 2.0},
              {{yaw, dash, left, right}, 4.0},
              {{yaw, left, right}, 8.5},
              {{yaw, left}, 8.0},
              {{yaw, right}, 9.0}};
  for (const auto &row : rows) {
    start(make::car());
    feed(make::quantities(0.0, row.given));
    TEST_ASSERT_EQUAL_DOUBLE(row.speed, front.twist_at(0, calibration).v);
  }
}

// Counts of wheels of which radius, ticks or track are not known are no motion.
TEST(test_counts_of_unknown_wheels_are_no_motion) {
  for (int which = 0; which < 6; which++) {
    wm_wheels w = make::two_wheels();
    if (which == 1) w.ticks_per_turn = 0.0;
    if (which == 2) w.ticks_per_turn = -1000.0;
    if (which == 3) w.ticks_per_turn = NAN;
    if (which == 4) w.radius_m = NAN;
    if (which == 5) w.track_m = NAN;
    start(w);
    for (int i = 0; i <= 50; i++) ticks(0.02 * i, 10.0 * i, 10.0 * i);
    TEST_ASSERT_EQUAL(which == 0 ? int{WM_MOTION_TICKS} : int{WM_MOTION_AUTO}, front.model());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, which == 0 ? 500.0 * 2 * M_PI * 0.1 / 1000 : 0.0, pose.x_m);
  }
}

// The road wheel's angle by the actuator's table: straight between two points, held beyond the ends.
TEST(test_the_actuators_table) {
  wm_wheels w = make::car();
  const double x[4] = {-0.02, 0.01, 0.05, 0.1}, y[4] = {-0.5, -0.1, 0.2, 0.6};
  for (const uint32_t points : {2u, 3u, 4u}) {
    w.steering_table_count = points;
    for (uint32_t i = 0; i < 4; i++)
      w.actuator_m[i] = i < points ? x[i] : 1.0, w.road_wheel_rad[i] = i < points ? y[i] : 1.0;
    for (int k = -5; k <= 15; k++) {
      const double at = 0.01 * k + 0.0003;
      double angle = at < x[0] ? y[0] : y[points - 1];
      for (uint32_t i = 0; i + 1 < points; i++)
        if (at >= x[i] && at <= x[i + 1]) angle = y[i] + (y[i + 1] - y[i]) * (at - x[i]) / (x[i + 1] - x[i]);
      start(w, WM_MOTION_ACKERMANN);
      feed(make::quantities(0, {{WM_Q_VEHICLE_SPEED, 2.0}, {WM_Q_STEERING_ACTUATOR, at}}));
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2.0 * std::tan(angle) / 2.5, front.twist_at(0, calibration).w);
    }
  }
  for (const double ratio : {1.0, 15.0})  // beyond 1.5 rad no road wheel is turned
    for (const double angle : {1.49, 1.51, -1.51}) {
      w = make::car();
      w.steering_ratio = ratio;
      start(w, WM_MOTION_ACKERMANN);
      feed(make::quantities(0, {{WM_Q_VEHICLE_SPEED, 2.0}, {WM_Q_STEERING_WHEEL, ratio * angle}}));
      TEST_ASSERT_EQUAL(std::fabs(angle) < 1.5 ? WM_MOTION_ACKERMANN : WM_MOTION_AUTO, front.model());
      start(w, WM_MOTION_ACKERMANN);
      feed(make::quantities(0, {{WM_Q_VEHICLE_SPEED, 2.0}, {WM_Q_ROAD_WHEEL, angle}}));
      TEST_ASSERT_EQUAL(std::fabs(angle) < 1.5 ? WM_MOTION_ACKERMANN : WM_MOTION_AUTO, front.model());
    }
}

// Off the plane: a climb beyond three sigma of the speed's noise, a roll or a pitch beyond three of the turn rate's and
// of a gyro's bias of 0.02 rad/s; for two seconds to one side. A recording's own sigmas take the place of the noise's.
TEST(test_how_far_off_the_plane_is_off) {
  for (const bool stated : {false, true})
    for (int axis = 0; axis < 3; axis++)
      for (const double sign : {-1.0, 1.0})
        for (int how = 0; how < 6; how++) {  // too short, too little, to the other side, interrupted; long enough
          start(make::no_wheels(), WM_MOTION_TWIST);
          wm_rig rig;
          wm_rig_init(&rig);
          if (stated)
            rig.twist6_sigma_v_mps[2] = 0.3, rig.twist6_sigma_w_radps[0] = 0.05, rig.twist6_sigma_w_radps[1] = 0.08;
          params.twist = WM_TWIST_MEASURED;
          params.noise_speed_mps = 0.04, params.noise_speed_rel = 0.03, params.noise_yaw_rate_radps = 0.03;
          front.init(&params, &wheels, &rig);
          const double rise = std::hypot(stated ? 0.3 : 0.04, 0.03 * 1.3);  // at 1.3 m/s
          const double roll = std::hypot(stated ? 0.05 : 0.03, 0.02), pitch = std::hypot(stated ? 0.08 : 0.03, 0.02);
          const double sigma = axis == 0 ? rise : axis == 1 ? roll : pitch;
          const double seconds = how == 0 ? 1.875 : how == 5 ? 2.0 : 2.125, sigmas = how == 1 ? 2.99 : 3.01;
          for (int i = 0; i <= 32; i++) {
            wm_event e = make::twist6(0.125 * i, 1.2, -0.5, 0.0);
            double value = 0.125 * i <= seconds ? sign * sigmas * sigma : 0.0;
            if (how == 2 && i == 10) value = -value;
            if (how == 3 && i == 10) value = 0.0;
            (axis == 0 ? e.as.twist6.v_mps[2] : e.as.twist6.w_radps[axis - 1]) = value;
            feed(e);
          }
          TEST_ASSERT_EQUAL(how >= 4, has_health(WM_MOTION_HEALTH_NOT_PLANAR));
        }
}

// GIVEN samples of one axis that change by 0.4 to and fro WHEN their own noise explains a part of it THEN the rest is
// noise between samples of that axis: (change^2 - 2 own / dt) dt^2 / 12.
TEST(test_the_sampling_noise_is_what_the_own_noise_does_not_explain) {
  for (int axis = 0; axis < 3; axis++) {
    start(make::no_wheels(), WM_MOTION_TWIST);
    params.twist = WM_TWIST_MEASURED;
    params.states.drive = WM_DRIVE_HOLONOMIC;
    params.noise_speed_mps = 0.03, params.noise_sideways_mps = 0.04, params.noise_yaw_rate_radps = 0.05;
    params.noise_speed_rel = 0.2, params.noise_sideways_rel = 0.3, params.noise_yaw_rate_rel = 0.25;
    params.noise_side_rel = params.noise_yaw_rate_per_mps = 0.0;
    front.init(&params, &wheels);
    const double constant[3] = {0.03, 0.04, 0.05}, rel[3] = {0.2, 0.3, 0.25}, dt_s = 0.1;
    double value[3] = {0.7, 0.6, 0.5}, before[3] = {};
    for (int i = 0; i <= 400; i++) {
      value[axis] = i % 2 ? 0.2 : -0.2;
      if (i == 391) before[0] = way_var, before[1] = side_var, before[2] = turn_var;
      feed(make::twist6(dt_s * i, value[0], value[1], value[2]));
    }
    const double grown[3] = {way_var - before[0], side_var - before[1], turn_var - before[2]};
    for (int k = 0; k < 3; k++) {
      const double own = constant[k] * constant[k] + rel[k] * rel[k] * value[k] * value[k];
      const double sampled = k == axis ? (0.16 - 2.0 * own / dt_s) * dt_s * dt_s / 12.0 : 0.0;
      TEST_ASSERT_DOUBLE_WITHIN(1e-6, 10.0 * (own * dt_s + sampled), grown[k]);
    }
  }
}

// The twist of an increment holds until the next one comes, which takes off what was moved by it.
TEST(test_the_twist_of_an_increment_holds_until_the_next) {
  start(make::no_wheels(), WM_MOTION_INCREMENTS);
  const double exact[6] = {1e-4, 0, 1e-4, 0, 0, 1e-4};
  feed(make::increment(0.0, 1.0, {1.0, 0.0, 0.0}, exact));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, pose.x_m);
  advance(1.5);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.5, pose.x_m);
  feed(make::increment(1.0, 2.0, {0.8, 0.0, 0.0}, exact));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.8, pose.x_m);
  advance(2.25);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.0, pose.x_m);
  const wm::motion_twist t = front.twist_at(make::at(2.25), calibration);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.8, t.v);
}

}  // namespace
