// SPDX-License-Identifier: Apache-2.0
// waymark-montecarlo-slam SCENARIO --config F: SLAM over many simulated drives, undisturbed, kidnapped, pushed, and
// started without a pose on a finished map.
#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "common/failure.h"
#include "common/program.h"
#include "common/statistics.h"
#include "montecarlo/slam_trials.h"

namespace {

using namespace wm::montecarlo;
using wm::tools::Failure;

struct Arguments {
  std::string scenario, config;
  std::vector<std::string> kinds;
  uint64_t first = 1, drives = 30;
  bool renumber = false, each = false;
};

double percentile_of(const std::vector<SlamOutcome> &all, double percent, double (*value)(const SlamOutcome &)) {
  std::vector<double> v;
  for (const SlamOutcome &o : all)
    if (std::isfinite(value(o))) v.push_back(value(o));
  return v.empty() ? wm::tools::kNan : wm::tools::percentile(v, percent);
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

int run(const Arguments &a) {
  wm::sim::Scenario scenario;
  wm_config config{};
  wm_error error{};
  if (wm::sim::load_scenario(a.scenario, scenario, &error) != WM_OK) throw Failure(error.text, wm::tools::kUsage);
  if (wm_config_load(a.config.c_str(), &config, &error) != WM_OK) throw Failure(error.text, wm::tools::kUsage);
  std::fputs(config.warnings, stderr);
  if (std::strcmp(config.estimator->name, "slam") != 0)
    throw Failure(a.config + ": estimator: is not slam", wm::tools::kUsage);
  std::printf(
      "%s, %s, seeds %" PRIu64 " to %" PRIu64
      "\n\n"
      "             |        | lost   right | with   | wrong for     | error at the  | map error, median, m  | NEES\n"
      "             | drives | in 5 s in 20 | alarms | > 10 s (most) | end, m (most) | before -> after, most | in 95 "
      "%%\n",
      scenario.name.c_str(), a.config.c_str(), a.first, a.first + a.drives - 1);
  for (const SlamTrial &trial : slam_trials()) {
    if (!a.kinds.empty() && std::find(a.kinds.begin(), a.kinds.end(), trial.name) == a.kinds.end()) continue;
    std::vector<SlamOutcome> all;
    for (uint64_t i = 0; i < a.drives; i++) {
      all.push_back(run_slam_trial(scenario, config, trial, {a.renumber}, a.first + i));
      if (a.each) print_each(trial.name, all.back());
    }
    print_row(trial.name, all);
  }
  wm_config_free(&config);
  return wm::tools::kDone;
}

}  // namespace

int main(int argc, char **argv) {
  Arguments a;
  wm::cli::App app(
      "SLAM over many simulated drives, features only: undisturbed, kidnapped, pushed, started without a pose.",
      "waymark-montecarlo-slam");
  std::vector<std::string> names;
  for (const SlamTrial &t : slam_trials()) names.emplace_back(t.name);
  app.add_option("SCENARIO", a.scenario, "scenario file (YAML)")->required();
  app.add_option("--config", a.config, "configuration of the estimator")->required();
  app.add_option("--trials", a.kinds, "which; all if not given")->delimiter(',')->check(wm::cli::one_of(names));
  app.add_option("--drives", a.drives, "number of seeds")->check(wm::cli::range(1, 100000))->capture_default_str();
  app.add_option("--first-seed", a.first, "the first one's seed")->capture_default_str();
  app.add_flag("--renumber", a.renumber, "identities are a tracker's numbers: new after 1 s out of sight");
  app.add_flag("--each", a.each, "prints each drive");
  app.footer(
      "example: waymark-montecarlo-slam config/worlds/loops-markers.yaml --config config/datasets/loops-markers.yaml\n"
      "docs/consistency.md defines each figure. Exit code: 0 done, 1 failed, 2 usage or configuration.");
  return wm::tools::run_program(app, argc, argv, [&] { return run(a); });
}
