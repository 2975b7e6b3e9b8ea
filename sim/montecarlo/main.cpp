// SPDX-License-Identifier: Apache-2.0
// waymark-montecarlo SCENARIO|DRIVES --config F: an estimator over many drives, as driven or with trials.
#include <cstring>
#include <memory>

#include "common/program.h"
#include "montecarlo/engines.h"

namespace {

using namespace wm::montecarlo;
using wm::tools::Failure;
using Names = std::vector<std::string>;

void parse(wm::cli::App *app, Request *a) {
  app->description(
      "Runs an estimator over many simulated drives and prints, beside each figure, the Cramer-Rao bound. With trials\n"
      "each drive is disturbed and judged: carried off, begun without a pose, shown what is wrong.");
  app->add_option("DRIVES", a->drives_of, "scenario file (YAML), or a folder that sim/montecarlo/pictures.py made")
      ->required();
  app->add_option("--config", a->config, "configuration of the estimator");
  app->add_option("--trials", a->trials,
                  "a list, or all. By the estimator slam: as-driven, kidnap, push, start, start-frozen; by others past "
                  "landmarks: as-driven, start, kidnap, false, moved, ...; of a folder (without --trials all): normal, "
                  "kidnap, start, alike")
      ->delimiter(',');
  app->add_option("--drives", a->drives, "number of seeds; 200, slam's trials 30, others 100; of a folder all")
      ->check(wm::cli::range(1, 1000000));
  app->add_option("--first-seed", a->first_seed, "the first one's seed")->capture_default_str();
  app->add_option("--landmarks", a->landmarks, "how many of the scenario's landmarks, a list")->delimiter(',');
  app->add_option("--laps", a->laps, "instead of the route's laps")->check(wm::cli::range(1, 1000));
  app->add_flag("--each", a->each, "slam's trials and a folder: prints each drive");
  app->add_flag("--renumber", a->renumber,
                "slam's trials: identities are a tracker's numbers, new after 1 s out of sight");
  app->add_option("--trials-each", a->trials_each, "a folder: trials a drive, of kidnap and start")
      ->check(wm::cli::range(1, 100));
  app->add_option("--filter-seed", a->filter_seed, "a folder: of the filter")->capture_default_str();
  app->add_option("--settled", a->six.settled_s, "in space: figures from so many seconds on")->capture_default_str();
  app->add_option("--until", a->six.until_s, "in space: ... to so many");
  app->add_option("--blind-from", a->six.blind_from_s, "in space: no picture shows anything from here, s");
  app->add_option("--blind-to", a->six.blind_to_s, "... to here");
  app->add_option("--points-seen", a->six.points_per_picture, "in space: only so many points of each pair of pictures");
  app->add_option("--bounds", a->six.bounds, "in space: compute the bound of so many drives, the first ones");
  app->add_option("--run", a->run, "prints the bound alone, for what `waymark replay` wrote here of a rendered drive");
  app->add_option("--recording", a->recording, "... and that drive's recording, with its truth");
  app->add_option("--csv", a->csv, "writes the figures of each step, of trials each look, of 0.1 s here");
  app->add_option("--diagram", a->diagram,
                  "trials past landmarks and of a folder: writes the reliability diagram of the probability of being "
                  "lost here (SVG)");
  app->add_option("--out", a->out, "writes each drive's figures into this folder, for waymark compare BEFORE AFTER");
  app->footer(
      "example: waymark-montecarlo config/worlds/crossing.yaml --config config/datasets/crossing-points.yaml\n"
      "         waymark-montecarlo config/worlds/loops-markers.yaml --config config/datasets/loops-markers.yaml "
      "--trials "
      "all\n"
      "         waymark-montecarlo WORLD --config F --out before; after a change: --out after; waymark compare before "
      "after\n"
      "docs/consistency.md defines each figure. Exit code: 0 done, 1 failed, 2 usage or configuration.");
}

void check_trials(const Request &a, const Names &known) {
  std::string list;
  for (const std::string &name : known) list += (list.empty() ? "" : ", ") + name;
  for (const std::string &name : a.trials)
    if (name != "all" && std::find(known.begin(), known.end(), name) == known.end())
      throw Failure("--trials: '" + name + "' is none of these here: all, " + list, wm::tools::kUsage);
}

void run_trials(const Request &a, const wm::sim::Scenario &scenario, const wm_config &config) {
  if (std::strcmp(config.estimator->name, "slam") == 0) {
    check_trials(a, slam_trial_names());
    return run_slam(a, scenario, config);
  }
#ifdef WM_HAS_RENDER
  check_trials(a, landmark_trial_names());
  run_landmarks(a, scenario, config);
#else
  throw Failure("--trials past landmarks: built without the renderer (WM_RENDER)", wm::tools::kUsage);
#endif
}

int run_all(const Request &a) {
  wm_error err{};
  const bool is_folder = std::filesystem::is_directory(a.drives_of);
  wm::sim::Scenario scenario;
  if (!is_folder) wm::tools::need_ok(wm::sim::load_scenario(a.drives_of, scenario, &err), err);
  if (a.laps) scenario.route.laps = *a.laps;
  if (a.run.empty() != a.recording.empty()) throw Failure("--run and --recording go together", wm::tools::kUsage);
  if (!a.run.empty()) {
    print_bound(a, scenario);
    return wm::tools::kDone;
  }
  if (a.config.empty()) throw Failure("--config is missing: which estimator?", wm::tools::kUsage);
  auto config = std::make_unique<wm_config>();
  const wm_status status = wm_config_load(a.config.c_str(), config.get(), &err);
  const std::unique_ptr<wm_config, decltype(&wm_config_free)> loaded(config.get(), &wm_config_free);
  std::fputs(config->warnings, stderr);
  wm::tools::need_ok(status, err);
  if (is_folder) {
    check_trials(a, kEdgeTrials);
    run_edges(a, *config);
  } else if (!a.trials.empty()) {
    run_trials(a, scenario, *config);
  } else {
    (scenario.swims() ? run_in_space : run_planar)(a, scenario, *config);
  }
  return wm::tools::kDone;
}

}  // namespace

int main(int argc, char **argv) {
  wm::cli::App app("", "waymark-montecarlo");
  Request request;
  parse(&app, &request);
  return wm::tools::run_program(app, argc, argv, [&request] { return run_all(request); });
}
