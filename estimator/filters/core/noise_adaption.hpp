// SPDX-License-Identifier: Apache-2.0
// Factors on the variances of process and measurement noise, found from the innovations: recursive maximum a posteriori
// of their logarithms [Mehra1972] [Ljung1979]. The innovation's log likelihood has derivatives by its variance and by
// its mean. Both follow from the derivatives of the filter's covariance and mean by each log factor, which are carried
// for a part of the states (the pose, and a time-correlated error of positions); landmarks and calibration states are
// left out. The prior of a factor is log-normal; each log factor is a Gauss-Markov process about zero, so that without
// evidence the stated noise returns.
//
// A lasting error of positions shows in what innovations sum up to over seconds, not in a single one: of a receiver
// that smooths its positions each is small, and the sum is not. Right noise makes innovations white, and their sums as
// large as stated [Mehra1972].
#ifndef WAYMARK_ESTIMATOR_CORE_NOISE_ADAPTION_HPP
#define WAYMARK_ESTIMATOR_CORE_NOISE_ADAPTION_HPP

#include <cmath>

#include "filters/core/calibration_list.hpp"
#include "math/elementary.hpp"
#include "waymark/time.h"

namespace wm {

class noise_adaption {
 public:
  // Of the variances of way and turn, of white bearings, ranges and positions, and of positions' time-correlated error.
  enum factor { kWay, kTurn, kBearings, kRanges, kPlace, kLasting, kFactors, kNone = kFactors };
  static constexpr int kPose = 3, kBlock = 5;  // x, y, heading; a position's time-correlated error on each axis
  static constexpr int kSums = 2;              // of positions: x and y
  static constexpr double kMostFactor = 16.0;  // of a variance: sigmas stated four times too small

  // A row of an innovation. `by`: derivatives by the block's states. `gain`: their rows of the Kalman gain that the
  // update applies. `variance`: of the innovation; `own`: the share of it that `kind` scales. `number`: of the row in
  // its observation.
  struct row {
    double by[kBlock], gain[kBlock], innovation, variance, own;
    int kind, number;
  };
  // What an update's innovation is of, and the share of its variance that this kind scales. Nothing is learned from
  // another one.
  struct source {
    int kind = kNone;
    double own = 0.0;
  };

  // `log_sigma`: of the prior of a variance's log factor; 0: no adaption.
  void init(double log_sigma);
  bool is_on() const { return log_sigma_ > 0.0; }
  // The variance's factor; 1 without adaption.
  double scale(int k) const { return scale_[k]; }
  // Of the time-correlated error: a sigma that is stated too small is so of both, one too large of a receiver that
  // smooths is not. No more in all than one factor may be.
  double lasting_scale() const {
    const double both = scale_[kLasting] * (understates() ? scale_[kPlace] : 1.0);
    return both < kMostFactor ? both : kMostFactor;
  }
  // Of a measurement with this sigma.
  source source_of(int kind, double sigma) const { return {kind, square(sigma) * scale_[kind]}; }

  // The pose moved by (x_m, y_m), with the adapted noise along, across and of the turn.
  void move(double x_m, double y_m, double along_m2, double across_m2, double turn_rad2);
  // A position's time-correlated error is a state from now on, of this variance.
  void begin_correlated(double variance_m2);
  // Its step: times `left`, plus an adapted variance.
  void fade_correlated(double left, double added_m2);
  // The factors learn from a row of a known kind; then the derivatives follow its update.
  void update(const row &r);
  // The errors of places turned, by this sine and cosine, as the filter turns its covariance.
  void turn(double sine, double cosine);
  // Whether a new pose's heading is still too vague for positions to teach anything; then its derivatives begin anew.
  bool waits(double heading_variance, wm_time_ns t_ns);
  // Time passes: sums are learned from, and factors forgotten.
  void pass(wm_time_ns t_ns);
  // With an alarm for a factor at its limit, which is forgotten by 1 % in 4 s.
  void list(calibration_list *out) const;
  // The pose has become another one; `and_factors`: what was learned may be wrong, too.
  void restart(bool and_factors);

 private:
  // Of innovations in their sigmas: sums of them, of the derivatives of their variance's logarithm by the log factors,
  // and of those of their mean.
  struct evidence {
    double count, innovations, share[kFactors], by[kFactors];
    void add(const evidence &one);
  };

  void clear();
  bool is_used(int k) const { return (used_ & 1 << k) != 0; }
  double derivatives(const row &r, int k, double dh[kBlock], double *ds) const;
  void follow(const row &r, int k, const double dh[kBlock], double ds, double by);
  void learn(const evidence &of);
  void learn_variance(const double share[kFactors], double nis);
  void learn_mean(const double by[kFactors], double normalised);
  void correct(const double gain[kFactors], double step, double weight);
  void forget(double dt_s);
  double prior(int k) const;  // variance of a log factor
  // Log of the factor that is applied; how far the one that was found is beyond it.
  double applied(int k) const;
  double beyond(int k) const { return log_[k] - applied(k); }
  bool understates() const { return log_[kPlace] >= 0.0; }  // positions have a sigma larger than stated
  void add_lasting(int axis, double variance_m2);

  double log_sigma_;
  double log_[kFactors], scale_[kFactors], covariance_[kFactors][kFactors];
  double variance_by_[kFactors][kBlock][kBlock];  // derivative of the block's covariance by each log factor
  double mean_by_[kFactors][kBlock];              // of its mean
  evidence sums_[kSums];
  wm_time_ns forgotten_ns_, summed_ns_, began_ns_;
  int32_t block_, used_;  // a bit for each factor with a source; no padding: the same events must give the same bytes
};

}  // namespace wm

#endif
