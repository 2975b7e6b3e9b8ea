// SPDX-License-Identifier: Apache-2.0
// An IMU with three axes in space: its rates beside a velocity log, an axis that sticks, silence; gravity for roll and
// pitch, with vibration and bumps.
#include "motion/spatial_source.hpp"
#include "stereo_scene.hpp"

namespace {

constexpr double kG = 9.80665;

using make::imu;
using make::kNoRates;

double jitter(int i) { return i % 2 ? 1e-6 : -1e-6; }
// Rates of a turn about the body's z axis, of an IMU that is alive; and of one that is silent.
auto turning(double w_radps) {
  return [w_radps](int i) { return vec3{jitter(i), jitter(i), w_radps}; };
}
vec3 silent(int) { return {NAN, 0, 0}; }

// stereo_ekf without pictures, from level, for `seconds`: the log ten times a second, the IMU a hundred times.
struct vehicle : scene {
  explicit vehicle(double bias_sigma_mps2 = 0.1) : scene(10) {
    set("states.accelerometer_bias_sigma_mps2", bias_sigma_mps2);
    set("noise.w_radps", 0.01);
    setup.start.sigma_heading_rad = 0.1;
    begin();
  }
  template <class Rates, class Force>
  void go(double seconds, const vec3 &v, const vec3 &log_rates, Rates rates, Force force) {
    const int end = (int)std::lround(seconds * 100);
    for (int i = 0; i < end; i++, step_++) {
      const double t = 0.01 * step_;
      if (step_ % 10 == 0) tell(make::log6(t, v, log_rates));
      const vec3 w = rates(step_);
      if (std::isfinite(w.x)) tell(imu(t, w, force(step_)));
    }
  }
  // Roll and pitch: of the body's axes, how far they leave the level.
  std::pair<double, double> tilt() const {
    const mat3 R = matrix_of(quat_of(estimate().pose_map_base.q_xyzw));
    return {R.m[2][1], -R.m[2][0]};
  }
  // Of a rotation about an axis of the map.
  double sigma_about(const vec3 &axis) const {
    const wm_estimate e = estimate();
    const vec3 in_body = transposed_times(matrix_of(quat_of(e.pose_map_base.q_xyzw)), axis);
    double sum = 0;
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) sum += in_body[i] * in_body[j] * e.covariance[wm_cov_index(3 + i, 3 + j)];
    return std::sqrt(sum);
  }
  int step_ = 0;
};

vec3 at_rest(int) { return {0, 0, kG}; }

TEST(test_the_rates_are_the_imus_and_the_velocity_the_logs) {
  vehicle v(0);
  v.go(2, {0.5, 0, 0}, {0, 0, 0}, turning(0.2), at_rest);
  const wm_estimate e = v.estimate();
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.2 * 1.99, e.heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.5 / 0.2 * std::sin(0.398), e.pose_map_base.p_m[0]);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.5 / 0.2 * (1 - std::cos(0.398)), e.pose_map_base.p_m[1]);
}

TEST(test_a_silent_imu_yields_to_the_logs_rates) {
  vehicle v(0);
  v.go(1, {0, 0, 0}, {0, 0, 0.1}, turning(0.3), at_rest);
  const double before = v.estimate().heading_rad;
  v.go(3, {0, 0, 0}, {0, 0, 0.1}, silent, at_rest);
  TEST_ASSERT_DOUBLE_WITHIN(0.07, before + 0.3, v.estimate().heading_rad);  // a quarter of a second until it is noticed
}

// Beside an IMU the log's velocity holds for hold_max_s, and no longer.
TEST(test_a_velocity_holds_for_its_time_and_no_longer) {
  spatial_source source;
  source.init(2.0, {0.05, 0.02});
  spatial_twist now = {{0.5, 0.1, 0.0}, {0.0, 0.0, 0.0}};
  TEST_ASSERT_TRUE(source.take(make::log6(0.0, now.v), &now));
  wm_event e = imu(2.0, {0.0, 0.0, 0.01}, {0.0, 0.0, kG});
  TEST_ASSERT_TRUE(source.take(e, &now));
  TEST_ASSERT_EQUAL_DOUBLE(0.5, now.v.x);
  TEST_ASSERT_EQUAL_DOUBLE(0.1, now.v.y);
  TEST_ASSERT_EQUAL_DOUBLE(0.01, now.w.z);
  e.t_ns++;
  TEST_ASSERT_TRUE(source.take(e, &now));
  TEST_ASSERT_EQUAL_DOUBLE(0.0, now.v.x);
  TEST_ASSERT_EQUAL_DOUBLE(0.0, now.v.y);
  TEST_ASSERT_EQUAL_DOUBLE(0.01, now.w.z);
}

TEST(test_a_silent_log_beside_an_imu_makes_the_place_uncertain) {
  vehicle v(0);
  const auto turns = turning(0.1);
  v.go(2, {0.5, 0, 0}, {0, 0, 0}, turns, at_rest);
  const double before_m = std::sqrt(v.estimate().covariance[0]);
  for (int i = 0; i < 1000; i++, v.step_++) v.tell(imu(0.01 * v.step_, turns(v.step_), {0, 0, kG}));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, before_m);
  TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, std::sqrt(v.estimate().covariance[0]));
}

