// SPDX-License-Identifier: Apache-2.0
// Short ways to say an event of a body in space: a velocity log with rates, an IMU with three axes.
#pragma once

#include "events.hpp"
#include "waymark/internal/math/rotation.hpp"

namespace make {

inline constexpr wm::vec3 kNoRates = {NAN, NAN, NAN};  // of a log that measures none

inline wm_event log6(double t_s, const wm::vec3 &v, const wm::vec3 &w = {0, 0, 0}) {
  wm_event e = empty(t_s, WM_EVENT_TWIST6);
  e.as.twist6 = {{v.x, v.y, v.z}, {w.x, w.y, w.z}, NAN, {}};
  return e;
}

inline wm_event imu(double t_s, const wm::vec3 &w, const wm::vec3 &f) {
  return quantities(t_s, {{WM_Q_ROLL_RATE, w.x},
                          {WM_Q_PITCH_RATE, w.y},
                          {WM_Q_YAW_RATE, w.z},
                          {WM_Q_ACCELERATION_X, f.x},
                          {WM_Q_ACCELERATION_Y, f.y},
                          {WM_Q_ACCELERATION_Z, f.z}});
}

}  // namespace make
