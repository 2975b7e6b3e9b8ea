// SPDX-License-Identifier: Apache-2.0
#include "aid/tag.hpp"

namespace wm {
namespace {

constexpr double kLeastLength_m = 1e-6;  // below, a marker is in the camera itself

double number_or(double a, double b) { return finite(a) ? a : b; }
double zero_if_absent(double a) { return std::isnan(a) ? 0.0 : a; }

}  // namespace

// sensor.axis is (Ry(pitch) Rx(roll))', its columns are the sensor's axes.
tag_reading read_tag(const wm_marker &m, bool second, const mounted_sensor &sensor, const sensor_errors &errors,
                     const wm_sighting_params &sightings, const wm_marker_params &params) {
  const double *p_m = second ? m.other_p_m : m.p_m;
  tag_reading r;
  double *level = r.level, *nominal = r.nominal;
  for (int i = 0; i < 3; i++)
    nominal[i] = sensor.axis[0][i] * p_m[0] + sensor.axis[1][i] * p_m[1] + sensor.axis[2][i] * p_m[2];
  // The states of roll and pitch are small rotations about the levelled axes ahead and to the left.
  const double roll = errors[kRoll], pitch = errors[kPitch];
  level[0] = nominal[0] + pitch * nominal[2];
  level[1] = nominal[1] - roll * nominal[2];
  level[2] = nominal[2] + roll * nominal[1] - pitch * nominal[0];
  const double floor_m = r.floor_m = std::sqrt(level[0] * level[0] + level[1] * level[1]);
  r.length_m = std::sqrt(level[0] * level[0] + level[1] * level[1] + level[2] * level[2]);
  r.along[0] = floor_m > kLeastLength_m ? level[0] / floor_m : 1.0;
  r.along[1] = floor_m > kLeastLength_m ? level[1] / floor_m : 0.0;
  r.yaw_rad = second ? m.other_yaw_rad : m.yaw_rad;
  const double across =
      sightings.bearing_sigma_factor * number_or(sensor.bearing_sigma_rad, params.bearing_sigma_rad) * floor_m;
  // A detector that gives the error along the line of sight leaves none to assume.
  const double assumed_m = finite(m.along_sigma_m) ? 0.0 : sightings.range_sigma_default_m;
  const double range = sightings.range_sigma_factor * number_or(sensor.range_sigma_m, assumed_m);
  const double least = square(params.sigma_m) + square(params.sigma_rel * r.length_m);
  // The error along the line of sight: its parts on the floor and upwards.
  const double along_sigma_m = zero_if_absent(m.along_sigma_m);
  const bool apart = r.length_m > kLeastLength_m;
  const double along = apart ? sightings.range_sigma_factor * along_sigma_m * floor_m / r.length_m : 0.0;
  const double up = apart ? sightings.range_sigma_factor * along_sigma_m * level[2] / r.length_m : 0.0;
  r.noise[0] = least + square(range) + square(along);
  r.noise[1] = least + square(across);
  r.noise[2] = square(number_or(m.yaw_sigma_rad, params.heading_sigma_rad));
  r.z_noise = least + square(across) + square(up);
  r.z_m = sensor.z_m + level[2];
  r.has_heading = m.poses != 2 && !(m.yaw_sigma_rad > params.heading_most_rad);
  return r;
}

}  // namespace wm
