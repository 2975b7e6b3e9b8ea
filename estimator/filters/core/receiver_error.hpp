// SPDX-License-Identifier: Apache-2.0
// The time-correlated error of a receiver's positions: a Gauss-Markov process on each axis, whose sigma follows the
// stated one. A filter has the process as states; this has its sigma, and what a position does to it.
#ifndef WAYMARK_ESTIMATOR_CORE_RECEIVER_ERROR_HPP
#define WAYMARK_ESTIMATOR_CORE_RECEIVER_ERROR_HPP

#include "filters/core/state_pool.hpp"
#include "math/elementary.hpp"
#include "sensors/shared_params.hpp"
#include "waymark/estimator.h"
#include "waymark/time.h"

namespace wm {

// Beyond this ratio of the sigmas of two positions the second is of another solution: RTK fixed states 0.02 m, RTK
// float 0.3 m, code 3 m. One solution's sigmas differ by two from epoch to epoch, and converge over many.
inline constexpr double kOtherSolution = 4.0;

inline double correlated_sigma_m(double stated_m, const wm_position_params &params) {
  return params.correlated_m < 0.0 ? -params.correlated_m * stated_m : params.correlated_m;
}
// Of what is new in each position.
inline double white_sigma_m(double stated_m, const wm_position_params &params) {
  const double sigma_m = params.sigma_factor * stated_m;
  return sigma_m < params.sigma_min_m ? params.sigma_min_m : sigma_m;
}

// The antenna's place in base_link, and its sigma on each axis; 0: exact.
struct antenna {
  double place_m[3], sigma_m;
};
inline constexpr double kTape_m = 0.02;
inline antenna antenna_of(const wm_setup &setup, const wm_position_params &params) {
  antenna out = {{0, 0, 0}, params.antenna_sigma_m < 0.0 ? -params.antenna_sigma_m : params.antenna_sigma_m};
  if (setup.rig == nullptr || !finite(setup.rig->antenna_m[0])) return out;
  for (int i = 0; i < 3; i++) out.place_m[i] = setup.rig->antenna_m[i];
  if (params.antenna_sigma_m < 0.0) out.sigma_m = kTape_m;
  return out;
}

class receiver_error {
 public:
  struct step {
    bool is_first;    // the process begins
    double left;      // share of the process that is left: none of another solution's, which has an error of its own
    double before_m;  // sigma before; behind the step sigma_m() holds
  };

  void begin() { newest_ns_ = WM_TIME_NONE; }
  bool is_used() const { return newest_ns_ != WM_TIME_NONE; }
  double sigma_m() const { return sigma_m_; }

  // To a position with this stated sigma of a horizontal axis. A receiver's sigma falls from tens of metres to one
  // after its start, and the error with it. It follows the stated one with the process's own time constant, since
  // receivers state sigmas that differ by a factor of two from epoch to epoch. With half of that time constant
  // smartloc has 10.1 m instead of 9.6 m, with one and a half 9.5 m.
  step move_to(wm_time_ns t_ns, double position_sigma_m, const wm_position_params &params) {
    const double now_m = correlated_sigma_m(position_sigma_m, params);
    const bool is_first = !is_used();
    const double before_m = is_first ? now_m : sigma_m_, leap = is_first ? 1.0 : now_m / stated_m_;
    const bool is_other = leap > kOtherSolution || leap < 1.0 / kOtherSolution;
    const double left = is_first ? 1.0 : is_other ? 0.0 : decay_over(newest_ns_, t_ns, params.correlated_tau_s);
    sigma_m_ = now_m + left * (before_m - now_m);
    stated_m_ = now_m;
    newest_ns_ = t_ns;
    return {is_first, left, before_m};
  }

 private:
  wm_time_ns newest_ns_;
  double sigma_m_, stated_m_;  // of the process, and by the newest position
};

}  // namespace wm

#endif
