// SPDX-License-Identifier: Apache-2.0
// What a recording has for judging and drawing: truth, GNSS, landmarks, sightings. (The runtime's own reader never
// opens truth; this one is the desk's.)
#pragma once

#include <filesystem>
#include <vector>

#include "common/pose.h"
#include "common/run_folder.h"

namespace wm::tools {

// truth.csv as it stands: the truth's point, `truth_offset_m` away from base_link. Throws Failure: not there, nothing
// in it, stamps that don't rise. *left_out: rows without a position.
std::vector<Pose> load_truth(const std::filesystem::path &recording, size_t *left_out = nullptr);
// truth_offset_m of recording.yaml: truth's point in base_link; 0 where it says nothing.
Eigen::Vector3d load_truth_offset(const std::filesystem::path &recording);
// The antenna's place in base_link, by calibration.yaml; 0 where it is not stated.
Eigen::Vector3d load_antenna(const std::filesystem::path &recording);
// gnss.csv as positions without orientation, in the order of their stamps; z 0 where absent.
// *left_out: rows without a position.
std::vector<Pose> load_gnss(const std::filesystem::path &recording, size_t *left_out = nullptr);

// A row of sightings.csv.
struct Sighting {
  int64_t t_ns;
  std::string sensor;
  int64_t id;
  double bearing_rad, range_m;  // NaN where absent
};
// Empty where the recording has none.
std::vector<Sighting> load_sightings(const std::filesystem::path &recording);

}  // namespace wm::tools
