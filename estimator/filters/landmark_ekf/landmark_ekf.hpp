// SPDX-License-Identifier: Apache-2.0
// The landmark filter of system 1 [Stepanov2017] with self-calibration, time-correlated errors and relocalization.
// docs/estimators/landmark_ekf.md has the model. One observation's way: correct() -> fuse_landmark() -> sighting_aid
// -> fuse() -> planar_filter::update() -> note().
#ifndef WAYMARK_ESTIMATOR_LANDMARK_EKF_HPP
#define WAYMARK_ESTIMATOR_LANDMARK_EKF_HPP

#include <cmath>

#include "aid/fuse.hpp"
#include "aid/localizer.hpp"
#include "aid/position.hpp"
#include "aid/sighting.hpp"
#include "filters/core/first_sightings.hpp"
#include "filters/core/landmark_evidence.hpp"
#include "filters/core/lifecycle.hpp"
#include "filters/core/rollback.hpp"
#include "filters/landmark_ekf/params.h"
#include "filters/landmark_ekf/start_hypotheses.hpp"
#include "filters/planar/planar_filter.hpp"
#include "filters/relocalize/pose_search.hpp"
#include "waymark/health.h"
#include "waymark/internal/memory/layout.hpp"

namespace wm {

inline constexpr double kBase_m[2] = {};  // base_link's place on itself

// The landmarks' box in the plane.
class landmark_box {
 public:
  landmark_box() = default;
  explicit landmark_box(const wm_setup &setup);
  // Variance of a place anywhere among the landmarks and the pose, each axis, m2: of a uniform density in their box.
  double anywhere_m2(const wm_pose2 &pose) const;

 private:
  void widen_to(const double place_m[2]);
  double low_m_[2] = {HUGE_VAL, HUGE_VAL}, high_m_[2] = {-HUGE_VAL, -HUGE_VAL};
};

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
  void carry(const landmark_ekf &from, const wm_pose2 *by);
  double misfit() const { return misfit_; }

 private:
  static constexpr int kMaxCalibration =
      kCalibrationCount + 2 + kMaxSensors * kSensorStates + position_aid::kStates;  // 2: the wheels' heading
  static_assert(kMaxSensors * kSensorStates <= kMaxSensorStates);
  // In list_calibration() beside them: the antenna's place, the heading's bias, factors of noise, turn, lasting error.
  static_assert(kMaxCalibration + 3 + noise_adaption::kFactors + 2 <= 2 * WM_HEALTH_CALIBRATION_MAX);

  wm_status fuse_landmark(const wm_event &event, record_list records);
  wm_status fuse_position(const wm_event &event, record_list records);
  wm_status fuse_heading(const wm_event &event, record_list records);
  wm_status fuse_localized(const wm_event &event, record_list records);
  wm_status take_pose(const wm_event &event);

  first_sightings::row row_at_prior(const residual &r, int sensor) const;
  void restart_calibration(int sensor, const double prior[kSensorStates]);
  void test_calibration(const sighting_aid::view &at, const residual *rows, int count);

  // How observations are fused now. `usable` false: the source is known to be wrong.
  fuse_policy policy(bool usable) const;
  // Returns the log Bayes factor of "anywhere in clutter_volume" against "as expected".
  double fuse(residual *rows, int count, double clutter_volume, bool usable, record_list records);
  double took(const fuse_result &done);

  sensor_errors remembered_errors_of(int sensor) const;

  // Relocalization (recovery.cpp).
  void buffer(const observation &seen) {
    if (params_.recover) observations_.add(seen);
  }
  void note(wm_time_ns t_ns, int key, double log_bayes, double angle_rad = NAN, double normalised = NAN);
  travelled_pose2 odometry() const { return {filter_.odom(), filter_.travelled_m(), filter_.turned_rad()}; }
  bool needs_search(wm_time_ns t_ns, bool by_bearing);
  void search_now(wm_time_ns t_ns);
  double found_sigma_m(wm_time_ns since_ns) const;
  void search(wm_time_ns since_ns, const observation *prior, int prior_count);
  void begin_life(bool pose_known);
  void start_again();
  // The filter's pose becomes that of the place `arm_m` in base_link, of which the next observation is.
  void go_to(const double arm_m[2]);
  void put_base(wm_estimate *out) const;
  void begin_at(const wm_pose2 &pose, double variance_m2);
  void begin_at(const localizer_aid::view &at);
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
    landmark_record *records;
    sighting_aid::arrays aid;
  };
  const wm_sighting_params &sightings() const { return *setup_->sightings; }
  static arrays place(memory_layout *layout, const wm_setup &setup);

  planar_filter filter_;
  sighting_aid aid_;
  relative_array<landmark_record> records_;
  const wm_setup *setup_;
  wm_landmark_ekf_params params_;
  position_aid positions_;
  localizer_aid localizer_;
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
  int32_t moved_id_;  // of the last one
  landmark_box box_;
  double misfit_;  // of the newest sighting, to the map
  // Without motion data, and by positions and ranges: places without a heading. The filter's pose is that of the place
  // seen last, at_m_ in base_link, so that one place alone never gives a heading, and several do by their differences.
  bool is_point_;
  double at_m_[2];
};

}  // namespace wm

#endif
