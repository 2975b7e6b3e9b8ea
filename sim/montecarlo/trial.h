// SPDX-License-Identifier: Apache-2.0
// A drive through an estimator as it was, or cut: set down elsewhere while driving, or begun without a pose; and what
// came of it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "config/config.h"
#include "montecarlo/drive.h"

namespace wm::montecarlo {

enum class TrialKind { kNormal, kKidnap, kStart, kAlike };

// Events before `cut_ns` (kNormal: all; kStart: none), then those from `on_ns` on, their stamps moved back to follow.
struct Trial {
  TrialKind kind;
  int64_t cut_ns, on_ns;
};

// One look at the filter, each 0.1 s. Judged from where it was set down on (normal: all).
struct Sample {
  double t_s, way_m;  // since set down
  double error_m, error_rad;
  double nees;
  double lost_probability, explained;
  uint32_t points;  // of the last scan
  bool tracking;    // or reckoning on from it; else lost or searching
  bool covered;     // truth within the published covariance's 95 %, or a cluster of particles about it
};

struct Outcome {
  std::vector<Sample> samples;
  [[nodiscard]] double position_mean_m() const, position_max_m() const, heading_mean_deg() const, nees_inside() const;
  // Off by more than 0.5 m or 15 degrees for longer than 2 s, or at the end.
  [[nodiscard]] bool lost() const;
  // Times that its state became lost or searching while it was right.
  [[nodiscard]] int false_alarms() const;
  // Seconds until its state is lost or searching; none: never.
  [[nodiscard]] std::optional<double> detected_after_s() const;
  // Way until it is right (tracking, within 0.3 m and 10 degrees) and stays so for 2 s.
  [[nodiscard]] std::optional<double> right_after_m() const;
  // Longest time that it tracks and is off by more than 1 m, s.
  [[nodiscard]] double astray_s() const;
  // Share of the time that it isn't right in which truth is covered.
  [[nodiscard]] double covered() const;
};

// Places for `count` trials of a kind in this drive, drawn by its name's number; fewer where there are no more.
// kKidnap: 3 m or 45 degrees away from where it was, driving, where the map looks different; kAlike: where it looks the
// same for as long as can be had (at least 1 s); kStart: driving. All where there are pictures, and enough way ahead.
std::vector<Trial> draw_trials(const EdgeDrive &drive, TrialKind kind, int count, double eye_m);

// Throws tools::Failure where the estimator can't work with the drive.
Outcome run_trial(const EdgeDrive &drive, const wm_config &config, const Trial &trial, uint64_t seed);

}  // namespace wm::montecarlo
