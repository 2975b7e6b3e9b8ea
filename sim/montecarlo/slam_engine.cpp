// SPDX-License-Identifier: Apache-2.0
// SLAM over many simulated drives, undisturbed, kidnapped, pushed, and started without a pose on a finished map.
#include "montecarlo/slam_trials.h"

#include <cstring>

#include "common/failure.h"
#include "common/statistics.h"
#include "montecarlo/engines.h"

namespace wm::montecarlo {
namespace {

double percentile_of(const std::vector<SlamOutcome> &all, double percent, double (*value)(const SlamOutcome &)) {
  std::vector<double> v;
  for (const SlamOutcome &o : all)
    if (std::isfinite(value(o))) v.push_back(value(o));
  return v.empty() ? tools::kNan : tools::percentile(v, percent);
}

void print_each(const char *name, const SlamOutcome &o) {
  std::printf("%-12s %3" PRIu64
              ": cut %5.1f s by %4.1f m %4.0f deg, detected %5.1f, right %5.1f, alarms %d, wrong %4.1f s, end %6.3f m, "
              "map %.3f -> %.3f m\n",
              name, o.seed, o.cut_s, o.moved_m, o.turned_rad * 57.3, o.detected_after_s.value_or(NAN),
              o.right_after_s.value_or(NAN), o.alarms, o.wrong_s, o.end_m, o.map_before_m, o.map_after_m);
}

void print_row(const char *name, const std::vector<SlamOutcome> &all) {
  size_t detected = 0, right = 0, alarms = 0, wrong = 0, looks = 0, inside = 0;
  double longest = 0;
  for (const SlamOutcome &o : all) {
    detected += o.detected_after_s.value_or(1e9) <= 5;
    right += o.right_after_s.value_or(1e9) <= 20;
    alarms += o.alarms > 0;
    wrong += o.wrong_s > 10;
    longest = std::max(longest, o.wrong_s);
    looks += o.looks;
    inside += o.inside;
  }
  const auto end_m = [](const SlamOutcome &o) { return o.end_m; };
  const auto before_m = [](const SlamOutcome &o) { return o.map_before_m; };
  const auto after_m = [](const SlamOutcome &o) { return o.map_after_m; };
  const bool undisturbed = std::strcmp(name, "as-driven") == 0;
  char found[60] = "   -      -   ";
  if (!undisturbed) std::snprintf(found, sizeof found, "%3zu    %3zu  ", detected, right);
  std::printf("%-12s | %3zu    | %s| %s | %3zu (%5.1f s)  | %.3f  %.3f  | %.3f -> %.3f  %.3f | %.3f\n", name,
              all.size(), found, undisturbed ? std::to_string(alarms).c_str() : "-", wrong, longest,
              percentile_of(all, 50, end_m), percentile_of(all, 100, end_m), percentile_of(all, 50, before_m),
              percentile_of(all, 50, after_m), percentile_of(all, 100, after_m),
              looks > 0 ? static_cast<double>(inside) / static_cast<double>(looks) : 0);
  std::fflush(stdout);
}

}  // namespace

std::vector<std::string> slam_trial_names() {
  std::vector<std::string> out;
  for (const SlamTrial &t : slam_trials()) out.emplace_back(t.name);
  return out;
}

void run_slam(const Request &a, const sim::Scenario &scenario, const wm_config &config) {
  const uint64_t drives = a.drives.value_or(30);
  std::printf(
      "%s, %s, seeds %" PRIu64 " to %" PRIu64
      "\n\n"
      "             |        | lost   right | with   | wrong for     | error at the  | map error, median, m  | NEES\n"
      "             | drives | in 5 s in 20 | alarms | > 10 s (most) | end, m (most) | before -> after, most | in 95 "
      "%%\n",
      scenario.name.c_str(), a.config.c_str(), a.first_seed, a.first_seed + drives - 1);
  for (const SlamTrial &trial : slam_trials()) {
    if (!a.wants(trial.name)) continue;
    std::vector<SlamOutcome> all;
    for (uint64_t i = 0; i < drives; i++) {
      all.push_back(run_slam_trial(scenario, config, trial, {a.renumber}, a.first_seed + i));
      if (a.each) print_each(trial.name, all.back());
      show_progress(trial.name, i + 1, drives);
    }
    end_progress();
    print_row(trial.name, all);
  }
}

}  // namespace wm::montecarlo
