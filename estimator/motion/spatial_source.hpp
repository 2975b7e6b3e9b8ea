// SPDX-License-Identifier: Apache-2.0
// Which velocity and which rates hold: those of a twist, or the twist's velocity and the rates of an IMU with three
// axes, which are better and come more often. One rule for the filter in space and for the poses published between its
// estimates.
#ifndef WAYMARK_ESTIMATOR_MOTION_SPATIAL_SOURCE_HPP
#define WAYMARK_ESTIMATOR_MOTION_SPATIAL_SOURCE_HPP

#include "math/se3.hpp"
#include "waymark/event.h"

namespace wm {

struct spatial_twist {
  vec3 v, w;  // m/s, rad/s, in body axes
};

class spatial_source {
 public:
  void init(double hold_max_s);
  // Takes a motion event, with the twist that it gives on its own (of quantities: by the front end). *now becomes the
  // twist that holds from here on. False: the event changes none.
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
  const vec3 &velocity_change() const { return velocity_change_; }  // between the last two twists
  // An axis of the gyro repeats one value; `without`: and no twist has its rate.
  bool is_stuck() const { return stuck_ != 0; }
  bool is_unmeasured(int axis) const { return (stuck_ & (1u << axis)) && !twist_has_rates_; }
  // Twists come: the newest is not overdue.
  bool velocity_is_known(wm_time_ns t_ns) const;
  // Of a held velocity over the `dt_s` until `end_ns`: the integral over a velocity that walks since the next twist is
  // overdue, for a density of 1.
  double unmeasured_s3(double dt_s, wm_time_ns end_ns) const;

 private:
  static constexpr int kImu = 6;  // three rates, three specific forces
  enum : uint32_t { kFreshRates = 1, kFreshForce = 2 };
  // While an axis has the same bits.
  struct axis_watch {
    wm_time_ns since_ns, until_ns;
    double apart_rad;  // the turn by the twist's rate less the gyro's
  };
  void note_imu(const wm_event &event);
  void note_twist(wm_time_ns t_ns, const spatial_twist &twist);
  void watch_axis(int axis, wm_time_ns t_ns, double rate_radps);
  bool are_alive(int first, wm_time_ns t_ns) const;  // three of imu_
  double overdue_s() const;

  double hold_max_s_;
  double imu_[kImu];
  wm_time_ns imu_ns_[kImu];
  axis_watch watch_[3];
  spatial_twist twist_;
  vec3 velocity_change_;
  wm_time_ns twist_ns_;  // WM_TIME_NONE: none came
  double twist_period_s_;
  uint32_t fresh_, stuck_, by_gyro_, twist_has_rates_;
};

}  // namespace wm

#endif
