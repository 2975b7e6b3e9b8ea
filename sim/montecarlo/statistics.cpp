// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "montecarlo/montecarlo.h"

namespace wm::montecarlo {
namespace {

double mean_root(double sum, uint64_t count) { return count ? std::sqrt(sum / static_cast<double>(count)) : 0; }

// Root mean square of a field over the runs and the steps from `from_s` to `to_s`.
double over(const std::vector<Step> &steps, double Step::*field, double from_s = 0, double to_s = INFINITY) {
  double sum = 0;
  uint64_t runs = 0;
  for (const Step &s : steps)
    if (s.t_s >= from_s && s.t_s <= to_s) sum += s.*field, runs += s.runs;
  return mean_root(sum, runs);
}

double at_end(const std::vector<Step> &steps, double Step::*field) {
  return steps.empty() ? 0 : mean_root(steps.back().*field, steps.back().runs);
}

}  // namespace

Band band_of(uint64_t drives) {
  const double wider = drives == 0 ? 1 : std::fmax(1, std::sqrt(200 / static_cast<double>(drives)));
  return {1 - 0.2 * wider, 1 + 0.25 * wider};
}

double Statistics::position_end_m() const { return at_end(steps, &Step::position_sq_m2); }
double Statistics::position_rms_m() const { return over(steps, &Step::position_sq_m2); }
double Statistics::heading_end_rad() const { return at_end(steps, &Step::heading_sq_rad2); }
double Statistics::heading_rms_rad() const { return over(steps, &Step::heading_sq_rad2); }
double Statistics::bound_position_end_m() const { return at_end(steps, &Step::bound_position_sq_m2); }
double Statistics::bound_position_rms_m() const { return over(steps, &Step::bound_position_sq_m2); }
double Statistics::bound_heading_end_rad() const { return at_end(steps, &Step::bound_heading_sq_rad2); }
double Statistics::bound_heading_rms_rad() const { return over(steps, &Step::bound_heading_sq_rad2); }
double Statistics::position_m(double from_s, double to_s) const {
  return over(steps, &Step::position_sq_m2, from_s, to_s);
}
double Statistics::bound_position_m(double from_s, double to_s) const {
  return over(steps, &Step::bound_position_sq_m2, from_s, to_s);
}

double Statistics::nees_inside(Band band) const {
  return share_inside(steps, band, [](const Step &s) { return s.nees / (3 * static_cast<double>(s.runs)); });
}

double Statistics::nis_inside(Band band) const {
  return share_inside(steps, band, [](const Step &s) { return s.nis / static_cast<double>(s.nis_dof); });
}

double Statistics::nees_mean() const {
  double sum = 0, dof = 0;
  for (const Step &s : steps) sum += s.nees, dof += 3 * static_cast<double>(s.runs);
  return dof > 0 ? sum / dof : 0;
}

double Statistics::nis_mean() const {
  double sum = 0, dof = 0;
  for (const Step &s : steps) sum += s.nis, dof += static_cast<double>(s.nis_dof);
  return dof > 0 ? sum / dof : 0;
}

}  // namespace wm::montecarlo
