// SPDX-License-Identifier: Apache-2.0
// The heading by the wheels' counts beside that of the gyro: each finds the other's errors, a slip is not believed.
#include <memory>
#include <string>

#include "common/suite.h"
#include "events.hpp"
#include "filters/planar/planar_filter.hpp"
#include "math/elementary.hpp"
#include "waymark/random.h"

namespace {

constexpr double kTick_m = 2 * M_PI * 0.3 / 1000, kTrack_m = 1.5;
constexpr double kGyroNoise = 0.02;  // rad/s each sample: a bad one, 0.002 rad per sqrt(s)

struct Car {
  wm_motion_params motion;
  wm_setup setup = {};
  wm_motion_states states = {};
  std::unique_ptr<wm::planar_filter_of<64>> filter = std::make_unique<wm::planar_filter_of<64>>();
  double t_s = 0, left_m = 0, right_m = 0;
  uint64_t sample = 0;

  explicit Car(bool with_wheels) {
    wm_params_defaults(&wm_motion_params_table, &motion);
    motion.model = WM_MOTION_SPEED_YAW_RATE;
    motion.noise_speed_mps = motion.noise_speed_rel = motion.noise_side_rel = 0.001;
    motion.noise_yaw_rate_radps = 0.1 * kGyroNoise;  // 100 samples a second
    motion.noise_yaw_rate_rel = 0;
    motion.noise_ticks_per_sqrt_m = 0.0002;
    motion.standstill_bias_sigma_radps = kGyroNoise;
    setup.motion = &motion;
    setup.wheels = make::car();
    setup.start.t_ns = WM_TIME_NONE;
    setup.start.sigma_xy_m = 0.01;
    setup.start.sigma_heading_rad = 0.001;
    states.sigma[wm::kYawRateBias] = 0.005;
    states.sigma[wm::kTrackScale] = 0.01;
    states.wheel_difference_sigma = with_wheels ? 0.0141 : 0.0;
    states.wheel_difference_walk = 0.00001;
    begin();
  }
  void begin() { filter->init(setup, states, wm::kPoseStates + wm::planar_filter::count_motion_states(states)); }

  // One step of 10 ms; the right wheel is larger than stated by `difference`.
  void step(double v, double w, double bias, double difference, double slip_m = 0) {
    const double rate = w + bias + kGyroNoise * wm_random_normal(5, 1, sample);
    filter->move(make::quantities(t_s, {{WM_Q_YAW_RATE, rate}}));
    if (sample % 2 == 0)
      filter->move(make::quantities(t_s, {{WM_Q_WHEEL_TICKS_LEFT, std::floor(left_m / kTick_m)},
                                          {WM_Q_WHEEL_TICKS_RIGHT, std::floor(right_m / kTick_m)}}));
    left_m += 0.01 * (v - 0.5 * kTrack_m * w);
    right_m += 0.01 * (v + 0.5 * kTrack_m * w) / (1 + difference) + slip_m;
    t_s += 0.01;
    sample++;
  }
  double sigma_heading() const { return std::sqrt(filter->variance(wm::kHeading)); }
};

// Found values are asked by their names, as a person would.
wm_calibration_value named(const Car &car, const char *name) {
  wm_calibration_value values[16];
  wm::calibration_list list(values, 16);
  car.filter->list_motion_states(&list);
  for (size_t i = 0; i < list.count(); i++)
    if (std::string(values[i].name) == name) return values[i];
  TEST_FAIL_MESSAGE(name);
  return {};
}

TEST(test_the_gyro_tells_the_wheels_and_the_wheels_hold_the_heading) {
  Car with(true), without(false);
  double heading = 0;
  for (int i = 0; i < 12000; i++) {  // two minutes with an S now and then; bias and radii differ in how speed acts
    const double w = i % 2000 < 400 ? 0.25 : i % 2000 < 800 ? -0.25 : 0.0;
    const double v = i < 1000 ? 0.0 : i % 3000 < 1000 ? 1.0 : 4.0;
    for (Car *car : {&with, &without}) car->step(v, v > 0 ? w : 0, 0.004, 0.01);
    if (v == 0) continue;
    heading += 0.01 * w;
  }
  TEST_ASSERT_DOUBLE_WITHIN(4 * with.sigma_heading(), 0, wm::wrap(with.filter->pose().heading_rad - heading));
  const wm_calibration_value difference = named(with, "motion.wheel_difference");
  TEST_ASSERT_DOUBLE_WITHIN(4 * difference.sigma, 0.01, difference.value);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.001, difference.sigma);
  const wm_calibration_value bias = named(with, "motion.yaw_rate_bias_radps");
  TEST_ASSERT_DOUBLE_WITHIN(4 * bias.sigma, 0.004, bias.value);
  // The bad gyro alone has walked by 0.002 sqrt(120) and more, by its bias.
  std::printf("sigma of the heading %g with the wheels, %g without; difference %g +- %g\n", with.sigma_heading(),
              without.sigma_heading(), difference.value, difference.sigma);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.02, without.sigma_heading());
  TEST_ASSERT_LESS_THAN_DOUBLE(0.6 * without.sigma_heading(), with.sigma_heading());
  for (int i = 0; i < with.filter->states(); i++) {
    TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0, with.filter->variance(i));
    for (int j = 0; j < i; j++) TEST_ASSERT_EQUAL_DOUBLE(with.filter->covariance(i, j), with.filter->covariance(j, i));
  }
}

