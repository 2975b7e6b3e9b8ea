// SPDX-License-Identifier: Apache-2.0
// The edge points that a run fused, from its event log, and where they were seen in the camera's pictures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/cameras.h"
#include "waymark/event.h"

namespace wm::tools {

struct EdgePoints {
  int64_t t_ns = 0;
  int32_t camera = -1;                  // index in calibration.yaml
  std::vector<Eigen::Vector2d> points;  // on the floor in base_link, in the detector's order (around the camera)
  std::vector<double> sigma_m;
};

// All of RUN/events.wmlog, in its order. Throws Failure: not there, damaged.
std::vector<EdgePoints> load_edge_points(const std::filesystem::path &run);

// The points in the picture, neighbours joined: a detector that gives points along rays has seen a line where the next
// ray's point is near by. Points further apart than `gap_px` begin a new polyline; single points are left out.
std::vector<std::vector<Eigen::Vector2d>> picture_polylines(const EdgePoints &points, const images::Camera &camera,
                                                            double gap_px);

// Frame of each stamp of a camera's pictures: REC/video/CAMERA.csv. Throws Failure.
std::vector<std::pair<int64_t, int64_t>> load_frame_stamps(const std::filesystem::path &recording,
                                                           const std::string &camera);

}  // namespace wm::tools
