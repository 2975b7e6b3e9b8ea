// SPDX-License-Identifier: Apache-2.0
// Dead reckoning as the predictor uses it: exact arcs, a short memory, and a pose carried from then to now.
#include "common/suite.h"
#include "events.hpp"
#include "math/arc.hpp"
#include "math/se2.hpp"
#include "math/se3.hpp"
#include "motion/motion_params.h"
#include "waymark/motion.h"
#include "waymark/random.h"

namespace {

wm_odometry *odom;
wm_motion_params params;
wm_wheels wheels;

void start(const wm_wheels &w) {
  wheels = w;
  make::exact_motion(&params);
  TEST_ASSERT_EQUAL(WM_OK, wm_odometry_init(odom, &params, &wheels));
}

void feed(const wm_event &e) { TEST_ASSERT_EQUAL(WM_OK, wm_odometry_feed(odom, &e)); }

wm_pose2 pose_at(double t_s) {
  wm_odom_point p;
  TEST_ASSERT_EQUAL(WM_OK, wm_odometry_at(odom, make::at(t_s), &p));
  return p.pose_odom_base;
}

void assert_pose(double x, double y, double heading, wm_pose2 p) {
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, x, p.x_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, y, p.y_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, heading, p.heading_rad);
}

// The mean of the two wheels stands. A slow turn is one of ticks that add up.
TEST(test_a_robot_that_turns_on_the_spot_does_not_stand) {
  for (const double rate : {0.05, 1.0}) {
    start(make::two_wheels());
    for (int k = 0; k <= 500; k++) {
      const double t = 0.02 * k, ticks = std::floor(rate * t * 0.25 / (2 * M_PI * 0.1) * 1000);
      feed(make::quantities(t,
                            {{WM_Q_WHEEL_TICKS_LEFT, -ticks}, {WM_Q_WHEEL_TICKS_RIGHT, ticks}, {WM_Q_YAW_RATE, rate}}));
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0, wm::wrap(pose_at(10).heading_rad - 10 * rate));
  }
}

TEST(test_an_estimate_without_a_time_is_carried_nowhere) {
  wm_estimate fused{}, out;
  fused.t_ns = WM_TIME_NONE;
  fused.dof = 3;
  start(make::no_wheels());
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_odometry_carry(odom, &fused, make::at(1), &out, nullptr));
  params.model = WM_MOTION_CONSTANT_VELOCITY;
  TEST_ASSERT_EQUAL(WM_OK, wm_odometry_init(odom, &params, &wheels));
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_odometry_carry(odom, &fused, make::at(1), &out, nullptr));
}

// Each pose of the last second is the one that was the newest at its time, at the stamps of the twists and between
// them, though each twist is another one; so are its twist and its noise.
TEST(test_poses_of_the_past_are_what_they_were) {
  wm_odom_point was[201], between[201];
  for (int i = 0; i <= 200; i++) {
    feed(make::twist6(0.01 * i, 1.0 + 0.3 * sin(i), 0.2 * cos(2 * i), 1.5 * sin(0.7 * i)));
    TEST_ASSERT_EQUAL(WM_OK, wm_odometry_at(odom, make::at(0.01 * i), &was[i]));
    TEST_ASSERT_EQUAL(WM_OK, wm_odometry_at(odom, make::at(0.01 * i + 0.004), &between[i]));
  }
  for (int i = 101; i < 200; i++)
    for (const bool at_stamp : {true, false}) {
      const wm_odom_point &expected = at_stamp ? was[i] : between[i];
      wm_odom_point p;
      TEST_ASSERT_EQUAL(WM_OK, wm_odometry_at(odom, make::at(0.01 * i + (at_stamp ? 0.0 : 0.004)), &p));
      TEST_ASSERT_EQUAL_INT64(expected.t_ns, p.t_ns);
      assert_pose(expected.pose_odom_base.x_m, expected.pose_odom_base.y_m, expected.pose_odom_base.heading_rad,
                  p.pose_odom_base);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, expected.v_mps, p.v_mps);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, expected.side_mps, p.side_mps);
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, expected.w_radps, p.w_radps);
      // Noise grows evenly from one to the next.
      const auto noise = [&](double wm_odom_point::*of) {
        return was[i].*of + (at_stamp ? 0.0 : 0.4) * (was[i + 1].*of - was[i].*of);
      };
      TEST_ASSERT_DOUBLE_WITHIN(1e-10, noise(&wm_odom_point::along_var_m2), p.along_var_m2);
      TEST_ASSERT_DOUBLE_WITHIN(1e-10, noise(&wm_odom_point::across_var_m2), p.across_var_m2);
      TEST_ASSERT_DOUBLE_WITHIN(1e-10, noise(&wm_odom_point::heading_var_rad2), p.heading_var_rad2);
    }
}

