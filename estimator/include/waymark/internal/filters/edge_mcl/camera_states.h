// SPDX-License-Identifier: Apache-2.0
// The table of edge_mcl's own states: five errors of each camera, and one that all cameras share. A row gives the key
// and unit, the name in calibration(), the start's sigma and its maximum. From it follow the parameter, the slot, the
// start, the unknown of an alignment, the roll-back and the calibration value. The derivative of a new state stands in
// edge_mcl::jacobian_of; nothing else names it.
#ifndef WAYMARK_INTERNAL_EDGE_MCL_CAMERA_STATES_H
#define WAYMARK_INTERNAL_EDGE_MCL_CAMERA_STATES_H

// ROW(state, key, unit, name, sigma, most, text); the states that move points come first, the shared one last.
// clang-format off
#define WM_CAMERA_STATES(ROW) \
  ROW(kCameraPitch, "pitch", "_rad", "pitch_rad", 0.01, 0.5, \
      "Start sigma of each camera's pitch about calibration.yaml's, rad. 0.1 degrees are 7 cm of floor at 4 m. 0: off.") \
  ROW(kCameraRoll, "roll", "_rad", "roll_rad", 0.01, 0.5, "The same of its roll about the view, rad. 0: off.") \
  ROW(kCameraYaw, "yaw", "_rad", "yaw_rad", 0.01, 0.5, "The same of its yaw, rad. 0: off.") \
  ROW(kCameraHeight, "height", "_m", "height_m", 0.01, 0.5, "The same of its height above the floor, m. 0: off.") \
  ROW(kCameraTime, "time_offset", "_s", "time_offset_s", 0.03, 0.3, \
      "Start sigma of each camera's time offset, s: its pictures are that much older than their stamps. 0: off.") \
  ROW(kEdgeOffset, "edge_offset", "_m", "offset_m", 0.01, 0.3, \
      "Start sigma of the distance between the detected edge and the map's, m: skirting, contact shadow. 0: off.")
// clang-format on

#define WM_CAMERA_ROW(state, ...) WM_CAMERA_ROW_##state,
enum { WM_CAMERA_STATES(WM_CAMERA_ROW) WM_CAMERA_ROWS };

#endif
