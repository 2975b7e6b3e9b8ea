// SPDX-License-Identifier: Apache-2.0
// An IMU in space that repeats its values: which axis is found stuck, how soon, and that no coarse sensor of a body
// that stands is taken for one; what the filter makes of it until the values move again.
#include "motion/spatial_source.hpp"
#include "stereo_scene.hpp"

namespace {

constexpr double kG = 9.80665, kStep_s = 0.01;

// A pseudo-random number of about unit size, the same on every computer.
double noise(int i, int axis) {
  const auto h = (uint32_t)(i * 6 + axis) * 2654435761u;
  return ((double)(h >> 8) / (double)(1u << 23) - 1.0) * 1.7;
}

struct imu_row {
  vec3 w, f;
};

// A live IMU with noise.
imu_row live(int i, const vec3 &w = {0, 0, 0}) {
  imu_row out = {w, {0, 0, kG}};
  for (int k = 0; k < 3; k++) {
    out.w[k] += 0.01 * noise(i, k);
    out.f[k] += 0.05 * noise(i, 3 + k);
  }
  return out;
}

// The source alone: a log ten times a second and the IMU a hundred times.
struct sensors {
  spatial_source source;
  int i = 0;
  sensors() { source.init(2.0, {0.05, 0.015}); }
  template <class Row>
  void go(double seconds, const vec3 &v, Row row, const vec3 &log_rates = {0, 0, 0}) {
    for (const int end = i + (int)std::lround(seconds / kStep_s); i < end; i++) {
      spatial_twist twist = {v, log_rates}, none = {};
      if (i % 10 == 0) (void)source.take(make::log6(kStep_s * i, v, log_rates), &twist);
      const imu_row r = row(i);
      (void)source.take(make::imu(kStep_s * i, r.w, r.f), &none);
    }
  }
};

imu_row moving(int i) { return live(i, {0, 0, 0.08}); }

TEST(test_all_axes_that_stick_are_found_within_half_a_second) {
  sensors s;
  s.go(10, {0.3, 0, 0}, moving);
  TEST_ASSERT_EQUAL(0, s.source.stuck_rates());
  const imu_row last = moving(s.i - 1);
  s.go(0.5, {0.3, 0, 0}, [&](int i) { return imu_row{last.w, moving(i).f}; });
  TEST_ASSERT_EQUAL(7, s.source.stuck_rates());
  TEST_ASSERT_EQUAL(0, s.source.stuck_forces());
  TEST_ASSERT_EQUAL(7, s.source.unmeasured_rates(make::at(kStep_s * s.i)));
  s.go(0.05, {0.3, 0, 0}, moving);
  TEST_ASSERT_EQUAL(0, s.source.lost_rates());
}

double coarse(double value, double step) { return step * std::round(value / step); }

// Steps as large as the noise, and a body that stands for a minute with the same value: alive.
TEST(test_a_coarse_gyro_that_stands_is_alive) {
  sensors s;
  const auto steps = [](int i) {
    imu_row r = moving(i);
    for (int k = 0; k < 3; k++) r.w[k] = coarse(r.w[k], 0.01);
    return r;
  };
  s.go(60, {0.3, 0, 0}, steps);
  TEST_ASSERT_EQUAL(0, s.source.stuck_rates());
  s.go(60, {0, 0, 0}, [](int i) { return imu_row{{0, 0.01, 0}, live(i).f}; });
  TEST_ASSERT_EQUAL(0, s.source.stuck_rates());
  s.go(60, {0.3, 0, 0}, steps);
  TEST_ASSERT_EQUAL(0, s.source.stuck_rates());
}

// A gyro that shows zero below a threshold: alive at rest, and in the straight drive after it.
TEST(test_a_gyro_with_a_dead_band_is_alive) {
  sensors s;
  s.go(20, {0.3, 0, 0}, moving);
  const auto zero = [](int i) { return imu_row{{0, 0, 0}, live(i).f}; };
  s.go(20, {0, 0, 0}, zero);
  TEST_ASSERT_EQUAL(0, s.source.stuck_rates());
  s.go(5, {0.3, 0, 0}, moving);
  s.go(5, {0.3, 0, 0}, zero);
  TEST_ASSERT_EQUAL(0, s.source.stuck_rates());
}

// A stuck value that shows a turn is found although the log stands; so is one that is stuck when the body leaves.
TEST(test_a_gyro_that_sticks_at_rest) {
  sensors turns;
  turns.go(10, {0, 0, 0}, moving);
  turns.go(0.5, {0, 0, 0}, [](int i) { return imu_row{{0.03, 0.04, 0.08}, live(i).f}; });
  TEST_ASSERT_EQUAL(7, turns.source.stuck_rates());
  sensors leaves;
  const auto stuck = [](int i) { return imu_row{{0.003, 0.004, -0.005}, live(i).f}; };
  leaves.go(10, {0, 0, 0}, [](int i) { return live(i); });
  leaves.go(10, {0, 0, 0}, stuck);
  TEST_ASSERT_EQUAL(0, leaves.source.stuck_rates());
  leaves.go(1, {0.3, 0, 0}, stuck);
  TEST_ASSERT_EQUAL(7, leaves.source.stuck_rates());
}

// stereo_ekf without pictures: the same sensors.
struct vehicle : scene {
  vehicle() : scene(10) {
    set("states.accelerometer_bias_sigma_mps2", 0.01);
    set("states.rate_bias_sigma_radps", 0.005);
    set("noise.w_radps", 0.01);
    setup.start.sigma_heading_rad = 0.01;
    begin();
  }
  template <class Row>
  void go(double seconds, Row row, const vec3 &log_rates = {0, 0, 0}) {
    for (const int end = i + (int)std::lround(seconds / kStep_s); i < end; i++) {
      if (i % 10 == 0) tell(make::log6(kStep_s * i, {0.3, 0, 0}, log_rates));
      const imu_row r = row(i);
      tell(make::imu(kStep_s * i, r.w, r.f));
    }
  }
  double sigma(int component) const { return std::sqrt(estimate().covariance[wm_cov_index(component, component)]); }
  int i = 0;
};

// A turn of 0.2 rad/s for 10 s of which the stuck gyro shows nothing.
TEST(test_a_stuck_gyro_makes_the_turn_uncertain) {
  vehicle v;
  v.go(10, [](int i) { return live(i); });
  TEST_ASSERT_LESS_THAN_DOUBLE(0.06, v.sigma(5));
  v.go(10, [](int i) { return imu_row{live(999).w, live(i).f}; });
  TEST_ASSERT_EQUAL(
      WM_MOTION_HEALTH_ROLL_RATE_STUCK | WM_MOTION_HEALTH_PITCH_RATE_STUCK | WM_MOTION_HEALTH_YAW_RATE_STUCK,
      v.ekf->motion_health(v.state));
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.3, v.sigma(5));  // 0.1 sqrt(10)
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.02, v.sigma(3));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.15, v.sigma(3));  // gravity still levels it
  v.go(1, [](int i) { return live(i); });
  TEST_ASSERT_EQUAL(0, v.ekf->motion_health(v.state));
}

