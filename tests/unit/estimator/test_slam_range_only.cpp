// SPDX-License-Identifier: Apache-2.0
// SLAM on beacons that give ranges alone, at unknown places. The noise is drawn from fixed seeds.
#include "filters/slam/params.h"
#include "world.hpp"

namespace {

using namespace world;

constexpr int kBeacons = 3;
constexpr double kStep_s = 0.05, kSpeed_mps = 1.0;
// White noise of the twist, as densities per sqrt(s), which the configuration states.
constexpr double kSpeedNoise_mps = 0.02, kRateNoise_radps = 0.005;

wm_slam_params params;
double place[kBeacons][2], range_sigma_m;

void begin(double spacing_m, double sigma_m, uint64_t seed) {
  prepare("slam", &params, make::sensor("radio", NAN, sigma_m), seed);
  motion.noise_speed_mps = kSpeedNoise_mps;
  motion.noise_yaw_rate_radps = kRateNoise_radps;
  motion.noise_speed_rel = motion.noise_yaw_rate_rel = motion.noise_side_rel = 0.0;
  start_at({}, 0.001, 0.001);
  const double corner[kBeacons][2] = {{0.5, 0.6}, {1.2, -0.7}, {-0.6, 0.3}};
  for (int i = 0; i < kBeacons; i++)
    for (int k = 0; k < 2; k++) place[i][k] = spacing_m * corner[i][k];
  range_sigma_m = sigma_m;
  world::begin();
}

// So many metres on a circle of this curvature; each beacon is heard twice a second.
void drive(double metres, double curvature_1pm) {
  const int steps = (int)(metres / (kSpeed_mps * kStep_s) + 0.5);
  for (int step = 0; step < steps; step++) {
    const double w = kSpeed_mps * curvature_1pm, spread = 1.0 / std::sqrt(kStep_s);
    feed(make::twist(now_s, kSpeed_mps + gauss(kSpeedNoise_mps * spread), w + gauss(kRateNoise_radps * spread)));
    for (int i = 0; step % 10 == 0 && i < kBeacons; i++)
      feed(make::sighting(now_s, 10 + i, NAN, view_of(place[i][0], place[i][1]).range_m + gauss(range_sigma_m)));
    go_on(kSpeed_mps, w, kStep_s);
  }
  feed(make::twist(now_s, kSpeed_mps, kSpeed_mps * curvature_1pm));
}

// A straight and a half circle, which closes with the next one; every other such loop turns to the right.
void drive_among(double spacing_m, int halves) {
  for (int i = 0; i < halves; i++) {
    drive(0.5 * spacing_m, 0.0);
    drive(0.25 * wm::kPi * spacing_m, (i / 2 % 2 ? -4.0 : 4.0) / spacing_m);
  }
}

// Landmarks on the map, of which those nearer than `near_m` to their true places are *right.
size_t placed(double near_m, int *right) {
  *right = 0;
  for (const mapped &m : map()) {
    const double *at = place[m.landmark.id - 10];
    *right += std::hypot(m.landmark.p_m[0] - at[0], m.landmark.p_m[1] - at[1]) < near_m;
  }
  return map().size();
}

// A way along a line sees a beacon and its mirror image alike; the first curve decides.
TEST(test_a_mirror_image_is_left_open_on_a_line_and_decided_by_the_first_curve) {
  for (const double spacing_m : {10.0, 60.0}) {
    begin(spacing_m, 0.01 * spacing_m, 3);
    int right;
    drive(0.5 * spacing_m, 0.0);
    TEST_ASSERT_EQUAL(0, placed(0.1 * spacing_m, &right));
    drive_among(spacing_m, 4);
    TEST_ASSERT_EQUAL(kBeacons, placed(0.1 * spacing_m, &right));
    TEST_ASSERT_EQUAL(kBeacons, right);
  }
}

// Beacons at other distances with other noise: the pose's error fits its covariance, and the map is right.
TEST(test_the_pose_among_beacons_is_as_sure_as_it_states) {
  const double kinds[][2] = {{5.0, 0.05}, {15.0, 0.1}, {40.0, 0.5}, {100.0, 1.0}};
  for (const auto &kind : kinds) {
    double sum = 0.0, worst = 0.0;
    int all_right = 0, inside = 0;
    const int seeds = 30;
    for (int seed = 1; seed <= seeds; seed++) {
      begin(kind[0], kind[1], (uint64_t)seed);
      drive_among(kind[0], 12);
      int right;
      placed(0.1 * kind[0], &right);
      const double error_m = off(), nees = nees_from(truth);
      if (right == kBeacons) worst = std::fmax(worst, error_m);
      all_right += right == kBeacons;
      inside += nees < 5.99;
      if (right == kBeacons) sum += nees;
    }
    TEST_ASSERT_GREATER_OR_EQUAL(26, inside);  // of 28.5 expected
    TEST_ASSERT_LESS_THAN_DOUBLE(3.0, sum / all_right);
    // Known weakness: of 200 drives among beacons 100 m apart, 7 take a beacon's mirror image for it; of those nearer,
    // none.
    TEST_ASSERT_GREATER_OR_EQUAL(kind[0] < 100.0 ? seeds : seeds - 1, all_right);
    TEST_ASSERT_LESS_THAN_DOUBLE(0.03 * kind[0], worst);
  }
}

// Ranges are no standard of length; times of flight are twice as uncertain.
TEST(test_the_scale_of_ranges_is_a_state_by_default) {
  for (const double bearing_sigma_rad : {(double)NAN, 0.01}) {
    begin(10.0, 0.1, 1);
    make::sightings.states.sigma[WM_SENSOR_ROW_kRangeScale] = -0.05;
    sensor.bearing_sigma_rad = bearing_sigma_rad;
    world::begin();
    TEST_ASSERT_EQUAL(1, calibration().size());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, std::isnan(bearing_sigma_rad) ? 0.1 : 0.05, calibration()[0].sigma);
  }
}

}  // namespace