// Of a fast bus a second is remembered, too: a point each 4 ms, and the newest event. Each point is found from its own
// time on.
TEST(test_a_second_of_a_fast_bus_is_remembered) {
  wm_pose2 was{};
  for (int i = 0; i <= 400; i++) {
    feed(make::twist(0.001 * i, 1.0 + 0.5 * sin(i), 2.0 * cos(0.6 * i)));
    if (i % 4 == 0) was = pose_at(0.001 * i);
    const wm_pose2 found = pose_at(0.001 * (i - i % 4));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, was.x_m, found.x_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, was.heading_rad, found.heading_rad);
  }
  start(make::no_wheels());
  for (int i = 0; i <= 3000; i++) feed(make::twist(0.001 * i, 1.0, 0.0));
  assert_pose(2.01, 0, 0, pose_at(2.01));
  assert_pose(2.5005, 0, 0, pose_at(2.5005));
}

// The covariance of a carried pose in the plane: J P J' by the start's heading, and noise along and across the way's
// middle heading; a turn's noise is spread evenly over the way. Not `turns`: the way is in the map's axes.
void expect_carried(const wm_estimate &from, const wm_estimate &out, double along, double across, double turn,
                    bool turns = true) {
  const double dx = out.pose_map_base.p_m[0] - from.pose_map_base.p_m[0],
               dy = out.pose_map_base.p_m[1] - from.pose_map_base.p_m[1];
  const double middle = from.heading_rad + 0.5 * (out.heading_rad - from.heading_rad), c = cos(middle), s = sin(middle);
  const double j[3][3] = {{1, 0, turns ? -dy : 0.0}, {0, 1, turns ? dx : 0.0}, {0, 0, 1}};
  const double noise[3][3] = {{along * c * c + across * s * s + turn * dy * dy / 3,
                               (along - across) * c * s - turn * dx * dy / 3, -turn * dy / 2},
                              {0, along * s * s + across * c * c + turn * dx * dx / 3, turn * dx / 2},
                              {0, 0, turn}};
  const int at[3] = {0, 1, 5};
  for (int a = 0; a < 3; a++)
    for (int b = a; b < 3; b++) {
      double expected = noise[a][b];
      for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++) expected += j[a][k] * from.covariance[wm_cov_index(at[k], at[l])] * j[b][l];
      TEST_ASSERT_DOUBLE_WITHIN(1e-9 + 1e-6 * fabs(expected), expected, out.covariance[wm_cov_index(at[a], at[b])]);
      TEST_ASSERT_EQUAL_DOUBLE(out.covariance[wm_cov_index(at[a], at[b])], out.covariance[wm_cov_index(at[b], at[a])]);
    }
}

wm_estimate somewhere(double t_s) {
  wm_estimate e{};
  e.t_ns = make::at(t_s);
  e.dof = 3;
  e.pose_map_base.p_m[0] = 3.0, e.pose_map_base.p_m[1] = -2.0;
  e.heading_rad = 0.7;
  const double p[3][3] = {{0.04, 0.01, -0.005}, {0.01, 0.03, 0.004}, {-0.005, 0.004, 0.01}};
  const int at[3] = {0, 1, 5};
  for (int a = 0; a < 3; a++)
    for (int b = 0; b < 3; b++) e.covariance[wm_cov_index(at[a], at[b])] = p[a][b];
  return e;
}

