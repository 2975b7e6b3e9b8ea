// SPDX-License-Identifier: Apache-2.0
#include "filters/stereo_ekf/gravity.hpp"

#include "math/elementary.hpp"

namespace wm {
namespace {

// A window of 1 s: with a velocity of 0.03 m/s noise its change leaves 0.04 m/s2, or 0.25 degrees; a gyro's bias of
// 0.01 rad/s turns it by half of that. Not swept.
constexpr double kWindow_s = 1.0;
constexpr int kSamplesLeast = 20;
constexpr double kGap_s = 0.1;  // between two samples; beyond it the window begins anew
// Samples that vibration correlates: four count_ as one. Not swept.
constexpr double kCorrelated = 4.0;
// Acceleration of a vehicle whose velocity is not measured, m/s2: a car brakes with 3, a vehicle in water 0.3.
constexpr double kUnmeasured_mps2 = 1.0;

}  // namespace

void gravity_window::begin(wm_time_ns t_ns, const vec3 &force, const vec3 &v) {
  count_ = 1;
  begin_ns_ = last_ns_ = t_ns;
  v_begin_ = v;
  turn_ = kNoTurn;
  sum_ = force;
  for (int i = 0; i < 3; i++) squares_[i] = square(force[i]);
}

bool gravity_window::add(wm_time_ns t_ns, const vec3 &force, const vec3 &v, const vec3 &w, const vec3 *v_var,
                         double turn_rad2ps, vec3 *out, double variance[3]) {
  const double dt_s = count_ > 0 ? wm_seconds_between(last_ns_, t_ns) : 0.0;
  if (count_ == 0 || dt_s > kGap_s || !(dt_s > 0.0)) {
    begin(t_ns, force, v);
    return false;
  }
  turn_ = normalized(turn_ * turn_by(dt_s * w));
  const mat3 R = matrix_of(turn_);
  const vec3 here = R * force;
  sum_ = sum_ + here;
  for (int i = 0; i < 3; i++) squares_[i] += square(here[i]);
  count_++;
  last_ns_ = t_ns;
  const double whole_s = wm_seconds_between(begin_ns_, t_ns);
  if (whole_s < kWindow_s || count_ < kSamplesLeast) return false;
  const double n = (double)count_;
  const vec3 mean = (1.0 / n) * sum_;
  *out = transposed_times(R, mean - (1.0 / whole_s) * (R * v - v_begin_));
  for (int i = 0; i < 3; i++) {
    const double scatter = squares_[i] / n - square(mean[i]);
    const double moved = v_var ? 2.0 * (*v_var)[i] / square(whole_s) : square(kUnmeasured_mps2);
    // The mean of a random walk of the direction differs from its end by a third of the end's variance.
    const double turned = square(kGravity_mps2) * turn_rad2ps * whole_s / 3.0;
    variance[i] = square(sigma_mps2_) + (scatter > 0.0 ? kCorrelated * scatter / n : 0.0) + moved + turned;
  }
  count_ = 0;
  return true;
}

}  // namespace wm
