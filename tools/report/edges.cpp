// SPDX-License-Identifier: Apache-2.0
#include "report/edges.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <utility>

#include "common/cameras.h"
#include "common/csv.h"
#include "common/edge_points.h"
#include "common/failure.h"
#include "common/map_edges.h"
#include "report/bird.h"
#include "report/data.h"
#include "report/picture.h"
#include "report/png.h"
#include "waymark/map.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kLayerSide_px = 1600;  // of the layer in the page, at most
constexpr uint32_t kLayerColour = 0xcc5500;
constexpr size_t kClouds = 9;   // instants
constexpr double kGap_px = 40;  // at 1280 of width, as `waymark eval` joins them
constexpr double kDotsAbove_px = 2;
constexpr double kDotsApart = 1.5 / 480;  // of a picture's width

using Map = std::unique_ptr<wm_map, decltype(&wm_map_free)>;

// The edges for the picture of the drive.
Raster edge_layer(const MapEdges &edges, const wm_raster &raster) {
  const MapMask mask = edges.reduced(raster.edges, kLayerSide_px);
  return {mask_png(mask.cells, mask.width, mask.height, kLayerColour),
          mask.width * mask.times,
          mask.height * mask.times,
          raster.resolution_m,
          {raster.origin_x_m, raster.origin_y_m, raster.origin_yaw_rad}};
}

// In the picture, and in the view from above.
void mark_mapped(const MapEdges &edges, const images::Camera &camera, const Pose &pose, ReportFrame *frame) {
  const Eigen::Vector3d eye = pose.p_m + pose.q * camera.T_base_camera.translation();
  std::set<std::pair<int, int>> taken, taken_above;
  const double apart_px = kDotsApart * frame->width_px;
  for (const Eigen::Vector2d &edge : edges.seen_from(eye.head<2>())) {
    const Eigen::Vector3d base =
        pose.q.conjugate() * Eigen::Vector3d(edge.x() - pose.p_m.x(), edge.y() - pose.p_m.y(), 0);
    const auto pixel = floor_pixel(camera, base.head<2>());
    if (pixel && taken.emplace(static_cast<int>(pixel->x() / apart_px), static_cast<int>(pixel->y() / apart_px)).second)
      frame->edges_mapped.push_back(*pixel);
    const auto above = frame->floor.pixel(base.head<2>());
    if (above &&
        taken_above.emplace(static_cast<int>(above->x() / kDotsAbove_px), static_cast<int>(above->y() / kDotsAbove_px))
            .second)
      frame->floor.edges_mapped.push_back(*above);
  }
}

// A polyline of the picture, from above; what lies outside of the view cuts it.
void mark_seen(const std::vector<Eigen::Vector2d> &line, const images::Camera &camera, ReportFrame *frame) {
  bool goes_on = false;
  for (const Eigen::Vector2d &pixel : line) {
    const auto base = floor_point(camera, pixel);
    const auto above = base ? frame->floor.pixel(*base) : std::nullopt;
    if (above && !goes_on) frame->floor.lines_seen.emplace_back();
    if (above) frame->floor.lines_seen.back().push_back(*above);
    goes_on = above.has_value();
  }
}

void mark_frames(const std::vector<EdgePoints> &seen, const std::vector<NamedCamera> &cameras, const MapEdges *edges,
                 ReportData *data) {
  for (ReportFrame &frame : data->frames) {
    const auto camera =
        std::find_if(cameras.begin(), cameras.end(), [&](const NamedCamera &c) { return c.name == frame.camera; });
    if (camera == cameras.end()) continue;
    const auto index = static_cast<int32_t>(camera - cameras.begin());
    for (const EdgePoints &points : seen) {
      if (points.t_ns != frame.t_ns || (points.camera != index && points.camera >= 0)) continue;
      if (!frame.grey.empty() && frame.floor.jpeg.empty()) frame.floor = view_floor(camera->camera, frame.grey);
      for (const auto &line : picture_polylines(points, camera->camera, kGap_px * frame.width_px / 1280))
        mark_seen(line, camera->camera, &frame);
      for (const Eigen::Vector2d &point : points.points)
        if (const auto pixel = floor_pixel(camera->camera, point)) frame.edges_seen.push_back(*pixel);
    }
    const auto pose = pose_at(data->trajectory.poses, frame.t_ns, kMaxGapNs);
    if (pose && pose->oriented && edges != nullptr) mark_mapped(*edges, camera->camera, *pose, &frame);
  }
}

// The particles at the instants nearest to some that are spread along the way.
std::vector<Eigen::Vector2d> load_cloud(const fs::path &file, const std::vector<Pose> &poses) {
  std::vector<Eigen::Vector2d> out;
  if (!fs::exists(file)) return out;
  const Csv csv = Csv::load(file);
  const size_t t = csv.need("t_ns"), x = csv.need("x_m"), y = csv.need("y_m");
  std::vector<int64_t> stamps;
  for (size_t row = 0; row < csv.rows(); row++)
    if (const int64_t stamp = csv.integer(row, t); stamps.empty() || stamps.back() != stamp) stamps.push_back(stamp);
  if (stamps.empty()) return out;
  std::set<int64_t> wanted;
  for (const size_t i : spread_along(poses, kClouds)) {
    const int64_t at = poses[i].t_ns;
    wanted.insert(*std::min_element(stamps.begin(), stamps.end(),
                                    [at](int64_t a, int64_t b) { return std::llabs(a - at) < std::llabs(b - at); }));
  }
  for (size_t row = 0; row < csv.rows(); row++)
    if (wanted.contains(csv.integer(row, t))) out.emplace_back(csv.number(row, x), csv.number(row, y));
  return out;
}

}  // namespace

void load_edges(const fs::path &run, const fs::path &recording, ReportData *data) {
  const fs::path file = recording / "map" / "map.yaml";
  if (!fs::exists(file) || !fs::exists(run / "events.wmlog")) return;
  try {
    const std::vector<EdgePoints> seen = load_edge_points(run);
    if (seen.empty()) return;
    data->cloud = load_cloud(run / "particles.csv", data->trajectory.poses);
    wm_map *made = nullptr;
    wm_error err{};
    if (wm_map_load(file.c_str(), nullptr, nullptr, &made, &err) != WM_OK) throw Failure(err.text);
    const Map map(made, wm_map_free);
    const wm_raster *raster = wm_map_raster(map.get());
    const MapEdges edges(*raster);
    const bool drawn = raster->edges != nullptr;
    if (drawn) data->edge_layer = edge_layer(edges, *raster);
    if (!data->frames.empty())
      mark_frames(seen, load_cameras(recording / "calibration.yaml"), drawn ? &edges : nullptr, data);
  } catch (const Failure &problem) {
    data->notes.push_back(std::string("Edges are not shown: ") + problem.what());
  }
}

}  // namespace wm::tools
