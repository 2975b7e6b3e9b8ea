// SPDX-License-Identifier: Apache-2.0
// The motion front end: one for all estimators. It takes motion events (ticks, wheel speeds, yaw rate, steering, gear,
// twists) and gives the motion of base_link with its noise. Pure: no clock, no heap, no file.
#ifndef WAYMARK_MOTION_H
#define WAYMARK_MOTION_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/event.h"
#include "waymark/params.h"
#include "waymark/pose.h"
#include "waymark/setup.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum wm_motion_model {
  WM_MOTION_AUTO = 0,        // the best that the recording's data allow (motion.model)
  WM_MOTION_TICKS,           // differential from both wheels' ticks
  WM_MOTION_SPEED_YAW_RATE,  // wheel or vehicle speed and yaw rate
  WM_MOTION_ACKERMANN,       // speed and steering (table, ratio or road wheel angle)
  WM_MOTION_TWIST,           // motion.csv, motion6.csv
  WM_MOTION_INCREMENTS       // increments.csv
} wm_motion_model;

// `motion:` of the config. The fields and their meaning are in wm_motion_params_table (motion_params.c).
typedef struct wm_motion_params wm_motion_params;
extern const wm_param_table wm_motion_params_table;

// Why two of the parameters, each allowed by itself, are wrong together, and how to correct it, as a text; *key is the
// wrong one. NULL, *key untouched: none is.
const char *wm_motion_params_clash(const wm_motion_params *params, const char **key);

// Data that the chosen model needs and the sources (`kinds`: WM_EVENT_BIT; `quantities`: a bit per wm_quantity) or the
// wheels' calibration do not have, as a text ("increments.csv"); NULL: none. `auto` needs data only where no model
// is possible. Constant cost.
const char *wm_motion_lacks(const wm_motion_params *params, const wm_wheels *wheels, uint32_t kinds,
                            uint32_t quantities);

// Sigmas of what the robot may have done in `blind_s` without data, besides going on as it did: as of a motion that is
// overdue (noise.hold_mps2, noise.hold_radps2, hold_max_s).
void wm_motion_unseen(const wm_motion_params *params, double blind_s, double *xy_m, double *heading_rad);

// motion.model `auto` becomes `constant_velocity` where no source (`kinds`) gives motion.
void wm_motion_choose(wm_motion_params *params, uint32_t kinds);
// Whether motion.model is `constant_velocity`: no data, so that no drive shows a heading.
int wm_motion_is_unmeasured(const wm_motion_params *params);
// White noise of a gyro's turn rate as configured, else the default, rad/s per sqrt(s).
double wm_motion_gyro_noise(const wm_motion_params *params);

// Health of the motion sensors, bits of motion_health. None of these is standstill or a straight drive.
#define WM_MOTION_HEALTH_ENCODER_LEFT_DEAD (1u << 0)
#define WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD (1u << 1)
#define WM_MOTION_HEALTH_COUNTER_FROZEN (1u << 2)
#define WM_MOTION_HEALTH_YAW_RATE_STUCK (1u << 3)
#define WM_MOTION_HEALTH_IMPLAUSIBLE (1u << 4)  // a sample was refused within the last 5 s (motion.limits)
#define WM_MOTION_HEALTH_NOT_PLANAR (1u << 5)  // motion6.csv: it rises, rolls or pitches, which the plane does not have
// An IMU in space; its third axis is the yaw rate's.
#define WM_MOTION_HEALTH_ROLL_RATE_STUCK (1u << 6)
#define WM_MOTION_HEALTH_PITCH_RATE_STUCK (1u << 7)
#define WM_MOTION_HEALTH_ACCELEROMETER_STUCK (1u << 8)
// Overdue while other sensors of the motion go on: another one stands in, or the last value holds with growing noise.
#define WM_MOTION_HEALTH_SPEED_SILENT (1u << 9)
#define WM_MOTION_HEALTH_TURN_SILENT (1u << 10)  // the gyro, or the steering of a robot without one
// Wheels that do not turn as the robot moves: their speed is that of an unknown motion meanwhile.
#define WM_MOTION_HEALTH_WHEELS_SPIN (1u << 11)      // they turn and the robot stands: a hole, a wall
#define WM_MOTION_HEALTH_ONE_WHEEL_SPINS (1u << 12)  // by the gyro
#define WM_MOTION_HEALTH_PUSHED (1u << 13)           // they stand and the robot moves
#define WM_MOTION_HEALTH_LIFTED (1u << 14)           // it moves otherwise than they turn

