// SPDX-License-Identifier: Apache-2.0
// One observation's information on the state, before it is decided whether it is fused: the innovation of its rows,
// their covariance and how well they fit.
#ifndef WAYMARK_ESTIMATOR_STATE_INNOVATION_HPP
#define WAYMARK_ESTIMATOR_STATE_INNOVATION_HPP

#include <cstdint>

#include "math/half_covariance.hpp"

namespace wm {

// Made by error_state::prepare(), used up by one update. The gains P H' lie in scratch memory of the state, and belong
// to the newest innovation. One whose state has changed since, or that has been used, is stale: an update refuses it.
class innovation {
 public:
  static constexpr int kRows = half_update::kRows;

  innovation() = default;
  innovation(innovation &&) = default;
  innovation &operator=(innovation &&) = default;
  innovation(const innovation &) = delete;
  innovation &operator=(const innovation &) = delete;

  int rows = 0;
  double value[kRows];     // observed - expected
  double s[kRows][kRows];  // covariance of the innovation, lower triangle: H P H' + diag(noise)
  double nis = 1e300;      // 1e300 where the covariance is not positive definite, or a row lacks entries
  double determinant = 0;  // of it; 0 there
  int delay = -1;          // the state of the observation's delay; -1: none
  double density() const;  // of the innovation, normal with this covariance
  // Behind error_state::solve(): what the rows before it leave of a row's innovation, and that one's variance.
  double left[kRows], left_variance[kRows];

 private:
  friend class error_state;
  uint64_t generation_ = 0;  // of the state; 0: of none
  filled_states of_;         // the gains of all other states are 0
};

}  // namespace wm

#endif
