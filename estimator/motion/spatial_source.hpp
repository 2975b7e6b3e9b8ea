// SPDX-License-Identifier: Apache-2.0
// Which velocity and which rates hold: those of a twist, or the twist's velocity and the rates of an IMU with three
// axes, which are better and come more often. One rule for the filter in space and for the poses published between its
// estimates.
#ifndef WAYMARK_ESTIMATOR_MOTION_SPATIAL_SOURCE_HPP
#define WAYMARK_ESTIMATOR_MOTION_SPATIAL_SOURCE_HPP

#include "math/se3.hpp"
#include "motion/repeated_value.hpp"
#include "waymark/event.h"

namespace wm {

struct spatial_twist {
  vec3 v, w;  // m/s, rad/s, in body axes
};

// Turn rate of an axis that nothing measures, rad/s per sqrt(s): a vehicle on its way turns by 6 degrees in a second.
inline constexpr double kUnmeasured_radps = 0.1;

// Below both a body may stand: the mean twist, and the value of a gyro.
struct spatial_rest {
  double v_mps, w_radps;
};

class spatial_source {
 public:
  static constexpr uint32_t kAxes = 7;  // a bit each: x, y, z

  void init(double hold_max_s, const spatial_rest &rest);
  // By wheels or a vehicle's speed; a body whose twists come is judged by their mean.
  void note_standing(bool stands) { stands_ = stands; }
  // Takes a motion event, with the twist that it gives on its own (of quantities: by the front end; of a twist in space
  // it is not read). *now becomes the twist that holds from here on. False: the event changes none.
  bool take(const wm_event &event, spatial_twist *now);

  // The newest event had the rates of an IMU, or a specific force on three axes.
  bool rates_are_fresh() const { return (fresh_ & kFreshRates) != 0; }
  bool force_is_fresh() const { return (fresh_ & kFreshForce) != 0; }
  vec3 force_mps2() const { return {imu_[3], imu_[4], imu_[5]}; }
  // The rates are an IMU's.
  bool by_gyro() const { return by_gyro_ != 0; }
  // The velocity is a twist's, beside an IMU: it has a period of its own.
  bool is_held() const { return by_gyro_ && twist_ns_ != WM_TIME_NONE; }
  double twist_period_s() const { return twist_period_s_; }
  bool lacks_rates() const { return lacks_rates_ != 0; }  // the newest twist is a log's without rates
  // Sigma that the newest twist states of its velocity, and the larger one of the newest two: a twist holds until the
  // next one has come. 0: none.
  double v_sigma_mps() const { return v_sigma_mps_[0]; }
  double v_sigma_held_mps() const { return v_sigma_mps_[v_sigma_mps_[1] > v_sigma_mps_[0]]; }
  const vec3 &velocity_change() const { return velocity_change_; }  // between the last two twists
  const vec3 &rate_change() const { return rate_change_; }
  // Axes of the gyro, and of the accelerometer, that repeat one value and are not used.
  uint32_t stuck_rates() const { return stuck_ & kAxes; }
  uint32_t stuck_forces() const { return stuck_ >> 3; }
  // Axes of which the gyro's rates are missing, after they were there or beside a log that has none: stuck or silent.
  // The twist's are taken.
  uint32_t lost_rates() const { return had_gyro_ || lacks_rates_ ? (by_gyro_ ? stuck_rates() : kAxes) : 0u; }
  // Of these, the ones that no twist measures at a time.
  uint32_t unmeasured_rates(wm_time_ns t_ns) const {
    return twist_has_rates_ && velocity_is_known(t_ns) ? 0u : lost_rates();
  }
  // Turns that were not measured until their axis was found stuck: variances, and since when, s. Hands them out once.
  bool take_missed(double turn_rad2[3], double *since_s);
  // Twists come: the newest is not overdue.
  bool velocity_is_known(wm_time_ns t_ns) const;
  // Of a held velocity over the `dt_s` until `end_ns`: the integral over a velocity that walks since the next twist is
  // overdue, for a density of 1.
  double unmeasured_s3(double dt_s, wm_time_ns end_ns) const;

 private:
  static constexpr int kImu = 6;  // three rates, three specific forces
  enum : uint32_t { kFreshRates = 1, kFreshForce = 2 };
  struct axis_watch : repeated_value {
    int64_t samples, in_motion;  // of this value in a row; those while the body moves
    int64_t values, longest;     // different ones so far, and the most samples of one of them
  };
  void note_imu(const wm_event &event);
  spatial_twist twist_of(const wm_event &event) const;
  void note_twist(wm_time_ns t_ns, const spatial_twist &twist);
  void watch_axis(int axis, wm_time_ns t_ns, double value);
  bool may_stand(int axis, double value) const;
  bool is_stuck(int axis, wm_time_ns t_ns) const;
  void note_missed(int axis, wm_time_ns t_ns);
  bool are_alive(int first, wm_time_ns t_ns) const;  // three of imu_
  double overdue_s() const;

  double hold_max_s_;
  double imu_[kImu];
  wm_time_ns imu_ns_[kImu];
  axis_watch watch_[kImu];
  spatial_rest rest_;
  spatial_twist twist_, mean_;  // the newest, and a low-pass of them
  vec3 velocity_change_, rate_change_;
  double missed_rad2_[3], missed_since_s_;
  wm_time_ns twist_ns_;  // WM_TIME_NONE: none came
  double twist_period_s_, v_sigma_mps_[2];
  uint32_t fresh_, stuck_, by_gyro_, had_gyro_, twist_has_rates_, lacks_rates_;
  uint64_t stands_;  // of 64 bits: no padding, so that states compare by bytes
};

}  // namespace wm

#endif
