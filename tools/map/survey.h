// SPDX-License-Identifier: Apache-2.0
// A map of landmarks that a run made or drove on, looked at afterwards: how well each landmark fits, and which ones are
// not what they seem.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace wm::tools {

// What one kind of residual (bearing, range; x along and y across the line of sight, heading) was like.
struct ResidualFigures {
  std::string kind;
  double mean = 0, rms = 0;  // m, rad; of the fused sightings
  double in_sigmas = 0;      // rms of residuals in units of what the filter expected of them: about 1, or less
};

struct LandmarkSurvey {
  int64_t id = 0;
  bool on_map = false;  // at the end of the run, confirmed
  double x_m = 0, y_m = 0, sigma_m = 0;
  size_t fused = 0, refused = 0, twice = 0;  // refused: by the gate; twice: the identity was not one landmark's
  double first_s = 0, last_s = 0;            // since the run's first sighting
  std::vector<ResidualFigures> residuals;
  std::vector<std::string> findings;  // "moved by about 1.50 m between 63.2 s and 65.1 s"
};

struct Survey {
  std::vector<LandmarkSurvey> landmarks;  // by id
  std::vector<std::string> cameras;       // "ceiling: range scale 1.0013 +- 0.0029, bloom 0.203 px"
  [[nodiscard]] size_t findings() const;
};

// From innovations.csv, map-estimate.csv and health.json of a run's folder. Throws Failure where one of the first two
// is not there or can't be read.
Survey survey_run(const std::filesystem::path &run);
std::string survey_table(const Survey &survey);
nlohmann::ordered_json survey_json(const Survey &survey);

}  // namespace wm::tools
