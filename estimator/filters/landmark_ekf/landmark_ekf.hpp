// SPDX-License-Identifier: Apache-2.0
// The landmark filter of system 1 with self-calibration, lasting errors and recovery. docs/estimators.md has the model.
#ifndef WAYMARK_ESTIMATOR_LANDMARK_EKF_HPP
#define WAYMARK_ESTIMATOR_LANDMARK_EKF_HPP

#include <cmath>

#include "filters/core/landmark_evidence.hpp"
#include "filters/core/record_list.hpp"
#include "filters/core/state_pool.hpp"
#include "filters/landmark_ekf/params.h"
#include "filters/landmark_ekf/start_trial.hpp"
#include "filters/planar/planar_filter.hpp"
#include "filters/relocalize/pose_search.hpp"
#include "sensors/sensor_model.hpp"

namespace wm {

class landmark_ekf {
 public:
  static size_t bytes(const wm_landmark_ekf_params &params, const wm_setup &setup, const char **why);
  void init(const wm_landmark_ekf_params &params, const wm_setup &setup);

  wm_status predict(const wm_event &motion);
  wm_status correct(const wm_event &event, record_list records);
  void estimate(wm_estimate *out) const;
  size_t list_calibration(wm_calibration_value *out, size_t capacity) const;
  size_t list_counters(wm_counter *out, size_t capacity) const;
  const wm_motion_calibration &motion_calibration() const { return filter_.calibration(); }
  uint32_t motion_health() const { return filter_.motion_health(); }

 private:
  // What was known of the sensors while the observations still fitted: two generations, of which the older one is safe,
  // and the start's.
  struct calibration_memory {
    double value[kMaxStates], variance[kMaxStates];
  };

  enum sensor_state {
    kYaw,
    kMountX,
    kMountY,
    kRoll,
    kPitch,
    kAngleScale,
    kTimeOffset,
    kRangeBias,
    kRangeScale,
    kSensorStates
  };

  // The pose when an observation was true, `age` before its stamp, and what moves it.
  struct past_pose {
    wm_pose2 pose;            // base_link in map
    wm_pose2 odom;            // the same in the odometry's frame
    double lever_x, lever_y;  // from now's position to it: what a heading error now makes of it
    double age_by[3];         // of x, y, heading by the time offset
  };
  past_pose look_back(double age_s) const;
  static void add_pose(sparse_row &row, const double by[3], const past_pose &past, int time_state);

  wm_status fuse_sighting(const wm_event &event, record_list records);
  wm_status fuse_position(const wm_event &event, record_list records);
  wm_status fuse_heading(const wm_event &event, record_list records);
  wm_status take_pose(const wm_event &event);

  // Gates one or two numbers jointly, weakens or rejects, updates, writes the records. Returns how much it speaks
  // against the pose (landmark_evidence::log_bayes_factor), `room` being where the numbers could lie.
  struct residual {
    sparse_row row;
    double innovation, noise;
    wm_innovation record;
  };
  // `believed`: false refuses it whatever it says.
  double fuse(residual *residuals, int count, double room, bool believed, record_list records);

  void fuse_elevation(residual bearing_then_own[2], const double *before, record_list records);

  double map_sigma(int landmark) const;
  int find_landmark(int32_t id) const;
  struct sighting_sigmas {
    double bearing_rad, range_m;
  };
  int associate(const wm_event &event, const sighting_sigmas &sigmas, const past_pose &past);
  void lend_states(int sensor, int landmark, wm_time_ns t_ns, int *lasting, int *map);
  double sensor_value(int sensor, int which, double neutral) const;
  sensor_errors errors_of(int sensor) const;
  void sway(wm_time_ns t_ns);
  sensor_errors remembered_errors_of(int sensor) const;
  const calibration_memory &memory_to_trust() const;
  void add_mounting(sparse_row &row, int sensor, const double by[kCauses]) const;

  // Recovery.
  void note(wm_time_ns t_ns, int witness, double against, double angle_rad = NAN, double normalised = NAN);
  void buffer_observation(const observation &seen);
  bool is_sought(wm_time_ns t_ns, bool by_bearing);
  void seek(wm_time_ns t_ns);
  void search(wm_time_ns since_ns, const observation *prior, int prior_count);
  void try_start();
  void weigh_start(wm_time_ns t_ns);
  double lost_probability() const;
  void remember_calibration(wm_time_ns t_ns);
  void restore_calibration();
  void start_again();

  wm_time_ns elsewhere_since(wm_time_ns t_ns);
  bool is_elsewhere(wm_time_ns since_ns, wm_time_ns t_ns);
  void tell_moved(int landmark);
  void widen(wm_estimate *out) const;
  void mix_start(wm_estimate *out) const;

  // Behind the object: landmarks by rising id, and what each proved to be.
  int *landmark_order() { return reinterpret_cast<int *>(this + 1); }
  const int *landmark_order() const { return reinterpret_cast<const int *>(this + 1); }
  landmark_record *landmark_records() {
    return reinterpret_cast<landmark_record *>(landmark_order() + setup_->landmark_count);
  }

  planar_filter filter_;
  const wm_setup *setup_;
  wm_landmark_ekf_params params_;
  mounted_sensor sensor_[kMaxSensors];
  int sensor_state_[kMaxSensors][kSensorStates];
  int gnss_time_state_, gnss_lasting_state_;
  wm_time_ns gnss_lasting_ns_;
  state_pool<24> lasting_;
  int lasting_bearing_offset_, lasting_range_offset_;  // within a slot; -1: not carried
  state_pool<16> map_;
  int tilt_state_;  // lean, nod; -1: not carried
  wm_time_ns tilt_ns_;
  calibration_memory memory_[3];
  wm_time_ns remembered_ns_;
  int calibration_states_;  // pose and calibration; the lent states come behind
  landmark_evidence evidence_;
  pose_search observations_;
  start_trial start_trial_;
  observation prior_[2];
  int prior_count_;
  observation vague_[2];  // the pose when it had become too vague to be corrected
  wm_time_ns fused_ns_, lost_ns_, searched_ns_, weighed_ns_, inflated_ns_, loosened_ns_, found_ns_, vague_ns_;
  uint32_t resets_, moved_;
  int32_t moved_id_;        // of the last one
  double map_variance_m2_;  // of a place anywhere among the landmarks, each axis
  uint8_t state_;           // wm_state, without dead reckoning
};

}  // namespace wm

#endif
