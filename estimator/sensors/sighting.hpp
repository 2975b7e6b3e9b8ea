// SPDX-License-Identifier: Apache-2.0
// A sighting's validation and its sigmas, the same for every filter.
#ifndef WAYMARK_ESTIMATOR_SENSORS_SIGHTING_HPP
#define WAYMARK_ESTIMATOR_SENSORS_SIGHTING_HPP

#include <cmath>

#include "math/elementary.hpp"
#include "sensors/sensor_model.hpp"
#include "waymark/event.h"
#include "waymark/status.h"

namespace wm {

inline constexpr double kMaxRange_m = 1e6, kMaxSigma = 1e6;  // beyond, a number is an error of the sender
inline constexpr double kMaxAngle_rad = 100.0;               // unwrapped angles may have turned a few times

// NaN: the sensor's own sigma.
inline bool is_sigma(double value) { return std::isnan(value) || (value > 0.0 && value < kMaxSigma); }
inline double first_number(double a, double b, double c) { return finite(a) ? a : finite(b) ? b : c; }

// Absent, or an angle above a plane with its sigma.
inline bool is_elevation(const wm_sighting &s) {
  return !wm_sighting_has_elevation(&s) ||
         (std::fabs(s.elevation_rad) <= kHalfPi && s.elevation_sigma_rad > 0.0 && s.elevation_sigma_rad < kMaxSigma);
}

// WM_NOT_FINITE, WM_OUT_OF_RANGE: it cannot be a measurement.
inline wm_status check_sighting(const wm_sighting &s, size_t sensor_count) {
  const bool has_bearing = !std::isnan(s.bearing_rad), has_range = !std::isnan(s.range_m);
  if ((!has_bearing && !has_range) || std::isinf(s.bearing_rad) || std::isinf(s.range_m) || std::isinf(s.elevation_rad))
    return WM_NOT_FINITE;
  const bool in_range = s.sensor < sensor_count && !(has_bearing && std::fabs(s.bearing_rad) > kMaxAngle_rad) &&
                        !(has_range && !(s.range_m >= 0.0 && s.range_m < kMaxRange_m)) &&
                        is_sigma(s.bearing_sigma_rad) && is_sigma(s.range_sigma_m) && is_elevation(s);
  return in_range ? WM_OK : WM_OUT_OF_RANGE;
}

// Which components of a sighting are fused, and how noisy they are.
struct sighting_reading {
  bool bearing, range;
  double bearing_sigma_rad, range_sigma_m;
};

// `params`: of a filter that has the rows WM_SIGHTING_NOISE_PARAMS.
template <class Params>
sighting_reading read_sighting(const wm_sighting &s, const mounted_sensor &sensor, const Params &params) {
  sighting_reading r;
  r.bearing = !std::isnan(s.bearing_rad) && params.use_bearing;
  r.range = !std::isnan(s.range_m) && params.use_range;
  r.bearing_sigma_rad = params.bearing_sigma_factor *
                        first_number(s.bearing_sigma_rad, sensor.bearing_sigma_rad, params.bearing_sigma_default_rad);
  r.range_sigma_m =
      params.range_sigma_factor * first_number(s.range_sigma_m, sensor.range_sigma_m, params.range_sigma_default_m);
  return r;
}

}  // namespace wm

#endif
