// SPDX-License-Identifier: Apache-2.0
// A motion front end whose segments are integrated: pose and variances of the way, the turn and the side.
#pragma once

#include "events.hpp"
#include "math/arc.hpp"
#include "motion/front_end.hpp"
#include "unity.h"

namespace {

wm_motion_params params;
wm_wheels wheels;
wm::motion_front_end front;
wm_motion_calibration calibration;
wm_pose2 pose;
double way_var, turn_var, side_var;

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
                  const wm::arc a = wm::make_arc(t.v * s.dt_s, t.w * s.dt_s);
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

}  // namespace
