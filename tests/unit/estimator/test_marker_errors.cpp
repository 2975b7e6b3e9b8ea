// SPDX-License-Identifier: Apache-2.0
// Markers whose errors last: each print is seen turned by an amount that wanders over seconds. A filter that takes such
// errors as fresh believes the mean of many and is far too sure; one that is told so is not.
#include "common/suite.h"
#include "events.hpp"
#include "filters/slam/params.h"
#include "math/arc.hpp"
#include "math/elementary.hpp"
#include "motion/motion_params.h"
#include "waymark/estimator.h"
#include "waymark/random.h"

namespace {

constexpr int kMarkers = 12, kDrives = 24;
constexpr double kFresh_rad = 0.01, kLasts_rad = 0.06, kLasts_s = 1.0, kPlace_m = 0.5, kPlaceFresh_m = 0.05,
                 kGyro_radps = 0.2;

const wm_estimator *slam;
wm_motion_params motion;
wm_slam_params params;
wm_setup setup;
wm_sensor sensor;

wm_event seen(double t_s, int32_t id, const wm_pose2 &from_eye) {
  wm_event e = make::empty(t_s, WM_EVENT_MARKER);
  e.as.marker.id = id;
  e.as.marker.p_m[0] = from_eye.x_m;
  e.as.marker.p_m[1] = from_eye.y_m;
  e.as.marker.p_m[2] = 1.0;
  e.as.marker.yaw_rad = wm::wrap(from_eye.heading_rad);
  e.as.marker.along_sigma_m = e.as.marker.bloom_px = NAN;
  e.as.marker.yaw_sigma_rad = std::sqrt(kFresh_rad * kFresh_rad + kLasts_rad * kLasts_rad);
  return e;
}

// Half a circle of 2 m past prints two of which are in view at a time; the heading's error squared in its variances.
double drive(uint64_t seed) {
  const char *why = "";
  const size_t bytes = slam->state_bytes(&params, &setup, &why);
  TEST_ASSERT_GREATER_THAN_MESSAGE(0, bytes, why);
  void *state = aligned_alloc(16, (bytes + 15) / 16 * 16);
  slam->init(state, &params, &setup);
  wm_random noise = {seed, 1, 0};
  double turned[kMarkers];
  for (double &t : turned) t = kLasts_rad * wm_random_next_normal(&noise);
  wm_pose2 truth = {2, 0, wm::kHalfPi};
  const double v = 0.5, w = 0.25, dt = 0.02;
  for (int step = 0; step * dt < 12.0; step++) {
    const double t_s = step * dt;
    const double left = wm::exp(-dt / kLasts_s);
    for (double &t : turned) t = left * t + std::sqrt(1 - left * left) * kLasts_rad * wm_random_next_normal(&noise);
    const wm_event moved = make::twist(t_s, v, w + kGyro_radps * wm_random_next_normal(&noise));
    slam->predict(state, &moved);
    for (int i = 0; i < kMarkers; i++) {
      const wm::sin_cos a = wm::sincos(wm::kTwoPi * i / kMarkers);
      const wm_pose2 there = wm::between(truth, {3.5 * a.cos, 3.5 * a.sin, wm::kTwoPi * i / kMarkers});
      if (there.x_m < 0.0 || there.x_m * there.x_m + there.y_m * there.y_m > 6.0) continue;
      const wm_event e = seen(t_s, i,
                              {there.x_m + kPlaceFresh_m * wm_random_next_normal(&noise),
                               there.y_m + kPlaceFresh_m * wm_random_next_normal(&noise),
                               there.heading_rad + turned[i] + kFresh_rad * wm_random_next_normal(&noise)});
      wm_innovation out[WM_INNOVATIONS_PER_EVENT_MAX];
      size_t count = 0;
      slam->correct(state, &e, out, WM_INNOVATIONS_PER_EVENT_MAX, &count);
    }
    const wm::arc a = wm::make_arc(v * dt, w * dt);
    truth = wm::compose(truth, {a.x_m, a.y_m, a.turn_rad});
  }
  wm_estimate e;
  slam->estimate(state, &e);
  std::free(state);
  const double off = wm::wrap(e.heading_rad - truth.heading_rad);
  return off * off / e.covariance[wm_cov_index(5, 5)];
}

double mean_nees() {
  double sum = 0.0;
  for (uint64_t seed = 1; seed <= kDrives; seed++) sum += drive(seed) / kDrives;
  return sum;
}

TEST(test_errors_that_last_are_not_averaged_away) {
  TEST_ASSERT_GREATER_THAN_DOUBLE(5.0, mean_nees());
  make::markers.correlated = kLasts_rad / std::sqrt(kFresh_rad * kFresh_rad + kLasts_rad * kLasts_rad);
  make::sightings.correlated_slots = 8;
  make::sightings.correlated_tau_s = kLasts_s;
  const double told = mean_nees();
  TEST_ASSERT_LESS_THAN_DOUBLE(2.0, told);
  TEST_ASSERT_GREATER_THAN_DOUBLE(0.3, told);
}

}  // namespace

void setUp(void) {
  slam = wm_estimator_find("slam");
  make::exact_sensors(&motion);
  wm_params_defaults(&slam->params, &params);
  make::markers.sigma_m = kPlace_m;
  motion.noise_yaw_rate_radps = kGyro_radps * std::sqrt(0.02);
  motion.noise_yaw_rate_rel = 0;
  sensor = make::sensor("camera", NAN, NAN);
  setup = make::setup(motion, sensor);
  setup.start = {WM_TIME_NONE, {2, 0, 0}, {0, 0, 0, 1}, wm::kHalfPi, 0.001, 0.001};
}