// GIVEN no motion data WHEN a pose is carried on THEN it goes by its own velocity, which walks; a pose of the future
// goes back by it, and is no less sure than it was. An error of the heading doesn't turn the way. Odom stays.
TEST(test_a_pose_is_carried_by_its_own_velocity) {
  params.model = WM_MOTION_CONSTANT_VELOCITY;
  TEST_ASSERT_EQUAL(WM_OK, wm_odometry_init(odom, &params, &wheels));
  wm_estimate fused = somewhere(1.0);
  fused.v_mps[0] = 0.8, fused.v_mps[1] = -0.3, fused.w_radps[2] = 0.5;
  for (const double dt_s : {0.3, 0.6, -0.2}) {
    wm_estimate out;
    wm_odom_point point;
    TEST_ASSERT_EQUAL(WM_OK, wm_odometry_carry(odom, &fused, make::at(1.0 + dt_s), &out, &point));
    const wm::arc a = wm::make_arc(0.8 * dt_s, -0.3 * dt_s, 0.5 * dt_s);
    const wm_pose2 end = wm::compose(wm_pose2{3.0, -2.0, 0.7}, {a.x_m, a.y_m, a.turn_rad});
    assert_pose(end.x_m, end.y_m, end.heading_rad,
                {out.pose_map_base.p_m[0], out.pose_map_base.p_m[1], out.heading_rad});
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::sin(0.5 * end.heading_rad), out.pose_map_base.q_xyzw[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::cos(0.5 * end.heading_rad), out.pose_map_base.q_xyzw[3]);
    const double grown = std::fmax(dt_s * dt_s * dt_s / 3.0, 0.0), walk = params.velocity_speed_walk,
                 turn = params.velocity_turn_walk;
    expect_carried(fused, out, walk * walk * grown, walk * walk * grown, turn * turn * grown, false);
    const double twist[3] = {out.v_mps[0], out.v_mps[1], out.w_radps[2]}, expected[3] = {0.8, -0.3, 0.5};
    TEST_ASSERT_EQUAL_DOUBLE_ARRAY(expected, twist, 3);
    const double of_odom[3] = {point.v_mps, point.side_mps, point.w_radps};
    TEST_ASSERT_EQUAL_DOUBLE_ARRAY(expected, of_odom, 3);
    assert_pose(0, 0, 0, point.pose_odom_base);
    TEST_ASSERT_EQUAL_INT64(make::at(1.0 + dt_s), out.t_ns);
    TEST_ASSERT_EQUAL_INT64(make::at(1.0 + dt_s), point.t_ns);
  }
}

// GIVEN twists of a base that drives sideways WHEN a pose is carried between, at and behind them THEN mean, covariance
// and twist are those of the motion's accumulated noise at both ends.
TEST(test_a_carried_pose_has_the_noise_between_its_times) {
  params.noise_hold_mps2 = params.noise_hold_radps2 = 0.0;
  TEST_ASSERT_EQUAL(WM_OK, wm_odometry_init(odom, &params, &wheels));
  for (int i = 0; i <= 100; i++) feed(make::twist6(0.01 * i, 0.8, i < 50 ? 0.3 : 0.1, 0.9));
  const double times[][2] = {{0.20, 0.80}, {0.203, 0.807}, {0.5, 0.5}, {0.8, 1.1}, {1.05, 1.15}};
  for (const auto &t : times) {
    wm_odom_point a, b, got;
    TEST_ASSERT_EQUAL(WM_OK, wm_odometry_at(odom, make::at(t[0]), &a));
    TEST_ASSERT_EQUAL(WM_OK, wm_odometry_at(odom, make::at(t[1]), &b));
    const wm_estimate fused = somewhere(t[0]);
    wm_estimate out;
    TEST_ASSERT_EQUAL(WM_OK, wm_odometry_carry(odom, &fused, make::at(t[1]), &out, &got));
    const wm_pose2 end = wm::compose(wm_pose2{3.0, -2.0, 0.7}, wm::between(a.pose_odom_base, b.pose_odom_base));
    assert_pose(end.x_m, end.y_m, end.heading_rad,
                {out.pose_map_base.p_m[0], out.pose_map_base.p_m[1], out.heading_rad});
    expect_carried(fused, out, b.along_var_m2 - a.along_var_m2, b.across_var_m2 - a.across_var_m2,
                   b.heading_var_rad2 - a.heading_var_rad2);
    // Noise per second of constant twists; the same between two points as at them.
    const double w2 = params.noise_yaw_rate_radps * params.noise_yaw_rate_radps + 0.03 * 0.9 * 0.03 * 0.9;
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, w2 * (t[1] - t[0]), b.heading_var_rad2 - a.heading_var_rad2);
    TEST_ASSERT_EQUAL_DOUBLE(0.8, out.v_mps[0]);
    TEST_ASSERT_EQUAL_DOUBLE(t[1] > 0.501 ? 0.1 : 0.3, out.v_mps[1]);
    TEST_ASSERT_EQUAL_DOUBLE(0.9, out.w_radps[2]);
    TEST_ASSERT_EQUAL_DOUBLE(b.pose_odom_base.x_m, got.pose_odom_base.x_m);
  }
}

