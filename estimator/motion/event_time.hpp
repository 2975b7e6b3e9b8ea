// SPDX-License-Identifier: Apache-2.0
// What motion asks of an event: its time, and whether its twist has rates.
#ifndef WAYMARK_ESTIMATOR_EVENT_TIME_HPP
#define WAYMARK_ESTIMATOR_EVENT_TIME_HPP

#include "math/elementary.hpp"
#include "waymark/event.h"
#include "waymark/internal/math/rotation.hpp"
#include "waymark/status.h"

namespace wm {

// Stamps beyond are absurd, and their differences would overflow.
inline constexpr wm_time_ns kMaxTime = INT64_C(1) << 62;

// May a state that stands at `now_ns` and begins at `start_ns` (WM_TIME_NONE: not yet, not said) go to `t_ns`?
inline wm_status check_event_time(wm_time_ns t_ns, wm_time_ns start_ns, wm_time_ns now_ns) {
  if (t_ns > kMaxTime || t_ns < -kMaxTime) return WM_OUT_OF_RANGE;
  if (start_ns != WM_TIME_NONE && t_ns < start_ns) return WM_TIME_RAN_BACK;
  return now_ns != WM_TIME_NONE && t_ns < now_ns ? WM_TIME_RAN_BACK : WM_OK;
}

// ── a velocity log's twist ──────────────────────────────────────────────────────────────────────────────────────────

// Any of them: one without the others is refused.
inline bool has_rates(const wm_twist6 &twist) {
  return !std::isnan(twist.w_radps[0]) || !std::isnan(twist.w_radps[1]) || !std::isnan(twist.w_radps[2]);
}

// Velocity of base_link's origin, m/s, while the vehicle turns by w_radps: v - w x arm.
inline vec3 velocity_of_base(const wm_twist6 &twist, const vec3 &w_radps) {
  const vec3 v = vec_of(twist.v_mps);
  return finite(twist.arm_m[0]) ? v - cross(w_radps, vec_of(twist.arm_m)) : v;
}

}  // namespace wm

#endif
