// SPDX-License-Identifier: Apache-2.0
// State of the robot at one time, record of one update, and the published pose.
#ifndef WAYMARK_POSE_H
#define WAYMARK_POSE_H

#include <stdint.h>

#include "waymark/frames.h"
#include "waymark/time.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum wm_state {
  WM_STATE_SEARCHING = 0,       // no pose known yet
  WM_STATE_TRACKING = 1,        // observations are being fused and fit
  WM_STATE_DEAD_RECKONING = 2,  // no observation fused for a while; the covariance grows
  WM_STATE_LOST = 3,            // observations contradict the pose; relocalization is under way
  WM_STATE_DEGRADED = 4,        // recent observations contradict the pose or do not support it: wm_cause
  WM_STATE_COUNT
} wm_state;

// Why a state is not TRACKING, or is doubtful. The numbers and names are stable: messages and tables have them.
typedef enum wm_cause {
  WM_CAUSE_NONE = 0,
  WM_CAUSE_CONTRADICTED,  // the estimator's own evidence contradicts the pose
  WM_CAUSE_REFUSED,       // the gates refuse most updates of a source
  WM_CAUSE_INCONSISTENT,  // fused innovations of a source are larger than their variance
  WM_CAUSE_BIASED,        // fused innovations of a source have a mean
  WM_CAUSE_LOST_AGAIN,    // a found pose was lost again soon; the next one is on probation
  WM_CAUSE_UNKNOWN,       // identities of a source's observations are not in the map
  WM_CAUSE_SILENT,        // a source gives no observations any more
  WM_CAUSE_OFF_MAP,       // the pose is outside of the map
  WM_CAUSE_TURN,          // the measured turn has another sign or unit than the observations show
  WM_CAUSE_FLOOR,         // the robot may be on another floor
  WM_CAUSE_COUNT
} wm_cause;

const char *wm_state_name(unsigned state);
// "refused", "inconsistent" ...; "" for none, "?" beyond.
const char *wm_cause_name(unsigned cause);

// An estimate of base_link in map. Covariance 6x6 row by row in (x, y, z, rx, ry, rz): position in map axes, rotation
// as a vector in the body's axes (R_true = R_est Exp(r)). A planar estimator fills x, y and rz and leaves the rest 0.
typedef struct wm_estimate {
  wm_time_ns t_ns;
  wm_pose3 pose_map_base;
  double heading_rad;
  double covariance[36];
  double v_mps[3];      // body axes
  double w_radps[3];    // body axes
  uint32_t resets;      // times that the pose was set anew: start, set_pose, recovery
  uint8_t dof;          // 3 or 6
  uint8_t state;        // wm_state
  uint8_t cause;        // wm_cause
  int8_t cause_source;  // index into the run's sources; -1: none
  // Probability that the robot is not where this pose is: 1 while searching, NaN: not estimated.
  double lost_probability;
} wm_estimate;

static inline int wm_cov_index(int row, int column) { return 6 * row + column; }

// Measured quantity of a scalar (or jointly gated) update.
typedef enum wm_residual {
  WM_RESIDUAL_BEARING = 0,
  WM_RESIDUAL_RANGE,
  WM_RESIDUAL_X,
  WM_RESIDUAL_Y,
  WM_RESIDUAL_Z,
  WM_RESIDUAL_HEADING,
  WM_RESIDUAL_STANDSTILL,
  WM_RESIDUAL_PIXEL,
  WM_RESIDUAL_ELEVATION,
  WM_RESIDUAL_COUNT
} wm_residual;

typedef enum wm_verdict {
  WM_FUSED = 0,
  WM_REJECTED_GATE,            // innovation beyond the gate
  WM_REJECTED_UNKNOWN_ID,      // no such landmark in the map
  WM_REJECTED_NO_ASSOCIATION,  // id -1 and no landmark fits, or more than one
  WM_REJECTED_OUT_OF_RANGE,    // beyond the sensor's range, or behind it
  WM_REJECTED_NOT_FINITE,
  WM_REJECTED_SINGULAR,   // the geometry gives no information (robot on the landmark)
  WM_REJECTED_SEARCHING,  // kept for the search, not fused; or its source is not trusted
  WM_REJECTED_BY_CONFIG,  // switched off by the configuration
  WM_REJECTED_NUMERIC,    // the update failed numerically (the innovation's covariance is not positive definite)
  WM_VERDICT_COUNT
} wm_verdict;

const char *wm_residual_name(unsigned residual);
const char *wm_verdict_name(unsigned verdict);

// Record of one update, fused or not.
typedef struct wm_innovation {
  wm_time_ns t_ns;
  uint16_t source;
  uint16_t sensor;
  int32_t landmark_id;  // -1 where none
  uint8_t residual;     // wm_residual
  uint8_t verdict;      // wm_verdict
  double observed;      // SI
  double expected;
  double variance;  // of the innovation, HPH' + R
  double nis;       // normalised innovation squared of the gated group
  double gate;      // threshold for nis; 0: none (points of edges are gated one by one)
  uint8_t gate_dof;
} wm_innovation;

