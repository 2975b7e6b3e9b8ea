// SPDX-License-Identifier: Apache-2.0
// Where a map of the robot's own lies in the frame of positions: the turn and the shift that take places of the path to
// the positions measured there, by least squares [Horn1987] over running sums.
#ifndef WAYMARK_ESTIMATOR_AID_FRAME_FIT_HPP
#define WAYMARK_ESTIMATOR_AID_FRAME_FIT_HPP

#include "math/arc.hpp"
#include "math/elementary.hpp"
#include "waymark/frames.h"

namespace wm {

class frame_fit {
 public:
  // Largest sigma of the turn with which it counts: the sine of an error differs from it by 0.2 %.
  static constexpr double kTurnMost_rad = 0.1;
  // The path and the positions must have the same size but for this: a wheel's radius is not wrong by more.
  static constexpr double kScaleMost = 0.2;

  void clear() { *this = {}; }
  int count() const { return static_cast<int>(n_); }

  // A place on the map of the robot's own, and what was measured there.
  void add(const double own_m[2], const double measured_m[2]) {
    if (n_ == 0.0)
      for (int i = 0; i < 2; i++) origin_[0][i] = own_m[i], origin_[1][i] = measured_m[i];
    n_ += 1.0;
    double a[2], b[2], da[2], db[2];
    for (int i = 0; i < 2; i++) {
      a[i] = own_m[i] - origin_[0][i], b[i] = measured_m[i] - origin_[1][i];
      da[i] = a[i] - mean_[0][i], db[i] = b[i] - mean_[1][i];
    }
    const double share = (n_ - 1.0) / n_;
    own2_ += share * (da[0] * da[0] + da[1] * da[1]);
    measured2_ += share * (db[0] * db[0] + db[1] * db[1]);
    along_ += share * (da[0] * db[0] + da[1] * db[1]);
    across_ += share * (da[0] * db[1] - da[1] * db[0]);
    for (int i = 0; i < 2; i++) mean_[0][i] += da[i] / n_, mean_[1][i] += db[i] / n_;
  }

  // `sigma_m`: of a position on each axis. Errors of a receiver last, so that many positions are no better than one.
  double turn_sigma_rad(double sigma_m) const {
    if (n_ < 3.0 || !(own2_ > 0.0)) return kPi;
    const double left = own2_ + measured2_ - 2.0 * std::sqrt(square(along_) + square(across_));
    return std::sqrt((square(sigma_m) + left / n_) * n_ / own2_);
  }
  bool is_sure(double sigma_m) const {
    return turn_sigma_rad(sigma_m) < kTurnMost_rad && std::fabs(std::sqrt(measured2_ / own2_) - 1.0) < kScaleMost;
  }
  // What takes the own map to the positions' frame.
  wm_pose2 motion() const {
    const double turn_rad = atan2(across_, along_);
    const sin_cos h = sincos(turn_rad);
    const double own[2] = {origin_[0][0] + mean_[0][0], origin_[0][1] + mean_[0][1]};
    return {origin_[1][0] + mean_[1][0] - (h.cos * own[0] - h.sin * own[1]),
            origin_[1][1] + mean_[1][1] - (h.sin * own[0] + h.cos * own[1]), turn_rad};
  }
  // The middle of the positions, about which the turn and the shift are independent.
  void middle(double out_m[2]) const {
    for (int i = 0; i < 2; i++) out_m[i] = origin_[1][i] + mean_[1][i];
  }

 private:
  double n_ = 0.0;
  double origin_[2][2] = {}, mean_[2][2] = {};  // of the own places and of the positions, relative to the first ones
  double own2_ = 0.0, measured2_ = 0.0, along_ = 0.0, across_ = 0.0;  // sums about the means
};

}  // namespace wm

#endif