TEST(test_a_time_too_old_or_before_any_motion_is_not_found) {
  wm_odom_point p;
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_odometry_at(odom, 0, &p));
  for (int i = 0; i <= 1000; i++) feed(make::twist(0.01 * i, 1.0, 0.0));
  TEST_ASSERT_EQUAL(WM_OK, wm_odometry_at(odom, make::at(9.0), &p));
  TEST_ASSERT_EQUAL(WM_NOT_FOUND, wm_odometry_at(odom, make::at(1.0), &p));
  const wm_event back = make::twist(9.99, 1, 0);
  TEST_ASSERT_EQUAL(WM_TIME_RAN_BACK, wm_odometry_feed(odom, &back));
  const wm_event other = make::heading(11, 0, 1);
  TEST_ASSERT_EQUAL(WM_UNSUPPORTED, wm_odometry_feed(odom, &other));
  TEST_ASSERT_EQUAL_INT64(make::at(10.0), wm_odometry_newest_ns(odom));
}

TEST(test_calibration_holds_from_now_on_and_nothing_jumps) {
  for (int i = 0; i <= 100; i++) feed(make::twist(0.01 * i, 1.0, 0.0));
  wm_motion_calibration c = {1.1, 1, -0.1, 1, 1, 1, 0, 0, 0};
  wm_odometry_calibrate(odom, &c);
  assert_pose(1.0, 0.0, 0.0, pose_at(1.0));
  for (int i = 101; i <= 200; i++) feed(make::twist(0.01 * i, 1.0, 0.0));
  assert_pose(1.0 + 1.1 * sin(0.1) / 0.1, 1.1 * (1 - cos(0.1)) / 0.1, 0.1, pose_at(2.0));
}

// An estimator took the twists as commands for a while, and then as measured: these have no response.
TEST(test_twists_are_commands_as_long_as_the_estimator_takes_them_so) {
  for (int i = 0; i <= 100; i++) feed(make::twist(0.01 * i, 0.0, 0.0));
  wm_motion_calibration c = {1, 1, 0, 1, 1, 1, 0, 0, 0.1};
  wm_odometry_calibrate(odom, &c);
  c.value[WM_TURN_SLOWDOWN] = 0.0;
  wm_odometry_calibrate(odom, &c);
  for (int i = 101; i <= 200; i++) feed(make::twist(0.01 * i, 1.0, 0.0));
  TEST_ASSERT_DOUBLE_WITHIN(0.011, 1.0, pose_at(2.0).x_m);
}

