// SPDX-License-Identifier: Apache-2.0
// waymark-montecarlo-landmarks SCENARIO --config F: an estimator by known landmarks over many simulated drives, as they
// are and with what may befall them.
#include <unistd.h>

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>

#include "common/failure.h"
#include "common/program.h"
#include "common/statistics.h"
#include "montecarlo/landmark_trials.h"
#include "montecarlo/reliability.h"

namespace {

using namespace wm::montecarlo;
using wm::tools::Failure;

struct Arguments {
  std::string scenario, config, csv, diagram;
  std::vector<std::string> kinds;
  uint64_t first = 1, drives = 100;
};

using Outcomes = std::vector<LandmarkOutcome>;

constexpr double kWrong_s = 0.55;  // confidently wrong for longer

std::string spread(std::vector<double> v) {
  std::erase_if(v, [](double x) { return !std::isfinite(x); });
  if (v.empty()) return "    -      -      -";
  char text[80];
  std::snprintf(text, sizeof text, "%6.3f %6.3f %6.3f", wm::tools::percentile(v, 50), wm::tools::percentile(v, 90),
                *std::max_element(v.begin(), v.end()));
  return text;
}

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

void write_looks(const std::string &file, const std::map<std::string, Outcomes> &all) {
  std::ofstream out(file);
  out << "trial,seed,t_s,error_m,error_deg,nees,lost_probability,tracking\n";
  for (const auto &[name, outcomes] : all)
    for (const LandmarkOutcome &o : outcomes)
      for (const Sample &s : o.outcome.samples) {
        char line[200];
        std::snprintf(line, sizeof line, "%s,%" PRIu64 ",%.2f,%.4f,%.3f,%.3f,%.6f,%d\n", name.c_str(), o.seed, s.t_s,
                      s.error_m, s.error_rad * 57.29578, s.nees, s.lost_probability, static_cast<int>(s.tracking));
        out << line;
      }
  if (!out) throw Failure(file + ": could not be written");
}

int run(const Arguments &a) {
  wm::sim::Scenario scenario;
  wm_config config{};
  wm_error error{};
  if (wm::sim::load_scenario(a.scenario, scenario, &error) != WM_OK) throw Failure(error.text, wm::tools::kUsage);
  if (wm_config_load(a.config.c_str(), &config, &error) != WM_OK) throw Failure(error.text, wm::tools::kUsage);
  std::fputs(config.warnings, stderr);
  std::vector<LandmarkTrial> wanted;
  for (const LandmarkTrial &o : landmark_trials())
    if (a.kinds.empty() || std::find(a.kinds.begin(), a.kinds.end(), o.name) != a.kinds.end()) wanted.push_back(o);
  std::map<std::string, Outcomes> all;
  Reliability reliability;
  for (uint64_t i = 0; i < a.drives; i++) {
    LandmarkWorld world(scenario, a.first + i);
    for (const LandmarkTrial &o : wanted) {
      all[o.name].push_back(run_landmark_trial(world, config, o));
      const std::string name = o.name;
      if (name == "as-driven" || name == "kidnap" || name == "start") reliability.take(all[name].back().outcome);
    }
    if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r%" PRIu64 " of %" PRIu64 " drives ", i + 1, a.drives);
  }
  if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r%40s\r", "");
  std::printf("%s, %s of %s, %" PRIu64 " drives each\n\n", scenario.name.c_str(), config.estimator->name,
              a.config.c_str(), a.drives);
  wm_config_free(&config);
  print_header();
  for (const LandmarkTrial &o : wanted) print_row(o.name, all[o.name]);
  std::printf("\n");
  for (const LandmarkTrial &o : wanted) {
    if (o.start || o.kidnap) print_found(o.name, all[o.name], o.kidnap);
    if (o.moved > 0) print_moved(o.name, all[o.name]);
  }
  print_cost(all);
  reliability.print();
  if (!a.csv.empty()) write_looks(a.csv, all);
  if (!a.diagram.empty()) reliability.draw(a.diagram);
  return wm::tools::kDone;
}

}  // namespace

int main(int argc, char **argv) {
  Arguments a;
  wm::cli::App app(
      "An estimator by known landmarks over many simulated drives, features only: as driven, started without a pose, "
      "carried off, with false detections, wrong identities, moved landmarks, and few of them.",
      "waymark-montecarlo-landmarks");
  std::vector<std::string> names;
  for (const LandmarkTrial &o : landmark_trials()) names.emplace_back(o.name);
  app.add_option("SCENARIO", a.scenario, "scenario file (YAML)")->required();
  app.add_option("--config", a.config, "configuration of the estimator")->required();
  app.add_option("--trials", a.kinds, "which; all if not given")->delimiter(',')->check(wm::cli::one_of(names));
  app.add_option("--drives", a.drives, "number of seeds")->check(wm::cli::range(1, 100000))->capture_default_str();
  app.add_option("--first-seed", a.first, "the first one's seed")->capture_default_str();
  app.add_option("--looks", a.csv, "writes what was judged, a row each 0.1 s, here (CSV)");
  app.add_option("--diagram", a.diagram, "writes the reliability diagram of the probability of being lost here (SVG)");
  app.footer(
      "example: waymark-montecarlo-landmarks config/worlds/crossing-easy.yaml --config "
      "config/datasets/crossing-cameras.yaml\n"
      "docs/consistency.md defines each figure. Exit code: 0 done, 1 failed, 2 usage or configuration.");
  return wm::tools::run_program(app, argc, argv, [&] { return run(a); });
}
