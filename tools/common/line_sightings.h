// SPDX-License-Identifier: Apache-2.0
// Upright lines that a run's camera saw, from its event log, as azimuths in base_link.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "waymark/setup.h"

namespace wm::tools {

struct LineSighting {
  int32_t track;
  double azimuth_rad;  // from the camera's centre, in the axes of base_link
  double sigma_rad;    // NaN where not given
};

// By stamp; a picture in which nothing was seen has an empty list.
using LineSightings = std::map<int64_t, std::vector<LineSighting>>;

// What the sensor of the camera's name said in RUN/events.wmlog, bearings alone. `camera` is the log's own. Throws
// Failure where the log is missing or damaged, or has no such camera or sensor. About 0.1 s for ten minutes.
LineSightings load_line_sightings(const std::filesystem::path &run, const std::string &name, wm_camera *camera);

}  // namespace wm::tools
