// SPDX-License-Identifier: Apache-2.0
// An event: one datum with the time at which it was true and the time at which it arrived. An estimator's whole input
// is events. The rings, the merge and the event log hold this struct.
// Fixed size, no pointers. A ring that carries only small events has slots of WM_EVENT_SMALL_BYTES.
//
// An absent number of type double or float is NaN, in every event, log and message. Zero is a value. (Events of logs
// before codec version 5 have zeros for some absent numbers; the decoder turns them into NaN.)
#ifndef WAYMARK_EVENT_H
#define WAYMARK_EVENT_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "waymark/frames.h"
#include "waymark/time.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum wm_event_kind {
  WM_EVENT_NONE = 0,
  WM_EVENT_QUANTITIES,  // motion: quantities decoded from one CAN frame
  WM_EVENT_TWIST2,      // motion: planar twist of base_link
  WM_EVENT_TWIST6,      // motion: twist in the vehicle's frame
  WM_EVENT_SIGHTING,    // a landmark seen from a sensor
  WM_EVENT_POSITION,    // base_link's position in map (GNSS)
  WM_EVENT_HEADING,     // base_link's heading in map
  WM_EVENT_MARKER,      // a coded marker's pose in the sensor frame
  WM_EVENT_STEREO,      // a point in both pictures of a rectified pair
  WM_EVENT_POINTS,      // edge points on the floor in base_link
  WM_EVENT_LOOKED,      // a sensor looked and detected nothing
  WM_EVENT_SET_POSE,    // the robot's pose, given by a person or a program
  WM_EVENT_RESET,       // start again from the start pose of the setup
  WM_EVENT_INCREMENT,   // motion: how base_link moved from one time to another
  WM_EVENT_LOCALIZED,   // base_link's pose by another localizer
  WM_EVENT_SET_FLOOR,   // the robot's floor, given by a person or a program
  WM_EVENT_KIND_COUNT
} wm_event_kind;

#define WM_EVENT_BIT(kind) (UINT32_C(1) << (kind))
#define WM_TWIST_EVENTS (WM_EVENT_BIT(WM_EVENT_TWIST2) | WM_EVENT_BIT(WM_EVENT_TWIST6))
#define WM_COMMAND_EVENTS \
  (WM_EVENT_BIT(WM_EVENT_SET_POSE) | WM_EVENT_BIT(WM_EVENT_RESET) | WM_EVENT_BIT(WM_EVENT_SET_FLOOR))
#define WM_MOTION_EVENTS (WM_EVENT_BIT(WM_EVENT_QUANTITIES) | WM_TWIST_EVENTS | WM_EVENT_BIT(WM_EVENT_INCREMENT))

// Quantities that CAN signals are bound to (recording-format: can-signals.yaml). SI units, forwards and left positive.
typedef enum wm_quantity {
  WM_Q_WHEEL_TICKS_LEFT = 0,     // ticks, unwrapped: grows without end when driving forwards
  WM_Q_WHEEL_TICKS_RIGHT,        // ticks, unwrapped
  WM_Q_WHEEL_SPEED_FRONT_LEFT,   // m/s
  WM_Q_WHEEL_SPEED_FRONT_RIGHT,  // m/s
  WM_Q_WHEEL_SPEED_REAR_LEFT,    // m/s
  WM_Q_WHEEL_SPEED_REAR_RIGHT,   // m/s
  WM_Q_VEHICLE_SPEED,            // m/s
  WM_Q_YAW_RATE,                 // rad/s
  WM_Q_STEERING_WHEEL,           // rad at the steering wheel
  WM_Q_ROAD_WHEEL,               // rad at the road wheel
  WM_Q_STEERING_ACTUATOR,        // m, position of the linear actuator
  WM_Q_GEAR,                     // -1 reverse, 0 neutral, 1 forward
  WM_Q_ROLL_RATE,                // rad/s about base_link's x axis, as the next ones on base_link's axes
  WM_Q_PITCH_RATE,               // rad/s about y; yaw_rate is the one about z
  WM_Q_ACCELERATION_X,           // m/s2, specific force: what an accelerometer measures, 9.8 upwards at rest
  WM_Q_ACCELERATION_Y,           // m/s2
  WM_Q_ACCELERATION_Z,           // m/s2
  WM_Q_COUNT
} wm_quantity;

#define WM_QUANTITIES_MAX 8
#define WM_POINTS_MAX 512
// Bits of wm_quantities.doubt: the values are not reliable, and are no evidence of standstill.
#define WM_DOUBT_FROZEN_COUNTER (1u << 0)  // the message's counter stands still: the sender is stuck
#define WM_DOUBT_COUNTS_WRAPPED (1u << 1)  // ticks: how often the counter wrapped in a silence is unknown

typedef struct wm_quantities {
  uint8_t count;
  uint8_t doubt;
  uint16_t lost_before;           // frames missing just before, by the message's own counter
  uint8_t id[WM_QUANTITIES_MAX];  // wm_quantity
  double value[WM_QUANTITIES_MAX];
} wm_quantities;

typedef struct wm_twist2 {
  double v_mps, w_radps;
} wm_twist2;

typedef struct wm_twist6 {
  double v_mps[3], w_radps[3];  // rates all NaN: not measured (a velocity log); another sensor's are taken
  double v_sigma_mps;           // of the velocity on each axis; NaN: the calibration's
  double arm_m[3];              // point of the vehicle whose velocity it is, from base_link's origin; NaN: that origin
} wm_twist6;

// Pose of base_link at the event's time, seen from base_link at `from_ns`.
typedef struct wm_increment {
  wm_time_ns from_ns;
  double dx_m, dy_m, dheading_rad;
  double covariance[6];  // xx, xy, yy, x heading, y heading, heading heading, on the same axes; NaN: not given
} wm_increment;

