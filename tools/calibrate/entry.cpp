// SPDX-License-Identifier: Apache-2.0
#include "calibrate/entry.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "common/failure.h"

namespace wm::calibrate {
namespace {

std::string list(const std::vector<double> &values) {
  std::string out = "[";
  for (const double v : values) {
    char text[32];
    std::snprintf(text, sizeof text, "%s%.10g", out.size() > 1 ? ", " : "", v);
    out += text;
  }
  return out + "]";
}

}  // namespace

std::string mounting_yaml(const images::Pose &pose) {
  constexpr double kDeg = 180 / images::kPi;
  constexpr double kRounded = 1e-9;       // m and degrees
  constexpr double kUpright = 1 - 1e-12;  // of sin(pitch): roll and yaw are about one axis, and roll is taken as 0
  const Eigen::Matrix3d R = pose.linear();
  const images::Vec3 p = pose.translation();
  const double sine = std::clamp(-R(2, 0), -1.0, 1.0);
  const bool upright = std::abs(sine) > kUpright;
  std::vector<double> xyz{p.x(), p.y(), p.z()};
  std::vector<double> rpy{upright ? 0 : std::atan2(R(2, 1), R(2, 2)) * kDeg, std::asin(sine) * kDeg,
                          (upright ? std::atan2(-R(0, 1), R(1, 1)) : std::atan2(R(1, 0), R(0, 0))) * kDeg};
  for (std::vector<double> *values : {&xyz, &rpy})
    for (double &v : *values) v = std::round(v / kRounded) * kRounded + 0.0;  // no -0
  return "{xyz_m: " + list(xyz) + ", rpy_deg: " + list(rpy) + "}";
}

std::string calibration_yaml(const std::vector<Entry> &entries) {
  std::string out = "cameras:\n";
  for (const Entry &entry : entries) {
    const images::Camera &c = entry.camera;
    if (!entry.remark.empty()) out += "  # " + entry.remark + "\n";
    out += "  " + entry.name + ":\n    model: " + images::model_name(c.model) + "\n    size: [" +
           std::to_string(c.width) + ", " + std::to_string(c.height) + "]\n    intrinsics: " + list(c.intrinsics) +
           "\n";
    if (!c.distortion.empty()) out += "    distortion: " + list(c.distortion) + "\n";
    if (entry.mounted) {
      out += "    mounting: " + mounting_yaml(c.T_base_camera) + "\n";
    } else {
      out +=
          "    mounting: {xyz_m: [0, 0, 0], rpy_deg: [0, 0, 0]}  # to be measured: x ahead, y left, z up from the "
          "rear axle on the floor; positive pitch looks down\n";
    }
  }
  return out;
}

void write_new(const std::string &path, const std::string &text) {
  if (path.empty() || path == "-") {
    std::fputs(text.c_str(), stdout);
    return;
  }
  if (std::filesystem::exists(path))
    throw tools::Failure(path + ": exists already and is not overwritten; name another file", tools::kUsage);
  std::ofstream file(path);
  file << text;
  file.close();
  if (!file) throw tools::Failure(path + ": could not be written");
}

}  // namespace wm::calibrate
