// SPDX-License-Identifier: Apache-2.0
// Wheel counters of few ticks: their rounding must not become a calibration.
#include "world.hpp"

namespace {

using namespace world;

constexpr int kLandmarks = 6;
constexpr double kTick_m = 2 * M_PI * 0.25 / 256, kTrack_m = 1.2, kPeriod_s = 0.02;

// A robot that drives squares, sees all landmarks of a known map, and counts its wheels in steps of 6 mm.
double way_m[2];

void begin_counting(uint64_t seed) {
  prepare_ekf(make::sensor("camera", 0.005, NAN), seed);
  all_by_default();
  put_on_map({}, 0);
  for (int i = 0; i < kLandmarks; i++) {
    const wm::sin_cos at = wm::sincos(wm::kTwoPi * i / kLandmarks);
    landmarks[i] = {i, {8.0 + 22.0 * at.cos, 8.0 + 22.0 * at.sin, NAN}, 0.01, NAN, {}, 0};
  }
  setup.landmark_count = kLandmarks;
  setup.wheels = {0.25, 256, kTrack_m, NAN, NAN, NAN, 0, {}, {}};
  start_at({}, 0.02, 0.01);
  begin();
  now_s = 10.0;
  way_m[0] = 0.0013, way_m[1] = 0.0047;
}

void look() {
  for (int i = 0; i < kLandmarks; i++)
    feed(make::sighting(now_s, i, view_of(landmarks[i].p_m[0], landmarks[i].p_m[1]).bearing_rad + gauss(0.005), NAN));
}

void roll(double v, double w, double dt_s) {
  go_on(v, w, dt_s);
  for (int side = 0; side < 2; side++) way_m[side] += (v + (side == 0 ? -0.5 : 0.5) * kTrack_m * w) * dt_s;
}

// Straight on for 6 s, then around a corner. Looks 10 ms after a count, 20 times a second: the pose there is carried on
// by that count's speed. Counts of a constant speed have roundings in a pattern.
void drive_side() {
  const double straight_s = 6.0, turn_s = 8.0;
  for (int i = 0; i < static_cast<int>((straight_s + turn_s) / kPeriod_s); i++) {
    const double turned_s = i * kPeriod_s - straight_s;
    const double v = 2.0 + 0.2 * wm::sin(0.7 * now_s);
    const double w = turned_s < 0.0 ? 0.0 : 0.2 * (1.0 - wm::cos(wm::kTwoPi * turned_s / turn_s));
    feed(make::quantities(now_s, {{WM_Q_WHEEL_TICKS_LEFT, std::floor(way_m[0] / kTick_m)},
                                  {WM_Q_WHEEL_TICKS_RIGHT, std::floor(way_m[1] / kTick_m)}}));
    roll(v, w, 0.5 * kPeriod_s);
    if (i % 5 == 0 || i % 5 == 2) look();
    roll(v, w, 0.5 * kPeriod_s);
  }
}

// The rounding of the newest count is in the pose that it carries on, and in that pose's correlation with the track.
TEST(test_rounding_of_counts_is_no_track) {
  double sum = 0.0;
  for (uint64_t seed = 1; seed <= 4; seed++) {
    begin_counting(seed);
    for (int side = 0; side < 8; side++) drive_side();
    sum += (value_of("motion.track_scale") - 1.0) / sigma_of("motion.track_scale");
  }
  TEST_ASSERT_DOUBLE_WITHIN(1.0, 0.0, sum / 4);
}

}  // namespace
