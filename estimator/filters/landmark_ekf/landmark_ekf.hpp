// SPDX-License-Identifier: Apache-2.0
// The landmark filter of system 1 [Stepanov2017] with self-calibration, time-correlated errors and relocalization.
// docs/estimators/landmark_ekf.md has the model. One observation's way: correct() -> fuse_sighting() -> associate() ->
// expect() -> sighting_rows() -> fuse() -> planar_filter::update() -> note().
#ifndef WAYMARK_ESTIMATOR_LANDMARK_EKF_HPP
#define WAYMARK_ESTIMATOR_LANDMARK_EKF_HPP

#include <cmath>

#include "aid/position.hpp"
#include "filters/core/first_sightings.hpp"
#include "filters/core/gate.hpp"
#include "filters/core/landmark_evidence.hpp"
#include "filters/core/lifecycle.hpp"
#include "filters/core/rollback.hpp"
#include "filters/core/sensor_slots.hpp"
#include "filters/core/state_pool.hpp"
#include "filters/landmark_ekf/params.h"
#include "filters/landmark_ekf/start_hypotheses.hpp"
#include "filters/planar/planar_filter.hpp"
#include "maps/landmark_index.hpp"
#include "sensors/sighting.hpp"
#include "waymark/health.h"
#include "waymark/internal/memory/layout.hpp"

namespace wm {

class landmark_ekf {
 public:
  static size_t bytes(const wm_landmark_ekf_params &params, const wm_setup &setup, const char **why);
  void init(const wm_landmark_ekf_params &params, const wm_setup &setup);

  wm_status predict(const wm_event &motion);
  wm_status correct(const wm_event &event, record_list records);
  void estimate(wm_estimate *out) const;
  void list_calibration(calibration_list *list) const;
  size_t list_counters(wm_counter *out, size_t capacity) const;
  const wm_motion_calibration &motion_calibration() const { return filter_.calibration(); }
  uint32_t motion_health() const { return filter_.motion_health(); }

 private:
  static constexpr int kErrorSlots = 24, kMapSlots = 24;  // most of correlated.slots and states.map_slots
  static constexpr int kMaxCalibration =
      kCalibrationCount + 2 + kMaxSensors * kSensorStates + position_aid::kStates;  // 2: the wheels' heading
  static_assert(kMaxSensors * kSensorStates <= kMaxSensorStates);
  // In list_calibration() beside them: the antenna's place, the heading's bias, factors of noise, turn, lasting error.
  static_assert(kMaxCalibration + 3 + noise_adaption::kFactors + 2 <= 2 * WM_HEALTH_CALIBRATION_MAX);
  // Pose, sensor, time-correlated error, landmark, tilt.
  static_assert(kPoseStates + kSensorStates + 2 + 3 + 2 <= planar_row::kMax);

  // A sighting on its way to the update: what is fused of it, of which landmark, and the pose at its time.
  struct sighting_context {
    const wm_sighting *s;
    sighting_reading reading;
    bool elevation;  // fused
    int landmark;    // index in the map
    past_pose past;
  };
  // The slots of the time-correlated error of this sensor on this landmark, and of the landmark's error on the map;
  // -1: none.
  struct lent_slots {
    int error, map;
    double repeated_error, repeated_map;  // variances of those without a slot, as noise, over their own
  };

  wm_status fuse_sighting(const wm_event &event, const wm_sighting &s, record_list records);
  wm_status fuse_marker(const wm_event &event, record_list records);
  wm_status fuse_position(const wm_event &event, record_list records);
  wm_status fuse_heading(const wm_event &event, record_list records);
  wm_status take_pose(const wm_event &event);

  // Whether a sighting is to be fused (WM_FUSED), and with which landmark.
  wm_verdict associate(const wm_sighting &s, sighting_context *out);
  int associate_nearest(const sighting_context &at);
  lent_slots lend_states(int sensor, int landmark, wm_time_ns t_ns);
  // The rows of a sighting: bearing, then range or elevation. Returns how many.
  int sighting_rows(const sighting_context &at, const expected_sighting &e, const wm_innovation &record,
                    residual rows[2]);
  void add_errors(const sighting_context &at, const lent_slots &lent, const double by[kCauses], int error_offset,
                  double error_size, residual *r) const;
  void finish_row(wm_residual kind, double observed, double expected, const wm_innovation &record, residual *r) const;
  first_sightings::row row_at_prior(const residual &r, int sensor) const;
  void restart_calibration(int sensor, const double prior[kSensorStates]);
  void test_calibration(const sighting_context &at, const residual *rows, int count);
  void decay_tilt(wm_time_ns t_ns);