TEST(test_a_stuck_axis_is_found) {
  spatial_source source;
  source.init(2, {0.05, 0.015});
  bool stuck = false;
  for (int i = 0; i < 500 && !stuck; i++) {
    const double t = 0.01 * i;
    spatial_twist log = {{0, 0, 0}, {0.2, 0, 0}}, none = {};
    if (i % 10 == 0) (void)source.take(make::log6(t, {0, 0, 0}, {0.2, 0, 0}), &log);
    (void)source.take(imu(t, {0.0, jitter(i), jitter(i)}, {0, 0, kG}), &none);
    stuck = source.stuck_rates() == 1;
    if (stuck) TEST_ASSERT_DOUBLE_WITHIN(0.2, 3.0, t);
  }
  TEST_ASSERT_TRUE(stuck);
  spatial_twist now = {};
  TEST_ASSERT_TRUE(source.take(imu(6, {0.0, 0.1, 0.3}, {0, 0, kG}), &now));
  TEST_ASSERT_EQUAL_DOUBLE(0.2, now.w.x);
  TEST_ASSERT_EQUAL_DOUBLE(0.3, now.w.z);
  TEST_ASSERT_TRUE(source.take(imu(6.01, {0.19, 0.1, 0.3}, {0, 0, kG}), &now));
  TEST_ASSERT_EQUAL(0, source.stuck_rates());
  TEST_ASSERT_EQUAL_DOUBLE(0.19, now.w.x);
}

TEST(test_the_filter_reports_a_stuck_axis) {
  vehicle v(0);
  const auto stuck = [](int i) { return vec3{0.05, jitter(i), jitter(i)}; };
  v.go(12, {0, 0, 0}, {0, 0, 0}, stuck, at_rest);
  TEST_ASSERT_EQUAL(WM_MOTION_HEALTH_ROLL_RATE_STUCK, v.ekf->motion_health(v.state));
}

// Specific force of a vehicle that rolls by 0.05 and pitches by -0.08 rad, whose filter begins level.
vec3 tilted(int) {
  return {kG * std::sin(0.08), kG * std::cos(0.08) * std::sin(0.05), kG * std::cos(0.08) * std::cos(0.05)};
}
vec3 still(int i) { return {jitter(i), jitter(i), jitter(i)}; }

TEST(test_gravity_levels) {
  vehicle v(0.01);
  v.go(20, {0, 0, 0}, {0, 0, 0}, still, tilted);
  const auto [roll, pitch] = v.tilt();
  TEST_ASSERT_DOUBLE_WITHIN(0.003, 0.05, roll);
  TEST_ASSERT_DOUBLE_WITHIN(0.003, -0.08, pitch);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.005, v.sigma_about({1, 0, 0}));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.005, v.sigma_about({0, 1, 0}));
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.08, v.sigma_about({0, 0, 1}));  // gravity shows no heading
}

TEST(test_without_the_state_gravity_is_not_used) {
  vehicle v(0);
  v.go(5, {0, 0, 0}, {0, 0, 0}, still, tilted);
  const auto [roll, pitch] = v.tilt();
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0, roll);
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0, pitch);
}

// 3 m/s2 at 23 Hz, and a bump of 30 m/s2 every two seconds: the tilt stays within its sigma.
TEST(test_vibration_and_bumps_tilt_nothing) {
  vehicle v(0.01);
  v.go(20, {0, 0, 0}, {0, 0, 0}, still, [](int i) {
    const double shaken = 3 * std::sin(2 * M_PI * 23 * 0.01 * i), bump = i % 200 < 5 ? 30.0 : 0.0;
    return vec3{shaken + 0.3 * bump, shaken, kG + shaken + bump};
  });
  const auto [roll, pitch] = v.tilt();
  const double sigma = std::sqrt(v.estimate().covariance[wm_cov_index(4, 4)]);
  TEST_ASSERT_DOUBLE_WITHIN(2 * sigma, 0, pitch);
  TEST_ASSERT_DOUBLE_WITHIN(0.03, 0, roll);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.05, sigma);
}

// The log's change of velocity is no tilt: 1 m/s2 forwards for 2 s.
TEST(test_an_acceleration_that_the_log_measures_is_no_tilt) {
  vehicle v(0.01);
  v.go(2, {0, 0, 0}, {0, 0, 0}, still, at_rest);
  for (int i = 0; i < 200; i++, v.step_++) {
    const double t = 0.01 * v.step_;
    if (v.step_ % 10 == 0) v.tell(make::log6(t, {0.01 * i + 0.05, 0, 0}));
    v.tell(imu(t, still(v.step_), {1, 0, kG}));
  }
  v.go(1, {2, 0, 0}, {0, 0, 0}, still, at_rest);
  const auto [roll, pitch] = v.tilt();
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0, pitch);
}

// The log sits at the bow and to the side: while the vehicle turns on the spot it moves, and the vehicle does not.
TEST(test_a_log_that_is_mounted_away_from_base_link) {
  const vec3 arm = {0.4, -0.3, 0.2}, w = {0.02, -0.03, 0.2};
  for (const bool has_rates : {false, true}) {
    spatial_source source;
    source.init(2.0, {0.05, 0.02});
    spatial_twist now;
    (void)source.take(imu(0.0, w, {0.0, 0.0, kG}), &now);
    wm_event e = make::log6(0.005, vec3{0.1, 0, 0} + cross(w, arm), has_rates ? w : kNoRates);
    for (int i = 0; i < 3; i++) e.as.twist6.arm_m[i] = arm[i];
    TEST_ASSERT_TRUE(source.take(e, &now));
    const vec3 right = {0.1, 0, 0};
    for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-15, right[i], now.v[i]);
  }
}

}  // namespace
