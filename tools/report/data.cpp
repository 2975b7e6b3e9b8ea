// SPDX-License-Identifier: Apache-2.0
#include "report/data.h"

#include <cmath>
#include <limits>

#include "common/csv.h"
#include "common/failure.h"
#include "common/json_file.h"
#include "common/yaml.h"
#include "report/edges.h"
#include "report/report_json.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

// Updates that were gated together have one NIS between them; how many they are is its degrees of freedom.
void count_gated_together(std::vector<Innovation> *all) {
  for (size_t begin = 0; begin < all->size();) {
    const Innovation &first = (*all)[begin];
    size_t end = begin + 1;
    while (end < all->size() && (*all)[end].t_ns == first.t_ns && (*all)[end].landmark == first.landmark &&
           (*all)[end].sensor == first.sensor && (*all)[end].nis == first.nis)
      ++end;
    const int dof = static_cast<int>(end - begin);
    for (; begin < end; ++begin) (*all)[begin].gate_dof = dof;
  }
}

std::vector<Innovation> load_innovations(const fs::path &file) {
  if (!fs::exists(file)) return {};
  const Csv csv = Csv::load(file);
  const auto text = [&csv](size_t row, std::optional<size_t> column) {
    return column ? std::string(csv.text(row, *column)) : std::string();
  };
  const size_t t = csv.need("t_ns");
  const auto source = csv.find("source");
  const auto sensor = csv.find("sensor");
  const auto residual = csv.find("residual");
  const auto landmark = csv.find("landmark");
  const auto observed = csv.find("observed");
  const auto expected = csv.find("expected");
  const auto variance = csv.find("variance");
  const auto nis = csv.find("nis");
  const auto gate = csv.find("gate");
  const auto dof = csv.find("gate_dof");
  const size_t verdict = csv.need("verdict");
  std::vector<Innovation> out;
  out.reserve(csv.rows());
  for (size_t row = 0; row < csv.rows(); ++row) {
    const double dof_value = csv.number(row, dof);
    const double id = csv.number(row, landmark);
    out.push_back({csv.integer(row, t), text(row, source), text(row, sensor), text(row, residual),
                   std::isfinite(id) ? static_cast<int64_t>(id) : -1, csv.number(row, observed),
                   csv.number(row, expected), csv.number(row, variance), csv.number(row, nis), csv.number(row, gate),
                   std::isfinite(dof_value) ? static_cast<int>(dof_value) : 1, std::string(csv.text(row, verdict))});
  }
  if (!dof) count_gated_together(&out);
  return out;
}

std::map<std::string, Pose> load_mountings(const fs::path &recording) {
  std::map<std::string, Pose> out;
  const Yaml calibration(recording / "calibration.yaml");
  for (const auto &[name, sensor] : calibration.children("sensors")) {
    const auto xyz = calibration.numbers(sensor, "mounting.xyz_m");
    const auto rpy = calibration.numbers(sensor, "mounting.rpy_deg");
    Pose mounting;
    if (xyz.size() == 3) mounting.p_m = {xyz[0], xyz[1], xyz[2]};
    if (rpy.size() == 3) {
      const auto turn = [](double deg, const Eigen::Vector3d &axis) {
        return Eigen::AngleAxisd(deg * M_PI / 180, axis);
      };
      mounting.q = turn(rpy[2], Eigen::Vector3d::UnitZ()) * turn(rpy[1], Eigen::Vector3d::UnitY()) *
                   turn(rpy[0], Eigen::Vector3d::UnitX());
    }
    out[name] = mounting;
  }
  return out;
}

void load_recording(const fs::path &recording, ReportData *out, Figures *figures) {
  if (!fs::is_directory(recording))
    throw Failure(recording.string() + ": is not a folder; REC is a recording's folder", kUsage);
  const Yaml about(recording / "recording.yaml");
  if (const std::string name = about.text("name"); !name.empty()) out->name = name;
  out->about = about.text("about");
  if (fs::exists(recording / "landmarks.csv")) out->landmarks = load_landmarks(recording / "landmarks.csv");
  if (fs::exists(recording / "truth-landmarks.csv")) out->landmarks = load_landmarks(recording / "truth-landmarks.csv");
  if (fs::exists(recording / "gnss.csv")) out->gnss = load_gnss(recording);
  out->sightings = load_sightings(recording);
  out->mountings = load_mountings(recording);
  out->raster = load_raster(recording, &out->notes);
  if (!fs::exists(recording / "truth.csv")) return;
  CompareOptions options;
  options.truth_offset_m = load_truth_offset(recording);
  out->truth = compare(out->trajectory, load_truth(recording), options);
  *figures = pose_figures(*out->truth, out->trajectory.has_covariance, false);
  if (!out->estimated_landmarks.empty() && !out->landmarks.empty())
    add_landmark_figures(out->estimated_landmarks, out->landmarks, *out->truth, has_identities(recording), figures);
}

}  // namespace

double Innovation::value() const {
  const double difference = observed - expected;
  return residual == "bearing" || residual == "heading" ? wrap(difference) : difference;
}

ReportData load_report_data(const fs::path &run, const fs::path &recording) {
  ReportData out;
  out.trajectory = load_trajectory(run);
  out.start_ns = out.trajectory.poses.front().t_ns;
  out.name = fs::weakly_canonical(run).filename().string();
  out.innovations = load_innovations(run / "innovations.csv");
  out.looked_for = load_looked_for(run / "looked-for.csv");
  const auto json = std::make_shared<ReportJson>();
  json->health = load_json(run / "health.json");
  json->timing = load_json(run / "timing.json");
  if (fs::exists(run / "map-estimate.csv")) out.estimated_landmarks = load_landmarks(run / "map-estimate.csv");
  if (!recording.empty()) {
    load_recording(recording, &out, &json->figures);
    out.frames = load_frames(recording, &out, 4);
    mark_sightings(recording, out, &out.frames);
    load_edges(run, recording, &out);
    mark_lines(run, recording, &out);
  }
  out.json = json;
  return out;
}

}  // namespace wm::tools
