// SPDX-License-Identifier: Apache-2.0
// Sightings (bearing, range, elevation) and coded markers (bearing, range, heading) of a given map's landmarks as
// observations of a planar filter, with their states: the sensors' errors, the time-correlated error of a sensor on a
// landmark, a landmark's error on the map, the body's tilt.
#ifndef WAYMARK_ESTIMATOR_AID_SIGHTING_HPP
#define WAYMARK_ESTIMATOR_AID_SIGHTING_HPP

#include "aid/fuse.hpp"
#include "aid/observation.hpp"
#include "aid/residual.hpp"
#include "aid/tag.hpp"
#include "filters/core/sensor_slots.hpp"
#include "filters/core/state_pool.hpp"
#include "filters/planar/past_pose.hpp"
#include "filters/planar/planar_filter.hpp"
#include "maps/landmark_index.hpp"
#include "sensors/sighting.hpp"

namespace wm {

class sighting_aid {
 public:
  static constexpr int kRows = planar_filter::kRows;
  static constexpr int kErrorSlots = 24, kMapSlots = 24;  // most of correlated.slots and states.map_slots
  // Pose, sensor, time-correlated error, landmark, tilt.
  static_assert(kPoseStates + kSensorStates + 2 + 3 + 2 <= planar_row::kMax);

  // Behind the filter's memory.
  struct arrays {
    int *order;
    wm_time_ns *seen_ns;
  };
  static arrays place(memory_layout *layout, const wm_setup &setup);
  // The states of add_calibration() and of add_lent().
  static int count_states(const wm_setup &setup);
  // `at_sensor`: the filter's pose is that of the sensor which an observation is of, and not base_link's.
  void init(const wm_setup &setup, const arrays &behind, bool at_sensor = false);
  void add_calibration(planar_filter *filter);  // the sensors' errors
  void add_lent(planar_filter *filter);         // the other states
  // The sensors' calibration goes on as that of `from`, of another map; their states are at the same place.
  void take_up(const sighting_aid &from, planar_filter *filter);
  // The lent states are nobody's again.
  void release(planar_filter *filter);

  // A sighting of a landmark of the map, and the robot when it was taken.
  struct view {
    wm_sighting s;  // of a marker: what it is as a sighting
    sighting_reading reading;
    bool elevation;  // fused
    int landmark;    // index in the map
    past_pose past;
    // A marker's direction in levelled axes along the sensor's yaw, where it is fused; NaN: it is not.
    double yaw_rad, yaw_variance;
    double nearest;  // chi-square of the landmark that fits a sighting without identity best; 0: none was looked for
  };
  // Whether the event's sighting or marker is in order. *record: what is known of it.
  wm_status check(const wm_event &event, wm_innovation *record) const;
  // Whether it is to be fused (WM_FUSED), and with which landmark. `tracking`: by the pose a sighting without identity
  // may be associated, and one of a marker's two poses chosen.
  wm_verdict look(const wm_event &event, const planar_filter &filter, bool tracking, view *out,
                  wm_innovation *record) const;
  expected_sighting expect(const planar_filter &filter, const view &at) const;
  // Gate, update and records. *rows, *count: bearing, range, a marker's heading; the elevation is fused behind them
  // and says nothing of the pose, since a larger tilt than stated must not make the robot lost.
  fuse_result fuse(const view &at, const expected_sighting &e, const wm_innovation &record, const fuse_policy &policy,
                   planar_filter *filter, residual rows[kRows], int *count, record_list records);
  // For the search of a pose, with all errors as sigmas. `errors`: the sensor's.
  observation observe(const view &at, const sensor_errors &errors, const planar_filter &filter) const;
  // The robot's heading by a marker's: at.yaw_rad is a number.
  observation observe_heading(const view &at, const sensor_errors &errors, const planar_filter &filter) const;

  const sensor_slots &slots() const { return slots_; }
  const mounted_sensor &sensor(int i) const { return sensor_[i]; }
  sensor_errors errors_of(const planar_filter &filter, int sensor) const {
    return slots_.errors(sensor, [&filter](int slot) { return filter.value(slot); });
  }
  int find(int32_t id) const { return index_.find(setup_->landmarks, id); }  // -1: not on the map
  double map_sigma(int landmark) const;
  double yaw_sigma(int landmark) const;

 private:
  // The slots of the time-correlated error of this sensor on this landmark, and of the landmark's error on the map;
  // the state of an anchor's own error. -1: none.
  struct lent_slots {
    int error, map, of_anchor;
    double repeated_error, repeated_map;  // variances of those without a slot, as noise, over their own
  };
  struct row_of {
    wm_residual kind;
    double observed, expected;
    const double *by;
    int error_offset;  // in the slot of the time-correlated error; -1: none
    double error_size;
  };
  const wm_sighting_params &params() const { return *setup_->sightings; }
  bool has_tilt() const { return params().use_elevation && params().tilt_sigma_rad > 0.0; }
  double time_offset(const planar_filter &filter, int sensor) const {
    const int slot = slots_.at(sensor, kTimeOffset);
    return slot < 0 ? 0.0 : filter.value(slot);
  }
  wm_verdict look_at(const planar_filter &filter, bool tracking, view *out) const;
  wm_verdict look_at(const wm_marker &m, const planar_filter &filter, bool tracking, view *out) const;
  // Bearing, then range or elevation, then a marker's heading. Returns how many.
  int put_rows(const view &at, const expected_sighting &e, const wm_innovation &record, planar_filter *filter,
               residual rows[kRows]);
  double expected_yaw(const planar_filter &filter, const view &at) const;
  void put_heading(const view &at, planar_row *row) const;
  double heading_nis(const planar_filter &filter, const view &at, const tag_reading &tag) const;
  void put_heading_row(const view &at, const lent_slots &lent, const wm_innovation &record, planar_filter *filter,
                       residual *r) const;
  int find_nearest(const planar_filter &filter, const view &at, double *chi2) const;
  lent_slots lend_states(const view &at, planar_filter *filter);
  void decay_tilt(planar_filter *filter);
  void put_row(const view &at, const lent_slots &lent, const row_of &of, const wm_innovation &record,
               const planar_filter &filter, residual *r) const;
  void add_errors(const view &at, const lent_slots &lent, const row_of &of, const planar_filter &filter,
                  residual *r) const;

  const wm_setup *setup_;
  wm_marker_params markers_;
  mounted_sensor sensor_[kMaxSensors];
  sensor_slots slots_;
  landmark_index index_;
  relative_array<wm_time_ns> seen_ns_;  // of each landmark's last sighting; WM_TIME_NONE: none
  state_pool<kErrorSlots> errors_;
  correlated_slot error_;  // a slot of these
  state_pool<kMapSlots> map_;
  unsigned components_;  // of expect(): whether the angle scale is a state
  int yaw_offset_;       // of a landmark's direction in a slot of map_; -1: the map states none
  int tilt_state_;       // the body's roll and pitch; -1: not carried
  int unused_;           // no padding
  wm_time_ns tilt_ns_;
};

}  // namespace wm

#endif
