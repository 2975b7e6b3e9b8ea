// SPDX-License-Identifier: Apache-2.0
// A simulated drive past known landmarks through an estimator, with what may befall it: started without a pose, carried
// off, false detections, wrong identities, landmarks that were moved. Features, no pixels: a drive takes milliseconds.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "montecarlo/trial.h"
#include "simulate/film.h"
#include "simulate/simulate.h"

namespace wm::montecarlo {

struct LandmarkTrial {
  const char *name;
  bool start = false;        // begun while driving, anywhere, without a pose
  bool kidnap = false;       // carried to another place of the drive
  double false_share = 0;    // of the detections there is nothing to be seen
  double misread_share = 0;  // of the detections have another's identity
  int moved = 0;             // so many landmarks of those that are seen stand elsewhere by now
  int landmarks = 0;         // only so many of those that are seen most; 0: all
  double start_off_m = 0;    // the start is off by so much, its stated sigma is 5 cm
};
// All that there are, by name.
const std::vector<LandmarkTrial> &landmark_trials();

// One seed's world: drawn once, then driven with one trial or another.
class LandmarkWorld {
 public:
  // Throws where the scenario doesn't fit.
  LandmarkWorld(const sim::Scenario &scenario, uint64_t seed);
  [[nodiscard]] const sim::Recording &as_driven() const { return driven_; }
  // With the trial's faults; `at_s`: when it was carried off.
  sim::Recording drive(const LandmarkTrial &trial, double *at_s);
  [[nodiscard]] const sim::Scenario &scenario() const { return film_.scenario; }

 private:
  sim::Recording record(const sim::Faults &faults);

  sim::Film film_;
  uint64_t seed_;
  sim::Recording driven_;
};

struct LandmarkOutcome {
  uint64_t seed = 0;
  Outcome outcome;  // looks of each 0.1 s; of a kidnapping or a start: from then on
  // Kidnapping: from the first view of a landmark on, until its state is lost or searching; none: never.
  std::optional<double> detected_after_s;
  // Start, kidnapping: seconds of driving until it is right (tracking, within 0.3 m and 5 degrees) and stays so for 2
  // s.
  std::optional<double> right_after_s;
  // Longest time that it is confidently wrong: tracks, off by more than 0.3 m or 5 degrees, beyond 99.9 % of its
  // covariance, with a lost_probability below a half. Carried off: from its detection on.
  double wrong_s = 0;
  double reported_moved = 0;   // landmarks reported as moved
  bool rightly_named = false;  // the last one reported was moved
  size_t moved_seen = 0;       // sightings of moved landmarks
  double rms_m = 0, rms_deg = 0;
};

// Throws where the estimator can't work with the drive.
LandmarkOutcome run_landmark_trial(LandmarkWorld &world, const wm_config &config, const LandmarkTrial &trial);

}  // namespace wm::montecarlo
