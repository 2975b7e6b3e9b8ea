// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_EVENT_TIME_HPP
#define WAYMARK_ESTIMATOR_EVENT_TIME_HPP

#include "waymark/status.h"
#include "waymark/time.h"

namespace wm {

// Stamps beyond are absurd, and their differences would overflow.
inline constexpr wm_time_ns kMaxTime = INT64_C(1) << 62;

// May a state that stands at `now_ns` and begins at `start_ns` (WM_TIME_NONE: not yet, not said) go to `t_ns`?
inline wm_status check_event_time(wm_time_ns t_ns, wm_time_ns start_ns, wm_time_ns now_ns) {
  if (t_ns > kMaxTime || t_ns < -kMaxTime) return WM_OUT_OF_RANGE;
  if (start_ns != WM_TIME_NONE && t_ns < start_ns) return WM_TIME_RAN_BACK;
  return now_ns != WM_TIME_NONE && t_ns < now_ns ? WM_TIME_RAN_BACK : WM_OK;
}

}  // namespace wm

#endif