// Effective track over the distance of the wheels of skid steer, and the prior's sigma [Mandow2007]: above 1, as wheels
// slip in turns. A prior for wheels and tracks on hard and soft floors. Not swept.
#define WM_SKID_TRACK 1.5
#define WM_SKID_TRACK_SIGMA 0.25

// Calibration of the motion sensors, as an estimator has learnt it. Neutral: scales 1, the rest 0.
typedef enum wm_motion_term {
  WM_SPEED_SCALE = 0,
  WM_YAW_RATE_SCALE,
  WM_YAW_RATE_BIAS,  // rad/s; true = scale * (measured - bias)
  WM_LEFT_SCALE,
  WM_RIGHT_SCALE,
  WM_TRACK_SCALE,
  WM_STEERING_OFFSET,  // rad
  WM_LAG,              // s by which the motion follows its samples
  WM_TURN_SLOWDOWN,    // m/s that a commanded speed loses at a turn rate of 1 rad/s; grows with the rate's square
  WM_SPEED_ONSET,      // s by which a rise of the commanded speed comes later than a fall: the rise times this is lost
  WM_TURN_ONSET,       // the same of the turn rate
  WM_GENTLE_TURNS,     // share by which gentle turns are driven with the largest radius of a drive by radius
  WM_SIDE_SCALE,       // of the sideways speed, besides the speed's
  WM_ROTATION_CENTER,  // m, x of the centre of rotation in base_link: sideways speed = -x * turn rate
  WM_MOTION_TERMS
} wm_motion_term;

typedef struct wm_motion_calibration {
  double value[WM_MOTION_TERMS];
} wm_motion_calibration;

// Dead reckoning in the odom frame, for publishing between what is fused and now. It integrates each motion event as it
// arrives and never jumps. Plain memory: a copy continues identically.
typedef struct wm_odometry wm_odometry;

// Pose in odom at a time. The noise between two points is the difference of their accumulated variances.
typedef struct wm_odom_point {
  wm_time_ns t_ns;
  wm_pose2 pose_odom_base;
  double v_mps, side_mps, w_radps;  // forwards, to the left, turning
  double along_var_m2;              // accumulated process variances since the start (rise without end)
  double across_var_m2;
  double heading_var_rad2;
} wm_odom_point;

size_t wm_odometry_bytes(void);
wm_status wm_odometry_init(wm_odometry *self, const wm_motion_params *params, const wm_wheels *wheels);
// A calibration holds from now on; past integration stays.
void wm_odometry_calibrate(wm_odometry *self, const wm_motion_calibration *calibration);
// Takes a motion event (others are refused with WM_UNSUPPORTED). WM_TIME_RAN_BACK where it is older than the last one.
wm_status wm_odometry_feed(wm_odometry *self, const wm_event *event);
// The point at t_ns: extrapolated with the held twist if t_ns is past the last event, else (up to about a second back)
// interpolated from what was integrated. WM_NOT_FOUND where it is older than that, or no motion has come.
wm_status wm_odometry_at(const wm_odometry *self, wm_time_ns t_ns, wm_odom_point *out);
// Stamp of the newest motion event that the model uses, WM_TIME_NONE before the first.
wm_time_ns wm_odometry_newest_ns(const wm_odometry *self);
// The pose `fused` carried on by odometry from its own time to `t_ns`: mean, covariance, twist. Source: composition of
// pose_map_base(t_f) with pose_odom_base(t_f)^-1 pose_odom_base(t). An estimate of six degrees of freedom moves by the
// twists in space (WM_EVENT_TWIST6); `odom` is their sum, projected to the plane.
wm_status wm_odometry_carry(const wm_odometry *self, const wm_estimate *fused, wm_time_ns t_ns, wm_estimate *out,
                            wm_odom_point *odom);

// By how much map has moved against odom between two times, as a motion of base_link on its own axes: 0 where the pose
// in map moved as the one in odom did. The same bits on every machine.
wm_pose2 wm_odometry_jump(const wm_pose2 *map_before, const wm_pose2 *odom_before, const wm_pose2 *map_now,
                          const wm_pose2 *odom_now);

#ifdef __cplusplus
}
#endif

#endif