// Bearing is positive to the left of the sensor's x axis. Bearing or range may be absent, not both. Elevation belongs
// to the bearing's ray and is measured from the sensor's xy plane. For a sensor that looks up or down the bearing is
// the azimuth, and elevation is measured from the horizontal plane.
typedef struct wm_sighting {
  uint16_t sensor;      // index into wm_setup.sensors
  int32_t landmark_id;  // identity in the map; -1: unknown
  double bearing_rad;
  double range_m;
  double bearing_sigma_rad;  // NaN: the sensor's own
  double range_sigma_m;      // NaN: the sensor's own
  double elevation_rad;
  double elevation_sigma_rad;  // of the elevation in the sensor, without the mounting's tilt; NaN: no elevation
} wm_sighting;

typedef struct wm_position {
  double p_m[3];  // z NaN where absent
  double sigma_xy_m;
  double sigma_z_m;  // NaN where absent
} wm_position;

typedef struct wm_heading {
  double heading_rad;
  double sigma_rad;
} wm_heading;

// A pose of base_link by another localizer, in map or in a frame of its own (localizer.frame of the configuration).
typedef struct wm_localized {
  double p_m[2];
  double heading_rad;    // NaN where absent
  double covariance[6];  // xx, xy, yy, x heading, y heading, heading heading; NaN: not given
  double reset;          // another number than before: its frame begins anew; NaN: it never does
} wm_localized;

// A coded marker.
typedef struct wm_marker {
  uint16_t sensor;
  uint16_t poses;  // 2: the corners fit a second pose, too: other_*; else other_* are not read
  int32_t id;
  double p_m[3];  // in the sensor's frame
  double yaw_rad;
  double other_p_m[3], other_yaw_rad;
  double along_sigma_m;  // of the distance along the line of sight; NaN: the configuration's
  double yaw_sigma_rad;  // NaN: the configuration's
  double bloom_px;       // growth of bright areas over each edge in this camera's pictures; NaN: not measured
} wm_marker;

typedef struct wm_stereo {
  int32_t id;
  double left_px[2];  // NaN where the point is not in that camera's picture
  double right_px[2];
  uint64_t appearance[4];  // 256 bits of the patch about it; points alike differ in few. All 0: none
} wm_stereo;

// Edge points on the floor. The normal of an edge points from its bright to its dark side.
typedef struct wm_points {
  uint32_t count;
  uint32_t dropped;          // points of this stamp beyond WM_POINTS_MAX
  int32_t camera;            // index into wm_rig.cameras; -1: unknown
  float x_m[WM_POINTS_MAX];  // in base_link, by the calibration's mounting
  float y_m[WM_POINTS_MAX];
  float normal_rad[WM_POINTS_MAX];  // direction of the edge's normal in base_link; NaN where unknown
  float sigma_m[WM_POINTS_MAX];     // across the edge, by the detector (pixels alone); NaN where unknown
} wm_points;

typedef struct wm_looked {
  uint16_t sensor;
} wm_looked;

typedef struct wm_set_pose {
  wm_pose3 pose_map_base;
  double sigma_xy_m;
  double sigma_heading_rad;
} wm_set_pose;

// The pose goes along by the connection between the two floors (docs/building.md).
typedef struct wm_set_floor {
  int32_t floor;  // index into the floors of site.yaml
} wm_set_floor;

typedef struct wm_event {
  wm_time_ns t_ns;        // time of validity
  wm_time_ns arrival_ns;  // time of arrival at this computer
  uint32_t seq;           // order within its source, from 0
  uint16_t source;        // index into the run's table of sources
  uint8_t kind;           // wm_event_kind
  uint8_t reserved;       // 0
  union {
    wm_quantities quantities;
    wm_twist2 twist2;
    wm_twist6 twist6;
    wm_increment increment;
    wm_sighting sighting;
    wm_position position;
    wm_heading heading;
    wm_localized localized;
    wm_marker marker;
    wm_stereo stereo;
    wm_looked looked;
    wm_set_pose set_pose;
    wm_set_floor set_floor;
    wm_points points;  // the only large one
  } as;
} wm_event;

#define WM_EVENT_HEADER_BYTES offsetof(wm_event, as)
#define WM_EVENT_SMALL_BYTES (WM_EVENT_HEADER_BYTES + 96)

// Bytes of `event` in use: copy this many, from a ring or to one. Constant cost. Any thread.
size_t wm_event_bytes(const wm_event *event);

// A sighting whose numbers are all absent, for a sensor to fill in: what it doesn't measure stays absent. Index 0,
// identity -1.
static inline wm_sighting wm_sighting_without_numbers(void) {
  const double absent = (double)NAN;
  wm_sighting s = {0, -1, absent, absent, absent, absent, absent, absent};
  return s;
}

// True if a sighting has an elevation and its sigma. Their values are not checked.
static inline int wm_sighting_has_elevation(const wm_sighting *s) {
  return s->elevation_rad == s->elevation_rad && s->elevation_sigma_rad == s->elevation_sigma_rad;
}

static inline int wm_event_is_motion(const wm_event *event) {
  return event->kind < 32 && ((WM_MOTION_EVENTS >> event->kind) & 1u);
}

// Name of a kind, of a quantity as can-signals.yaml writes it; "?" where there is none.
const char *wm_event_kind_name(unsigned kind);
const char *wm_quantity_name(unsigned quantity);
// Quantity of a name, or -1.
int wm_quantity_find(const char *name);

#ifdef __cplusplus
}
#endif

#endif
