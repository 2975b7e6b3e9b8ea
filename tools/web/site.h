// SPDX-License-Identifier: Apache-2.0
// What the page can show of a place and a robot besides messages: map, cameras, sensors. From the run's configuration
// (and its recording); all of it may be absent.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/cameras.h"
#include "waymark/map.h"

namespace wm::tools {

// Where a sensor sits, and whether it looks up or down, so that its bearings are azimuths about its mounting's yaw.
struct SensorMount {
  Eigen::Isometry3d T_base = Eigen::Isometry3d::Identity();
  double yaw_rad = 0;
  bool is_steep = false;

  // Unit direction in base_link of a bearing and an elevation.
  [[nodiscard]] Eigen::Vector3d direction(double bearing_rad, double elevation_rad) const;
};

struct WebSite {
  std::unique_ptr<wm_map, decltype(&wm_map_free)> map{nullptr, wm_map_free};
  std::vector<NamedCamera> cameras;
  std::map<std::string, SensorMount> sensors;  // cameras are in it, too
  std::string lcm_url, prefix = "WAYMARK_", picture_socket, name;

  [[nodiscard]] const wm_raster *raster() const { return map ? wm_map_raster(map.get()) : nullptr; }
  [[nodiscard]] SensorMount sensor(const std::string &wanted) const;  // at base_link where it is not known
};

// `config` and `recording` as of `waymark run`; either may be empty. `map` (a map.yaml) stands above theirs. Throws
// Failure for what is wrong in them.
WebSite load_web_site(const std::filesystem::path &config, const std::filesystem::path &recording,
                      const std::filesystem::path &map);

}  // namespace wm::tools
