// SPDX-License-Identifier: Apache-2.0
// The components of a sighting and their sigmas, the same for every planar filter.
#ifndef WAYMARK_ESTIMATOR_SENSORS_SIGHTING_HPP
#define WAYMARK_ESTIMATOR_SENSORS_SIGHTING_HPP

#include <cmath>

#include "math/elementary.hpp"
#include "sensors/sensor_model.hpp"
#include "sensors/validation.hpp"

namespace wm {

inline double first_number(double a, double b, double c) { return finite(a) ? a : finite(b) ? b : c; }

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
