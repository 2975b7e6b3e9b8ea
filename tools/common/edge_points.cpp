// SPDX-License-Identifier: Apache-2.0
#include "common/edge_points.h"

#include <algorithm>

#include "common/csv.h"
#include "common/event_log.h"

namespace wm::tools {

std::vector<EdgePoints> load_edge_points(const std::filesystem::path &run) {
  EventLog log(run);
  std::vector<EdgePoints> out;
  while (const wm_event *next = log.next()) {
    const wm_event &event = *next;
    if (event.kind != WM_EVENT_POINTS) continue;
    const wm_points &points = event.as.points;
    EdgePoints one{event.t_ns, points.camera, {}, {}};
    for (uint32_t i = 0; i < points.count && i < WM_POINTS_MAX; i++) {
      one.points.emplace_back(points.x_m[i], points.y_m[i]);
      one.sigma_m.push_back(static_cast<double>(points.sigma_m[i]));
    }
    out.push_back(std::move(one));
  }
  return out;
}

std::vector<std::vector<Eigen::Vector2d>> picture_polylines(const EdgePoints &points, const images::Camera &camera,
                                                            double gap_px) {
  std::vector<std::vector<Eigen::Vector2d>> out;
  for (const Eigen::Vector2d &point : points.points) {
    const std::optional<Eigen::Vector2d> pixel = floor_pixel(camera, point);
    if (!pixel) continue;
    if (out.empty() || (*pixel - out.back().back()).norm() > gap_px) out.emplace_back();
    out.back().push_back(*pixel);
  }
  std::erase_if(out, [](const std::vector<Eigen::Vector2d> &line) { return line.size() < 2; });
  return out;
}

std::vector<std::pair<int64_t, int64_t>> load_frame_stamps(const std::filesystem::path &recording,
                                                           const std::string &camera) {
  const Csv csv = Csv::load(recording / "video" / (camera + ".csv"));
  const size_t frame = csv.need("frame"), t = csv.need("t_ns");
  std::vector<std::pair<int64_t, int64_t>> out;
  for (size_t row = 0; row < csv.rows(); row++) out.emplace_back(csv.integer(row, t), csv.integer(row, frame));
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace wm::tools