// The heading by the counts begins at the filter's, with the rounding of both counts to a tick: a twelfth of its square
// each, over the track.
TEST(test_the_heading_by_the_counts_begins_with_their_rounding) {
  Car car(true);
  const int heading = car.filter->states() - 1;
  while (car.t_s < 5.0 && car.filter->variance(heading) == 0.0) car.step(2.0, 0, 0.0, 0.0);
  const double rounding = kTick_m * kTick_m / (kTrack_m * kTrack_m) / 6.0;
  TEST_ASSERT_DOUBLE_WITHIN(1e-6 * rounding, rounding,
                            car.filter->variance(heading) - car.filter->variance(wm::kHeading));
  TEST_ASSERT_EQUAL_DOUBLE(car.filter->variance(wm::kHeading), car.filter->covariance(heading, wm::kHeading));
}

// Its variance grows by walk^2 a metre of the way, here without a gyro of use.
TEST(test_the_difference_of_the_wheels_walks_with_the_way) {
  Car car(true);
  car.motion.noise_yaw_rate_radps = 1e3;
  car.states.wheel_difference_walk = 0.001;
  car.begin();
  for (int i = 0; i < 2000; i++) car.step(5.0, 0, 0, 0);
  const double sigma = named(car, "motion.wheel_difference").sigma;
  TEST_ASSERT_DOUBLE_WITHIN(2e-6, 0.0141 * 0.0141 + 1e-6 * 100.0, sigma * sigma);
}

TEST(test_a_slip_is_not_believed) {
  Car slipping(true), holding(true);
  for (int i = 0; i < 6000; i++) {
    holding.step(2.0, 0, 0.0, 0.01);
    slipping.step(2.0, 0, 0.0, 0.01, i == 4000 ? 0.3 : 0);  // as if turned by 0.2 rad
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.03, holding.filter->pose().heading_rad, slipping.filter->pose().heading_rad);
  TEST_ASSERT_DOUBLE_WITHIN(0.002, 0.01, named(slipping, "motion.wheel_difference").value);
}

// Slip of one wheel by 1 %, Gauss-Markov over 5 s, as of tyres in bends: twenty times the walk of the difference that
// is stated. The track keeps what the gyro knows of it, within 2.9 sigma; it is 8.8 sigma off with the stated walk
// alone.
TEST(test_slip_that_lasts_is_no_calibration) {
  Car car(true);
  double heading = 0, slip = 0;
  for (int i = 0; i < 20000; i++) {
    const double w = i % 2000 < 400 ? 0.25 : i % 2000 < 800 ? -0.25 : 0.0, v = i < 1000 ? 0.0 : 4.0;
    slip += -slip * 0.01 / 5.0 + 0.01 * std::sqrt(2 * 0.01 / 5.0) * wm_random_normal(7, 2, static_cast<uint64_t>(i));
    car.step(v, v > 0 ? w : 0, 0.004, 0.005, slip * v * 0.01);
    heading += v > 0 ? 0.01 * w : 0;
  }
  const wm_calibration_value track = named(car, "motion.track_scale"), bias = named(car, "motion.yaw_rate_bias_radps");
  TEST_ASSERT_DOUBLE_WITHIN(3.5 * track.sigma, 1.0, track.value);
  TEST_ASSERT_DOUBLE_WITHIN(2.5 * bias.sigma, 0.004, bias.value);
  TEST_ASSERT_DOUBLE_WITHIN(2.5 * car.sigma_heading(), 0, wm::wrap(car.filter->pose().heading_rad - heading));
}

// Such a slip, from the first metre on, looks like a track that is stated wrongly in the first bend: it is no alarm.
TEST(test_slip_beside_a_gyro_accuses_no_track) {
  for (uint64_t seed = 1; seed <= 20; seed++) {
    Car car(true);
    double slip = 0;
    for (int i = 0; i < 1500; i++) {
      slip +=
          -slip * 0.01 / 5.0 + 0.014 * std::sqrt(2 * 0.01 / 5.0) * wm_random_normal(7, seed, static_cast<uint64_t>(i));
      car.step(2.0, i > 800 ? 0.1 : 0, 0.004, 0.02, slip * 0.02);
      wm_alarm alarms[4];
      wm::calibration_list list(alarms, 4);
      car.filter->list_motion_states(&list);
      TEST_ASSERT_EQUAL(0, list.finish_alarms());
    }
  }
}

