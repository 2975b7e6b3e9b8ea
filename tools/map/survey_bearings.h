// SPDX-License-Identifier: Apache-2.0
// A map of landmarks by driving: their places from the bearings of a run and from poses that are known.
#pragma once

#include <filesystem>
#include <string>

#include "map/survey.h"
#include "map/triangulate.h"

namespace wm::tools {

struct SurveyDrive {
  std::filesystem::path run;    // events.wmlog: the bearings, with identities
  std::filesystem::path poses;  // a recording (truth.csv) or another run (trajectory.csv)
  std::filesystem::path out;    // a folder to make: landmarks.csv, landmarks/; empty: none
  SurveyPriors priors;
};

// Residuals are observed less expected, with the mountings as they were found. Findings: what moved while it was seen,
// identities that stand in two places, misread ones, what is elsewhere than the run's own map has it. Of landmarks that
// the run's map knows, the height is the map's; of others that of the cameras. Throws Failure.
Survey survey_drive(const SurveyDrive &drive);

}  // namespace wm::tools
