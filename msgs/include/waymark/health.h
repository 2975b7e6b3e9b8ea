// SPDX-License-Identifier: Apache-2.0
// Health of a run: counts by source, calibration states, counters, deadlines. Fixed size, no pointers. Every datum from
// a source is in exactly one of: fused, rejected, refused, late, dropped, duplicates, future, or still waiting in the
// merge.
#ifndef WAYMARK_HEALTH_H
#define WAYMARK_HEALTH_H

#include <stdint.h>

#include "waymark/look.h"
#include "waymark/pose.h"
#include "waymark/status.h"
#include "waymark/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_HEALTH_SOURCES_MAX 32
#define WM_HEALTH_CALIBRATION_MAX 128  // of `calibration`, and of `more_calibration`: 16 sensors with all their states
#define WM_HEALTH_COUNTERS_MAX 16
#define WM_HEALTH_NAME_MAX 48
#define WM_HEALTH_HOST_MAX 64
#define WM_HEALTH_REASON_MAX 256
#define WM_STATUS_COUNT (WM_INTERNAL + 1)

// A live source's device. A recording has none.
typedef enum wm_device_state {
  WM_DEVICE_NONE = 0,
  WM_DEVICE_WORKS,
  WM_DEVICE_ABSENT,   // unplugged, or never plugged in; searched for repeatedly
  WM_DEVICE_DOWN,     // present, but switched off (a CAN interface that is down)
  WM_DEVICE_PASSIVE,  // a CAN controller in the state error-passive
  WM_DEVICE_BUS_OFF,  // a CAN controller in the state bus-off
  WM_DEVICE_STALLED,  // a camera that delivers no pictures
  WM_DEVICE_FROZEN,   // a camera that delivers the same picture repeatedly
  WM_DEVICE_STATE_COUNT
} wm_device_state;

// "works", "absent" ...; "" for a recording, "?" beyond.
const char *wm_device_state_name(unsigned state);

typedef struct wm_source_health {
  char name[WM_HEALTH_NAME_MAX];
  uint64_t received;                    // delivered by the source
  uint64_t fused;                       // motion accepted; observations of which at least one update was fused
  uint64_t rejected[WM_VERDICT_COUNT];  // observations of which none was fused, by the first update's verdict
  uint64_t refused[WM_STATUS_COUNT];    // not accepted by the estimator, by its status
  uint64_t late;                        // older than the watermark at its arrival
  uint64_t dropped;                     // ring or merge full
  uint64_t duplicates;                  // the same datum again
  uint64_t future;                      // stamped later than it arrived
  uint64_t lost, malformed, not_finite, out_of_order, ignored, frozen;  // the source's own (wm_source_counts)
  uint64_t overflows, bus_errors;                                       // likewise
  wm_time_ns lateness_p99_ns;                                           // arrival minus stamp, of 99 of 100
  wm_time_ns lateness_worst_ns;                                         // of all
  wm_time_ns lateness_max_ns;                                           // the config's bound
  wm_time_ns newest_ns;                                                 // newest stamp, WM_TIME_NONE before the first
  wm_time_ns silent_ns;                                                 // since its last datum, on the arrival clock
  wm_time_ns stamp_uncertainty_ns;                                      // of a device; 0 for a recording
  uint8_t stale;                                                        // silent for far longer than usual
  uint8_t device;                                                       // wm_device_state
  uint64_t looks[WM_LOOK_COUNT];  // of a detector of known landmarks: one for each landmark and picture, by wm_look
} wm_source_health;

typedef struct wm_health {
  wm_time_ns t_ns;            // on the run's clock
  wm_time_ns fused_until_ns;  // WM_TIME_NONE before the first
  uint8_t state;              // wm_state
  uint8_t cause;              // wm_cause
  int8_t cause_source;        // index into sources; -1: none
  double lost_probability;    // wm_estimate's
  uint32_t resets, jumps;
  uint32_t motion_health;  // bits of WM_MOTION_HEALTH_*
  uint32_t source_count;
  wm_source_health sources[WM_HEALTH_SOURCES_MAX];
  uint32_t calibration_count;                                   // wm_health_calibration_count() has all of them
  wm_calibration_value calibration[WM_HEALTH_CALIBRATION_MAX];  // the first ones
  uint32_t counter_count;
  wm_counter counters[WM_HEALTH_COUNTERS_MAX];
  uint64_t loops, deadlines_missed;
  uint64_t outputs_lost;  // records dropped because a sink was too slow
  uint64_t published;
  // Remaining dead reckoning until the pose is too uncertain: infinite while the robot stands, NaN without a pose.
  double reckoning_left_m, reckoning_left_s;
  wm_time_ns send_p99_ns;                 // from a pose made to its message handed to LCM, 99 of 100
  uint64_t lines_lost;                    // lines of text that a blocked disk or terminal had no room for
  uint64_t run_id;                        // random, of the run that sends; 0: none
  int32_t pid;                            // its process
  char host[WM_HEALTH_HOST_MAX];          // its computer
  uint32_t other_runs, other_runs_total;  // that publish on the same channels: now, and since the start
  // From here on unknown to programs of 0.2, and not in messages over LCM.
  uint32_t more_count;  // calibration values behind the first ones
  wm_calibration_value more_calibration[WM_HEALTH_CALIBRATION_MAX];
  uint32_t alarm_count;
  wm_alarm alarms[WM_ALARMS_MAX];
  char refused_because[WM_HEALTH_SOURCES_MAX][WM_HEALTH_REASON_MAX];  // of each source's first unusable datum; "": none
  int32_t floor;                        // of a building with several: its index in site.yaml; -1: there are none
  uint32_t floor_count;                 // 0: there are none
  double floor_probability;             // that the robot is there
  char floor_name[WM_HEALTH_NAME_MAX];  // ""
} wm_health;

static inline uint32_t wm_health_calibration_count(const wm_health *health) {
  return health->calibration_count + health->more_count;
}
// The value `i` of that many.
static inline const wm_calibration_value *wm_health_calibration(const wm_health *health, uint32_t i) {
  return i < health->calibration_count ? &health->calibration[i]
                                       : &health->more_calibration[i - health->calibration_count];
}
// Whether there is an alarm of this kind about the calibration value `i`.
static inline int wm_health_has_alarm(const wm_health *health, wm_alarm_kind kind, uint32_t i) {
  for (uint32_t k = 0; k < health->alarm_count; k++)
    if (health->alarms[k].kind == (uint32_t)kind && health->alarms[k].calibration == (int32_t)i) return 1;
  return 0;
}

// The counter of this kind, or a null pointer where the estimator has none.
static inline const wm_counter *wm_health_counter(const wm_health *health, wm_counter_kind kind) {
  for (uint32_t i = 0; i < health->counter_count; i++)
    if (health->counters[i].kind == (uint32_t)kind) return &health->counters[i];
  return 0;
}

#ifdef __cplusplus
}
#endif

#endif