// The carried covariance against the spread of many noisy drives, and the carried mean against the drive itself.
TEST(test_carry_moves_mean_and_covariance) {
  for (int i = 0; i <= 60; i++) feed(make::twist(0.01 * i, 2.0, 0.8));
  wm_estimate fused{}, now;
  fused.t_ns = make::at(0.1);
  fused.heading_rad = 0.6;
  fused.pose_map_base.p_m[0] = 5.0;
  const double p0[3][3] = {{0.04, 0.01, 0.002}, {0.01, 0.09, -0.003}, {0.002, -0.003, 0.01}};
  const int index[3] = {0, 1, 5};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) fused.covariance[wm_cov_index(index[i], index[j])] = p0[i][j];
  wm_odom_point point;
  TEST_ASSERT_EQUAL(WM_OK, wm_odometry_carry(odom, &fused, make::at(0.5), &now, &point));
  const double w = 0.8, r = 2.0 / w, a = 0.6, b = 0.6 + w * 0.4;
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 5.0 + r * (sin(b) - sin(a)), now.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, r * (cos(a) - cos(b)), now.pose_map_base.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, b, now.heading_rad);
  TEST_ASSERT_EQUAL_INT64(make::at(0.5), now.t_ns);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.0, now.v_mps[0]);

  // The same by sampling the start and the noise (Cholesky of p0 by hand).
  const double l00 = 0.2, l10 = 0.05, l20 = 0.01, l11 = sqrt(0.09 - l10 * l10), l21 = (-0.003 - l20 * l10) / l11;
  const double l22 = sqrt(0.01 - l20 * l20 - l21 * l21);
  double sum[3] = {}, outer[3][3] = {};
  const int runs = 40000, steps = 8;
  for (int run = 0; run < runs; run++) {
    wm_random rnd = {11, (uint64_t)run, 0};
    const double n0 = wm_random_next_normal(&rnd), n1 = wm_random_next_normal(&rnd), n2 = wm_random_next_normal(&rnd);
    double x = 5.0 + l00 * n0, y = l10 * n0 + l11 * n1, h = 0.6 + l20 * n0 + l21 * n1 + l22 * n2;
    const double dt = 0.4 / steps;
    const double sv = sqrt((0.02 * 0.02 + 0.06 * 0.06) * dt), sw = sqrt((0.01 * 0.01 + 0.024 * 0.024) * dt);
    for (int k = 0; k < steps; k++) {
      const double s = 2.0 * dt + sv * wm_random_next_normal(&rnd), t = w * dt + sw * wm_random_next_normal(&rnd);
      x += s * cos(h + t / 2), y += s * sin(h + t / 2), h += t;
    }
    const double d[3] = {x, y, h};
    for (int i = 0; i < 3; i++) {
      sum[i] += d[i];
      for (int j = 0; j < 3; j++) outer[i][j] += d[i] * d[j];
    }
  }
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      const double sampled = outer[i][j] / runs - sum[i] / runs * sum[j] / runs;
      const double scale = sqrt((outer[i][i] / runs - sum[i] * sum[i] / runs / runs) *
                                (outer[j][j] / runs - sum[j] * sum[j] / runs / runs));
      TEST_ASSERT_DOUBLE_WITHIN(0.03 * scale, sampled, now.covariance[wm_cov_index(index[i], index[j])]);
    }
}

// A bus that is silent for a minute: what the robot may have driven since the fused pose, 0.25 s ago, is added to it;
// not what it may have driven in a quarter of a second more of the whole silence, 11.6 m.
TEST(test_unknown_motion_begins_at_the_fused_pose) {
  for (int i = 0; i <= 100; i++) feed(make::twist(0.01 * i, 1.5, 0.0));
  for (double sigma_m : {0.01, 2.0}) {
    wm_estimate fused{}, now;
    fused.t_ns = make::at(61.0);
    for (int axis = 0; axis < 2; axis++) fused.covariance[wm_cov_index(axis, axis)] = sigma_m * sigma_m;
    TEST_ASSERT_EQUAL(WM_OK, wm_odometry_carry(odom, &fused, make::at(61.25), &now, nullptr));
    const double position_m = sqrt(2.0) * sigma_m;
    const double gone_m2 = (position_m + 1.5 * 0.25) * (position_m + 1.5 * 0.25) - position_m * position_m;
    for (int axis = 0; axis < 2; axis++)
      TEST_ASSERT_DOUBLE_WITHIN(0.01 * gone_m2, gone_m2, now.covariance[wm_cov_index(axis, axis)] - sigma_m * sigma_m);
  }
}

// A bus delays some counts: the last two stamps, 14.7 ms apart, would make a speed 36 % too high. A silence of 0.3 s
// goes on by the steady one. The own speed of 80 ms, a third off, is left.
TEST(test_delayed_counts_begin_a_silence_with_a_steady_speed) {
  const double late_s[] = {0.0, 0.0006, -0.0004, 0.003, -0.0023};
  for (const bool has_gyro : {false, true}) {
    start(make::two_wheels());
    for (int i = 0; i <= 54; i++) {
      const double t_s = 0.02 * i + late_s[i % 5];
      if (has_gyro) feed(make::quantities(t_s, {{WM_Q_YAW_RATE, 1e-9 * (i % 2)}}));
      feed(make::quantities(t_s, {{WM_Q_WHEEL_TICKS_LEFT, 28.0 * i}, {WM_Q_WHEEL_TICKS_RIGHT, 28.0 * i}}));
    }
    const double newest_s = 0.02 * 54 + late_s[4], at_rest = pose_at(newest_s).x_m, mps = at_rest / newest_s;
    TEST_ASSERT_DOUBLE_WITHIN(0.4 * mps * 0.08, mps * 0.08, pose_at(newest_s + 0.08).x_m - at_rest);
    const double late_m = pose_at(newest_s + 0.3).x_m - pose_at(newest_s + 0.08).x_m;
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * mps * 0.22, mps * 0.22, late_m);
  }
}

