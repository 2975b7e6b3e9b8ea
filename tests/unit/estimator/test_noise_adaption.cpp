// SPDX-License-Identifier: Apache-2.0
// Simulated drives whose noise is stated wrong: the estimate stays consistent by the adapted noise. GIVEN / WHEN /
// THEN; all noise is drawn from fixed seeds.
#include <cmath>
#include <cstdlib>

#include "events.hpp"
#include "filters/core/noise_adaption.hpp"
#include "math/cholesky.hpp"
#include "math/elementary.hpp"
#include "motion/motion_params.h"
#include "unity.h"
#include "waymark/estimator.h"
#include "waymark/random.h"

namespace {

constexpr double kStep_s = 0.05, kEnd_s = 240.0, kFrom_s = 60.0;
constexpr double kWay_mps = 0.05, kTurn_radps = 0.05;       // true noise, per sqrt(s)
constexpr double kBearing_rad = 0.02, kRange_m = 0.05;      // true sigmas
constexpr double kReceiver_m = 1.0, kReceiverTau_s = 20.0;  // of its correlated error; a tenth of it is white
constexpr double kInside95 = 7.815;                         // chi2, 3 degrees of freedom

// Factors of the stated sigmas over the true ones.
struct stated {
  double motion = 1.0, sensor = 1.0, receiver = 1.0;
};

struct drive {
  explicit drive(uint64_t seed) : noise{seed, 1, 0} {}

  double gauss(double sigma) { return sigma * wm_random_next_normal(&noise); }
  bool now_every(int steps) const { return step % steps == 0; }

  // Share of the NEES of the pose inside 95 % after the first minute.
  double run(const wm_estimator &estimator, const stated &by, bool has_landmarks, double adapt_log_sigma,
             bool lasting) {
    make::exact_sensors(&motion);
    motion.noise_speed_rel = motion.noise_yaw_rate_rel = motion.noise_side_rel = 0.0;
    motion.noise_speed_mps = by.motion * kWay_mps;
    motion.noise_yaw_rate_radps = by.motion * kTurn_radps;
    motion.noise_rest_factor = 1.0;
    motion.noise_adapt_log_sigma = adapt_log_sigma;
    make::exact_map(&params);
    params.gnss.correlated_m = -1.0;
    params.gnss.correlated_tau_s = kReceiverTau_s;
    params.gnss.sigma_factor = 0.1;
    if (lasting) {
      make::sightings.correlated_slots = 10;
      make::sightings.correlated_bearing_rad = make::sightings.correlated_range_m = -1.0;
    }
    for (int i = 0; i < kLandmarks; i++) {
      const double angle_rad = i * wm::kTwoPi / kLandmarks, far_m = i % 2 == 0 ? 5.0 : 8.0;
      landmarks[i] = {i, {far_m * std::cos(angle_rad), far_m * std::sin(angle_rad), 0}, 0.0, NAN, {}, 0};
      offset_rad[i] = lasting ? gauss(kBearing_rad) : 0.0;
      offset_m[i] = lasting ? gauss(kRange_m) : 0.0;
    }
    sensor = make::sensor("camera", by.sensor * kBearing_rad, by.sensor * kRange_m);
    wm_setup setup = make::setup(motion, sensor);
    setup.landmarks = landmarks;
    setup.landmark_count = kLandmarks;
    setup.start = {WM_TIME_NONE, {2, 0, 0}, {0, 0, 0, 1}, 0.0, 0.05, 0.05};
    void *state = make::begun(estimator, &params, setup);
    TEST_ASSERT_NOT_NULL(state);
    truth = {2, 0, 0};
    double receiver_m[2] = {gauss(kReceiver_m), gauss(kReceiver_m)};
    int inside = 0, judged = 0;
    for (step = 1; step * kStep_s < kEnd_s; step++) {
      const double t_s = step * kStep_s, root = std::sqrt(kStep_s);
      // Circles of changing speed, then of the other direction.
      const double v = 0.5 + 0.3 * std::sin(0.2 * t_s), w = 0.35 * std::sin(0.05 * t_s);
      const wm_event event = make::twist(t_s, v + gauss(kWay_mps) / root, w + gauss(kTurn_radps) / root);
      truth = compose_step(v, w);
      TEST_ASSERT_EQUAL(WM_OK, estimator.predict(state, &event));
      if (has_landmarks && now_every(8)) see(estimator, state, t_s);
      if (!has_landmarks && now_every(20)) {
        const double left = std::exp(-20 * kStep_s / kReceiverTau_s);
        for (double &m : receiver_m) m = left * m + gauss(kReceiver_m * std::sqrt(1.0 - left * left));
        const wm_event fix =
            make::position(t_s, truth.x_m + receiver_m[0] + gauss(0.1 * kReceiver_m),
                           truth.y_m + receiver_m[1] + gauss(0.1 * kReceiver_m), by.receiver * kReceiver_m);
        correct(estimator, state, fix);
      }
      if (t_s < kFrom_s || !now_every(10)) continue;
      judged++;
      inside += nees(estimator, state) < kInside95;
    }
    std::free(state);
    return inside / static_cast<double>(judged);
  }

 private:
  static constexpr int kLandmarks = 8;

