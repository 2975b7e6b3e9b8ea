// SPDX-License-Identifier: Apache-2.0
#include "sensors/sensor_model.hpp"

#include <limits>

#include "math/jet.hpp"
#include "waymark/internal/sensors/mounting.hpp"

namespace wm {
namespace {

constexpr double kLevel[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
constexpr double kTouching_m2 = 1e-6;  // landmark within 1 mm of the sensor's axis: no bearing
constexpr double kShallow_m = 0.02;    // least depth
constexpr double kPole = 1e-3;         // floor of a unit ray's horizontal part, so that its tangent stays finite
constexpr double kOnAxis = 1e-6;       // sine of the angle from the sensor's axis below which the angle's scale is lost

// The formulas are templates: T is double, or a jet. A sighting is differentiated in two steps, which takes a third of
// the operations: the ray in the sensor's axes by what moves it, and bearing, range and elevation by the ray and the
// sensor's other states.

// What moves the ray. The height is the landmark's over the sensor's.
template <class T>
struct ray_view {
  T x_m, y_m, heading_rad, body_roll_rad, body_pitch_rad, height_m;
  T yaw_rad, mount_x_m, mount_y_m, roll_rad, pitch_rad;
};
using ray_jet = jet<even(kBySensor + kPitch + 1)>;

// The ray and the states that do not move it.
template <class T>
struct sensor_view {
  T v[3];
  T error[kSensorStates];  // from kFirstOwn on
};
constexpr int kFirstOwn = kPitch + 1;
using sensor_jet = jet<even(3 + kSensorStates - kFirstOwn)>;

// Small rotations about the x and y axes, applied to a direction.
template <class T>
void tilt(const T &roll_rad, const T &pitch_rad, T v[3]) {
  const T x = v[0] - pitch_rad * v[2], y = v[1] + roll_rad * v[2];
  v[2] = v[2] + (pitch_rad * v[0] - roll_rad * v[1]);
  v[0] = x;
  v[1] = y;
}

// The landmark from the sensor, in the sensor's axes: x_c, y_c, alpha of [Stepanov2017], with the mounting's height,
// roll and pitch. floor_m: distance on the floor.
template <class T>
void find_ray(const mounted_sensor &sensor, const ray_view<T> &at, const double landmark_m[3], T v[3],
              double *floor_m) {
  const sin_cos_of<T> h = sine_cosine(at.heading_rad), m = sine_cosine(at.yaw_rad);
  const T dx = landmark_m[0] - at.x_m, dy = landmark_m[1] - at.y_m;
  T from[3] = {h.cos * dx + h.sin * dy - at.mount_x_m, h.cos * dy - h.sin * dx - at.mount_y_m, at.height_m};
  *floor_m = std::sqrt(square(value_of(from[0])) + square(value_of(from[1])));
  tilt(at.body_roll_rad, at.body_pitch_rad, from);
  const T level[3] = {m.cos * from[0] + m.sin * from[1], m.cos * from[1] - m.sin * from[0], from[2]};
  if (sensor.is_steep)
    for (int i = 0; i < 3; i++) v[i] = level[i];
  else
    for (int i = 0; i < 3; i++)
      v[i] = sensor.axis[i][0] * level[0] + sensor.axis[i][1] * level[1] + sensor.axis[i][2] * level[2];
  tilt(at.roll_rad, at.pitch_rad, v);
}

// A relative error of angles from the sensor's x axis moves the ray along the great circle through that axis; the
// result is by how much of that the bearing and the elevation move, rad.
template <class T>
struct axis_angle {
  T bearing, elevation;
};

template <class T>
axis_angle<T> by_angle_scale(const T v[3], const T &flat_m, const T &length_m) {
  if (!(square(value_of(v[1])) + square(value_of(v[2])) > square(kOnAxis * value_of(length_m)))) return {0.0, 0.0};
  const T off_axis = root(v[1] * v[1] + v[2] * v[2]), angle = atan2(off_axis, v[0]);
  return {angle * v[1] * length_m * length_m / off_axis / (flat_m * flat_m), angle * v[0] * v[2] / (off_axis * flat_m)};
}

template <class T>
T expect_range(const mounted_sensor &sensor, const sensor_view<T> &at, const T &length_m) {
  if (!sensor.range_is_depth) return at.error[kRangeScale] * length_m + at.error[kRangeBias];
  const sin_cos_of<T> axis = sine_cosine(at.error[kDepthAxis]);
  return at.error[kRangeScale] * (axis.cos * at.v[0] + axis.sin * at.v[1]) + at.error[kRangeBias];
}

template <class T>
T expect_bearing(const sensor_view<T> &at, const T &flat_m, const axis_angle<T> &stretch) {
  return wrap(atan2(at.v[1], at.v[0]) + at.error[kAngleScale] * stretch.bearing +
              (at.error[kEccentricY] * at.v[0] - at.error[kEccentricX] * at.v[1]) / flat_m);
}

// The landmark's or the sensor's height may be unknown: then neither it nor the body's tilt moves the ray.
ray_view<ray_jet> view_of(const mounted_sensor &sensor, const sensor_errors &errors, const wm_pose2 &pose,
                          const double landmark_m[3], bool with_height) {
  const auto own = [&](double calibrated, int state) {
    return ray_jet::variable(calibrated + errors[state], kBySensor + state);
  };
  const auto of_height = [&](double value, int cause) {
    return with_height ? ray_jet::variable(value, cause) : ray_jet(0.0);
  };
  return {.x_m = ray_jet::variable(pose.x_m, kByX),
          .y_m = ray_jet::variable(pose.y_m, kByY),
          .heading_rad = ray_jet::variable(pose.heading_rad, kByHeading),
          .body_roll_rad = of_height(0.0, kByBodyRoll),
          .body_pitch_rad = of_height(0.0, kByBodyPitch),
          .height_m = of_height(landmark_m[2] - sensor.z_m, kByHeight),
          .yaw_rad = own(sensor.yaw_rad, kYaw),
          .mount_x_m = own(sensor.x_m, kMountX),
          .mount_y_m = own(sensor.y_m, kMountY),
          .roll_rad = own(0.0, kRoll),
          .pitch_rad = own(0.0, kPitch)};
}

sensor_view<sensor_jet> view_of(const ray_jet ray[3], const sensor_errors &errors) {
  sensor_view<sensor_jet> out;
  for (int i = 0; i < 3; i++) out.v[i] = sensor_jet::variable(ray[i].value, i);
  for (int k = kFirstOwn; k < kSensorStates; k++) out.error[k] = sensor_jet::variable(errors[k], 3 + k - kFirstOwn);
  return out;
}

// A component's value, and its derivatives by each cause.
double put(const sensor_jet &component, const ray_jet ray[3], double by[kCauses]) {
  const double along[3] = {component.derivative(0), component.derivative(1), component.derivative(2)};
  for (int c = 0; c < kBySensor + kFirstOwn; c++)
    by[c] = along[0] * ray[0].derivative(c) + along[1] * ray[1].derivative(c) + along[2] * ray[2].derivative(c);
  for (int k = kFirstOwn; k < kSensorStates; k++) by[kBySensor + k] = component.derivative(3 + k - kFirstOwn);
  return component.value;
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
  const bool with_height = finite(landmark_m[2]) && finite(sensor.z_m);
  ray_jet ray[3];
  find_ray(sensor, view_of(sensor, errors, pose, landmark_m, with_height), landmark_m, ray, &out.distance_m);
  const sensor_view<sensor_jet> at = view_of(ray, errors);
  const sensor_jet q = at.v[0] * at.v[0] + at.v[1] * at.v[1];
  out.possible = q.value > kTouching_m2 && (!sensor.range_is_depth || ray[0].value > kShallow_m);
  if (!(q.value > kTouching_m2)) return out;
  const sensor_jet flat = root(q), length = root(q + at.v[2] * at.v[2]);
  const bool scaled = (components & kAngleScaled) || errors[kAngleScale] != 0.0;
  const auto stretch = scaled ? by_angle_scale(at.v, flat, length) : axis_angle<sensor_jet>{0.0, 0.0};
  if (components & kBearing) out.bearing_rad = put(expect_bearing(at, flat, stretch), ray, out.bearing_by);
  if (components & kRange) out.range_m = put(expect_range(sensor, at, length), ray, out.range_by);
  out.elevation_rad = std::numeric_limits<double>::quiet_NaN();
  if ((components & kElevation) && with_height)
    out.elevation_rad = put(atan2(at.v[2], flat) + at.error[kAngleScale] * stretch.elevation, ray, out.elevation_by);
  return out;
}

}  // namespace wm
