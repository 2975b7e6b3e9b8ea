// SPDX-License-Identifier: Apache-2.0
// Wheels that do not turn as the robot moves, found by positions: of a robot that drives along x, in a filter of its
// place alone.
#include <cmath>

#include "common/suite.h"
#include "filters/core/wheel_check.hpp"
#include "waymark/motion.h"
#include "waymark/random.h"

namespace {

constexpr double kStep_s = 0.2, kReceiver_m = 0.02, kWheel_m = 0.01;  // sigmas of a position, and of the way of a step
constexpr double kUnknown_mps = 0.5;                                  // noise of the speed while wheels lie

struct Drive {
  wm::wheel_check check;
  double true_m[2] = {0, 0}, mean_m[2] = {0, 0}, variance_m2[2] = {1e-4, 1e-4};
  uint64_t draw = 0, seed;
  int steps = 0;

  explicit Drive(uint64_t seed_) : seed(seed_) { check.init(); }
  double normal() { return wm_random_normal(seed, 1, draw++); }

  // One position: the wheels say `wheel_mps` along x, the robot moves otherwise. `larger`: the receiver's error over
  // what it states.
  void step(double wheel_mps, double robot_x_mps, double robot_y_mps, double larger = 1) {
    const double lies = check.holds() ? wm::square(kUnknown_mps) * kStep_s : 0.0;
    true_m[0] += robot_x_mps * kStep_s;
    true_m[1] += robot_y_mps * kStep_s;
    mean_m[0] += wheel_mps * kStep_s + kWheel_m * normal();
    for (double &variance : variance_m2) variance += wm::square(kWheel_m) + lies;
    check.move({0.0, 1.0}, kStep_s, wheel_mps, lies);
    wm::noise_adaption::row rows[2];
    for (int k = 0; k < 2; k++) {
      const double seen = true_m[k] + larger * kReceiver_m * normal();
      rows[k] = {{},
                 {},
                 seen - mean_m[k],
                 variance_m2[k] + wm::square(kReceiver_m),
                 wm::square(kReceiver_m),
                 wm::noise_adaption::kPlace,
                 k};
      rows[k].by[k] = 1.0;
    }
    const double added_m2 = check.weigh(rows, 2, static_cast<wm_time_ns>(++steps * kStep_s * 1e9));
    for (int k = 0; k < 2; k++) {
      variance_m2[k] += added_m2;
      rows[k].variance += added_m2;
      rows[k].gain[k] = variance_m2[k] / rows[k].variance;
      check.update(rows[k]);
      mean_m[k] += rows[k].gain[k] * rows[k].innovation;
      variance_m2[k] *= 1.0 - rows[k].gain[k];
    }
  }
  // Seconds of this until an alternative holds; NaN: none within 3 s.
  double until(double wheel_mps, double robot_x_mps, double robot_y_mps) {
    for (int i = 1; i <= 15; i++) {
      step(wheel_mps, robot_x_mps, robot_y_mps);
      if (check.health() != 0) return i * kStep_s;
    }
    return NAN;
  }
};

TEST(test_each_lie_is_said_by_its_name_and_forgotten) {
  const struct {
    double wheel_mps, x_mps, y_mps;
    uint32_t name;
  } lies[] = {{0.5, 0, 0, WM_MOTION_HEALTH_WHEELS_SPIN},
              {0, 0.5, 0, WM_MOTION_HEALTH_PUSHED},
              {-0.3, 0.5, 0, WM_MOTION_HEALTH_LIFTED},
              {0.4, 0.4, 0.6, WM_MOTION_HEALTH_LIFTED}};
  for (const auto &lie : lies)
    for (uint64_t seed = 1; seed <= 20; seed++) {
      Drive drive(seed);
      for (int i = 0; i < 100; i++) drive.step(0.5, 0.5, 0);
      TEST_ASSERT_EQUAL_UINT32(0, drive.check.health());
      TEST_ASSERT_TRUE(drive.until(lie.wheel_mps, lie.x_mps, lie.y_mps) <= 3.0);
      for (int i = 0; i < 10; i++) drive.step(lie.wheel_mps, lie.x_mps, lie.y_mps);
      TEST_ASSERT_EQUAL_UINT32(lie.name, drive.check.health());
      // The pose is that of the positions meanwhile.
      for (int k = 0; k < 2; k++)
        TEST_ASSERT_DOUBLE_WITHIN(5 * std::sqrt(drive.variance_m2[k]), drive.true_m[k], drive.mean_m[k]);
      for (int i = 0; i < 30; i++) drive.step(0.5, 0.5, 0);
      TEST_ASSERT_EQUAL_UINT32(0, drive.check.health());
    }
}

// Five hours of a receiver that is right, and as many of one whose error is three times what it states: at most a
// second an hour.
TEST(test_a_receiver_that_is_worse_than_stated_is_no_lie) {
  for (const double larger : {1.0, 3.0}) {
    int holds = 0;
    for (uint64_t seed = 1; seed <= 100; seed++) {
      Drive drive(seed);
      for (int i = 0; i < 900; i++) {
        drive.step(0.5, 0.5, 0, larger);
        holds += drive.check.holds();
      }
    }
    TEST_ASSERT_TRUE(holds * kStep_s <= 5.0);
  }
}

// A wheel that spins: the counts turn by 1 rad/s more than the gyro.
TEST(test_one_wheel_that_spins_is_said_by_the_gyro) {
  wm::wheel_check check;
  check.init();
  const auto compare = [&check](double apart_rad, int times) {
    for (int i = 0; i < times; i++) {
      check.move({0.0, 1.0}, 0.5, 0.5, 0.0);
      check.weigh_turn(apart_rad, wm::square(0.03), 0.6, 0.5);
    }
    return check.health();
  };
  TEST_ASSERT_EQUAL_UINT32(0, compare(0.03, 1000));
  TEST_ASSERT_EQUAL_UINT32(WM_MOTION_HEALTH_ONE_WHEEL_SPINS, compare(0.5, 5));
  TEST_ASSERT_EQUAL_UINT32(0, compare(0.03, 10));
  TEST_ASSERT_EQUAL_UINT32(0, compare(0.2, 1));  // once is a bump
}

}  // namespace
