// SPDX-License-Identifier: Apache-2.0
// A planar filter whose states are examined. All is exact and no term of the motion is a state, but what a test
// switches on between all_exact() and begin().
#pragma once

#include <memory>

#include "common/suite.h"
#include "events.hpp"
#include "filters/planar/planar_filter.hpp"

namespace planar {

inline wm_motion_params params;
inline wm_motion_states states;
inline wm_setup setup;
inline std::unique_ptr<wm::planar_filter_of<64>> filter;

inline void all_exact() {
  make::exact_motion(&params);
  states = {};
  setup = {};
  setup.motion = &params;
  filter = std::make_unique<wm::planar_filter_of<64>>();
}

// From the setup as it is, with room for `more` states.
inline void begin_again(int more = 0) {
  filter->init(setup, states, wm::kPoseStates + wm::planar_filter::count_motion_states(states, params.model) + more);
}

// `sigma`: of the start, in m and rad.
inline void begin(const wm_wheels &wheels, const wm_pose2 &at, double sigma, int more = 0) {
  setup.wheels = wheels;
  setup.start = {WM_TIME_NONE, {at.x_m, at.y_m, 0}, {0, 0, 0, 1}, at.heading_rad, sigma, sigma};
  begin_again(more);
}

// Twists that swing, so that all states are correlated.
inline wm_event swinging(int i) { return make::twist(0.1 * i, 1.0 + 0.3 * sin(i), 0.5 * cos(0.7 * i)); }
inline void drive_swinging() {
  for (int i = 0; i <= 20; i++) filter->move(swinging(i));
}

}  // namespace planar
