// SPDX-License-Identifier: Apache-2.0
// The direction of gravity in body axes by an accelerometer: the mean specific force of a second, less the acceleration
// by the change of a measured velocity.
#ifndef WAYMARK_ESTIMATOR_GRAVITY_HPP
#define WAYMARK_ESTIMATOR_GRAVITY_HPP

#include "waymark/internal/math/rotation.hpp"
#include "waymark/time.h"

namespace wm {

inline constexpr double kGravity_mps2 = 9.80665;

class gravity_window {
 public:
  void init(double sigma_mps2) {
    sigma_mps2_ = sigma_mps2;
    count_ = 0;
  }

  // Takes one sample, with the velocity and the rates that hold until it (m/s, rad/s, body axes). `v_var`: variances
  // of the velocity; nullptr: it is not measured. `turn_rad2ps`: density of turns that the rates do not have. True once
  // a second: *out is g towards the zenith, in body axes at `t_ns`, and `variance` those of its axes.
  bool add(wm_time_ns t_ns, const vec3 &force, const vec3 &v, const vec3 &w, const vec3 *v_var, double turn_rad2ps,
           vec3 *out, double variance[3]);
  // Drops the open window: rates before and after are of different sensors.
  void restart() { count_ = 0; }

 private:
  void begin(wm_time_ns t_ns, const vec3 &force, const vec3 &v);

  double sigma_mps2_;
  int64_t count_;  // 0: no window is open
  wm_time_ns begin_ns_, last_ns_;
  // In axes of the body at the window's beginning.
  vec3 sum_, squares_, v_begin_;
  quat turn_;
};

}  // namespace wm

#endif
