// SPDX-License-Identifier: Apache-2.0
// The slots of the sensors' calibration states in a filter's state vector: all that follows from the table of
// sensors/sensor_states.h.
#ifndef WAYMARK_ESTIMATOR_CORE_SENSOR_SLOTS_HPP
#define WAYMARK_ESTIMATOR_CORE_SENSOR_SLOTS_HPP

#include <cmath>

#include "filters/core/state_slots.hpp"
#include "motion/motion_params.h"
#include "sensors/sighting.hpp"
#include "waymark/estimator.h"

namespace wm {

class sensor_slots {
 public:
  // States that the sensors take. Without motion data the default leaves out what only a motion beside the observations
  // shows: where the sensor looks, and how late it is. An axis of depths is a sensor's that measures depths.
  static int count(const wm_setup &setup) {
    int out = 0;
    for (int i = 0; i < static_cast<int>(setup.sensor_count); i++)
      for (const sensor_state_spec &spec : kSensorStateSpecs) out += is_on(setup, i, spec.row);
    return out;
  }

  // add(neutral, sigma, walk, low, high) appends a state to the filter and returns its index. Without a known map, a
  // sensor with a sigma of ranges alone has a larger prior of their scale: those are times of flight of radio or sound.
  template <class Add>
  void init(const wm_setup &setup, bool known_map, Add add) {
    const wm_sighting_params &p = *setup.sightings;
    for (int k = 0; k < kSensorStates; k++) by_default_[k] = p.states.sigma[kSensorStateSpecs[k].row] < 0.0;
    slots_.init(static_cast<int>(setup.sensor_count), [&](int sensor, int k) {
      const sensor_state_spec &s = kSensorStateSpecs[k];
      const double range_sigma_m =
          first_number(setup.sensors[sensor].range_sigma_m, p.range_sigma_default_m, p.range_sigma_default_m);
      const bool flight = !known_map && gives_ranges_alone(setup.sensors[sensor]) && s.row == WM_SENSOR_ROW_kRangeScale;
      const double unit = s.row == WM_SENSOR_ROW_kRangeBias ? range_sigma_m : flight ? kFlightScale : 1.0;
      const double sigma = absolute_sigma(p.states.sigma[s.row], unit);
      return is_on(setup, sensor, s.row) ? add(s.neutral, sigma, p.states.walk[s.row], s.low, s.high) : -1;
    });
  }

  int at(int sensor, int state) const { return slots_.at(sensor, state); }  // -1: off
  // The sensor's state that this slot is of; -1: none.
  int state_of(int sensor, int slot) const {
    for (int k = 0; k < kSensorStates; k++)
      if (at(sensor, k) == slot) return k;
    return -1;
  }
  bool is_by_default(int state) const { return by_default_[state]; }
  // `exact`: states, by bit, that are at their neutral value unless a parameter states their sigma.
  int at(int sensor, int state, unsigned exact) const {
    return (exact >> state & 1u) && by_default_[state] ? -1 : at(sensor, state);
  }

  // The errors as value(slot) gives them; neutral where the state is off.
  template <class Value>
  sensor_errors errors(int sensor, Value value) const {
    sensor_errors out;
    for (int k = 0; k < kSensorStates; k++)
      if (at(sensor, k) >= 0) out[k] = value(at(sensor, k));
    return out;
  }

  // Adds the derivatives by all of a sensor's errors but the time offset to a Jacobian row. `by`: by sighting_cause.
  template <class Row>
  void add_to(Row *row, int sensor, const double by[kCauses], unsigned exact = 0) const {
    for (int k = 0; k < kSensorStates; k++)
      if (k != kTimeOffset) row->add(at(sensor, k, exact), by[kBySensor + k]);
  }

  // The motion's lag has become a state, and the observations show its sum with the time offsets alone: what these have
  // taken of it until now is theirs or the lag's.
  template <class Filter>
  void begin_lag(const wm_setup &setup, Filter *filter) const {
    const double sigma = absolute_sigma(setup.sightings->states.sigma[WM_SENSOR_ROW_kTimeOffset], 1.0);
    for (int i = 0; i < static_cast<int>(setup.sensor_count); i++)
      if (const int slot = at(i, kTimeOffset); slot >= 0) filter->forget(slot, 0.0, square(sigma));
  }

  template <class Filter>
  void list(const wm_setup &setup, const Filter &filter, calibration_list *out) const {
    for (int i = 0; i < static_cast<int>(setup.sensor_count); i++)
      for (int k = 0; k < kSensorStates; k++) {
        const int slot = at(i, k);
        if (slot < 0) continue;
        const double value = filter.value(slot), sigma = std::sqrt(filter.variance(slot));
        out->add(setup.sensors[i].name, kSensorStateSpecs[k].name, value, sigma);
        if (k == kRangeScale) out->add_length(length_square(*setup.sightings, value, sigma));
        if (filter.is_stated_wrongly(slot)) out->alarm(WM_ALARM_STATED, value);
      }
  }

  static bool gives_ranges_alone(const wm_sensor &s) {
    return std::isnan(s.bearing_sigma_rad) && !std::isnan(s.range_sigma_m);
  }
  // Of the default's sigma of a range's scale, for times of flight without a map: 10 %. The speed of sound varies by
  // that in water and air. Not swept.
  static constexpr double kFlightScale = 2.0;

 private:
  static bool is_on(const wm_setup &setup, int sensor, int row) {
    const double sigma = setup.sightings->states.sigma[row];
    if (sigma < 0.0 && row == WM_SENSOR_ROW_kDepthAxis && !setup.sensors[sensor].range_is_depth) return false;
    if (sigma < 0.0 && row == WM_SENSOR_ROW_kMountX && !finite(setup.sensors[sensor].range_sigma_m)) return false;
    const bool shown_by_motion = row == WM_SENSOR_ROW_kYaw || row == WM_SENSOR_ROW_kTimeOffset;
    const bool moves = setup.motion->model != WM_MOTION_CONSTANT_VELOCITY;
    return sigma > 0.0 || (sigma < 0.0 && (moves || !shown_by_motion));
  }

  state_slots<kMaxSensors, kSensorStates> slots_;
  bool by_default_[kSensorStates];
};

}  // namespace wm

#endif
