// SPDX-License-Identifier: Apache-2.0
#include "sensors/sensor_model.hpp"

#include <limits>

#include "math/elementary.hpp"
#include "waymark/internal/sensors/mounting.hpp"

namespace wm {
namespace {

constexpr double kLevel[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
constexpr double kTouching_m2 = 1e-6;  // landmark within 1 mm of the sensor's axis: no bearing
constexpr double kShallow_m = 0.02;    // least depth
constexpr double kPole = 1e-3;         // floor of a unit ray's horizontal part, so that its tangent stays finite

// Small rotations about the sensor's x and y axes, applied to a direction.
void tilt(double roll_rad, double pitch_rad, double v[3]) {
  const double x = v[0] - pitch_rad * v[2], y = v[1] + roll_rad * v[2];
  v[2] += pitch_rad * v[0] - roll_rad * v[1];
  v[0] = x;
  v[1] = y;
}

// The landmark from the sensor, in the sensor's axes, with its derivative by each cause that moves it.
struct sensor_ray {
  double v[3];
  double by[kCauses][3];
  double floor_m;  // distance on the floor
};

// A vector in levelled axes along the mounting's yaw, in the sensor's own axes.
void turn_to_sensor(const mounted_sensor &sensor, const sensor_errors &errors, const double level[3], double out[3]) {
  const double(*axis)[3] = sensor.is_steep ? kLevel : sensor.axis;
  for (int i = 0; i < 3; i++) out[i] = axis[i][0] * level[0] + axis[i][1] * level[1] + axis[i][2] * level[2];
  tilt(errors[kRoll], errors[kPitch], out);
}

void find_ray(const mounted_sensor &sensor, const sensor_errors &errors, const wm_pose2 &pose,
              const double landmark_m[3], bool with_height, sensor_ray *out) {
  const sin_cos h = sincos(pose.heading_rad), m = sincos(sensor.yaw_rad + errors[kYaw]);
  const double dx = landmark_m[0] - pose.x_m, dy = landmark_m[1] - pose.y_m;
  // In base_link, then from the sensor in levelled axes along its yaw ([Stepanov2017]: x_c, y_c, alpha).
  const double base_x = h.cos * dx + h.sin * dy, base_y = h.cos * dy - h.sin * dx;
  const double from_x = base_x - sensor.x_m - errors[kMountX], from_y = base_y - sensor.y_m - errors[kMountY];
  const double up = finite(landmark_m[2]) ? landmark_m[2] - sensor.z_m : 0.0;
  const double level[3] = {m.cos * from_x + m.sin * from_y, m.cos * from_y - m.sin * from_x, up};
  const double c = h.cos * m.cos - h.sin * m.sin, s = h.sin * m.cos + h.cos * m.sin;  // of heading + yaw
  turn_to_sensor(sensor, errors, level, out->v);
  out->floor_m = std::sqrt(from_x * from_x + from_y * from_y);

  const auto column = [&](int cause, double x, double y, double z) {
    const double moved[3] = {x, y, z};
    turn_to_sensor(sensor, errors, moved, out->by[cause]);
  };
  column(kByX, -c, s, 0.0);
  column(kByY, -s, -c, 0.0);
  column(kByHeading, m.cos * base_y - m.sin * base_x, -m.cos * base_x - m.sin * base_y, 0.0);
  column(kBySensor + kYaw, level[1], -level[0], 0.0);
  column(kBySensor + kMountX, -m.cos, m.sin, 0.0);
  column(kBySensor + kMountY, -m.sin, -m.cos, 0.0);
  const double *v = out->v;
  const double by_roll[3] = {0.0, v[2], -v[1]}, by_pitch[3] = {-v[2], 0.0, v[0]};
  for (int i = 0; i < 3; i++) {
    out->by[kBySensor + kRoll][i] = by_roll[i];
    out->by[kBySensor + kPitch][i] = by_pitch[i];
  }
  if (!with_height) return;
  column(kByBodyRoll, m.sin * up, m.cos * up, -m.sin * level[0] - m.cos * level[1]);
  column(kByBodyPitch, -m.cos * up, m.sin * up, m.cos * level[0] - m.sin * level[1]);
  column(kByHeight, 0.0, 0.0, 1.0);
}

// The causes whose columns find_ray() fills.
constexpr int kRayCauses[] = {kByX,
                              kByY,
                              kByHeading,
                              kBySensor + kYaw,
                              kBySensor + kMountX,
                              kBySensor + kMountY,
                              kBySensor + kRoll,
                              kBySensor + kPitch,
                              kByBodyRoll,
                              kByBodyPitch,
                              kByHeight};

constexpr int kRayCauseCount = sizeof kRayCauses / sizeof kRayCauses[0];  // the last three by the height

// A relative error of angles from the sensor's x axis moves the ray along the great circle through that axis; the
// result is by how much of that the bearing and the elevation move, rad.
struct axis_angle {
  double bearing, elevation;
};

axis_angle by_angle_scale(const double v[3], double flat_m, double length_m) {
  const double off_axis = std::sqrt(v[1] * v[1] + v[2] * v[2]);
  if (!(off_axis > 1e-6 * length_m)) return {0.0, 0.0};
  const double angle = atan2(off_axis, v[0]);
  return {angle * v[1] * length_m * length_m / off_axis / (flat_m * flat_m), angle * v[0] * v[2] / (off_axis * flat_m)};
}

// `causes`: of kRayCauses, as many as count; `length_m`: of the ray.
void expect_range(const mounted_sensor &sensor, const sensor_errors &errors, const sensor_ray &ray, int causes,
                  double length_m, expected_sighting *out) {
  const double *v = ray.v;
  const sin_cos axis = errors[kDepthAxis] != 0.0 ? sincos(errors[kDepthAxis]) : sin_cos{0.0, 1.0};
  const double along[3] = {sensor.range_is_depth ? axis.cos : v[0] / length_m,
                           sensor.range_is_depth ? axis.sin : v[1] / length_m,
                           sensor.range_is_depth ? 0.0 : v[2] / length_m};
  const double plain = sensor.range_is_depth ? axis.cos * v[0] + axis.sin * v[1] : length_m;
  out->range_m = errors[kRangeScale] * plain + errors[kRangeBias];
  for (int i = 0; i < causes; i++) {
    const double *d = ray.by[kRayCauses[i]];
    out->range_by[kRayCauses[i]] = errors[kRangeScale] * (along[0] * d[0] + along[1] * d[1] + along[2] * d[2]);
  }
  out->range_by[kBySensor + kRangeBias] = 1.0;
  out->range_by[kBySensor + kRangeScale] = plain;
  if (sensor.range_is_depth)
    out->range_by[kBySensor + kDepthAxis] = errors[kRangeScale] * (axis.cos * v[1] - axis.sin * v[0]);
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
  double v[3] = {e.cos * b.cos, e.cos * b.sin, e.sin}, level[3];
  tilt(-errors[kRoll], -errors[kPitch], v);
  const double(*axis)[3] = sensor.is_steep ? kLevel : sensor.axis;
  for (int i = 0; i < 3; i++) level[i] = axis[0][i] * v[0] + axis[1][i] * v[1] + axis[2][i] * v[2];
  const double flat = std::sqrt(level[0] * level[0] + level[1] * level[1]);
  return {atan2(level[1], level[0]), level[2] / (flat > kPole ? flat : kPole)};
}

expected_sighting expect(const mounted_sensor &sensor, const sensor_errors &errors, const wm_pose2 &pose,
                         const double landmark_m[3], unsigned components) {
  expected_sighting out{};
  sensor_ray ray;
  const bool with_height = finite(landmark_m[2]) && finite(sensor.z_m);
  const int causes = with_height ? kRayCauseCount : kRayCauseCount - 3;
  find_ray(sensor, errors, pose, landmark_m, with_height, &ray);
  const double *v = ray.v, q = v[0] * v[0] + v[1] * v[1];
  out.distance_m = ray.floor_m;
  out.possible = q > kTouching_m2 && (!sensor.range_is_depth || v[0] > kShallow_m);
  if (!(q > kTouching_m2)) return out;
  const double over_q = 1.0 / q, flat = std::sqrt(q), length = std::sqrt(q + v[2] * v[2]);
  const bool scaled = (components & kAngleScaled) || errors[kAngleScale] != 0.0;
  const axis_angle stretch = scaled ? by_angle_scale(v, flat, length) : axis_angle{0.0, 0.0};
  if (components & kBearing) {
    const double by_x = -v[1] / flat, by_y = v[0] / flat;
    out.bearing_rad = wrap(atan2(v[1], v[0]) + errors[kAngleScale] * stretch.bearing + errors[kEccentricX] * by_x +
                           errors[kEccentricY] * by_y);
    for (int i = 0; i < causes; i++) {
      const double *d = ray.by[kRayCauses[i]];
      out.bearing_by[kRayCauses[i]] = (v[0] * d[1] - v[1] * d[0]) * over_q;
    }
    out.bearing_by[kBySensor + kAngleScale] = stretch.bearing;
    out.bearing_by[kBySensor + kEccentricX] = by_x;
    out.bearing_by[kBySensor + kEccentricY] = by_y;
  }
  if (components & kRange) expect_range(sensor, errors, ray, causes, length, &out);
  out.elevation_rad = std::numeric_limits<double>::quiet_NaN();
  if ((components & kElevation) && with_height) {
    const double over_length2 = 1.0 / (length * length);
    out.elevation_rad = atan2(v[2], flat) + errors[kAngleScale] * stretch.elevation;
    for (int i = 0; i < causes; i++) {
      const double *d = ray.by[kRayCauses[i]];
      out.elevation_by[kRayCauses[i]] = (flat * d[2] - v[2] * (v[0] * d[0] + v[1] * d[1]) / flat) * over_length2;
    }
    out.elevation_by[kBySensor + kAngleScale] = stretch.elevation;
  }
  return out;
}

}  // namespace wm
