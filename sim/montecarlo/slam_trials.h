// SPDX-License-Identifier: Apache-2.0
// A simulated drive through SLAM, with a disturbance: carried off, pushed, or started without a pose on a finished map.
// Features, no pixels: a drive takes milliseconds.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "simulate/scenario.h"

namespace wm::montecarlo {

enum class Disturbance {
  kNone,
  kKidnap,  // to another part of the drive, at least 2 m away; odometry does not show it
  kPush,    // by 0.5 to 2 m or 20 to 90 degrees
  kStart,   // on a finished map, driving, without a pose
};

struct SlamTrial {
  const char *name;
  Disturbance disturbance;
  bool frozen;  // kStart: the map does not grow
};
// All that there are.
const std::vector<SlamTrial> &slam_trials();

struct SlamOptions {
  bool renumber = false;  // an identity is a tracker's number: another one after 1 s out of sight, and after the cut
};

struct SlamOutcome {
  uint64_t seed = 0;
  double cut_s = 0;  // of the disturbance; start: when it begins
  double moved_m = 0, turned_rad = 0;
  // From when enough was seen since the cut (two landmarks of the map, four sightings; renumbered: eight sightings)
  // until the state is LOST or SEARCHING; 0: the pose was right by then. None: never.
  std::optional<double> detected_after_s;
  std::optional<double> right_after_s;       // from the cut until right (tracking, 0.3 m, 5 degrees) for 2 s
  int alarms = 0;                            // changes to LOST or SEARCHING without a disturbance
  double wrong_s = 0;                        // longest time of TRACKING off by more than 0.5 m and 3.5 sigma
  double end_m = 0;                          // error of the position at the end
  double map_before_m = 0, map_after_m = 0;  // RMS error of the landmarks, before the cut and at the end
  size_t looks = 0, inside = 0;              // looks while tracking, those within 95 % of the covariance
};

// Throws where the estimator refuses the drive, or no disturbance of this kind fits into it.
SlamOutcome run_slam_trial(const sim::Scenario &scenario, const wm_config &config, const SlamTrial &trial,
                           const SlamOptions &options, uint64_t seed);

}  // namespace wm::montecarlo
