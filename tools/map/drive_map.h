// SPDX-License-Identifier: Apache-2.0
// The map that a drive made: landmarks with their joint covariance.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace wm::tools {

struct DriveMap {
  struct Landmark {
    int64_t id;
    double z_m;
    double seen;  // how often, or another weight of z_m
  };
  std::string name;
  bool has_identities = true;  // else ids are numbers of this drive alone
  int width = 2;               // numbers of a landmark: x, y in m and, of markers, the heading in rad
  std::vector<Landmark> landmarks;
  Eigen::VectorXd mean;  // landmarks.size() * width
  Eigen::MatrixXd covariance;
  [[nodiscard]] int states() const { return static_cast<int>(mean.size()); }
};

// A run's folder (its map-estimate.wmmap), or such a file or one of start.saved_map, of `slam`. Landmarks that the run
// had confirmed, all else marginalized. Throws Failure: not there, damaged, of another estimator.
DriveMap read_drive_map(const std::filesystem::path &from);
// landmarks.csv with sigmas or covariances, each landmark for itself. Throws Failure where one has no sigma.
DriveMap read_surveyed_map(const std::filesystem::path &csv);

}  // namespace wm::tools
