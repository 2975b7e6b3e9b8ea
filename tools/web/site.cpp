// SPDX-License-Identifier: Apache-2.0
#include "web/site.h"

#include <cmath>

#include "common/program.h"

extern "C" {
#include "config/config.h"
#include "waymark/site.h"
}

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

SensorMount mount_of(const wm_mounting &m) {
  SensorMount out;
  out.T_base = images::pose_xyz_rpy({m.xyz_m[0], m.xyz_m[1], m.xyz_m[2]}, m.rpy_rad[0], m.rpy_rad[1], m.rpy_rad[2]);
  out.yaw_rad = m.rpy_rad[2];
  out.is_steep = std::fabs(out.T_base.linear()(2, 0)) > M_SQRT1_2;
  return out;
}

struct ConfigDeleter {
  void operator()(wm_config *config) const {
    wm_config_free(config);
    delete config;
  }
};

}  // namespace

Eigen::Vector3d SensorMount::direction(double bearing_rad, double elevation_rad) const {
  const double across = std::cos(elevation_rad), up = std::sin(elevation_rad);
  const double azimuth = bearing_rad + (is_steep ? yaw_rad : 0);
  const Eigen::Vector3d ray(across * std::cos(azimuth), across * std::sin(azimuth), up);
  return is_steep ? ray : Eigen::Vector3d(T_base.linear() * ray);
}

SensorMount WebSite::sensor(const std::string &wanted) const {
  const auto at = sensors.find(wanted);
  return at == sensors.end() ? SensorMount{} : at->second;
}

WebSite load_web_site(const fs::path &config_file, const fs::path &recording, const fs::path &map) {
  WebSite out;
  wm_error err{};
  wm_recording_overrides files{};
  if (!config_file.empty()) {
    const std::unique_ptr<wm_config, ConfigDeleter> config(new wm_config{});
    need_ok(wm_config_load(config_file.c_str(), config.get(), &err), err);
    files = config->overrides;
    out.lcm_url = config->lcm_url;
    out.prefix = config->channel_prefix;
    out.picture_socket = config->picture_socket;
    out.name = config_file.stem().string();
  }
  std::string map_file = map.string();
  if (!config_file.empty() || !recording.empty()) {
    wm_site *opened = nullptr;
    need_ok(wm_site_open(recording.empty() ? nullptr : recording.c_str(), &files, nullptr, nullptr, &opened, &err),
            err);
    const std::unique_ptr<wm_site, decltype(&wm_site_close)> site(opened, wm_site_close);
    size_t count = 0;
    const wm_sensor *sensors = wm_site_sensors(site.get(), &count);
    const wm_rig *rig = wm_site_rig(site.get());
    for (uint32_t i = 0; i < rig->camera_count; i++)
      out.sensors[rig->cameras[i].name] = mount_of(rig->cameras[i].mounting);
    for (size_t i = 0; i < count; i++) out.sensors[sensors[i].name] = mount_of(sensors[i].mounting);
    if (map_file.empty()) map_file = wm_site_map_path(site.get());
    fs::path calibration = files.calibration;
    if (calibration.empty() && !recording.empty()) calibration = recording / "calibration.yaml";
    if (rig->camera_count > 0 && fs::exists(calibration)) out.cameras = load_cameras(calibration);
    if (!recording.empty()) out.name = fs::weakly_canonical(recording).filename().string();
  }
  if (map_file.empty()) return out;
  wm_map *loaded = nullptr;
  need_ok(wm_map_load(map_file.c_str(), nullptr, nullptr, &loaded, &err), err);
  out.map.reset(loaded);
  return out;
}

}  // namespace wm::tools
