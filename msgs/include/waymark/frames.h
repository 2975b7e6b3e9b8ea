// SPDX-License-Identifier: Apache-2.0
// Frames and poses. REP 103 and 105: base_link x forward, y left, z up, on the ground under the rear axle (or the
// middle of a differential robot); map fixed to the world; odom continuous. A pose is written child in parent:
// pose_map_base is base_link in map. T_a_b takes coordinates in b to coordinates in a.
#ifndef WAYMARK_FRAMES_H
#define WAYMARK_FRAMES_H

#include <stdint.h>

typedef enum wm_frame_id { WM_FRAME_MAP = 0, WM_FRAME_ODOM = 1, WM_FRAME_BASE = 2 } wm_frame_id;

// Pose in the plane. heading_rad in (-pi, pi], positive to the left.
typedef struct wm_pose2 {
  double x_m, y_m, heading_rad;
} wm_pose2;

// Pose in space, unit quaternion (x, y, z, w).
typedef struct wm_pose3 {
  double p_m[3];
  double q_xyzw[4];
} wm_pose3;

// Where a sensor's body frame (x along the view, y left, z up) sits in base_link.
// rpy means Rz(yaw) Ry(pitch) Rx(roll); positive pitch looks down.
typedef struct wm_mounting {
  double xyz_m[3];
  double rpy_rad[3];
} wm_mounting;

#endif
