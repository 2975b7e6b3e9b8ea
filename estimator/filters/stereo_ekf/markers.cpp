// SPDX-License-Identifier: Apache-2.0
// Coded markers of the map, in space: the place in the sensor's axes. A marker's yaw is about the vertical of a level
// sensor, which a vehicle in space is not: it is not used.
#include "filters/core/gate.hpp"
#include "filters/stereo_ekf/stereo_ekf.hpp"
#include "sensors/validation.hpp"

namespace wm {
namespace {

constexpr double kClutter_m = 10.0;  // a misread code lies anywhere in a cube of this side, as in the plane
constexpr double kNearest_m = 0.05;  // nearer to the sensor, a marker has no direction
constexpr double kAslant = 0.9;      // cosine, below which an axis serves to find one across the line of sight

double number_or(double a, double b) { return finite(a) ? a : b; }

// Unit vectors along the line of sight and across it.
void axes_along(const vec3 &sight, double distance_m, vec3 axis[3]) {
  axis[0] = (1.0 / distance_m) * sight;
  const vec3 other = std::fabs(axis[0].z) < kAslant ? vec3{0, 0, 1} : vec3{0, 1, 0};
  const vec3 across = cross(other, axis[0]);
  axis[1] = (1.0 / length(across)) * across;
  axis[2] = cross(axis[0], axis[1]);
}

}  // namespace

// Components of the place along and across the measured line of sight: a . S'(R'(l - p) - arm), S the sensor's axes.
// False: too near to the sensor.
bool stereo_ekf::marker_rows(const wm_marker &m, int landmark, int slot, row_block *out) const {
  static constexpr wm_residual kKinds[3] = {WM_RESIDUAL_X, WM_RESIDUAL_Y, WM_RESIDUAL_Z};
  const wm_sensor &sensor = setup_->sensors[m.sensor];
  const wm_landmark &known = setup_->landmarks[landmark];
  const past_pose past = state_before(0.0);
  const vec3 arm = vec_of(sensor.mounting.xyz_m), seen = vec_of(m.p_m);
  const vec3 to = (slot >= 0 ? filter_.point(slot) : vec_of(known.p_m)) - past.at.p - past.R * arm;
  const double distance_m = length(seen), map = slot >= 0 ? 0.0 : map_sigma(known);
  if (!(distance_m > kNearest_m)) return false;
  const mat3 to_map = past.R * matrix_of_rpy(sensor.mounting.rpy_rad);
  const double own = square(markers_.sigma_m) + square(markers_.sigma_rel * distance_m) + square(map);
  const double across_m = distance_m * number_or(sensor.bearing_sigma_rad, markers_.bearing_sigma_rad);
  // A detector that gives the error along the line of sight leaves none to assume.
  const bool is_given = finite(m.along_sigma_m);
  const double assumed_m = is_given ? 0.0 : setup_->sightings->range_sigma_default_m;
  const double along2 = square(number_or(sensor.range_sigma_m, assumed_m)) + (is_given ? square(m.along_sigma_m) : 0.0);
  vec3 axis[3];
  axes_along(seen, distance_m, axis);
  double by_end[3][3], by_turn[3][3];
  for (int k = 0; k < 3; k++) {
    // Its gradient in map axes, g. A rotation dr changes it by dr . (g x to).
    const vec3 gradient = to_map * axis[k], turned = cross(gradient, to);
    const double observed = dot(axis[k], seen);
    out->add_row(kKinds[k], observed, observed - dot(gradient, to), own + (k == 0 ? along2 : square(across_m)));
    for (int j = 0; j < 3; j++) {
      by_end[k][j] = -gradient[j];
      by_turn[k][j] = turned[j];
    }
  }
  add_pose_columns(out, past, arm, by_end, by_turn);
  if (slot < 0) return true;
  const int column = out->add_columns(filter_.point_state(slot), 3);
  for (int k = 0; k < 3; k++)
    for (int j = 0; j < 3; j++) out->by[k][column + j] = -by_end[k][j];
  return true;
}

wm_status stereo_ekf::fuse_marker(const wm_event &event, record_list records) {
  const wm_marker &m = event.as.marker;
  wm_innovation blank = record_of(event, WM_RESIDUAL_X);
  blank.sensor = m.sensor;
  blank.landmark_id = m.id;
  if (const wm_status bad = check_marker(m, setup_->sensor_count); bad != WM_OK) return refuse(records, blank, bad);
  if (const wm_status bad = check_time(event.t_ns); bad != WM_OK) return bad;
  move_to(event.t_ns);
  if (m.id < 0) return reject(records, blank, WM_REJECTED_NO_ASSOCIATION);
  const int known = index_.find(setup_->landmarks, m.id);
  if (known < 0) return reject(records, blank, WM_REJECTED_UNKNOWN_ID);
  if (life_.searching()) return reject(records, blank, WM_REJECTED_SEARCHING);
  if (length(vec_of(m.p_m)) > setup_->sensors[m.sensor].max_range_m)
    return reject(records, blank, WM_REJECTED_OUT_OF_RANGE);
  row_block rows;
  if (!marker_rows(m, known, slot_of_known(known), &rows)) return reject(records, blank, WM_REJECTED_SINGULAR);
  note(event.t_ns, m.id, fuse_rows(rows, blank, records), kClutter_m * kClutter_m * kClutter_m,
       &records_[(size_t)known]);
  return WM_OK;
}

}  // namespace wm
