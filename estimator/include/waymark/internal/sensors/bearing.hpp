// SPDX-License-Identifier: Apache-2.0
// Bearing and elevation of a camera's ray by the sensor model of the filters.
#ifndef WAYMARK_INTERNAL_SENSORS_BEARING_HPP
#define WAYMARK_INTERNAL_SENSORS_BEARING_HPP

#include "waymark/internal/math/elementary.hpp"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/internal/sensors/mounting.hpp"

namespace wm {

// Whether the camera looks up or down rather than ahead (sensors/mounting.hpp).
inline bool is_steep(const wm_camera &camera) { return is_steep_axis(matrix_of_rpy(camera.mounting.rpy_rad).m[2][0]); }

// Angle from the camera's axis to the left, in the camera's axes; of a steep camera the azimuth about its mounting's
// yaw. `ray` in optical axes, of any length.
inline double sensor_bearing(const mounted_camera &camera, bool steep, const vec3 &ray) {
  if (!steep) return atan2(-ray.x, ray.z);
  const vec3 r = camera.R_base_optical * ray;
  // The body's x and y axes in base_link are the optical z and minus x axes.
  const auto &m = camera.R_base_optical.m;
  const double yaw = atan2(m[0][1] * m[2][2] < 0 ? m[1][1] : m[1][2], m[0][1] * m[2][2] < 0 ? m[0][1] : m[0][2]);
  return wrap(atan2(r.y, r.x) - yaw);
}

// Angle of the ray above the plane of its bearing.
inline double sensor_elevation(const mounted_camera &camera, bool steep, const vec3 &ray) {
  if (!steep) return atan2(-ray.y, std::sqrt(ray.x * ray.x + ray.z * ray.z));
  const vec3 r = camera.R_base_optical * ray;
  return atan2(r.z, std::sqrt(r.x * r.x + r.y * r.y));
}

// Time of exposure of a pixel's row; a frame's stamp is that of its middle row.
inline wm_time_ns time_of_row(wm_time_ns middle_ns, double v_px, uint32_t height_px, wm_time_ns readout_ns) {
  const double row = (v_px - 0.5 * (height_px - 1)) / (height_px - 1);
  return middle_ns + static_cast<wm_time_ns>(std::floor(row * static_cast<double>(readout_ns) + 0.5));
}

}  // namespace wm

#endif
