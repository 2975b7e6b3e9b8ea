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
#include "report/bird.h"
#include "report/data.h"
#include "report/picture.h"
#include "report/png.h"
#include "waymark/map.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

constexpr double kReach_m = 8;       // edges further away are a pixel or two above the nearer ones
constexpr int kLayerSide_px = 1600;  // of the layer in the page, at most
constexpr uint32_t kLayerColour = 0xcc5500;
constexpr size_t kClouds = 9;   // instants
constexpr double kGap_px = 40;  // at 1280 of width, as `waymark eval` joins them
constexpr double kDotsAbove_px = 2;
constexpr double kDotsApart = 1.5 / 480;  // of a picture's width

using Map = std::unique_ptr<wm_map, decltype(&wm_map_free)>;

// The layers by places in the map.
class Edges {
 public:
  explicit Edges(const wm_raster &raster) : raster_(raster) {
    axes_ = Eigen::Rotation2Dd(raster.origin_yaw_rad).toRotationMatrix();
  }

  [[nodiscard]] Eigen::Vector2d centre(int column, int row) const {
    const double up = static_cast<double>(raster_.height_px) - row - 0.5;
    return Eigen::Vector2d(raster_.origin_x_m, raster_.origin_y_m) +
           axes_ * Eigen::Vector2d(column + 0.5, up) * raster_.resolution_m;
  }
  [[nodiscard]] Eigen::Vector2i cell(const Eigen::Vector2d &map) const {
    const Eigen::Vector2d at =
        axes_.transpose() * (map - Eigen::Vector2d(raster_.origin_x_m, raster_.origin_y_m)) / raster_.resolution_m;
    return {static_cast<int>(std::floor(at.x())),
            static_cast<int>(raster_.height_px) - 1 - static_cast<int>(std::floor(at.y()))};
  }
  [[nodiscard]] bool set(const uint8_t *layer, int column, int row) const {
    return column >= 0 && row >= 0 && column < static_cast<int>(raster_.width_px) &&
           row < static_cast<int>(raster_.height_px) &&
           layer[static_cast<size_t>(row) * raster_.width_px + static_cast<size_t>(column)] != 0;
  }
  // Floor, or so close to an edge that a ray along a wall may pass.
  [[nodiscard]] bool open(const Eigen::Vector2i &c) const {
    if (set(raster_.drivable, c.x(), c.y())) return true;
    for (int j = -1; j <= 1; j++)
      for (int i = -1; i <= 1; i++)
        if (set(raster_.edges, c.x() + i, c.y() + j)) return true;
    return false;
  }
  // No wall between the two; true of all where the map doesn't say where the floor is, or has none under `eye`.
  [[nodiscard]] bool sees(const Eigen::Vector2d &eye, const Eigen::Vector2d &edge) const {
    if (raster_.drivable == nullptr || !open(cell(eye))) return true;
    const int steps = static_cast<int>((edge - eye).norm() / raster_.resolution_m);
    for (int i = 1; i < steps; i++)
      if (!open(cell(eye + (edge - eye) * i / steps))) return false;
    return true;
  }
  // Edges within reach that a straight look from `eye` meets.
  [[nodiscard]] std::vector<Eigen::Vector2d> seen_from(const Eigen::Vector2d &eye) const {
    std::vector<Eigen::Vector2d> out;
    const Eigen::Vector2i middle = cell(eye);
    const int reach = static_cast<int>(kReach_m / raster_.resolution_m);
    for (int row = middle.y() - reach; row <= middle.y() + reach; row++)
      for (int column = middle.x() - reach; column <= middle.x() + reach; column++) {
        if (!set(raster_.edges, column, row)) continue;
        const Eigen::Vector2d edge = centre(column, row);
        if ((edge - eye).norm() <= kReach_m && sees(eye, edge)) out.push_back(edge);
      }
    return out;
  }

  // The layer for the picture of the drive: a pixel is an edge where one of those is that it stands for.
  [[nodiscard]] Raster layer() const {
    const int width = static_cast<int>(raster_.width_px), height = static_cast<int>(raster_.height_px);
    const int times = (std::max(width, height) + kLayerSide_px - 1) / kLayerSide_px;
    const int w = (width + times - 1) / times, h = (height + times - 1) / times;
    std::vector<uint8_t> mask(static_cast<size_t>(w) * static_cast<size_t>(h));
    const int spare = h * times - height;  // rows above the uppermost, so that the lower left corner stays
    for (int row = 0; row < height; row++)
      for (int column = 0; column < width; column++)
        if (set(raster_.edges, column, row))
          mask[static_cast<size_t>((row + spare) / times) * static_cast<size_t>(w) +
               static_cast<size_t>(column / times)] = 1;
    return {mask_png(mask, w, h, kLayerColour),
            w * times,
            h * times,
            raster_.resolution_m,
            {raster_.origin_x_m, raster_.origin_y_m, raster_.origin_yaw_rad}};
  }

 private:
  const wm_raster &raster_;
  Eigen::Matrix2d axes_;
};

// In the picture, and in the view from above.
void mark_mapped(const Edges &edges, const render::Camera &camera, const Pose &pose, ReportFrame *frame) {
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
void mark_seen(const std::vector<Eigen::Vector2d> &line, const render::Camera &camera, ReportFrame *frame) {
  bool goes_on = false;
  for (const Eigen::Vector2d &pixel : line) {
    const auto base = floor_point(camera, pixel);
    const auto above = base ? frame->floor.pixel(*base) : std::nullopt;
    if (above && !goes_on) frame->floor.lines_seen.emplace_back();
    if (above) frame->floor.lines_seen.back().push_back(*above);
    goes_on = above.has_value();
  }
}

void mark_frames(const std::vector<EdgePoints> &seen, const std::vector<NamedCamera> &cameras, const Edges *edges,
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
    const Edges edges(*raster);
    const bool drawn = raster->edges != nullptr;
    if (drawn) data->edge_layer = edges.layer();
    if (!data->frames.empty())
      mark_frames(seen, load_cameras(recording / "calibration.yaml"), drawn ? &edges : nullptr, data);
  } catch (const Failure &problem) {
    data->notes.push_back(std::string("Edges are not shown: ") + problem.what());
  }
}

}  // namespace wm::tools
