// SPDX-License-Identifier: Apache-2.0
#include "sensors/sensor_model.hpp"

#include <limits>

#include "math/elementary.hpp"
#include "sensors/mounting.hpp"

namespace wm {
namespace {

constexpr double kLevel[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

// What a sensor sees that is turned a little further about its x and y axes than it was thought to be.
void tilt(const sensor_errors &errors, double v[3]) {
  const double x = v[0] - errors.pitch_rad * v[2], y = v[1] + errors.roll_rad * v[2];
  v[2] += errors.pitch_rad * v[0] - errors.roll_rad * v[1];
  v[0] = x;
  v[1] = y;
}

}  // namespace

void mounted_sensor::init(const wm_sensor &sensor) {
  x_m = sensor.mounting.xyz_m[0];
  y_m = sensor.mounting.xyz_m[1];
  z_m = sensor.mounting.xyz_m[2];
  yaw_rad = wrap(sensor.mounting.rpy_rad[2]);
  const sin_cos r = sincos(sensor.mounting.rpy_rad[0]), p = sincos(sensor.mounting.rpy_rad[1]);
  // Ry(pitch) Rx(roll), transposed: rows are the sensor's axes in levelled coordinates.
  const double rows[3][3] = {
      {p.cos, 0.0, -p.sin}, {p.sin * r.sin, r.cos, p.cos * r.sin}, {p.sin * r.cos, -r.sin, p.cos * r.cos}};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) axis[i][j] = rows[i][j];
  is_steep = is_steep_axis(axis[0][2]);
  bearing_sigma_rad = sensor.bearing_sigma_rad;
  range_sigma_m = sensor.range_sigma_m;
  max_range_m = sensor.max_range_m;
  range_is_depth = sensor.range_is_depth != 0;
}

level_ray levelled(const mounted_sensor &sensor, const sensor_errors &errors, double bearing_rad,
                   double elevation_rad) {
  const sin_cos b = sincos(bearing_rad), e = sincos(elevation_rad);
  double seen[3] = {e.cos * b.cos, e.cos * b.sin, e.sin}, level[3];
  tilt({.roll_rad = -errors.roll_rad, .pitch_rad = -errors.pitch_rad}, seen);
  const double(*axis)[3] = sensor.is_steep ? kLevel : sensor.axis;
  for (int i = 0; i < 3; i++) level[i] = axis[0][i] * seen[0] + axis[1][i] * seen[1] + axis[2][i] * seen[2];
  const double flat = std::sqrt(level[0] * level[0] + level[1] * level[1]);
  return {atan2(level[1], level[0]), level[2] / (flat > 1e-3 ? flat : 1e-3)};
}

expected_sighting expect(const mounted_sensor &sensor, const sensor_errors &errors, const wm_pose2 &pose,
                         const double landmark_m[3]) {
  expected_sighting out{};
  const sin_cos h = sincos(pose.heading_rad);
  const sin_cos m = sincos(sensor.yaw_rad + errors.yaw_rad);
  const double dx = landmark_m[0] - pose.x_m, dy = landmark_m[1] - pose.y_m;
  // The landmark in base_link, then from the sensor in levelled axes along its yaw (paper: x_c, y_c, alpha).
  const double base_x = h.cos * dx + h.sin * dy, base_y = h.cos * dy - h.sin * dx;
  const double from_x = base_x - sensor.x_m - errors.x_m, from_y = base_y - sensor.y_m - errors.y_m;
  const double up = finite(landmark_m[2]) ? landmark_m[2] - sensor.z_m : 0.0;
  const double level[3] = {m.cos * from_x + m.sin * from_y, m.cos * from_y - m.sin * from_x, up};
  // Derivatives of `level` (its third is constant) by x, y, heading, and the mounting's yaw, x, y.
  const double c = h.cos * m.cos - h.sin * m.sin, s = h.sin * m.cos + h.cos * m.sin;  // heading + yaw
  const double by[6][2] = {{-c, s},
                           {-s, -c},
                           {m.cos * base_y - m.sin * base_x, -m.cos * base_x - m.sin * base_y},
                           {level[1], -level[0]},
                           {-m.cos, m.sin},
                           {-m.sin, -m.cos}};
  const double(*axis)[3] = sensor.is_steep ? kLevel : sensor.axis;
  double seen[3];
  for (int i = 0; i < 3; i++) {
    const double *row = axis[i];
    seen[i] = row[0] * level[0] + row[1] * level[1] + row[2] * level[2];
  }
  tilt(errors, seen);
  const double q = seen[0] * seen[0] + seen[1] * seen[1];
  const double length = std::sqrt(q + seen[2] * seen[2]);
  out.distance_m = std::sqrt(from_x * from_x + from_y * from_y);
  out.possible = q > 1e-6 && (!sensor.range_is_depth || seen[0] > 0.02);
  if (!(q > 1e-6)) return out;
  const double over_q = 1.0 / q;
  // Along the circle that a longer or shorter focal length moves it on: the angle from the axis, and how much of that
  // is to the side.
  const double off_axis = std::sqrt(seen[1] * seen[1] + seen[2] * seen[2]);
  const double stretch =
      off_axis > 1e-6 * length ? atan2(off_axis, seen[0]) * seen[1] * length * length / off_axis * over_q : 0.0;
  out.bearing_rad = wrap(atan2(seen[1], seen[0]) + errors.angle_scale * stretch);
  const double plain = sensor.range_is_depth ? seen[0] : length;
  out.range_m = errors.range_scale * plain + errors.range_bias_m;
  out.range_by_scale = plain;
  const double over_length = 1.0 / length, flat = std::sqrt(q), over_length2 = over_length * over_length;
  const double up_stretch =
      off_axis > 1e-6 * length ? atan2(off_axis, seen[0]) * seen[0] * seen[2] / (off_axis * flat) : 0.0;
  const bool has_height = finite(landmark_m[2]) && finite(sensor.z_m);
  out.elevation_rad =
      has_height ? atan2(seen[2], flat) + errors.angle_scale * up_stretch : std::numeric_limits<double>::quiet_NaN();
  const auto raises = [&](const double d[3]) {
    return (flat * d[2] - seen[2] * (seen[0] * d[0] + seen[1] * d[1]) / flat) * over_length2;
  };
  for (int k = 0; k < 6; k++) {
    double d[3];
    for (int i = 0; i < 3; i++) {
      const double *row = axis[i];
      d[i] = row[0] * by[k][0] + row[1] * by[k][1];
    }
    tilt(errors, d);
    out.bearing_by[k] = (seen[0] * d[1] - seen[1] * d[0]) * over_q;
    out.elevation_by[k] = raises(d);
    out.range_by[k] = errors.range_scale *
                      (sensor.range_is_depth ? d[0] : (seen[0] * d[0] + seen[1] * d[1] + seen[2] * d[2]) * over_length);
  }
  out.bearing_by[kByRoll] = seen[0] * seen[2] * over_q;
  out.bearing_by[kByPitch] = seen[1] * seen[2] * over_q;
  out.bearing_by[kByAngleScale] = stretch;
  out.elevation_by[kByRoll] = -seen[1] / flat;
  out.elevation_by[kByPitch] = seen[0] / flat;
  out.elevation_by[kByAngleScale] = up_stretch;
  // The robot leans (about its x axis) and nods (about y), as a sensor's roll and pitch would turn; the landmark rises.
  const double turned[3][3] = {{m.sin * up, m.cos * up, -m.sin * level[0] - m.cos * level[1]},
                               {-m.cos * up, m.sin * up, m.cos * level[0] - m.sin * level[1]},
                               {0.0, 0.0, 1.0}};
  for (int k = 0; k < 3; k++) {
    double d[3];
    for (int i = 0; i < 3; i++)
      d[i] = axis[i][0] * turned[k][0] + axis[i][1] * turned[k][1] + axis[i][2] * turned[k][2];
    tilt(errors, d);
    out.bearing_by[kByLean + k] = (seen[0] * d[1] - seen[1] * d[0]) * over_q;
    out.elevation_by[kByLean + k] = raises(d);
  }
  return out;
}

}  // namespace wm
