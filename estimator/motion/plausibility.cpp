// SPDX-License-Identifier: Apache-2.0
#include "motion/plausibility.hpp"

#include <cmath>

#include "math/elementary.hpp"

namespace wm {
namespace {

// A level that stays elsewhere for so long is the sensor's new level (a wrong limit, a sensor that was replaced). A
// count that goes on from elsewhere began anew (a controller that restarted). Not swept.
constexpr double kLevelTakeover_s = 1.0;
constexpr double kPositionTakeover_s = 0.1;
constexpr uint32_t kTakeoverSamples = 3;

}  // namespace

template <class Follows, class Rate>
plausibility sample_check::take(wm_time_ns t_ns, double value, double takeover_s, Follows follows, Rate rate) {
  const auto extend = [&](run &r) {
    if (r.count == 0) r.since_ns = t_ns;
    r.rate = r.count == 0 ? 0.0 : rate(r);
    r.value = value;
    r.t_ns = t_ns;
    if (r.count < UINT32_MAX) r.count++;
  };
  if (trusted_.count == 0 || follows(trusted_)) {
    extend(trusted_);
    rival_.count = 0;
    return plausibility::plausible;
  }
  if (rival_.count > 0 && !follows(rival_)) rival_.count = 0;
  extend(rival_);
  const bool settled = rival_.count >= kTakeoverSamples && wm_seconds_between(rival_.since_ns, t_ns) >= takeover_s;
  if (!settled && rival_.count <= trusted_.count) return plausibility::refused;
  trusted_ = rival_;
  rival_.count = 0;
  return plausibility::new_run;
}

plausibility sample_check::check_level(wm_time_ns t_ns, double value, double step, double per_s) {
  return take(
      t_ns, value, kLevelTakeover_s,
      [&](const run &r) { return std::fabs(value - r.value) <= step + per_s * wm_seconds_between(r.t_ns, t_ns); },
      [](const run &) { return 0.0; });
}

plausibility sample_check::check_position(wm_time_ns t_ns, double position_m, double mps2, double period_s,
                                          double tick_m, double bound) {
  // Counts that come in a burst share the period before them: their own stamps give no speed.
  const auto seconds = [&](const run &r) {
    const double dt = wm_seconds_between(r.t_ns, t_ns);
    return dt < 0.5 * period_s ? period_s : dt;
  };
  return take(
      t_ns, position_m, kPositionTakeover_s,
      [&](const run &r) {
        const double s = seconds(r), moved_m = position_m - r.value;
        if (r.count < 2) return std::fabs(moved_m) <= kSpeedMost_mps * s;
        const double expected_m = r.rate * wm_seconds_between(r.t_ns, t_ns);
        const double bound_m = bound * (kSpeedStep_mps + mps2 * s) * s + period_s * std::fabs(r.rate) + 2.0 * tick_m;
        return std::fabs(moved_m - expected_m) <= bound_m;
      },
      [&](const run &r) {
        const double s = seconds(r);  // 0: the second count of the first stamp
        return s > 0.0 ? (position_m - r.value) / s : r.rate;
      });
}

}  // namespace wm
