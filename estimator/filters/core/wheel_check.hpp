// SPDX-License-Identifier: Apache-2.0
// Wheels that do not turn as the robot moves: in a hole or at a wall they turn and it stands; pushed, it moves and they
// stand; lifted, it moves otherwise than they turn; or one of them spins. Each is an alternative to wheels that roll,
// with a rate at which it begins and a probability; while one is probable, the speed is that of an unknown motion.
//
// Against observations the alternative is a speed that is off by a constant on the robot's axes, with a normal prior.
// That error shifts the filter's mean; the shift is carried through prediction and updates for a block of states as the
// noise's derivatives are (noise_adaption.hpp), so that each innovation has an expectation under the alternative
// [Willsky1976]. The Bayes factor follows in closed form from sums over the last seconds. The innovations' scale is
// unknown, with a prior by the drive until now: a source that is worse than stated is no fault of the wheels.
// Against a gyro it is a turn that the wheels' difference has and the gyro has not.
#ifndef WAYMARK_ESTIMATOR_CORE_WHEEL_CHECK_HPP
#define WAYMARK_ESTIMATOR_CORE_WHEEL_CHECK_HPP

#include "filters/core/calibration_list.hpp"
#include "filters/core/evidence.hpp"
#include "filters/core/noise_adaption.hpp"
#include "waymark/motion.h"
#include "waymark/time.h"

namespace wm {

class wheel_check {
 public:
  void init();
  // Whether an alternative is more probable than wheels that roll.
  bool holds() const { return off_ || spins_; }
  uint32_t health() const { return off_ | (spins_ ? kSpins : 0u); }  // bits of WM_MOTION_HEALTH_*
  // For how long each alternative held in all, where it did.
  void list(calibration_list *out) const;

  // The robot moved for this time with this heading; by its wheels forwards at `wheel_mps`. `noise_m2`: variance on
  // each axis that it has because the alternative holds.
  void move(const sin_cos &heading, double dt_s, double wheel_mps, double noise_m2);
  // A time-correlated error of positions decays.
  void fade_correlated(double left);
  // An innovation and its gain, before the update.
  void update(const noise_adaption::row &r);
  // The rows of an observation, before they are gated; own: variance of the observation alone. The alternative begins
  // with this one: then the variance that it adds to the place on each axis, else 0.
  double weigh(const noise_adaption::row *rows, int count, wm_time_ns t_ns);
  // The wheels' difference and the gyro turned apart by so much in this time, with this variance by what wheels that
  // roll do. `spinning_rad`: sigma of the same where one spins.
  void weigh_turn(double apart_rad, double variance_rad2, double spinning_rad, double dt_s);
  // The pose has become another one: what the speed did to it no longer counts.
  void restart();

 private:
  static constexpr uint32_t kSpins = WM_MOTION_HEALTH_ONE_WHEEL_SPINS, kFirst = WM_MOTION_HEALTH_WHEELS_SPIN;
  static constexpr int kAlternatives = 4;  // bits from kFirst on
  static constexpr int kBlock = noise_adaption::kBlock, kAxes = 2;
  double decide(double nats);

  // Sums over the last seconds, of innovations in their sigmas: how many, their squares, their products with the
  // expectations by the speed's error, and those of these (xx, xy, yy).
  struct sums {
    double count, squares, products[kAxes], information[3];
    void fade(double left);
    void add(double weight, double z, const double shift[kAxes]);
    // Log Bayes factor of a speed that is off forwards, or on both axes; `scale2`: of the innovations until now.
    double nats(double scale2) const;
    double nats_at_most(double scale2) const;  // a bound of it, without logarithms
    double explained(double prior) const;      // of the squares, by a speed that is off on both axes
  };

  double by_[kAxes][kBlock];  // derivative of the mean by an error of the speed forwards, to the left
  double added_m2_;           // of the place's variance, on each axis: what it has because the alternative holds
  double wheel_mps_;          // of late
  double lasted_s_[kAlternatives];
  sums window_, late_;     // of some seconds, of the last one
  double raw_[kAxes];      // as the products of the last one, with innovations as large as they are
  double off_mps_[kAxes];  // by which the speed is off, if it is
  double scale2_;          // mean square of what no error of the speed explains of the innovations, at least 1
  double fitted_s_;        // for how long wheels that roll explained the observations, since the pose began
  double unsupported_s_, uncompared_s_;  // since the evidence was enough for it to begin; since the gyro was compared
  wm_time_ns weighed_ns_;
  evidence spin_;
  uint32_t off_;  // the bit of the alternative that holds against observations; 0: none
  uint32_t spins_;
};

}  // namespace wm

#endif
