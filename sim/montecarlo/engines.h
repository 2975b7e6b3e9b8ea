// SPDX-License-Identifier: Apache-2.0
// What waymark-montecarlo runs, by what it is given: each engine drives, judges and prints its table.
#pragma once

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "montecarlo/montecarlo.h"
#include "montecarlo/trial.h"

namespace wm::montecarlo {

// The command line. What an engine has no use for it leaves alone.
struct Request {
  std::string drives_of;  // a scenario, or a folder of drives
  std::string config, csv, diagram, out, run, recording;
  std::vector<std::string> trials;
  uint64_t first_seed = 1, filter_seed = 1;
  std::optional<uint64_t> drives;
  std::optional<int> laps;
  int trials_each = 1;
  bool each = false, renumber = false;
  std::vector<size_t> landmarks = {0, 1, 2, 3};
  Options6 six;

  [[nodiscard]] bool wants(const std::string &trial) const {
    return trials.empty() || trials.front() == "all" || std::find(trials.begin(), trials.end(), trial) != trials.end();
  }
};

// Of a scenario: as it is driven, with the bound.
void run_planar(const Request &request, const sim::Scenario &scenario, const wm_config &config);
void run_in_space(const Request &request, const sim::Scenario &scenario, const wm_config &config);
// The same with trials.
void run_slam(const Request &request, const sim::Scenario &scenario, const wm_config &config);
void run_landmarks(const Request &request, const sim::Scenario &scenario, const wm_config &config);
// Of a folder of drives.
void run_edges(const Request &request, const wm_config &config);
// The bound of one rendered drive.
void print_bound(const Request &request, const sim::Scenario &scenario);

// Names of the trials of each engine that has some.
std::vector<std::string> slam_trial_names(), landmark_trial_names();
inline const std::vector<std::string> kEdgeTrials = {"normal", "kidnap", "start", "alike"};

// "12 of 100 drives" on a terminal, in place.
void show_progress(const char *what, uint64_t done, uint64_t all);
void end_progress();

// Median, 90 of 100 below, largest of those that are finite.
std::string spread(std::vector<double> values);

// What was judged, a row each look, as CSV.
class Looks {
 public:
  explicit Looks(const std::string &file);  // empty: nothing is written
  void add(const std::string &trial, const std::string &drive, const Outcome &outcome);

 private:
  std::string name_;
  std::ofstream file_;
};

}  // namespace wm::montecarlo