  wm_pose2 compose_step(double v, double w) const {
    const double middle = truth.heading_rad + 0.5 * w * kStep_s;
    return {truth.x_m + v * kStep_s * std::cos(middle), truth.y_m + v * kStep_s * std::sin(middle),
            wm::wrap(truth.heading_rad + w * kStep_s)};
  }
  static void correct(const wm_estimator &estimator, void *state, const wm_event &event) {
    wm_innovation records[4];
    size_t count = 0;
    TEST_ASSERT_EQUAL(WM_OK, estimator.correct(state, &event, records, 4, &count));
  }
  void see(const wm_estimator &estimator, void *state, double t_s) {
    for (int i = 0; i < kLandmarks; i++) {
      const double dx = landmarks[i].p_m[0] - truth.x_m, dy = landmarks[i].p_m[1] - truth.y_m;
      const double bearing = wm::wrap(std::atan2(dy, dx) - truth.heading_rad);
      if (std::fabs(bearing) > 0.8) continue;
      correct(estimator, state,
              make::sighting(t_s, i, wm::wrap(bearing + offset_rad[i] + gauss(kBearing_rad)),
                             std::hypot(dx, dy) + offset_m[i] + gauss(kRange_m)));
    }
  }
  double nees(const wm_estimator &estimator, void *state) const {
    wm_estimate e;
    estimator.estimate(state, &e);
    const int at[3] = {0, 1, 5};
    double p[3][3], d[3] = {truth.x_m - e.pose_map_base.p_m[0], truth.y_m - e.pose_map_base.p_m[1],
                            wm::wrap(truth.heading_rad - e.heading_rad)};
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) p[i][j] = e.covariance[wm_cov_index(at[i], at[j])];
    TEST_ASSERT_TRUE(wm::factorize(3, p[0], 3));
    wm::substitute_forward(3, p[0], 3, d);
    return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
  }

  wm_random noise;
  wm_motion_params motion;
  wm_landmark_ekf_params params;
  wm_sensor sensor;
  wm_landmark landmarks[kLandmarks];
  double offset_rad[kLandmarks], offset_m[kLandmarks];
  wm_pose2 truth;
  int step;
};

double mean_inside(const stated &by, bool has_landmarks, double adapt_log_sigma = 1.4, bool lasting = false) {
  constexpr int kDrives = 4;
  double sum = 0.0;
  for (int i = 0; i < kDrives; i++)
    sum += drive(static_cast<uint64_t>(100 + i))
               .run(*wm_estimator_find("landmark_ekf"), by, has_landmarks, adapt_log_sigma, lasting);
  return sum / kDrives;
}

void expect_consistent(const stated &by, bool has_landmarks, bool lasting = false) {
  const double share = mean_inside(by, has_landmarks, 1.4, lasting);
  TEST_ASSERT_GREATER_OR_EQUAL_DOUBLE(0.85, share);
}

// GIVEN positions that are off by four stated sigmas WHEN nothing comes for three time constants of 1000 s THEN what
// was found of their noise is forgotten by exp(-3).
void test_what_was_found_is_forgotten(void) {
  wm::noise_adaption adaption;
  adaption.init(1.0);
  adaption.forget(make::at(0.0));
  for (int i = 0; i < 60; i++) {
    wm::noise_adaption::row row{};
    row.innovation = i % 2 ? 4.0 : -4.0;
    row.variance = row.own = 1.0;
    row.kind = wm::noise_adaption::kPlace;
    adaption.update(row);
  }
  const double found = std::log(adaption.scale(wm::noise_adaption::kPlace));
  TEST_ASSERT_GREATER_THAN_DOUBLE(1.0, found);
  for (int i = 1; i <= 3000; i++) adaption.forget(make::at(i));
  TEST_ASSERT_DOUBLE_WITHIN(0.01 * found, found * std::exp(-3.0), std::log(adaption.scale(wm::noise_adaption::kPlace)));
}

void test_right_noise_stays_consistent() {
  expect_consistent({}, true);
  expect_consistent({}, false);
  expect_consistent({}, true, true);
}

void test_noise_of_the_motion_stated_four_times_too_small() {
  TEST_ASSERT_LESS_THAN_DOUBLE(0.6, mean_inside({.motion = 0.25}, true, 0.0));
  expect_consistent({.motion = 0.25}, true);
  expect_consistent({.motion = 0.25}, true, true);
}

void test_noise_of_the_motion_stated_four_times_too_large() {
  expect_consistent({.motion = 4.0}, true);
  expect_consistent({.motion = 4.0}, false);
}

void test_noise_of_the_sensor_stated_wrong() {
  TEST_ASSERT_LESS_THAN_DOUBLE(0.87, mean_inside({.sensor = 0.25}, true, 0.0));
  expect_consistent({.sensor = 0.25}, true);
  expect_consistent({.sensor = 4.0}, true);
}

void test_noise_of_the_receiver_stated_wrong() {
  TEST_ASSERT_LESS_THAN_DOUBLE(0.6, mean_inside({.receiver = 0.25}, false, 0.0));
  expect_consistent({.receiver = 0.25}, false);
  expect_consistent({.receiver = 4.0}, false);
}

}  // namespace

void setUp(void) {}
void tearDown(void) {}

int main() {
  UNITY_BEGIN();
  RUN_TEST(test_what_was_found_is_forgotten);
  RUN_TEST(test_right_noise_stays_consistent);
  RUN_TEST(test_noise_of_the_motion_stated_four_times_too_small);
  RUN_TEST(test_noise_of_the_motion_stated_four_times_too_large);
  RUN_TEST(test_noise_of_the_sensor_stated_wrong);
  RUN_TEST(test_noise_of_the_receiver_stated_wrong);
  return UNITY_END();
}