TEST(test_a_copy_continues_identically) {
  start(make::two_wheels());
  for (int i = 0; i <= 50; i++)
    feed(make::quantities(0.02 * i, {{WM_Q_WHEEL_TICKS_LEFT, 30.0 * i}, {WM_Q_WHEEL_TICKS_RIGHT, 35.0 * i}}));
  wm_odometry *copy = (wm_odometry *)malloc(wm_odometry_bytes());
  memcpy((void *)copy, (void *)odom, wm_odometry_bytes());
  const wm_event e = make::quantities(1.02, {{WM_Q_WHEEL_TICKS_LEFT, 1540}, {WM_Q_WHEEL_TICKS_RIGHT, 1800}});
  feed(e);
  TEST_ASSERT_EQUAL(WM_OK, wm_odometry_feed(copy, &e));
  TEST_ASSERT_EQUAL_MEMORY(odom, copy, wm_odometry_bytes());
  free(copy);
}

}  // namespace

void setUp(void) {
  odom = (wm_odometry *)malloc(wm_odometry_bytes());
  start(make::no_wheels());
}
void tearDown(void) { free(odom); }

// In space the newest fused pose goes on by the twists that came since; roll and pitch stay what they are.
TEST(test_a_pose_in_space_is_carried_in_space) {
  start({NAN, NAN, NAN, NAN, NAN, NAN, 0, {}, {}});
  for (int i = 0; i <= 10; i++) {
    wm_event e = make::empty(0.1 * i, WM_EVENT_TWIST6);
    e.as.twist6 = {{0, 0.2, 1}, {0.5, 0, 0}, NAN, {}};
    feed(e);
  }
  wm_estimate fused{}, out{};
  fused.t_ns = make::at(0.5);
  fused.dof = 6;
  fused.pose_map_base.q_xyzw[1] = std::sqrt(0.5);  // the nose points straight down
  fused.pose_map_base.q_xyzw[3] = std::sqrt(0.5);
  for (int i = 0; i < 6; i++) fused.covariance[wm_cov_index(i, i)] = 0.01;
  TEST_ASSERT_EQUAL(WM_OK, wm_odometry_carry(odom, &fused, make::at(1.05), &out, nullptr));
  const double turn = 0.5 * 0.55;
  // Body z is map x there, body y is map y; a roll turns y towards z.
  const double y = (0.2 * std::sin(turn) - (1 - std::cos(turn))) / 0.5,
               z = (std::sin(turn) + 0.2 * (1 - std::cos(turn))) / 0.5;
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, z, out.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, y, out.pose_map_base.p_m[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, out.pose_map_base.p_m[2]);
  const double *q = out.pose_map_base.q_xyzw;
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, std::sqrt(0.5) * std::sin(0.5 * turn), q[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, std::sqrt(0.5) * std::cos(0.5 * turn), q[1]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, std::sqrt(0.5) * std::cos(0.5 * turn), q[3]);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.01, out.covariance[wm_cov_index(0, 0)]);
  TEST_ASSERT_EQUAL_DOUBLE(out.covariance[wm_cov_index(0, 4)], out.covariance[wm_cov_index(4, 0)]);
}

void feed_six(double t_s, double v, double w) {
  wm_event e = make::empty(t_s, WM_EVENT_TWIST6);
  e.as.twist6 = {{v, 0, 0}, {0, 0, w}, NAN, {}};
  feed(e);
}

wm_estimate carried_in_space(double from_s, double to_s) {
  wm_estimate fused{}, out{};
  fused.t_ns = make::at(from_s);
  fused.dof = 6;
  fused.pose_map_base.q_xyzw[3] = 1;
  TEST_ASSERT_EQUAL(WM_OK, wm_odometry_carry(odom, &fused, make::at(to_s), &out, nullptr));
  return out;
}

