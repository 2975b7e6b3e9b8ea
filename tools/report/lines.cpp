// SPDX-License-Identifier: Apache-2.0
// Upright lines in the pictures of a report.
#include <cmath>

#include "common/cameras.h"
#include "common/failure.h"
#include "common/line_sightings.h"
#include "report/data.h"
#include "report/frames.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr double kFrom_rad = -0.05, kSeenTo_rad = 0.30,
                 kMappedTo_rad = 0.12;  // elevations between which a line is drawn
constexpr int kPieces = 8;
constexpr double kReach_m = 20;  // lines of the map that are further away are not drawn

std::vector<Eigen::Vector2d> upright(const images::Camera &camera, double azimuth_rad, double to_rad) {
  std::vector<Eigen::Vector2d> out;
  const images::Pose base_to_optical = images::T_base_optical(camera).inverse();
  const Vector3d eye = camera.T_base_camera.translation();
  for (int i = 0; i <= kPieces; i++) {
    const double e = kFrom_rad + (to_rad - kFrom_rad) * i / kPieces;
    const Vector3d ray(std::cos(e) * std::cos(azimuth_rad), std::cos(e) * std::sin(azimuth_rad), std::sin(e));
    images::Vec2 pixel;
    if (images::project(camera, base_to_optical * (eye + ray), pixel)) out.emplace_back(pixel.x(), pixel.y());
  }
  return out;
}

}  // namespace

void mark_lines(const fs::path &run, const fs::path &recording, ReportData *data) {
  if (data->frames.empty() || !fs::exists(run / "events.wmlog")) return;
  for (const NamedCamera &camera : load_cameras(recording / "calibration.yaml")) {
    LineSightings seen;
    wm_camera own{};
    try {
      seen = load_line_sightings(run, camera.name, &own);
    } catch (const Failure &) {
      continue;  // this camera saw none
    }
    for (ReportFrame &frame : data->frames) {
      const auto at = seen.find(frame.t_ns);
      if (frame.camera != camera.name || at == seen.end()) continue;
      for (const LineSighting &line : at->second)
        frame.lines_seen.push_back(upright(camera.camera, line.azimuth_rad, kSeenTo_rad));
      const auto pose = pose_at(data->trajectory.poses, frame.t_ns, kMaxGapNs);
      if (!pose || !pose->oriented) continue;
      for (const Landmark &landmark : data->estimated_landmarks) {
        const Vector3d from =
            pose->q.conjugate() * Vector3d(landmark.p_m.x() - pose->p_m.x(), landmark.p_m.y() - pose->p_m.y(), 0) -
            camera.camera.T_base_camera.translation();
        if (from.head<2>().norm() > kReach_m) continue;
        frame.lines_mapped.push_back(upright(camera.camera, std::atan2(from.y(), from.x()), kMappedTo_rad));
      }
    }
  }
}

}  // namespace wm::tools