// GIVEN counts of 0.09 m WHEN the robot drives straight THEN the turn rate by the counts jumps by 3 rad/s, and the one
// for a time offset's derivative stays 0. In a turn that is faster than the dead band it follows.
TEST(test_steps_of_the_counts_are_no_turn) {
  Car car(false);
  car.motion.model = WM_MOTION_TICKS;
  car.setup.wheels.ticks_per_turn = 20;
  car.filter->init(car.setup, car.states, wm::kPoseStates + wm::planar_filter::count_motion_states(car.states));
  constexpr double kCoarse_m = 2 * M_PI * 0.3 / 20;
  double left_m = 0.03, right_m = 0, most = 0, most_shiver = 0;
  const auto drive = [&](double w, int steps) {
    for (int i = 0; i < steps; i++) {
      car.filter->move(make::quantities(car.t_s, {{WM_Q_WHEEL_TICKS_LEFT, std::floor(left_m / kCoarse_m)},
                                                  {WM_Q_WHEEL_TICKS_RIGHT, std::floor(right_m / kCoarse_m)}}));
      left_m += 0.02 * (1.0 - 0.5 * kTrack_m * w);
      right_m += 0.02 * (1.0 + 0.5 * kTrack_m * w);
      car.t_s += 0.02;
      most = std::fmax(most, std::fabs(car.filter->steady({}).w));
      wm::motion_twist twist{};
      car.filter->path(car.filter->now_ns(), car.filter->now_ns() + 1, &twist);
      most_shiver = std::fmax(most_shiver, std::fabs(twist.w));
    }
  };
  drive(0, 500);
  TEST_ASSERT_GREATER_THAN_DOUBLE(3.0, most_shiver);
  TEST_ASSERT_EQUAL_DOUBLE(0.0, most);
  drive(3.0, 500);
  TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(3.5, car.filter->steady({}).w);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.5, car.filter->steady({}).w);
}

TEST(test_a_pose_given_from_outside_is_kept) {
  Car car(true);
  for (int i = 0; i < 2000; i++) car.step(2.0, 0, 0.0, 0.0);
  const double exact[3][3] = {{1e-6, 0, 0}, {0, 1e-6, 0}, {0, 0, 1e-8}};
  car.filter->set_pose({0, 0, 1.0}, exact);
  for (int i = 0; i < 200; i++) car.step(2.0, 0, 0.0, 0.0);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 1.0, car.filter->pose().heading_rad);
}

// A day, with stops and turns: covariances stay covariances.
TEST(test_a_day_leaves_the_covariance_sound) {
  Car car(true);
  for (int i = 0; i < 24 * 3600 * 4; i++) {
    const double v = i % 4000 < 300 ? 0.0 : i % 4000 < 2000 ? 0.5 : -0.4;
    car.step(v, v > 0 && i % 200 < 100 ? 0.3 : 0.0, 0.002, -0.008);
    if (i % 1000) continue;
    for (int a = 0; a < car.filter->states(); a++)
      for (int b = 0; b <= a; b++) {
        const double bound = std::sqrt(car.filter->variance(a) * car.filter->variance(b));
        TEST_ASSERT_DOUBLE_WITHIN(bound * (1 + 1e-9) + 1e-15, 0.0, car.filter->covariance(a, b));
        TEST_ASSERT_TRUE(car.filter->covariance(a, b) == car.filter->covariance(b, a));
      }
  }
  const wm_calibration_value difference = named(car, "motion.wheel_difference");
  TEST_ASSERT_DOUBLE_WITHIN(5 * difference.sigma, -0.008, difference.value);
}

TEST(test_wheels_of_unknown_track_are_left_alone) {
  Car car(true);
  car.setup.wheels.track_m = NAN;
  car.filter->init(car.setup, car.states, wm::kPoseStates + wm::planar_filter::count_motion_states(car.states));
  for (int i = 0; i < 2000; i++) car.step(2.0, 0.1, 0.0, 0.01);
  TEST_ASSERT_DOUBLE_IS_DETERMINATE(car.filter->pose().heading_rad);
  TEST_ASSERT_DOUBLE_IS_DETERMINATE(car.sigma_heading());
  TEST_ASSERT_EQUAL_DOUBLE(0, named(car, "motion.wheel_difference").value);
}

}  // namespace
