// SPDX-License-Identifier: Apache-2.0
// What is known beforehand of a robot and a place: wheels, sensors, landmarks, start. Drivers read it, estimators use
// it. These structs are for one process: wm_raster and wm_appearance (and wm_frame, wm_cascade in headers of their own)
// borrow memory by pointers, so that they are never copied to a ring, a log or a message.
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

// calibration.yaml: a camera. Pixels' centres have whole coordinates; what isn't given of the distortion is 0.
typedef struct wm_camera {
  char name[WM_NAME_MAX];
  int32_t model;  // wm_camera_model
  uint32_t width_px, height_px;
  uint32_t intrinsics_count, distortion_count;
  double intrinsics[WM_INTRINSICS_MAX];
  double distortion[WM_INTRINSICS_MAX];
  wm_time_ns readout_ns;  // rolling shutter: from the first row to the last; 0: global
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

// What the cameras, the vehicle's twist and the coded markers are like.
typedef struct wm_rig {
  wm_camera cameras[WM_CAMERAS_MAX];
  uint32_t camera_count;
  wm_stereo_pair stereo;
  double twist6_sigma_v_mps[3], twist6_sigma_w_radps[3];  // NaN where not given
  char marker_family[WM_NAME_MAX];                        // "" where not given
  double marker_size_m;                                   // outer edge of the black square; NaN where not given
} wm_rig;

// Makes a rig without cameras, all else unknown.
void wm_rig_init(wm_rig *out);
// Index of the camera of this name, or -1.
int wm_rig_find_camera(const wm_rig *rig, const char *name);

// A raster map. Row 0 is the top (largest y); 255 is edge or drivable, 0 is not. The centre of pixel (column, row) is
// origin + R(yaw) (column + 0.5, height - 0.5 - row) resolution. The pixels are somebody else's and outlive this.
typedef struct wm_raster {
  uint32_t width_px, height_px;
  double resolution_m;                            // of a pixel
  double origin_x_m, origin_y_m, origin_yaw_rad;  // outer corner of the lower left pixel, in map
  const uint8_t *edges;                           // height x width; NULL where there is no such layer
  const uint8_t *drivable;                        // likewise
  uint64_t hash;                                  // of all of the above
} wm_raster;

typedef struct wm_landmark {
  int32_t id;
  double p_m[3];
  double sigma_m;
  double yaw_rad;        // NaN where not given
  double cov_m2[3];      // xx, xy, yy of the place; all 0 where not given: sigma_m on each axis
  double yaw_sigma_rad;  // 0 where not given
} wm_landmark;

// How a landmark looks: an upright flat picture, its middle at the landmark's place. One landmark may have several.
typedef struct wm_appearance {
  int32_t landmark_id;
  uint32_t width_px, height_px;
  const uint8_t *grey;  // height x width, row 0 at the top, as a reader sees it; somebody else's, outlives this
  double width_m, height_m;
  double yaw_rad;  // direction in the map from its left edge to its right one, as a reader sees it
} wm_appearance;

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
