// SPDX-License-Identifier: Apache-2.0
// Markers whose errors last: each print is seen turned by an amount that wanders over seconds. A filter that takes such
// errors as fresh believes the mean of many and is far too sure; one that is told so is not.
#include "filters/slam/params.h"
#include "world.hpp"

namespace {

using namespace world;

constexpr int kMarkers = 12, kDrives = 24;
constexpr double kFresh_rad = 0.01, kLasts_rad = 0.06, kLasts_s = 1.0, kPlace_m = 0.5, kPlaceFresh_m = 0.05,
                 kGyro_radps = 0.2;

wm_slam_params params;

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
  begin();
  noise = {seed, 1, 0};
  double turned[kMarkers];
  for (double &t : turned) t = gauss(kLasts_rad);
  truth = {2, 0, wm::kHalfPi};
  const double v = 0.5, w = 0.25, dt = 0.02;
  for (int step = 0; step * dt < 12.0; step++) {
    const double t_s = step * dt;
    const double left = wm::exp(-dt / kLasts_s);
    for (double &t : turned) t = left * t + std::sqrt(1 - left * left) * gauss(kLasts_rad);
    feed(make::twist(t_s, v, w + gauss(kGyro_radps)));
    for (int i = 0; i < kMarkers; i++) {
      const wm::sin_cos a = wm::sincos(wm::kTwoPi * i / kMarkers);
      const wm_pose2 there = wm::between(truth, {3.5 * a.cos, 3.5 * a.sin, wm::kTwoPi * i / kMarkers});
      if (there.x_m < 0.0 || there.x_m * there.x_m + there.y_m * there.y_m > 6.0) continue;
      feed(seen(t_s, i,
                {there.x_m + gauss(kPlaceFresh_m), there.y_m + gauss(kPlaceFresh_m),
                 there.heading_rad + turned[i] + gauss(kFresh_rad)}));
    }
    go_on(v, w, dt);
  }
  return wm::square(heading_off()) / estimate().covariance[wm_cov_index(5, 5)];
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
  prepare("slam", &params, make::sensor("camera", NAN, NAN));
  start_at({2, 0, wm::kHalfPi}, 0.001, 0.001);
  make::markers.sigma_m = kPlace_m;
  motion.noise_yaw_rate_radps = kGyro_radps * std::sqrt(0.02);
  motion.noise_yaw_rate_rel = 0;
}