TEST(test_a_stuck_gyro_yields_to_the_logs_rates) {
  vehicle v;
  const vec3 turn = {0, 0, 0.2};
  v.go(
      10, [&](int i) { return live(i, turn); }, turn);
  const double before = v.estimate().heading_rad;
  v.go(
      5,
      [&](int i) {
        return imu_row{{0.01, 0.01, 0.01}, live(i).f};
      },
      turn);
  TEST_ASSERT_DOUBLE_WITHIN(3 * v.sigma(5), 1.0, wrap(v.estimate().heading_rad - before));
  TEST_ASSERT_LESS_THAN_DOUBLE(0.12, v.sigma(5));
}

// The rates' bias is the gyro's: what is learnt of another source is not kept for it.
TEST(test_the_gyros_bias_comes_back_with_it) {
  vehicle v;
  v.go(10, [](int i) { return live(i); });
  const auto bias_sigma = [&v] { return v.calibrated("motion.rate_bias_x_radps").sigma; };
  const double learnt = bias_sigma();
  TEST_ASSERT_LESS_THAN_DOUBLE(0.0045, learnt);
  v.go(5, [](int i) { return imu_row{live(999).w, live(i).f}; });
  TEST_ASSERT_DOUBLE_WITHIN(0.0005, 0.005, bias_sigma());
  v.go(0.02, [](int i) { return live(i); });
  TEST_ASSERT_DOUBLE_WITHIN(0.0005, learnt, bias_sigma());
}

// Specific force that stays as it was while the body tilts levels nothing.
TEST(test_a_stuck_accelerometer_is_not_used) {
  vehicle v;
  v.go(10, [](int i) { return live(i); });
  v.go(10, [](int i) { return imu_row{live(i, {0.02, 0, 0}).w, live(999).f}; });
  TEST_ASSERT_EQUAL(WM_MOTION_HEALTH_ACCELEROMETER_STUCK, v.ekf->motion_health(v.state));
  const mat3 R = matrix_of(quat_of(v.estimate().pose_map_base.q_xyzw));
  TEST_ASSERT_DOUBLE_WITHIN(3 * v.sigma(3) + 0.01, 0.2, std::asin(R.m[2][1]));
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.1, std::asin(R.m[2][1]));
}

// A gyro that falls silent beside a log without rates: the turn is as uncertain.
TEST(test_a_silent_gyro_makes_the_turn_uncertain) {
  vehicle v;
  v.go(10, [](int i) { return live(i); });
  for (const int end = v.i + 1000; v.i < end; v.i += 10) v.tell(make::log6(kStep_s * v.i, {0.3, 0, 0}));
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.3, v.sigma(5));
}

}  // namespace
