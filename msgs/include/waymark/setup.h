// SPDX-License-Identifier: Apache-2.0
// Prior knowledge of a robot and a place: wheels, sensors, landmarks, start. Drivers read it, estimators use it.
// wm_raster and wm_appearance (and wm_frame, wm_cascade in headers of their own) borrow memory by pointers. They are
// for one process and are never copied to a ring, a log or a message.
#ifndef WAYMARK_SETUP_H
#define WAYMARK_SETUP_H

#include <stdint.h>

#include "waymark/frames.h"
#include "waymark/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_STEERING_TABLE_MAX 64

// calibration.yaml: wheels. NaN where unknown.
typedef struct wm_wheels {
  double radius_m, ticks_per_turn, track_m, wheelbase_m, steering_ratio, encoder_offset_m;
  uint32_t steering_table_count;
  double actuator_m[WM_STEERING_TABLE_MAX];  // rising
  double road_wheel_rad[WM_STEERING_TABLE_MAX];
} wm_wheels;

#define WM_NAME_MAX 32

// Where the sensors sit whose rows are in axes of their own: an IMU, and a velocity log (motion6).
typedef struct wm_row_mountings {
  wm_mounting imu, motion6;
} wm_row_mountings;

typedef struct wm_sensor {
  char name[WM_NAME_MAX];
  wm_mounting mounting;
  double bearing_sigma_rad;  // NaN where not given
  double range_sigma_m;      // NaN where not given
  double max_range_m;        // infinity where not given
  int32_t range_is_depth;    // 1: range_m is along the sensor's x axis
} wm_sensor;

typedef enum wm_camera_model {
  WM_CAMERA_EQUIDISTANT = 0,  // Kannala-Brandt: [fx, fy, cx, cy], [k1, k2, k3, k4]
  WM_CAMERA_PINHOLE_RADTAN,   // [fx, fy, cx, cy], [k1, k2, p1, p2(, k3)]
  WM_CAMERA_OMNI,             // Mei: [xi, fx, fy, cx, cy], [k1, k2, p1, p2(, k3)]
  WM_CAMERA_DOUBLE_SPHERE,    // [xi, alpha, fx, fy, cx, cy]
  WM_CAMERA_OCAM,             // Scaramuzza's polynomial
  WM_CAMERA_MODEL_COUNT
} wm_camera_model;

#define WM_INTRINSICS_MAX 16

// calibration.yaml: a camera. Centres of pixels have integer coordinates. Absent distortion coefficients are 0.
typedef struct wm_camera {
  char name[WM_NAME_MAX];
  int32_t model;  // wm_camera_model
  uint32_t width_px, height_px;
  uint32_t intrinsics_count, distortion_count;
  double intrinsics[WM_INTRINSICS_MAX];
  double distortion[WM_INTRINSICS_MAX];
  wm_time_ns readout_ns;  // rolling shutter: from the first row to the last; 0: global shutter
  wm_mounting mounting;   // of the camera's body frame in base_link
} wm_camera;

// calibration.yaml: a rectified pair. Both cameras' rectified pictures have the left one's axes.
typedef struct wm_stereo_pair {
  int32_t left, right;     // indices of cameras; -1: there is no pair
  double baseline_m;       // NaN where not given
  double rectified_px[4];  // fu, fv, cu, cv; NaN where not given
  double sigma_px[4];      // of ul, vl, ur, vr; NaN where not given
} wm_stereo_pair;

#define WM_CAMERAS_MAX 16

// Cameras, noise of the vehicle's twist, coded markers, and the receiver's antenna.
typedef struct wm_rig {
  wm_camera cameras[WM_CAMERAS_MAX];
  uint32_t camera_count;
  wm_stereo_pair stereo;
  double twist6_sigma_v_mps[3], twist6_sigma_w_radps[3];  // NaN where not given
  char marker_family[WM_NAME_MAX];                        // "" where not given
  double marker_size_m;                                   // outer edge of the black square; NaN where not given
  double antenna_m[3];                                    // of positions, in base_link; NaN where not given
} wm_rig;

// Makes a rig without cameras; all other fields are unknown.
void wm_rig_init(wm_rig *out);
// Index of the camera of this name, or -1.
int wm_rig_find_camera(const wm_rig *rig, const char *name);

// A raster map. Row 0 is the top (largest y); 255 is edge or drivable, 0 is not. The centre of pixel (column, row) is
// origin + R(yaw) (column + 0.5, height - 0.5 - row) resolution. The pixels are borrowed and must outlive the struct.
typedef struct wm_raster {
  uint32_t width_px, height_px;
  double resolution_m;                            // of a pixel
  double origin_x_m, origin_y_m, origin_yaw_rad;  // outer corner of the lower left pixel, in map
  const uint8_t *edges;                           // height x width; NULL: no such layer
  const uint8_t *drivable;                        // likewise
  uint64_t hash;                                  // of all fields above
} wm_raster;

typedef struct wm_landmark {  // absent numbers are NaN; readers take a sigma or covariance of 0 for absent, too
  int32_t id;
  double p_m[3];
  double sigma_m;        // of the place on each axis; absent: the estimator's least sigma of a map
  double yaw_rad;        // direction of a marker; absent: unknown
  double cov_m2[3];      // xx, xy, yy of the place; absent (or not positive definite): sigma_m on each axis
  double yaw_sigma_rad;  // absent: unknown
} wm_landmark;

// Appearance of a landmark: an upright flat picture, its centre at the landmark's place. A landmark may have several.
typedef struct wm_appearance {
  int32_t landmark_id;
  uint32_t width_px, height_px;
  const uint8_t *grey;  // height x width, row 0 at the top, not mirrored; borrowed, must outlive the struct
  double width_m, height_m;
  double yaw_rad;  // direction in the map from its left edge to its right edge, seen from the front
} wm_appearance;

#define WM_FLOORS_MAX 64
#define WM_CONNECTIONS_MAX 256

typedef enum wm_connection_kind { WM_CONNECTION_LIFT, WM_CONNECTION_RAMP, WM_CONNECTION_DOOR } wm_connection_kind;

// An end of a connection between floors: the connection's place and direction in the axes of one floor.
typedef struct wm_floor_end {
  int32_t floor;       // index
  int32_t connection;  // number; the ends of one connection are the same place
  int32_t kind;        // wm_connection_kind
  int32_t unused;      // no padding
  double x_m, y_m, heading_rad;
  double radius_m;  // of the area in which a robot may change floors
} wm_floor_end;

// Start pose. NaN where unknown.
typedef struct wm_start {
  wm_time_ns t_ns;  // WM_TIME_NONE: the first motion event
  double p_m[3];
  double q_xyzw[4];  // for 6 degrees of freedom; NaN in the plane
  double heading_rad;
  double sigma_xy_m;
  double sigma_heading_rad;
} wm_start;

#ifdef __cplusplus
}
#endif

#endif
