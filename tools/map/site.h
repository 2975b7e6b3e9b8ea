// SPDX-License-Identifier: Apache-2.0
// A building's folder (docs/building.md) as a whole: what its files are, and whether they fit each other.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "waymark/floors.h"

namespace wm::tools {

using Floors = std::unique_ptr<wm_floors, void (*)(void *)>;
// The files that people edit. Throws Failure where the folder is no site.
Floors read_floors(const std::filesystem::path &site);

// Where the joint covariance of merged landmarks is, with their file: landmarks-covariance.npy beside landmarks.csv.
std::filesystem::path covariance_beside(const std::filesystem::path &landmarks);

// The files that a version has, below the site's folder, sorted: site.yaml and all that it names, with the pictures of
// maps and landmarks. Throws Failure where one is not there or lies outside.
std::vector<std::string> files_of(const wm_floors &site);

struct SiteReport {
  std::vector<std::string> facts;
  std::vector<std::string> wrong;  // where it is, what will not work, what to do
  std::vector<std::string> odd;    // what may be meant so
};
// The site's own files: floors, landmarks, connections, origins. Throws Failure where site.yaml can't be read.
SiteReport check_floors(const std::filesystem::path &site);
// And its versions, with the hash of each file.
SiteReport check_site(const std::filesystem::path &site);

}  // namespace wm::tools
