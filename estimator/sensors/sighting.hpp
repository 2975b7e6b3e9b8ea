// SPDX-License-Identifier: Apache-2.0
// The components of a sighting and their sigmas, the same for every planar filter.
#ifndef WAYMARK_ESTIMATOR_SENSORS_SIGHTING_HPP
#define WAYMARK_ESTIMATOR_SENSORS_SIGHTING_HPP

#include <cmath>

#include "math/elementary.hpp"
#include "sensors/sensor_model.hpp"
#include "sensors/sighting_params.h"
#include "sensors/validation.hpp"

namespace wm {

inline double first_number(double a, double b, double c) { return finite(a) ? a : finite(b) ? b : c; }

// A parameter of a sigma: below 0 the multiple of `sigma`.
inline double absolute_sigma(double parameter, double sigma) {
  return parameter < 0.0 ? -parameter * sigma : parameter;
}

// Which components of a sighting are fused, and how noisy they are.
struct sighting_reading {
  bool bearing, range;
  bool complete;     // its sigmas have all of its errors: by default none of the sensor come on top
  bool independent;  // in time: by default no error that lasts comes on top
  double bearing_sigma_rad, range_sigma_m;
};

inline sighting_reading read_sighting(const wm_sighting &s, const mounted_sensor &sensor,
                                      const wm_sighting_params &params) {
  sighting_reading r;
  r.bearing = !std::isnan(s.bearing_rad) && params.use_bearing;
  r.range = !std::isnan(s.range_m) && params.use_range;
  r.complete = r.independent = false;
  r.bearing_sigma_rad = params.bearing_sigma_factor *
                        first_number(s.bearing_sigma_rad, sensor.bearing_sigma_rad, params.bearing_sigma_default_rad);
  r.range_sigma_m =
      params.range_sigma_factor * first_number(s.range_sigma_m, sensor.range_sigma_m, params.range_sigma_default_m);
  return r;
}

// A false range lies anywhere within this; a factor of 10 is 2.3 nats.
inline constexpr double kClutterRange_m = 30.0;
// Where a false detection may lie.
inline double clutter_volume(const sighting_reading &r) {
  return (r.bearing ? kTwoPi : 1.0) * (r.range ? kClutterRange_m : 1.0);
}

inline constexpr double kOnSensor_m = 0.05;  // nearer to the sensor, a landmark has no direction
// Of an expectation that is not possible.
inline wm_verdict why_impossible(const expected_sighting &e) {
  return e.distance_m < kOnSensor_m ? WM_REJECTED_SINGULAR : WM_REJECTED_OUT_OF_RANGE;
}

// Sigma of a sighting's time-correlated error: of the bearing, without and with that across the line of sight, and of
// the range, without and with the part that is relative to it. 0 without slots.
inline double correlated_bearing(const wm_sighting_params &p, double sigma_rad) {
  return p.correlated_slots > 0 ? absolute_sigma(p.correlated_bearing_rad, sigma_rad) : 0.0;
}
inline double correlated_bearing(const wm_sighting_params &p, const sighting_reading &r, double distance_m) {
  if (p.correlated_slots == 0 || (r.independent && p.correlated_bearing_rad < 0.0)) return 0.0;
  // Of bearings alone that state their sigmas: an edge has no breadth.
  const double lateral_m = r.complete ? 0.0 : p.correlated_lateral_m;
  return std::sqrt(square(correlated_bearing(p, r.bearing_sigma_rad)) + square(lateral_m / distance_m));
}
inline double correlated_range(const wm_sighting_params &p, double sigma_m) {
  return p.correlated_slots > 0 ? absolute_sigma(p.correlated_range_m, sigma_m) : 0.0;
}
inline double correlated_range(const wm_sighting_params &p, const sighting_reading &r, double range_m) {
  if (p.correlated_slots == 0 || (r.independent && p.correlated_range_m < 0.0)) return 0.0;
  // Of ranges alone (radio, sound) what grows with the range is the sensor's scale; a landmark's own error does not.
  const double relative_m = r.bearing ? p.correlated_range_rel * range_m : 0.0;
  return std::sqrt(square(correlated_range(p, r.range_sigma_m)) + square(relative_m));
}

// Of ranges alone half of the variance is an error of the anchor for a whole drive: of its delay, of the walls beside
// it; the other half fades. It takes the state that a bearing's error has else. Time constant, s; flat from 60 on.
inline constexpr double kOfAnchor_s = 300.0;

// The states of a slot of time-correlated errors: `width` of them; the offsets of the bearing's and the range's error
// in it, -1: not carried. An error of sigma 1 is scaled by the parameters.
struct correlated_slot {
  int bearing, range, width;
};
inline correlated_slot correlated_slot_of(const wm_sighting_params &p) {
  const bool bearing = p.correlated_bearing_rad != 0.0 || p.correlated_lateral_m > 0.0;
  const bool range = p.correlated_range_m != 0.0 || p.correlated_range_rel > 0.0;
  return {bearing ? 0 : -1, range ? static_cast<int>(bearing) : -1, p.correlated_slots > 0 ? bearing + range : 0};
}

}  // namespace wm

#endif
