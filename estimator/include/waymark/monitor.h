// SPDX-License-Identifier: Apache-2.0
// Monitor of the innovations: whether the observations of a run agree with its poses. It is one for all estimators: it
// takes the records of their updates (wm_innovation), of each source over a sliding window, and corrects state, cause,
// covariance and probability of being lost of their estimates. Constant memory and cost; the same events give the same
// bits. The estimator's own state is not changed.
#ifndef WAYMARK_MONITOR_H
#define WAYMARK_MONITOR_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/estimator.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_MONITOR_SOURCES 32  // more are not monitored
#define WM_MONITOR_SLOTS 40    // of a source: more than the longest window has
#define WM_MONITOR_KINDS 3     // kinds of residuals of a source; further ones are not monitored

// Observations of a source so near in time that they share their errors.
typedef struct wm_monitor_slot {
  wm_time_ns begin_ns, newest_ns;
  uint32_t stamps;                   // different ones
  uint32_t observations;             // fused, refused by a gate, or of an unknown identity
  double refused, unknown;           // of these
  double sum[WM_MONITOR_KINDS];      // of the fused innovations over their sigma
  double squares;                    // likewise, of all kinds
  uint32_t fused[WM_MONITOR_KINDS];  // scalar innovations
  uint32_t scalars;                  // of all kinds
} wm_monitor_slot;

// What the windows show of a source.
typedef struct wm_monitor_source {
  wm_monitor_slot slots[WM_MONITOR_SLOTS];  // a ring; `opened` counts them
  uint64_t opened;
  wm_time_ns newest_ns;  // of its observations; WM_TIME_NONE: none yet
  double slot_s;         // length of its slots
  uint32_t kinds;        // of residuals that were seen, at most WM_MONITOR_KINDS
  uint8_t residual[WM_MONITOR_KINDS];
  uint8_t cause;  // wm_cause at the last step
} wm_monitor_source;

#define WM_MONITOR_COURSE_SLOTS 33

// Positions near in time, and the mean of the dead reckoning at their stamps.
typedef struct wm_monitor_course_slot {
  wm_time_ns begin_ns;
  double count, variance;  // sum of the stated ones, m2, both axes
  double place_m[2];       // sums
  double way_m[2];         // sums of the dead reckoning
} wm_monitor_course_slot;

// Positions against the motion between them.
typedef struct wm_monitor_course {
  wm_monitor_course_slot slots[WM_MONITOR_COURSE_SLOTS];  // a ring; `opened` counts them
  uint64_t opened;
  double way_m[2], heading_rad;  // dead reckoning until `until_ns`
  double v_mps[2], w_radps;      // from there on
  wm_time_ns until_ns;
  double impossible_s;  // time of turns that no vehicle can drive, less that of others
  int32_t is_mirrored, is_impossible;
  // Log likelihood ratio of the mirror image (NAN: not known), the least so far, and where the image lies: turned about
  // mirror_way_m, then shifted from there to mirror_place_m.
  double nats, least_nats;
  double mirror_turn_rad, mirror_way_m[2], mirror_place_m[2];
} wm_monitor_course;

#define WM_MONITOR_LANDMARKS 48

// A residual of a landmark: its slots' mean innovations over sigma, summed up with forgetting.
typedef struct wm_monitor_landmark {
  int32_t id;
  uint16_t source;
  uint16_t residual;
  wm_time_ns at_ns, slot_ns;  // of the sum; begin of the present slot
  double sum, variance;
  double slot_sum, slot_count;
} wm_monitor_landmark;

typedef struct wm_monitor_landmarks {
  wm_monitor_landmark entries[WM_MONITOR_LANDMARKS];
  uint32_t count;
  int32_t contradicts;
} wm_monitor_landmarks;

typedef struct wm_monitor {
  wm_monitor_source sources[WM_MONITOR_SOURCES];
  uint64_t observers;  // bit for each source that may give observations
  wm_monitor_course course;
  wm_monitor_landmarks landmarks;     // of a known map
  double mirrored_m2, mirrored_rad2;  // what the chance of a mirror image adds to the covariance
  double spread_m2;                   // variance of a place anywhere on the map, each axis
  double low_m[2], high_m[2];         // the map, else the way so far
  double doubt_s;                     // time of contradiction that fitting observations have not made up for
  double fitted_s;                    // time of fitting observations since the pose was set or found
  double since_found_s;               // since a search found a pose
  double contradicted_s;              // lost or contradicted, less a share of the time without doubt
  double proof_s;                     // of driving in agreement with the observations
  double lost_s;                      // by the estimator, without a break
  wm_time_ns begun_ns, stepped_ns, next_ns;
  uint32_t resets;
  int32_t cause, source;        // of the present doubt; source -1: none
  int32_t has_positions;        // a position was fused
  int32_t found, is_map_known;  // found: poses that a search found, one soon after the other
  int32_t is_unsupported, is_outside;
  int32_t was_lost, silent;             // by the estimator; silent: source, -1: none
  int32_t is_probation;                 // of a found pose, until it fits
  int32_t is_found_early;               // a pose was found before one was proven
  int32_t is_calibration_contradicted;  // a scale, a lasting error or an adapted noise
} wm_monitor;

// `observers`: bit for each of the run's sources that may give observations. The setup is not kept.
void wm_monitor_init(wm_monitor *self, const wm_setup *setup, uint64_t observers);
// After each event that the estimator was given: the records of its update. True: a step is due.
int wm_monitor_take(wm_monitor *self, const wm_event *event, const wm_innovation *records, size_t count);
// With the estimator's own estimate and alarms, a few times a second of the events' time.
void wm_monitor_step(wm_monitor *self, const wm_estimate *estimate, const wm_alarm *alarms, size_t count);
// State, cause, covariance and probability of being lost, as the monitor finds them. Without doubt nothing changes.
void wm_monitor_judge(const wm_monitor *self, wm_estimate *estimate);
// Probability that something is wrong which no test could see yet: until observations have fitted for 5 s.
double wm_monitor_untested(const wm_monitor *self);
// The pose that is right if turn or positions are mirrored, with that probability; 0: it is none of weight.
int wm_monitor_image(const wm_monitor *self, wm_hypothesis *out);
// Whether the pose is in doubt.
int wm_monitor_doubts(const wm_monitor *self);

#ifdef __cplusplus
}
#endif

#endif
