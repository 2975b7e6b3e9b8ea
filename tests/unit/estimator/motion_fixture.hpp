// SPDX-License-Identifier: Apache-2.0
// A motion front end whose segments are integrated: pose and variances of the way, the turn and the side. Short ways to
// put the data of a robot with counters, a speed and a gyro.
#pragma once

#include "common/suite.h"
#include "events.hpp"
#include "math/arc.hpp"
#include "motion/front_end.hpp"

namespace {

wm_motion_params params;
wm_wheels wheels;
wm::motion_front_end front;
wm_motion_calibration calibration;
wm_pose2 pose;
double way_var, turn_var, side_var;
constexpr double kTick = 2 * M_PI * 0.1 / 1000;  // of make::two_wheels()

// Default parameters, except the model, and everything from zero.
void start(const wm_wheels &w, int model = WM_MOTION_AUTO) {
  wheels = w;
  wm_params_defaults(&wm_motion_params_table, &params);
  params.model = model;
  calibration = wm::kNeutralCalibration;
  pose = {};
  way_var = turn_var = side_var = 0;
  front.init(&params, &wheels);
}

void advance(double t_s) {
  front.advance(make::at(t_s), calibration,
                [](const wm::motion_segment &s, const wm::motion_twist &t, const wm::motion_noise &n) {
                  const wm::arc a = wm::make_arc(t.v * s.dt_s, t.u * s.dt_s, t.w * s.dt_s);
                  pose = wm::compose(pose, {a.x_m, a.y_m, a.turn_rad});
                  way_var += n.distance_m2;
                  turn_var += n.rotation_rad2;
                  side_var += n.lateral_m2;
                });
}

void feed(const wm_event &e) {
  TEST_ASSERT_EQUAL(WM_OK, front.check(e));
  front.feed(e);
  advance(1e-9 * (double)e.t_ns);
}

[[maybe_unused]] void ticks(double t_s, double left, double right) {
  feed(make::quantities(t_s, {{WM_Q_WHEEL_TICKS_LEFT, left}, {WM_Q_WHEEL_TICKS_RIGHT, right}}));
}
// Both wheels rolled so far.
[[maybe_unused]] void rolled(double t_s, double way_m) { ticks(t_s, way_m / kTick, way_m / kTick); }
[[maybe_unused]] void speed(double t_s, double v) { feed(make::quantities(t_s, {{WM_Q_VEHICLE_SPEED, v}})); }
[[maybe_unused]] void gyro(double t_s, double w) { feed(make::quantities(t_s, {{WM_Q_YAW_RATE, w}})); }
[[maybe_unused]] void speed_and_gyro(double t_s, double v, double w) {
  feed(make::quantities(t_s, {{WM_Q_VEHICLE_SPEED, v}, {WM_Q_YAW_RATE, w}}));
}
[[maybe_unused]] bool has_health(uint32_t bit) { return (front.health() & bit) != 0; }
// Of the driven speed and turn rate.
[[maybe_unused]] void without_noise_of_rates() {
  params.noise_speed_mps = params.noise_speed_rel = params.noise_yaw_rate_radps = params.noise_yaw_rate_rel = 0;
}
[[maybe_unused]] double speed_at(double t_s) { return front.twist_at(make::at(t_s), calibration).v; }

}  // namespace
