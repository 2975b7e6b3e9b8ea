// SPDX-License-Identifier: Apache-2.0
// waymark simulate SCENARIO --out DIR: a world, a robot and its errors become a recording with truth.
#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>

#include "simulate/simulate.h"
#include "simulate/write.h"

int main(int argc, char **argv) {
  CLI::App app{
      "Makes a recording (waymark-recording/1) of a simulated drive, with truth.\n"
      "The same scenario, seed and options give the same bytes. Scenarios: docs/simulate.md.\n\n"
      "Example: waymark simulate config/worlds/crossing.yaml --out out/crossing --landmarks 3",
      "waymark simulate"};
  std::string scenario_path, out;
  uint64_t seed = 0;
  size_t landmarks = SIZE_MAX;
  int laps = 0;
  bool perfect = false;
  app.add_option("SCENARIO", scenario_path, "scenario file (YAML)")->required();
  app.add_option("--out", out, "folder of the recording, made if it isn't there")->required();
  auto *seed_option = app.add_option("--seed", seed, "instead of the scenario's seed");
  app.add_option("--landmarks", landmarks, "only the scenario's first N landmarks");
  auto *laps_option = app.add_option("--laps", laps, "instead of the route's laps")->check(CLI::Range(1, 1000));
  app.add_flag("--perfect", perfect, "no errors, no noise, no faults");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError &e) {
    return app.exit(e) == 0 ? 0 : 2;
  }

  wm_error err{};
  wm::sim::Scenario scenario;
  wm_status status = wm::sim::load_scenario(scenario_path, scenario, &err);
  if (status == WM_OK) {
    if (*laps_option) scenario.route.laps = laps;
    if (!*seed_option) seed = scenario.seed;
    if (perfect) wm::sim::make_perfect(scenario);
  }
  wm::sim::Recording recording;
  if (status == WM_OK) status = wm::sim::simulate(scenario, seed, landmarks, recording, &err);
  if (status == WM_OK) status = wm::sim::write_recording(scenario, recording, out, &err);
  if (status != WM_OK) {
    std::fprintf(stderr, "waymark simulate: %s\n", err.text[0] ? err.text : wm_status_text(status));
    return status == WM_BAD_CONFIG || status == WM_NOT_FOUND ? 2 : 1;
  }
  std::printf("%s: seed %" PRIu64 ", %.1f s, %.1f m, %zu CAN frames, %zu sightings of %zu landmarks\n", out.c_str(),
              seed, recording.drive.duration_s(), recording.drive.length_m(), recording.can.size(),
              recording.sightings.size(), recording.map.size());
  return 0;
}