  // Gates one or two components jointly, weakens or rejects, updates, writes the records. Returns the log Bayes factor
  // of "anywhere in clutter_volume" against "as expected". `usable` false: the source is known to be wrong.
  double fuse(residual *rows, int count, double clutter_volume, bool usable, record_list records);
  wm_verdict update(innovation &&prepared, const residual *rows, const gate_result &g);
  innovation prepare(const residual *rows, int count);
  bool passes(const gate_result &g, int dof) const;
  void fuse_elevation(residual bearing_then_own[2], const double *before, record_list records);

  double map_sigma(int landmark) const;
  sensor_errors errors_of(int sensor) const;
  sensor_errors remembered_errors_of(int sensor) const;
  double time_offset(int sensor) const;

  // Relocalization (recovery.cpp).
  observation observation_of(const sighting_context &at, wm_time_ns t_ns) const;
  observation observation_at(wm_time_ns t_ns, int key, const wm_pose2 &sensor_in_odom) const;
  void buffer_observation(const observation &seen);
  void note(wm_time_ns t_ns, int key, double log_bayes, double angle_rad = NAN, double normalised = NAN);
  travelled_pose2 odometry() const { return {filter_.odom(), filter_.travelled_m(), filter_.turned_rad()}; }
  bool needs_search(wm_time_ns t_ns, bool by_bearing);
  void search_now(wm_time_ns t_ns);
  double found_sigma_m(wm_time_ns since_ns) const;
  void search(wm_time_ns since_ns, const observation *prior, int prior_count);
  void begin_life(bool pose_known);
  void start_again();
  void begin_start_test();
  void test_start(wm_time_ns t_ns);
  double lost_probability() const;
  rollback<kMaxCalibration>::generation trusted_generation() const;
  void restore_calibration();
  wm_time_ns elsewhere_since(wm_time_ns t_ns);
  bool is_elsewhere(wm_time_ns since_ns, wm_time_ns t_ns);
  void update_moved(int landmark);
  void widen(wm_estimate *out) const;
  void add_start_mixture(wm_estimate *out) const;

  struct arrays {
    double *filter;
    int *order;
    landmark_record *records;
    wm_time_ns *seen_ns;
  };
  const wm_sighting_params &sightings() const { return *setup_->sightings; }
  static arrays place(memory_layout *layout, const wm_landmark_ekf_params &params, const wm_setup &setup);

  planar_filter filter_;
  landmark_index index_;
  relative_array<landmark_record> records_;
  relative_array<wm_time_ns> seen_ns_;  // of each landmark's last sighting; WM_TIME_NONE: none
  const wm_setup *setup_;
  wm_landmark_ekf_params params_;
  mounted_sensor sensor_[kMaxSensors];
  sensor_slots slots_;
  unsigned components_;  // of expect(): whether the angle scale is a state
  position_aid positions_;
  state_pool<kErrorSlots> errors_;
  correlated_slot error_;  // a slot of these
  state_pool<kMapSlots> map_;
  int tilt_state_;  // the body's roll and pitch; -1: not carried
  wm_time_ns tilt_ns_;
  rollback<kMaxCalibration> rollback_;
  int calibration_states_;  // pose and calibration; the lent states come behind
  lifecycle life_;
  landmark_evidence evidence_;
  first_sightings first_;
  pose_search observations_;
  start_hypotheses start_;
  observation prior_[2];
  int prior_count_;
  observation vague_[2];  // the pose when it had become too vague to be corrected
  wm_time_ns start_tested_ns_, inflated_ns_, vague_ns_;
  uint32_t moved_;
  int32_t moved_id_;        // of the last one
  double map_variance_m2_;  // of a place anywhere among the landmarks, each axis
};

}  // namespace wm

#endif
