// SPDX-License-Identifier: Apache-2.0
// How large a map is, where nothing measures it: a robot whose speed is commanded and a camera whose ranges' scale
// nobody knows. And the axis along which a camera's depths are measured. GIVEN / WHEN / THEN; noise is drawn from fixed
// seeds.
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "events.hpp"
#include "filters/slam/params.h"
#include "math/arc.hpp"
#include "motion/motion_params.h"
#include "unity.h"
#include "waymark/estimator.h"
#include "waymark/random.h"

namespace {

constexpr int kCount = 14;
constexpr double kPrior = 0.05;  // of the speed's and the ranges' scale

const wm_estimator *slam;
wm_motion_params motion;
wm_slam_params params;
wm_setup setup;
wm_sensor sensor;
void *state;

struct found {
  double speed, speed_sigma, range, axis, axis_sigma;
};

void make_room() {
  slam = wm_estimator_find("slam");
  wm_params_defaults(&wm_motion_params_table, &motion);
  wm_params_defaults(&slam->params, &params);
  params.motion.sigma[0] = kPrior;  // speed_scale
  params.range_scale_sigma = kPrior;
  params.sensor_yaw_sigma_rad = 0.05;
  motion.noise_yaw_rate_radps = 0.03;
  sensor = make::sensor("camera", 0.005, 0.02);
  sensor.range_is_depth = 1;
  setup = make::setup(motion, sensor);
  setup.start = {WM_TIME_NONE, {3, 0, 0}, {0, 0, 0, 1}, wm::kHalfPi, 0.05, 0.05};
}

// Five minutes round a circle of 3 m, of which the middle third of each minute sees nothing.
found drive(uint64_t seed, double axis_rad) {
  const char *why = "";
  std::free(state);
  state = aligned_alloc(16, (slam->state_bytes(&params, &setup, &why) + 15) / 16 * 16);
  TEST_ASSERT_EQUAL(WM_OK, slam->init(state, &params, &setup));
  wm_random noise = {seed, 1, 0};
  wm_pose2 truth = {3, 0, wm::kHalfPi};
  const double dt = 0.05;
  for (int step = 0; step < 6000; step++) {
    const double v = 0.3, w = 0.1;
    const wm_event e = make::twist(step * dt, v, w);
    TEST_ASSERT_EQUAL(WM_OK, slam->predict(state, &e));
    for (int i = 0; step % 4 == 0 && step / 400 % 3 != 1 && i < kCount; i++) {
      const wm::sin_cos at = wm::sincos(wm::kTwoPi * i / kCount);
      const double radius = 4.0 + i % 3, dx = radius * at.cos - truth.x_m, dy = radius * at.sin - truth.y_m;
      const double bearing = wm::wrap(wm::atan2(dy, dx) - truth.heading_rad), distance = std::sqrt(dx * dx + dy * dy);
      if (std::fabs(bearing) > 0.6 || distance > 5.0) continue;
      const double depth = distance * wm::cos(bearing - axis_rad);
      wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX];
      size_t count = 0;
      const wm_event seen = make::sighting(step * dt, i, bearing + 0.005 * wm_random_next_normal(&noise),
                                           depth + 0.02 * wm_random_next_normal(&noise));
      TEST_ASSERT_EQUAL(WM_OK, slam->correct(state, &seen, out, WM_INNOVATIONS_PER_EVENT_MAX, &count));
    }
    const wm::arc a =
        wm::make_arc((v + 0.1 * wm_random_next_normal(&noise)) * dt,
                     w * dt + motion.noise_yaw_rate_radps * std::sqrt(dt) * wm_random_next_normal(&noise));
    truth = wm::compose(truth, {a.x_m, a.y_m, a.turn_rad});
  }
  wm_calibration_value values[64];
  const size_t n = slam->calibration(state, values, 64);
  found out{};
  for (size_t i = 0; i < n; i++) {
    if (std::strcmp(values[i].name, "motion.speed_scale") == 0) {
      out.speed = values[i].value;
      out.speed_sigma = values[i].sigma;
    }
    if (std::strcmp(values[i].name, "camera.range_scale") == 0) out.range = values[i].value;
    if (std::strcmp(values[i].name, "camera.depth_axis_rad") == 0) {
      out.axis = values[i].value;
      out.axis_sigma = values[i].sigma;
    }
  }
  return out;
}

// GIVEN a speed and ranges whose scales are known to 5 % each WHEN the map is driven through for minutes THEN only
// their product is learnt: each stays as unsure as the mean of two such, and lies as near to 1 as that says. The
// textbook's filter believes to have learnt more.
void test_a_scale_that_nothing_measures_is_not_learnt(void) {
  const double honest = kPrior / std::sqrt(2.0);
  double squares = 0.0, plain_sigma = 0.0;
  for (uint64_t seed = 1; seed <= 6; seed++) {
    const found f = drive(seed, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.03 * honest, honest, f.speed_sigma);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 1.0, f.speed * f.range);
    squares += (f.speed - 1.0) * (f.speed - 1.0) / 6;
  }
  TEST_ASSERT_LESS_THAN_DOUBLE(0.012, std::sqrt(squares));
  params.consistency = WM_SLAM_PLAIN;
  for (uint64_t seed = 1; seed <= 6; seed++) plain_sigma += drive(seed, 0.0).speed_sigma / 6;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.5 * honest, plain_sigma);
}

// GIVEN a camera whose bearings are 0 beside its lens's axis WHEN it is driven THEN the angle between is found.
void test_the_axis_of_depth_is_found(void) {
  params.depth_axis_sigma_rad = 0.05;
  for (double axis : {-0.04, 0.03}) {
    const found f = drive(7, axis);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.01, f.axis_sigma);
    TEST_ASSERT_DOUBLE_WITHIN(3.0 * f.axis_sigma, axis, f.axis);
  }
}

}  // namespace

void setUp(void) { make_room(); }
void tearDown(void) {
  std::free(state);
  state = nullptr;
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_a_scale_that_nothing_measures_is_not_learnt);
  RUN_TEST(test_the_axis_of_depth_is_found);
  return UNITY_END();
}
