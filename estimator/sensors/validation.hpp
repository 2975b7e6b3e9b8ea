// SPDX-License-Identifier: Apache-2.0
// Validation of sightings, markers, positions, headings, poses and stated poses, the same for every filter.
// WM_NOT_FINITE, WM_OUT_OF_RANGE: the datum cannot be a measurement.
#ifndef WAYMARK_ESTIMATOR_SENSORS_VALIDATION_HPP
#define WAYMARK_ESTIMATOR_SENSORS_VALIDATION_HPP

#include <cmath>

#include "math/elementary.hpp"
#include "waymark/event_fields.h"
#include "waymark/status.h"

namespace wm {

inline constexpr double kMaxRange_m = 1e6, kMaxSigma = 1e6;  // beyond, a number is an error of the sender
inline constexpr double kMaxAngle_rad = 100.0;               // unwrapped angles may have turned a few times

inline constexpr double kMaxMarker_m = WM_MARKER_MOST_M, kMaxPosition_m = WM_PLACE_MOST_M;
inline constexpr double kMaxHeadingSigma_rad = WM_HEADING_SIGMA_MOST_RAD, kUnitNorm = WM_UNIT_NORM;

// NaN: the sensor's own sigma.
inline bool is_sigma(double value) { return std::isnan(value) || (value > 0.0 && value < kMaxSigma); }

// Absent, or an angle above a plane with its sigma.
inline bool is_elevation(const wm_sighting &s) {
  return !wm_sighting_has_elevation(&s) ||
         (std::fabs(s.elevation_rad) <= kHalfPi && s.elevation_sigma_rad > 0.0 && s.elevation_sigma_rad < kMaxSigma);
}

inline wm_status check_sighting(const wm_sighting &s, size_t sensor_count) {
  const bool has_bearing = !std::isnan(s.bearing_rad), has_range = !std::isnan(s.range_m);
  if ((!has_bearing && !has_range) || std::isinf(s.bearing_rad) || std::isinf(s.range_m) || std::isinf(s.elevation_rad))
    return WM_NOT_FINITE;
  const bool in_range = s.sensor < sensor_count && !(has_bearing && std::fabs(s.bearing_rad) > kMaxAngle_rad) &&
                        !(has_range && !(s.range_m >= 0.0 && s.range_m < kMaxRange_m)) &&
                        is_sigma(s.bearing_sigma_rad) && is_sigma(s.range_sigma_m) && is_elevation(s);
  return in_range ? WM_OK : WM_OUT_OF_RANGE;
}

// Coordinates [first, last) of a position.
inline wm_status check_position(const wm_position &p, int first, int last) {
  const auto sigma = [&p](int i) { return i == 2 ? p.sigma_z_m : p.sigma_xy_m; };
  for (int i = first; i < last; i++)
    if (!finite(p.p_m[i]) || !finite(sigma(i))) return WM_NOT_FINITE;
  for (int i = first; i < last; i++)
    if (std::fabs(p.p_m[i]) > kMaxPosition_m || !is_sigma(sigma(i))) return WM_OUT_OF_RANGE;
  return WM_OK;
}

inline wm_status check_heading(const wm_heading &h) {
  if (!finite(h.heading_rad) || !finite(h.sigma_rad)) return WM_NOT_FINITE;
  const bool possible = std::fabs(h.heading_rad) <= kMaxAngle_rad && h.sigma_rad > 0.0 && h.sigma_rad < kMaxAngle_rad;
  return possible ? WM_OK : WM_OUT_OF_RANGE;
}

inline double absent_as_zero(double a) { return std::isnan(a) ? 0.0 : a; }

inline wm_status check_localized(const wm_localized &p) {
  const double *c = p.covariance;
  const bool is_stated = !std::isnan(c[0]);
  double sum = p.p_m[0] + p.p_m[1] + absent_as_zero(p.heading_rad);
  for (int i = 0; i < 6 && is_stated; i++) sum += c[i];
  if (!finite(sum)) return WM_NOT_FINITE;
  const bool is_place = std::fabs(p.p_m[0]) <= kMaxPosition_m && std::fabs(p.p_m[1]) <= kMaxPosition_m;
  const bool is_angle = std::isnan(p.heading_rad) || std::fabs(p.heading_rad) <= kMaxAngle_rad;
  const bool is_definite = !is_stated || (c[0] > 0.0 && c[5] > 0.0 && c[0] * c[2] > c[1] * c[1]);
  return is_place && is_angle && is_definite ? WM_OK : WM_OUT_OF_RANGE;
}

inline wm_status check_marker(const wm_marker &m, size_t sensor_count) {
  const bool two = m.poses == 2;
  const double lengths[] = {m.p_m[0],
                            m.p_m[1],
                            m.p_m[2],
                            two ? m.other_p_m[0] : 0.0,
                            two ? m.other_p_m[1] : 0.0,
                            two ? m.other_p_m[2] : 0.0,
                            absent_as_zero(m.along_sigma_m)};
  const double angles[] = {m.yaw_rad, two ? m.other_yaw_rad : 0.0, absent_as_zero(m.yaw_sigma_rad),
                           absent_as_zero(m.bloom_px)};
  bool all_finite = true, in_range = m.sensor < sensor_count && !(m.along_sigma_m <= 0.0) && !(m.yaw_sigma_rad <= 0.0);
  for (double n : lengths) {
    all_finite &= finite(n);
    in_range &= std::fabs(n) <= kMaxMarker_m;
  }
  for (double a : angles) {
    all_finite &= finite(a);
    in_range &= std::fabs(a) <= kMaxAngle_rad;
  }
  return !all_finite ? WM_NOT_FINITE : in_range ? WM_OK : WM_OUT_OF_RANGE;
}

// `coordinates`: 2 in the plane, 3 in space.
inline wm_status check_set_pose(const wm_set_pose &s, int coordinates) {
  double norm = 0.0;
  for (const double q : s.pose_map_base.q_xyzw) norm += q * q;
  if (!finite(norm) || !finite(s.sigma_xy_m) || !finite(s.sigma_heading_rad)) return WM_NOT_FINITE;
  for (int i = 0; i < coordinates; i++)
    if (!finite(s.pose_map_base.p_m[i])) return WM_NOT_FINITE;
  for (int i = 0; i < coordinates; i++)
    if (std::fabs(s.pose_map_base.p_m[i]) > kMaxPosition_m) return WM_OUT_OF_RANGE;
  const bool possible = std::fabs(norm - 1.0) <= kUnitNorm && s.sigma_xy_m > 0.0 && s.sigma_xy_m <= kMaxPosition_m &&
                        s.sigma_heading_rad > 0.0 && s.sigma_heading_rad < kMaxHeadingSigma_rad;
  return possible ? WM_OK : WM_OUT_OF_RANGE;
}

}  // namespace wm

#endif