// The published pose. Valid at t_ns, made at made_ns.
typedef struct wm_published {
  wm_estimate now;  // carried on by odometry from fused_until_ns to now.t_ns
  wm_time_ns made_ns;
  wm_time_ns fused_until_ns;
  wm_pose2 pose_odom_base;  // continuous: never jumps
  uint32_t jumps;           // times that map against odom moved by more than the threshold
  double last_jump_m, last_jump_rad;
  uint32_t status_flags;  // WM_PUB_*
  uint32_t deadlines_missed;
  int64_t utc_offset_ns;  // UTC minus the monotonic clock; 0 with utc_uncertainty_ns < 0 where unknown
  int64_t utc_uncertainty_ns;
} wm_published;

#define WM_PUB_MOTION_STALE (1u << 0)  // no fresh motion: the pose is extrapolated on old speeds
#define WM_PUB_FUSION_STALE (1u << 1)  // nothing fused for longer than the horizon
#define WM_PUB_JUMPED (1u << 2)        // map against odom moved since the last message
#define WM_PUB_CAUSE_SHIFT 8           // bits 8 to 15: now.cause
#define WM_PUB_CAUSE(flags) (((flags) >> WM_PUB_CAUSE_SHIFT) & 255u)
// Bits 16 to 23: the floor, its index in site.yaml plus 1; 0: a robot with one floor. Bits 24 to 30: its probability in
// percent, rounded down.
#define WM_PUB_FLOOR_SHIFT 16
#define WM_PUB_FLOOR_PERCENT_SHIFT 24
#define WM_PUB_FLOOR(flags) ((int)(((flags) >> WM_PUB_FLOOR_SHIFT) & 255u) - 1)  // -1: there are none
#define WM_PUB_FLOOR_PERCENT(flags) (((flags) >> WM_PUB_FLOOR_PERCENT_SHIFT) & 127u)

// The floor of a pose where it is known for sure, else -1.
static inline int wm_published_floor(const wm_published *published) {
  return WM_PUB_FLOOR_PERCENT(published->status_flags) >= 99 ? WM_PUB_FLOOR(published->status_flags) : -1;
}

// A calibration state for health and report.
typedef struct wm_calibration_value {
  char name[40];  // e.g. "laser.yaw_rad"
  double value;
  double sigma;  // NaN where it is not estimated
} wm_calibration_value;

// What contradicts itself by the estimator's own values. The numbers and names are stable.
typedef enum wm_alarm_kind {
  WM_ALARM_NOISE = 0,      // a factor on a variance is at its limit: sources disagree; value: the factor
  WM_ALARM_SCALE,          // of older versions: a scale is far from its prior
  WM_ALARM_LENGTHS,        // wheels and ranges together are far from their priors; value: sigmas
  WM_ALARM_LASTING_ERROR,  // a receiver's lasting error is far larger than stated; value: over its sigma
  WM_ALARM_TURN,           // the measured turn has another sign or unit; value: the factor that explains the rest
  WM_ALARM_STATED,         // a stated value is wrong, and not known as well yet as it was stated; value: the value
  WM_ALARM_LOCALIZER,      // another localizer contradicts and is not followed; value: the probability that it is wrong
  WM_ALARM_KIND_COUNT
} wm_alarm_kind;

typedef struct wm_alarm {
  uint32_t kind;        // wm_alarm_kind
  int32_t calibration;  // index of the calibration value that it is about; -1: none
  double value;
} wm_alarm;

// Room for all that an estimator of 16 sensors may have (estimator/filters/core/length_test.cpp counts it).
#define WM_ALARMS_MAX 32

// "noise", "scale" ...; "?" beyond.
const char *wm_alarm_name(unsigned kind);

// What an estimator counts, for health and report. Counts are since the start, unless "now" is stated.
typedef enum wm_counter_kind {
  WM_COUNTER_LANDMARKS = 0,         // landmarks in the map now
  WM_COUNTER_LANDMARKS_ADDED,       // landmarks that entered the map
  WM_COUNTER_LANDMARKS_REMOVED,     // landmarks that left it
  WM_COUNTER_LANDMARKS_MOVED,       // landmarks found at another place than before; landmark_id is the last one's
  WM_COUNTER_LANDMARKS_MERGED,      // pairs of landmarks that were found to be one
  WM_COUNTER_IDENTITIES_AMBIGUOUS,  // sightings whose identity stood for two landmarks
  WM_COUNTER_MAP_FULL,              // new landmarks for which there was no capacity
  WM_COUNTER_ROTATION_OUTLIERS,     // turns that the motion data lack: slip, or turned by hand
  WM_COUNTER_MOTION_OUTLIERS,       // motion data that no robot can do
  WM_COUNTER_RELOCALIZATIONS,       // times that a lost robot was found again
  WM_COUNTER_ALIASED_POSES,         // other poses that explain the observations as well, now
  WM_COUNTER_EXPLAINED_PERMILLE,    // of 1000 edge points, those that lie on edges of the map, now (smoothed)
  WM_COUNTER_KIND_COUNT
} wm_counter_kind;

typedef struct wm_counter {
  uint32_t kind;        // wm_counter_kind
  int32_t landmark_id;  // the landmark that was counted last; -1 where there is none
  uint64_t count;
} wm_counter;

// "landmarks", "landmarks_added" ...; "?" beyond.
const char *wm_counter_name(unsigned kind);

#ifdef __cplusplus
}
#endif

#endif
