// SPDX-License-Identifier: Apache-2.0
// Corrects a point on the floor by the errors of its camera's mounting.
#ifndef WAYMARK_INTERNAL_EDGE_MCL_FLOOR_CAMERA_HPP
#define WAYMARK_INTERNAL_EDGE_MCL_FLOOR_CAMERA_HPP

#include "waymark/internal/filters/edge_mcl/camera_states.h"
#include "waymark/internal/math/elementary.hpp"
#include "waymark/setup.h"

namespace wm {

#define WM_CAMERA_STATE(state, ...) state,
enum camera_state { WM_CAMERA_STATES(WM_CAMERA_STATE) kCameraStates };
inline constexpr int kCameraErrors = kCameraTime;  // errors of the mounting: they move points

// A point in base_link and its derivatives by the errors.
struct floor_point {
  double x, y;
  double x_by[kCameraErrors], y_by[kCameraErrors];
};

struct floor_camera {
  double x_m, y_m, height_m, yaw_cos, yaw_sin, focal_px;

  void init(const wm_camera &camera) {
    const double *p = camera.mounting.xyz_m;
    const sin_cos yaw = sincos(camera.mounting.rpy_rad[2]);
    x_m = p[0];
    y_m = p[1];
    height_m = p[2];
    yaw_cos = yaw.cos;
    yaw_sin = yaw.sin;
    const int first = camera.model == WM_CAMERA_OMNI ? 1 : camera.model == WM_CAMERA_DOUBLE_SPHERE ? 2 : 0;
    focal_px = camera.model == WM_CAMERA_OCAM || camera.intrinsics_count <= (uint32_t)first ? camera.width_px / kPi
                                                                                            : camera.intrinsics[first];
  }
  // Distance on the floor from below the camera.
  double range(double x, double y) const { return std::sqrt(square(x - x_m) + square(y - y_m)); }
  // Sigma across an edge at this range of `pixels` in the picture: a pixel is an angle of 1/focal, and the floor is
  // seen at a flat angle.
  double sigma(double range_m, double pixels) const {
    return pixels / focal_px * (range_m * range_m + height_m * height_m) / height_m;
  }
  // `point` is by the nominal mounting. The ray is turned by small angles about the camera's own axes, taken as level,
  // and meets the floor again. False where it no longer does.
  bool correct(double x, double y, const double error[kCameraErrors], floor_point *out) const {
    const double v[3] = {x - x_m, y - y_m, -height_m};
    // Cross products of the turn axes with it: pitch about the camera's left, roll about its view's horizontal
    // direction, yaw about the vertical.
    const double by[3][3] = {{yaw_cos * v[2], yaw_sin * v[2], -yaw_sin * v[1] - yaw_cos * v[0]},
                             {yaw_sin * v[2], -yaw_cos * v[2], yaw_cos * v[1] - yaw_sin * v[0]},
                             {-v[1], v[0], 0.0}};
    double turned[3];
    for (int i = 0; i < 3; i++)
      turned[i] = v[i] + error[kCameraPitch] * by[0][i] + error[kCameraRoll] * by[1][i] + error[kCameraYaw] * by[2][i];
    const double down = -turned[2];
    const double height = height_m + error[kCameraHeight];
    if (!(down > 0.02 * height_m) || !(height > 0.0)) return false;
    const double stretch = height / down;
    out->x = x_m + turned[0] * stretch;
    out->y = y_m + turned[1] * stretch;
    for (int k = 0; k < 3; k++) {
      const double stretch_by = stretch / down * by[k][2];
      out->x_by[k] = stretch * by[k][0] + turned[0] * stretch_by;
      out->y_by[k] = stretch * by[k][1] + turned[1] * stretch_by;
    }
    out->x_by[kCameraHeight] = turned[0] / down;
    out->y_by[kCameraHeight] = turned[1] / down;
    return true;
  }
};

}  // namespace wm

#endif
