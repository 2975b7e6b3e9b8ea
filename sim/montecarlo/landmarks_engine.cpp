// SPDX-License-Identifier: Apache-2.0
// An estimator by known landmarks over many simulated drives, as they are and with what may befall them.
#include <map>

#include "montecarlo/engines.h"
#include "montecarlo/landmark_trials.h"
#include "montecarlo/reliability.h"

namespace wm::montecarlo {
namespace {

using Outcomes = std::vector<LandmarkOutcome>;

constexpr double kWrong_s = 0.55;  // confidently wrong for longer

double share_inside(const Outcomes &all) {
  double inside = 0, looks = 0;
  for (const LandmarkOutcome &o : all) {
    const auto n = static_cast<double>(o.outcome.samples.size());
    inside += n * o.outcome.nees_inside(), looks += n;
  }
  return looks > 0 ? inside / looks : 0;
}

void print_header() {
  std::printf(
      "             | position RMS of a drive, m | heading, deg | NEES   |                 |            | confidently\n"
      "             | median  90 %%   worst       | worst        | in 95 %% | lost at the end | false alarm | wrong "
      "for > 0.5 s\n"
      "-------------+----------------------------+--------------+--------+-----------------+-------------+------------"
      "\n");
}

void print_row(const std::string &name, const Outcomes &all) {
  std::vector<double> rms, heading;
  size_t lost = 0, alarms = 0, wrong = 0;
  double most = 0;
  for (const LandmarkOutcome &o : all) {
    rms.push_back(o.rms_m);
    heading.push_back(o.rms_deg);
    lost += o.outcome.samples.empty() || !o.outcome.samples.back().tracking || o.outcome.samples.back().error_m > 0.5;
    alarms += o.outcome.false_alarms() > 0;
    wrong += o.wrong_s > kWrong_s;
    most = std::max(most, o.wrong_s);
  }
  std::printf("%-12s | %s       | %7.3f      | %5.3f  | %6zu          | %6zu      | %zu of %zu, longest %.1f s\n",
              name.c_str(), spread(rms).c_str(), *std::max_element(heading.begin(), heading.end()), share_inside(all),
              lost, alarms, wrong, all.size(), most);
  std::fflush(stdout);
}

void print_found(const std::string &name, const Outcomes &all, bool kidnapped) {
  std::vector<double> detected, right;
  size_t detected5 = 0, right5 = 0;
  for (const LandmarkOutcome &o : all) {
    detected.push_back(o.detected_after_s.value_or(NAN));
    right.push_back(o.right_after_s.value_or(NAN));
    detected5 += detected.back() <= 5;
    right5 += right.back() <= 5;
  }
  std::printf("%s: right after %s s of driving (median, 90 %%, worst), within 5 s %zu of %zu", name.c_str(),
              spread(right).c_str(), right5, all.size());
  if (kidnapped)
    std::printf("; detected %s s after the first view, within 5 s %zu of %zu", spread(detected).c_str(), detected5,
                all.size());
  std::printf("\n");
}

void print_moved(const std::string &name, const Outcomes &all) {
  size_t seen = 0, reported = 0, named = 0;
  for (const LandmarkOutcome &o : all) {
    seen += o.moved_seen >= 20;
    reported += o.moved_seen >= 20 && o.reported_moved > 0;
    named += o.moved_seen >= 20 && o.reported_moved > 0 && o.rightly_named;
  }
  std::printf(
      "%s: a moved landmark was seen 20 times or more in %zu drives; reported in %zu, with its identity in %zu\n",
      name.c_str(), seen, reported, named);
}

void print_cost(const std::map<std::string, Outcomes> &all) {
  const auto plain = all.find("as-driven");
  if (plain == all.end()) return;
  const auto pooled = [](const Outcomes &o) {
    double sum = 0;
    for (const LandmarkOutcome &one : o) sum += one.rms_m * one.rms_m;
    return std::sqrt(sum / static_cast<double>(o.size()));
  };
  for (const char *name : {"false", "misread", "moved"})
    if (const auto at = all.find(name); at != all.end())
      std::printf("%s: RMS over all drives %.4f m, as driven %.4f m: %+.1f %%\n", name, pooled(at->second),
                  pooled(plain->second), 100 * (pooled(at->second) / pooled(plain->second) - 1));
  size_t reported = 0;
  for (const LandmarkOutcome &o : plain->second) reported += o.reported_moved > 0;
  std::printf("as-driven: a landmark was reported as moved in %zu of %zu\n", reported, plain->second.size());
}

}  // namespace

std::vector<std::string> landmark_trial_names() {
  std::vector<std::string> out;
  for (const LandmarkTrial &t : landmark_trials()) out.emplace_back(t.name);
  return out;
}

void run_landmarks(const Request &a, const sim::Scenario &scenario, const wm_config &config) {
  const uint64_t drives = a.drives.value_or(100);
  std::vector<LandmarkTrial> wanted;
  for (const LandmarkTrial &o : landmark_trials())
    if (a.wants(o.name)) wanted.push_back(o);
  std::map<std::string, Outcomes> all;
  Reliability reliability;
  for (uint64_t i = 0; i < drives; i++) {
    LandmarkWorld world(scenario, a.first_seed + i);
    for (const LandmarkTrial &o : wanted) {
      all[o.name].push_back(run_landmark_trial(world, config, o));
      const std::string name = o.name;
      if (name == "as-driven" || name == "kidnap" || name == "start") reliability.take(all[name].back().outcome);
    }
    show_progress("landmarks", i + 1, drives);
  }
  end_progress();
  std::printf("%s, %s of %s, %" PRIu64 " drives each\n\n", scenario.name.c_str(), config.estimator->name,
              a.config.c_str(), drives);
  print_header();
  for (const LandmarkTrial &o : wanted) print_row(o.name, all[o.name]);
  std::printf("\n");
  for (const LandmarkTrial &o : wanted) {
    if (o.start || o.kidnap) print_found(o.name, all[o.name], o.kidnap);
    if (o.moved > 0) print_moved(o.name, all[o.name]);
  }
  print_cost(all);
  reliability.print();
  Looks looks(a.csv);
  for (const auto &[name, outcomes] : all)
    for (const LandmarkOutcome &o : outcomes) looks.add(name, std::to_string(o.seed), o.outcome);
  if (!a.diagram.empty()) reliability.draw(a.diagram);
}

}  // namespace wm::montecarlo
