// SPDX-License-Identifier: Apache-2.0
// How far the robot may be from a published pose, for a stated risk. The model is in docs/usable.md.
#ifndef WAYMARK_BOUND_H
#define WAYMARK_BOUND_H

#include <stdint.h>

#include "waymark/time.h"

#ifdef __cplusplus
extern "C" {
#endif

// Why a pose is not to be acted on. The numbers and names are stable.
typedef enum wm_unusable {
  WM_UNUSABLE_NOT = 0,      // it is usable
  WM_UNUSABLE_NO_POSE,      // searching
  WM_UNUSABLE_UNMONITORED,  // its estimator gives no probability that it is wrong
  WM_UNUSABLE_DOUBT,        // it is wrong with a larger probability than the risk: wm_bound.cause
  WM_UNUSABLE_UNTESTED,     // observations have not fitted it for long enough yet
  WM_UNUSABLE_POSITION,     // horizontal_m is beyond integrity.alert_limit_m
  WM_UNUSABLE_HEADING,      // heading_rad is beyond integrity.alert_limit_heading_deg
  WM_UNUSABLE_COUNT
} wm_unusable;

// "", "no_pose", "doubt" ...; "?" beyond.
const char *wm_unusable_name(unsigned why);

typedef struct wm_bound {
  wm_time_ns t_ns;  // of the pose
  double risk;      // probability that the pose is off by more than a bound
  // Infinity: not bounded.
  double horizontal_m, heading_rad;
  double limit_m, limit_rad;  // the configuration's; infinity: none
  double heading_after_m;     // so far a straight drive makes the heading known; 0: it is; NaN: that is not known
  uint8_t usable;             // 1: both bounds are finite and within the limits
  uint8_t why;                // wm_unusable
  uint8_t cause;              // wm_cause of the pose
  int8_t cause_source;        // index into the run's sources; -1: none
  uint8_t reserved[4];
} wm_bound;

#ifdef __cplusplus
}
#endif

#endif
