// SPDX-License-Identifier: Apache-2.0
#include "eval/detector_command.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/cameras.h"
#include "common/edge_points.h"
#include "common/failure.h"
#include "eval/detector.h"
#include "eval/line_contrast.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

// Neighbouring rays' points that are this near in the picture are one line: some three times the distance of two rays
// on a wall that is looked at straight on.
constexpr double kGap_px = 40;

// What the run's log says that was seen, frame by frame; a labelled frame that the run passed over is not judged.
FramePolylines polylines_of_log(const fs::path &run, const fs::path &recording, const NamedCamera &camera,
                                int32_t index, FramePolylines *truth) {
  const auto stamps = load_frame_stamps(recording, camera.name);
  FramePolylines out;
  for (const EdgePoints &points : load_edge_points(run)) {
    if (points.camera != index && points.camera >= 0) continue;
    const auto at = std::lower_bound(stamps.begin(), stamps.end(), std::pair<int64_t, int64_t>(points.t_ns, INT64_MIN));
    if (at != stamps.end() && at->first == points.t_ns)
      out[at->second] = picture_polylines(points, camera.camera, kGap_px * camera.camera.width / 1280);
  }
  if (out.empty()) throw Failure((run / "events.wmlog").string() + ": has no edge points of this camera");
  std::erase_if(*truth, [&](const auto &entry) { return !out.contains(entry.first); });
  return out;
}

}  // namespace

Figures evaluate_detector(const DetectorArguments &a) {
  const fs::path run = a.run, recording = a.recording, calibration = recording / "calibration.yaml",
                 labels = recording / "labels/edges.csv";
  if (!fs::exists(labels))
    throw Failure(labels.string() +
                  ": is not there; a detector is judged by labelled pictures (waymark simulate "
                  "writes them for its worlds)");
  const std::vector<NamedCamera> cameras = load_cameras(calibration);
  const NamedCamera &camera = choose_camera(cameras, a.camera, calibration);
  const fs::path detections = run / "detections" / (camera.name + "-edges.csv");
  FramePolylines truth = load_polylines(labels);
  if (!fs::exists(detections) && !fs::exists(run / "events.wmlog"))
    throw Failure(detections.string() + ": is not there, nor an events.wmlog: this run detected no edges");
  const FramePolylines detected =
      fs::exists(detections)
          ? load_polylines(detections)
          : polylines_of_log(run, recording, camera, static_cast<int32_t>(&camera - cameras.data()), &truth);

  DetectorMetric metric;
  metric.omega_px = 14.0 * camera.camera.width / 1920;
  metric.in_view = [&](const Eigen::Vector2d &pixel) {
    const auto floor = floor_point(camera.camera, pixel);
    if (!floor) return false;
    return a.view_m.empty() || (floor->x() >= a.view_m[0] && floor->x() <= a.view_m[1] && floor->y() >= a.view_m[2] &&
                                floor->y() <= a.view_m[3]);
  };
  return detector_figures(truth, detected, metric);
}

Figures evaluate_lines(const DetectorArguments &a) {
  constexpr double kWithin_rad = 0.5 * M_PI / 180;  // half of what separates a line from its sides
  const fs::path run = a.run, recording = a.recording, calibration = recording / "calibration.yaml",
                 labels = recording / "labels/lines.csv";
  if (!fs::exists(labels))
    throw Failure(labels.string() +
                  ": is not there; a detector is judged by labelled pictures (waymark simulate writes them for halls)");
  const std::vector<NamedCamera> cameras = load_cameras(calibration);
  const NamedCamera &camera = choose_camera(cameras, a.camera, calibration);
  wm_camera own{};
  const LineSightings seen = load_line_sightings(run, camera.name, &own);
  std::map<int64_t, std::vector<LabelledLine>> truth = load_line_labels(labels);
  std::map<int64_t, int64_t> stamps;
  for (const auto &[t_ns, frame] : load_frame_stamps(recording, camera.name)) stamps[frame] = t_ns;
  // A labelled picture that the run passed over is not judged.
  std::erase_if(truth, [&](const auto &entry) {
    const auto stamp = stamps.find(entry.first);
    return stamp == stamps.end() || !seen.contains(stamp->second);
  });
  if (truth.empty()) throw Failure(run.string() + ": the run processed no labelled picture");
  mark_contrast(recording, own, static_cast<int32_t>(&camera - cameras.data()), stamps, &truth);
  std::vector<LinePicture> pictures;
  for (const auto &[frame, lines] : truth) pictures.push_back({lines, seen.at(stamps.at(frame))});
  return line_figures(pictures, kWithin_rad);
}

}  // namespace wm::tools
