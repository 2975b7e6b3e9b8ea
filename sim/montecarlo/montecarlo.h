// SPDX-License-Identifier: Apache-2.0
// Many simulated drives of one scenario through one estimator, in this process: are its errors as large as its
// covariance (consistency), and how near does it come to what is possible at all (efficiency)? docs/consistency.md.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "config/config.h"
#include "simulate/scenario.h"

namespace wm::montecarlo {

constexpr double kStep_s = 0.1;  // figures are taken this often

// In which a consistent mean of normalised errors squared lies, nearly always: [0.8, 1.25] for 200 drives and more,
// wider by the square root for fewer.
struct Band {
  double low, high;
};
Band band_of(uint64_t drives);
// Share of the steps whose mean is in the band; steps without one have NaN.
template <class Steps, class Mean>
double share_inside(const Steps &steps, Band band, Mean mean_of) {
  size_t inside = 0, all = 0;
  for (const auto &step : steps) {
    const double mean = mean_of(step);
    if (std::isnan(mean)) continue;
    all++;
    inside += mean >= band.low && mean <= band.high;
  }
  return all > 0 ? static_cast<double>(inside) / static_cast<double>(all) : 0;
}

// Means over the runs at one time of the drive.
struct Step {
  double t_s = 0;
  uint64_t runs = 0;
  double position_sq_m2 = 0, heading_sq_rad2 = 0;              // sums of squared errors
  double nees = 0;                                             // sum of 3-dof normalised errors squared
  double nis = 0;                                              // sum over fused updates since the step before
  uint64_t nis_dof = 0;                                        // their degrees of freedom
  double bound_position_sq_m2 = 0, bound_heading_sq_rad2 = 0;  // Cramér-Rao
};

// One drive: root mean squares of its errors over the steps, the largest, and the mean of its NEES, which is not
// divided.
struct Run {
  uint64_t seed = 0;
  double position_rms_m = 0, position_max_m = 0, rotation_rms_rad = 0;  // planar: of the heading
  double nees_mean = 0;
  double beyond_s = 0;  // longest time of tracking without a break beyond 5 sigma (NEES above kBeyond6), in six degrees
};

struct Statistics {
  size_t landmarks = 0;
  uint64_t runs = 0, lost = 0;  // lost: at the end off by more than 2 m or 15 degrees, or searching
  uint64_t fused = 0, rejected = 0, outliers = 0;
  std::vector<Step> steps;
  std::vector<Run> each;

  // Root mean squares over the runs, at the end and over the whole drive.
  double position_end_m() const, position_rms_m() const, heading_end_rad() const, heading_rms_rad() const;
  double bound_position_end_m() const, bound_position_rms_m() const, bound_heading_end_rad() const,
      bound_heading_rms_rad() const;
  // Root mean square of the position's error from `from_s` to `to_s` of the drive, and the bound there.
  double position_m(double from_s, double to_s) const, bound_position_m(double from_s, double to_s) const;
  // Share of the steps whose mean NEES (NIS) divided by its degrees of freedom lies in the band; steps without a fused
  // update don't count for NIS.
  double nees_inside(Band band) const, nis_inside(Band band) const;
  double nees_mean() const, nis_mean() const;  // over all, divided by the degrees of freedom
};

// Runs seeds first, first + 1, ... through the estimator of `config`, every datum in the order of its stamp.
// `progress` (may be empty) is called after each run. Errors are those of the scenario and of the estimator's init.
wm_status run(const sim::Scenario &scenario, const wm_config &config, size_t landmarks, uint64_t first_seed,
              uint64_t seeds, const std::function<void(uint64_t done)> &progress, Statistics &out, wm_error *err);

// The same in six degrees of freedom: errors against the truth at one time of the drive, summed over the runs.
struct Step6 {
  double t_s = 0;
  uint64_t runs = 0;  // with a pose by then
  double position_sq_m2 = 0, rotation_sq_rad2 = 0;
  double nees = 0;  // 6 degrees of freedom
  // Sums over the drives of which a bound was computed: of the position's and the rotation's variances.
  double bound_position_sq_m2 = 0, bound_rotation_sq_rad2 = 0;
  // The same by component: along, across and above the heading, m2; about the body's axes, rad2. Squares of the error,
  // variances by the estimator, variances by the bound.
  double error_sq[6] = {}, variance[6] = {}, bound[6] = {};
};

// Of six degrees of freedom, exceeded as seldom as 5 sigma of a normal distribution: 6e-7.
inline constexpr double kBeyond6 = 39.5;

struct Statistics6 {
  uint64_t runs = 0, fused = 0, rejected = 0, outliers = 0, bounds = 0;
  std::vector<Step6> steps;
  std::vector<Run> each;  // from `settled_s` to `until_s` of the options
  // Points found on the way, each as it was when it was last in the state; wrong: off by more than 0.1 m, or by more
  // than 4 sigma on the map's plane.
  uint64_t points = 0, wrong_points = 0;
  double point_error_sum_m = 0;
  double nees_mean() const;             // divided by its degrees of freedom
  double nees_inside(Band band) const;  // share of the steps
  // Root mean square over the drives and over the steps from `from_s` to `to_s`, divided by the bound; 0: no bound.
  double position_over_bound(double from_s, double to_s) const, rotation_over_bound(double from_s, double to_s) const;
};

struct Options6 {
  uint64_t first_seed = 1, seeds = 1;
  double settled_s = 2;                     // figures of a run count from here ...
  double until_s = 1e9;                     // ... to here
  double blind_from_s = 0, blind_to_s = 0;  // no picture shows anything meanwhile
  size_t points_per_picture = SIZE_MAX;     // the first ones that are in both pictures; others are left out
  uint64_t bounds = 0;                      // drives of which the bound is computed, the first ones
};

// As run(), for a scenario that swims.
wm_status run_six(const sim::Scenario &scenario, const wm_config &config, const Options6 &options,
                  const std::function<void(uint64_t done)> &progress, Statistics6 &out, wm_error *err);

}  // namespace wm::montecarlo
