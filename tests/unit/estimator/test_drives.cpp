// SPDX-License-Identifier: Apache-2.0
// Drives beyond rolling wheels: holonomic bases with a scale and a noise of their own sideways, and skid steer, whose
// centre of rotation and effective track are states.
#include "math/arc.hpp"
#include "math/se2.hpp"
#include "planar_fixture.hpp"
#include "waymark/random.h"

namespace {

using namespace planar;

void begin(int drive, const wm_wheels &wheels, bool default_states) {
  all_exact();
  if (default_states) wm_params_defaults(&wm_motion_params_table, &params);
  params.noise_adapt_log_sigma = 0.0;
  params.twist = WM_TWIST_MEASURED;
  params.states.drive = drive;
  states = params.states;
  planar::begin(wheels, {}, 1e-6);
}

// A measured place of base_link, by 5 mm.
void see(const wm_pose2 &truth, uint64_t number) {
  constexpr double kSigma_m = 0.005;
  for (int axis = 0; axis < 2; axis++) {
    wm::planar_row row;
    row.add(axis, 1.0);
    const double measured = (axis ? truth.y_m : truth.x_m) + kSigma_m * wm_random_normal(11, 3, 2 * number + axis);
    TEST_ASSERT_TRUE(
        filter->update(row, measured - (axis ? filter->pose().y_m : filter->pose().x_m), kSigma_m * kSigma_m));
  }
}

double sigma_of(int state) { return std::sqrt(filter->variance(state)); }

// GIVEN wheels that roll WHEN a twist has a sideways speed THEN it is used, without a state of its own: the odometry of
// a rolling base by pictures, or of a base_link that is not on the axle, has it, too.
TEST(test_a_rolling_base_uses_a_sideways_speed_without_a_scale) {
  begin(WM_DRIVE_ROLLING, make::no_wheels(), true);
  for (int i = 0; i <= 100; i++) filter->move(make::twist6(0.1 * i, 0.0, 0.3, 0.0));
  TEST_ASSERT_LESS_THAN(0, filter->motion_state(wm::kSideScale));
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 3.0, filter->pose().y_m);
}

// GIVEN a sideways speed of which rollers lose 12 % WHEN the place is seen THEN the scale is found, apart from that of
// the speed forwards.
TEST(test_the_sideways_scale_is_found) {
  begin(WM_DRIVE_HOLONOMIC, make::no_wheels(), true);
  wm_pose2 truth{};
  for (uint64_t i = 0; i <= 1200; i++) {
    const double t_s = 0.05 * static_cast<double>(i), v = 0.4 * sin(0.5 * t_s), u = 0.5 * cos(0.3 * t_s), w = 0.2;
    const double noise = 1e-3 * wm_random_normal(12, 4, i);
    filter->move(make::twist6(t_s, v + noise, u / 0.88 + noise, w));
    if (i % 4 == 0) see(truth, i);
    const wm::arc a = wm::make_arc(0.05 * v, 0.05 * u, 0.05 * w);
    truth = wm::compose(truth, {a.x_m, a.y_m, a.turn_rad});
  }
  const int side = filter->motion_state(wm::kSideScale), speed = filter->motion_state(wm::kSpeedScale);
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.88, filter->value(side) * filter->value(speed));
  TEST_ASSERT_DOUBLE_WITHIN(0.02, 1.0, filter->value(speed));
  TEST_ASSERT_DOUBLE_WITHIN(3.0 * sigma_of(side), 0.88, filter->value(side));
}

// GIVEN four wheels that slip in turns, an effective track of 1.35 times the wheels' distance and a centre of rotation
// 0.12 m ahead WHEN the place is seen THEN both are found.
TEST(test_skid_steer_finds_its_centre_and_its_track) {
  constexpr double kTrack = 1.35, kCentre_m = 0.12, kTick_m = 2 * M_PI * 0.1 / 1000;
  begin(WM_DRIVE_SKID_STEER, make::two_wheels(), true);
  TEST_ASSERT_LESS_THAN(0, filter->motion_state(wm::kSideScale));
  wm_pose2 truth{};
  double left_m = 0.0, right_m = 0.0;
  for (uint64_t i = 0; i <= 2400; i++) {
    const double t_s = 0.05 * static_cast<double>(i), v = 0.5, w = 0.6 * sin(0.2 * t_s);
    filter->move(make::quantities(
        t_s, {{WM_Q_WHEEL_TICKS_LEFT, left_m / kTick_m}, {WM_Q_WHEEL_TICKS_RIGHT, right_m / kTick_m}}));
    if (i % 4 == 0) see(truth, i);
    const double half_m = 0.5 * setup.wheels.track_m * kTrack;
    left_m += 0.05 * (v - half_m * w);
    right_m += 0.05 * (v + half_m * w);
    const wm::arc a = wm::make_arc(0.05 * v, -0.05 * kCentre_m * w, 0.05 * w);
    truth = wm::compose(truth, {a.x_m, a.y_m, a.turn_rad});
  }
  const int centre = filter->motion_state(wm::kRotationCenter), track = filter->motion_state(wm::kTrackScale);
  TEST_ASSERT_DOUBLE_WITHIN(0.02, kCentre_m, filter->value(centre));
  TEST_ASSERT_DOUBLE_WITHIN(0.03, kTrack, filter->value(track));
  TEST_ASSERT_DOUBLE_WITHIN(3.0 * sigma_of(centre), kCentre_m, filter->value(centre));
  TEST_ASSERT_DOUBLE_WITHIN(3.0 * sigma_of(track), kTrack, filter->value(track));
}

// GIVEN sources without motion WHEN no model is configured THEN it is that of a constant velocity.
TEST(test_what_the_sources_settle) {
  const auto chosen = [](uint32_t kinds) {
    wm_params_defaults(&wm_motion_params_table, &params);
    wm_motion_choose(&params, kinds);
    return params.model;
  };
  TEST_ASSERT_EQUAL(WM_MOTION_AUTO, chosen(WM_EVENT_BIT(WM_EVENT_QUANTITIES)));
  TEST_ASSERT_EQUAL(WM_MOTION_CONSTANT_VELOCITY, chosen(WM_EVENT_BIT(WM_EVENT_SIGHTING)));
}

}  // namespace
