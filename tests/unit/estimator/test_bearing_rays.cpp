// SPDX-License-Identifier: Apache-2.0
// Landmarks seen by bearings alone, with the default's start distance and a motion that is uncertain: lines far beyond
// that distance, a line that a tracker lost to another edge, a detector that states its sigma. GIVEN / WHEN / THEN;
// noise is drawn from fixed seeds.
#include "filters/slam/params.h"
#include "world.hpp"

namespace {

using namespace world;

constexpr int kLines = 16;
constexpr double kSigma = 0.003;

wm_slam_params params;
bool is_reused;  // the number of a line ahead, seen once, is another line's from 2 s on

void prepare_rays() {
  is_reused = false;
  prepare("slam", &params, make::sensor("omni", kSigma, NAN));
  make::sightings.gate_hard = 50.0;  // the default's
  start_at({}, 0.001, 0.001);
}

struct straight {
  double along_m, turned_rad, widest_rad;  // sigma of an innovation that was fused
};

// 4 m at 0.5 m/s along two rows of lines; `wrong_from_s`: from then on the line named first in each picture goes over
// to another edge, which moves by 4 mrad a picture. Error along the way, largest turn of the heading since then.
straight drive(uint64_t seed, double wrong_from_s, double stated_sigma_rad) {
  begin();
  noise = {seed, 1, 0};
  straight out{};
  double x_m = 0.0, slid_rad = 0.0, heading_rad = 0.0;
  for (int step = 0; step < 400; step++) {
    const double t_s = 0.02 * step, v = 0.5;
    feed(make::twist(t_s, v, 0.0));
    const bool wrong = t_s >= wrong_from_s;
    if (wrong && step % 5 == 0) slid_rad += 0.004;
    for (int i = 0; step % 5 == 0 && i < kLines; i++) {
      const int pair = i / 2;
      double along = pair - 2.0, aside = (i % 2 == 0 ? 1 : -1) * (4.0 + i % 3);
      if (is_reused && i == 0) {
        if (step > 0 && t_s < 2.0) continue;
        along = step == 0 ? 3.0 : 0.2;
        aside = step == 0 ? 0.3 : 1.8;
      }
      const double bearing = wm::atan2(aside, along - x_m) + gauss(kSigma);
      wm_event seen = make::sighting(t_s, 10 + i, wm::wrap(bearing + (i == 0 ? slid_rad : 0.0)), kAbsent);
      seen.as.sighting.bearing_sigma_rad = stated_sigma_rad;
      feed(seen);
      for (size_t k = 0; k < count; k++)
        if (records[k].verdict == WM_FUSED) out.widest_rad = std::fmax(out.widest_rad, std::sqrt(records[k].variance));
    }
    const wm_estimate now = estimate();
    if (!wrong) heading_rad = now.heading_rad;
    out.turned_rad = std::fmax(out.turned_rad, std::fabs(now.heading_rad - heading_rad));
    x_m += 0.02 * v;
  }
  out.along_m = estimate().pose_map_base.p_m[0] - (x_m - 0.01);
  return out;
}

// GIVEN lines 4 to 6 m away, and a speed with white noise and a scale known to 5 % (together 0.23 m of 4 m) THEN the
// way is as long as the wheels say within a sigma: bearings linearised at 1 m in full would make it 10 % too short. And
// the scale is not learnt. Over 16 seeds it is 0.15 m too long; rays that began at 1 m left -0.02 m, and in recordings
// too much certainty.
TEST(test_a_rays_first_guess_does_not_shorten_the_way) {
  double mean = 0.0, sigma = 0.0;
  for (uint64_t seed = 1; seed <= 4; seed++) {
    prepare_rays();
    motion.noise_speed_mps = 0.04;
    motion.states.sigma[WM_SPEED_SCALE] = 0.05;
    mean += 0.25 * drive(seed, 1e9, NAN).along_m;
    sigma += 0.25 * sigma_of("motion.speed_scale");
  }
  std::printf("along %.3f m, sigma of the scale %.4f\n", mean, sigma);
  TEST_ASSERT_DOUBLE_WITHIN(0.2, 0.0, mean);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.05, sigma);
}

// GIVEN a heading that is uncertain by more than a bearing from picture to picture WHEN the line that is named first is
// another edge THEN the robot does not turn with it.
TEST(test_a_line_that_is_another_one_turns_nothing) {
  double most = 0.0;
  for (uint64_t seed = 1; seed <= 4; seed++) {
    prepare_rays();
    motion.noise_yaw_rate_radps = 0.1;
    most = std::fmax(most, drive(seed, 3.0, NAN).turned_rad);
  }
  std::printf("turned by %.2f deg\n", most * 180 / M_PI);
  TEST_ASSERT_LESS_THAN_DOUBLE(2.5 * M_PI / 180, most);
}

// GIVEN a line ahead that was seen once WHEN its number returns 1 m on, at another line beside the robot THEN the ray
// begins anew: where its bearing is uncertain by a radian no linear update holds, and no gate.
TEST(test_a_ray_whose_bearing_is_not_linear_begins_anew) {
  prepare_rays();
  is_reused = true;
  params.line_rejoin = WM_SLAM_REJOIN_OFF;
  motion.noise_yaw_rate_radps = 0.1;
  TEST_ASSERT_LESS_THAN_DOUBLE(0.35, drive(1, 1e9, NAN).widest_rad);
}

// GIVEN a detector that states its sigma, and the default's states THEN rays leave the mounting's yaw alone, and the
// clock is one of 20 ms.
TEST(test_rays_of_stated_sigmas_leave_the_mounting_alone) {
  prepare_rays();
  motion.noise_yaw_rate_radps = 0.03;
  make::sightings.states.sigma[WM_SENSOR_ROW_kYaw] = -0.05;
  make::sightings.states.sigma[WM_SENSOR_ROW_kTimeOffset] = -0.1;
  drive(1, 1e9, kSigma);
  TEST_ASSERT_EQUAL_DOUBLE(0.0, value_of("omni.yaw_rad"));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.05, sigma_of("omni.yaw_rad"));
  TEST_ASSERT_LESS_OR_EQUAL_DOUBLE(0.02, sigma_of("omni.time_offset_s"));
  drive(1, 1e9, NAN);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.03, sigma_of("omni.yaw_rad"));
}

}  // namespace
