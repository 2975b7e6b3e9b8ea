// SPDX-License-Identifier: Apache-2.0
#include "eval/detector_command.h"

#include "common/cameras.h"
#include "common/failure.h"
#include "eval/detector.h"

namespace wm::tools {

namespace fs = std::filesystem;

Figures evaluate_detector(const DetectorArguments &a) {
  const fs::path calibration = fs::path(a.recording) / "calibration.yaml",
                 labels = fs::path(a.recording) / "labels/edges.csv";
  if (!fs::exists(labels))
    throw Failure(labels.string() +
                  ": is not there; a detector is judged by labelled pictures (waymark simulate "
                  "writes them for its worlds)");
  const std::vector<NamedCamera> cameras = load_cameras(calibration);
  const NamedCamera &camera = choose_camera(cameras, a.camera, calibration);
  const fs::path detections = fs::path(a.run) / "detections" / (camera.name + "-edges.csv");
  if (!fs::exists(detections))
    throw Failure(detections.string() + ": is not there: this run wrote no detections of that camera");

  DetectorMetric metric;
  metric.omega_px = 14.0 * camera.camera.width / 1920;
  metric.in_view = [&](const Eigen::Vector2d &pixel) {
    const auto floor = floor_point(camera.camera, pixel);
    if (!floor) return false;
    return a.view_m.empty() || (floor->x() >= a.view_m[0] && floor->x() <= a.view_m[1] && floor->y() >= a.view_m[2] &&
                                floor->y() <= a.view_m[3]);
  };
  return detector_figures(load_polylines(labels), load_polylines(detections), metric);
}

}  // namespace wm::tools
