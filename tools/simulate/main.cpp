// SPDX-License-Identifier: Apache-2.0
// waymark simulate SCENARIO --out DIR: a world, a robot and its errors become a recording with truth.
#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <optional>

#include "common/failure.h"
#include "simulate/simulate.h"
#include "simulate/write.h"

namespace {

using namespace wm;

struct Arguments {
  std::string scenario, out;
  std::optional<uint64_t> seed;
  std::optional<int> laps;
  size_t landmarks = SIZE_MAX;
  bool perfect = false;
};

void parse(CLI::App *app, Arguments *a) {
  app->description(
      "Makes a recording of a simulated drive, with truth.\nThe same scenario, seed and options give the same bytes.");
  app->add_option("SCENARIO", a->scenario, "scenario file (YAML)")->required();
  app->add_option("--out", a->out, "folder of the recording, made if it isn't there")->required();
  app->add_option("--seed", a->seed, "instead of the scenario's seed");
  app->add_option("--landmarks", a->landmarks, "only the scenario's first N landmarks");
  app->add_option("--laps", a->laps, "instead of the route's laps")->check(CLI::Range(1, 1000));
  app->add_flag("--perfect", a->perfect, "no errors, no noise, no faults");
  app->footer(
      "example: waymark simulate config/worlds/crossing.yaml --landmarks 3 --out out/crossing\n"
      "docs/simulate.md tells all keys of a scenario. Exit code: 0 done, 1 can't write, 2 usage or scenario.");
}

wm_status simulate(const Arguments &a, wm_error *err) {
  sim::Scenario scenario;
  if (const wm_status s = sim::load_scenario(a.scenario, scenario, err); s != WM_OK) return s;
  if (a.laps) scenario.route.laps = *a.laps;
  if (a.perfect) sim::make_perfect(scenario);
  sim::Recording made;
  const uint64_t seed = a.seed.value_or(scenario.seed);
  if (sim::simulate(scenario, seed, a.landmarks, made, err) != WM_OK) return wm_fail_in(err, "%s", a.scenario.c_str());
  if (const wm_status s = sim::write_recording(scenario, made, a.out, err); s != WM_OK) return s;
  std::printf("%s: seed %" PRIu64 ", %.1f s, %.1f m, %zu CAN frames, %zu sightings of %zu landmarks\n", a.out.c_str(),
              made.seed, made.drive.duration_s(), made.drive.length_m(), made.can.size(), made.sightings.size(),
              made.map.size());
  return WM_OK;
}

}  // namespace

int main(int argc, char **argv) {
  CLI::App app("", "waymark simulate");
  try {
    Arguments arguments;
    parse(&app, &arguments);
    app.parse(argc, argv);
    wm_error err{};
    const wm_status status = simulate(arguments, &err);
    if (status == WM_OK) return tools::kDone;
    std::fprintf(stderr, "waymark simulate: %s\n", err.text[0] ? err.text : wm_status_text(status));
    return status == WM_BAD_CONFIG || status == WM_NOT_FOUND ? tools::kUsage : tools::kFailed;
  } catch (const CLI::ParseError &problem) {
    return app.exit(problem) == 0 ? tools::kDone : tools::kUsage;
  } catch (const std::exception &problem) {
    std::fprintf(stderr, "waymark simulate: %s\n", problem.what());
    return tools::kFailed;
  }
}
