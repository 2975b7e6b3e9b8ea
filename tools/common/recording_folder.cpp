// SPDX-License-Identifier: Apache-2.0
#include "common/recording_folder.h"

#include <algorithm>
#include <cmath>

#include "common/csv.h"
#include "common/failure.h"
#include "common/yaml.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

void need_folder(const fs::path &recording) {
  if (!fs::is_directory(recording))
    throw Failure(recording.string() + ": is not a folder; REC is a recording's folder", kUsage);
}

std::vector<Pose> load_positions(const fs::path &file, bool must_rise, size_t *left_out) {
  const Csv csv = Csv::load(file);
  const size_t t = csv.need("t_ns");
  const size_t x = csv.need("x_m");
  const size_t y = csv.need("y_m");
  const auto z = csv.find("z_m");
  const auto qx = csv.find("qx");
  const auto qy = csv.find("qy");
  const auto qz = csv.find("qz");
  const auto qw = csv.find("qw");
  std::vector<Pose> out;
  out.reserve(csv.rows());
  for (size_t row = 0; row < csv.rows(); ++row) {
    Pose pose;
    pose.t_ns = csv.integer(row, t);
    pose.p_m = {csv.number(row, x), csv.number(row, y), csv.number(row, z)};
    if (std::isnan(pose.p_m.z())) pose.p_m.z() = 0;
    if (!pose.p_m.allFinite()) continue;
    const Eigen::Vector4d q{csv.number(row, qx), csv.number(row, qy), csv.number(row, qz), csv.number(row, qw)};
    pose.oriented = q.allFinite() && q.norm() > 0.5;
    if (pose.oriented) pose.q = Eigen::Quaterniond(q).normalized();
    if (must_rise && !out.empty() && pose.t_ns <= out.back().t_ns)
      throw Failure(csv.where(row, t) + ": " + std::to_string(pose.t_ns) + " does not rise over the row before");
    out.push_back(pose);
  }
  if (out.empty()) throw Failure(file.string() + ": has no position in it");
  if (left_out) *left_out = csv.rows() - out.size();
  return out;
}

}  // namespace

std::vector<Pose> load_truth(const fs::path &recording, size_t *left_out) {
  need_folder(recording);
  if (!fs::exists(recording / "truth.csv"))
    throw Failure(
        recording.string() + ": has no truth.csv" +
        (fs::exists(recording / "gnss.csv") ? "; `--against gnss` compares positions with its gnss.csv" : ""));
  return load_positions(recording / "truth.csv", true, left_out);
}

Eigen::Vector3d load_truth_offset(const fs::path &recording) {
  const Yaml about(recording / "recording.yaml");
  for (const char *key :
       {"vehicle.truth_offset_m", "truth_offset_m"})  // the format doesn't say in which; both are clear
    if (const auto xyz = about.numbers(key); xyz.size() == 3) return {xyz[0], xyz[1], xyz[2]};
  return Eigen::Vector3d::Zero();
}

Eigen::Vector3d load_antenna(const fs::path &recording) {
  const Yaml calibration(recording / "calibration.yaml");
  const auto xyz = calibration.numbers("gnss.mounting.xyz_m");
  return xyz.size() == 3 ? Eigen::Vector3d(xyz[0], xyz[1], xyz[2]) : Eigen::Vector3d::Zero();
}

std::vector<Pose> load_gnss(const fs::path &recording, size_t *left_out) {
  need_folder(recording);
  auto out = load_positions(recording / "gnss.csv", false, left_out);
  std::stable_sort(out.begin(), out.end(), [](const Pose &a, const Pose &b) { return a.t_ns < b.t_ns; });
  for (Pose &fix : out) fix.oriented = false;
  return out;
}

std::vector<Sighting> load_sightings(const fs::path &recording) {
  if (!fs::exists(recording / "sightings.csv")) return {};
  const Csv csv = Csv::load(recording / "sightings.csv");
  const size_t t = csv.need("t_ns");
  const size_t id = csv.need("id");
  const auto sensor = csv.find("sensor");
  const auto bearing = csv.find("bearing_rad");
  const auto range = csv.find("range_m");
  std::vector<Sighting> out;
  out.reserve(csv.rows());
  for (size_t row = 0; row < csv.rows(); ++row)
    out.push_back({csv.integer(row, t), sensor ? std::string(csv.text(row, *sensor)) : std::string(),
                   csv.text(row, id).empty() ? -1 : csv.integer(row, id), csv.number(row, bearing),
                   csv.number(row, range)});
  std::stable_sort(out.begin(), out.end(), [](const Sighting &a, const Sighting &b) { return a.t_ns < b.t_ns; });
  return out;
}

}  // namespace wm::tools