// Of twists that come in time each second of a carried pose adds the white noise of the speed and of the turn rate.
TEST(test_in_space_a_carried_pose_has_the_noise_of_its_twists) {
  for (int i = 0; i <= 10; i++) feed_six(0.1 * i, 1.0, 0.0);
  const wm_estimate out = carried_in_space(0.5, 1.0);
  const double place_m2 = 0.5 * params.noise_speed_mps * params.noise_speed_mps,
               rotation_rad2 = 0.5 * params.noise_yaw_rate_radps * params.noise_yaw_rate_radps;
  for (int i = 0; i < 6; i++) {
    const double expected = i < 3 ? place_m2 : rotation_rad2;
    TEST_ASSERT_DOUBLE_WITHIN(1e-9 * expected, expected, out.covariance[wm_cov_index(i, i)]);
  }
}

// GIVEN twists in space WHEN they stop THEN the last one holds for hold_max_s, more and more unsure, and no longer.
TEST(test_a_twist_in_space_does_not_hold_for_ever) {
  for (int i = 0; i <= 10; i++) feed_six(0.1 * i, 1.0, 0.0);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.7, carried_in_space(0.5, 1.2).pose_map_base.p_m[0]);
  const wm_estimate out = carried_in_space(0.5, 60.0);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5 + params.hold_max_s, out.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, out.v_mps[0]);
  TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, out.covariance[wm_cov_index(1, 1)]);
}

TEST(test_derivatives_of_compositions) {
  const wm_pose2 a = {1.0, -2.0, 0.7}, b = {0.4, 0.3, -1.1};
  const double h = 1e-6;
  for (bool inverse : {false, true}) {
    const auto f = [&](const wm_pose2 &x, const wm_pose2 &y) {
      return inverse ? wm::between(x, y) : wm::compose(x, y);
    };
    wm::matrix<3> by_a, by_b;
    if (inverse)
      wm::between(a, b, &by_a, &by_b);
    else
      wm::compose(a, b, &by_a, &by_b);
    for (int k = 0; k < 6; k++) {
      wm_pose2 up[2] = {a, b}, down[2] = {a, b};
      const auto number = [k](wm_pose2 *p) -> double & {
        return k % 3 == 0 ? p[k / 3].x_m : k % 3 == 1 ? p[k / 3].y_m : p[k / 3].heading_rad;
      };
      number(up) += h;
      number(down) -= h;
      const wm_pose2 u = f(up[0], up[1]), d = f(down[0], down[1]);
      const double by[3] = {(u.x_m - d.x_m) / (2 * h), (u.y_m - d.y_m) / (2 * h),
                            (u.heading_rad - d.heading_rad) / (2 * h)};
      for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-8, by[i], (k < 3 ? by_a : by_b)(i, k % 3));
    }
  }
  const wm::pose3 p = {{1, 2, 3}, wm::turn_by({0.3, -0.4, 0.5})}, q = {{0.5, -0.2, 0.1}, wm::turn_by({-0.6, 0.2, 0.9})};
  wm::matrix<6> by_p, by_q;
  const wm::pose3 c = wm::compose(p, q, &by_p, &by_q);
  for (int k = 0; k < 12; k++) {
    const auto moved = [k](const wm::pose3 &x, double e) {
      wm::vec3 dp = {0, 0, 0}, dr = {0, 0, 0};
      (k % 6 < 3 ? dp : dr)[k % 3] = e;
      return wm::pose3{x.p + dp, x.q * wm::turn_by(dr)};
    };
    const wm::pose3 u = k < 6 ? wm::compose(moved(p, h), q) : wm::compose(p, moved(q, h));
    const wm::pose3 d = k < 6 ? wm::compose(moved(p, -h), q) : wm::compose(p, moved(q, -h));
    const wm::vec3 place = (1 / (2 * h)) * (u.p - d.p), turn = (1 / (2 * h)) * wm::turn_of(wm::conjugate(d.q) * u.q);
    for (int i = 0; i < 3; i++) {
      TEST_ASSERT_DOUBLE_WITHIN(1e-8, place[i], (k < 6 ? by_p : by_q)(i, k % 6));
      TEST_ASSERT_DOUBLE_WITHIN(1e-8, turn[i], (k < 6 ? by_p : by_q)(3 + i, k % 6));
    }
  }
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, wm::length(wm::between(p, c).p - q.p));
}
