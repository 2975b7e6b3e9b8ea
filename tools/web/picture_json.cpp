// SPDX-License-Identifier: Apache-2.0
// A picture and what is drawn over it.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "report/frames.h"
#include "report/png.h"
#include "web/pictures.h"

namespace wm::tools {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Json = nlohmann::json;

constexpr int kWidth_px = 960;                       // a larger picture is made smaller by a whole number
constexpr double kApart = 1.5 / 480;                 // of a picture's width: dots of the map nearer than this are one
constexpr double kLandmarks_m = 30;                  // landmarks farther away are not drawn
constexpr double kFrom_rad = -0.05, kTo_rad = 0.30;  // elevations between which a bearing without one is drawn
constexpr int kPieces = 8;

Json pixel_json(const Vector2d &p) { return {std::round(p.x() * 10) / 10, std::round(p.y() * 10) / 10}; }

// Draws by the camera's model; nothing where it is not known.
class Sketch {
 public:
  Sketch(const NamedCamera *camera, const SensorMount &mount) : camera_(camera), mount_(mount) {}

  [[nodiscard]] std::optional<Vector2d> pixel(const Vector3d &base) const {
    Vector2d out;
    if (camera_ == nullptr) return std::nullopt;
    const images::Camera &c = camera_->camera;
    if (!images::project(c, images::T_base_optical(c).inverse() * base, out)) return std::nullopt;
    if (out.x() < 0 || out.y() < 0 || out.x() > c.width || out.y() > c.height) return std::nullopt;
    return out;
  }
  [[nodiscard]] Vector3d eye() const { return mount_.T_base.translation(); }
  [[nodiscard]] Vector3d from_sensor(const Vector3d &p) const { return mount_.T_base * p; }

  // A bearing without elevation: an upright line.
  [[nodiscard]] Json upright(double bearing_rad) const {
    Json line = Json::array();
    for (int i = 0; i <= kPieces; i++) {
      const double elevation = kFrom_rad + (kTo_rad - kFrom_rad) * i / kPieces;
      if (const auto at = pixel(eye() + mount_.direction(bearing_rad, elevation))) line.push_back(pixel_json(*at));
    }
    return line;
  }
  [[nodiscard]] std::optional<Vector2d> along(double bearing_rad, double elevation_rad) const {
    return pixel(eye() + mount_.direction(bearing_rad, elevation_rad));
  }
  [[nodiscard]] const images::Camera *camera() const { return camera_ != nullptr ? &camera_->camera : nullptr; }

 private:
  const NamedCamera *camera_;
  SensorMount mount_;
};

struct Found {
  Json dots = Json::array(), lines = Json::array(), marks = Json::array();
};

void add_sighting(const wm_sighting &s, const Sketch &sketch, Found *found) {
  if (!std::isfinite(s.bearing_rad)) return;
  if (!std::isfinite(s.elevation_rad)) {
    found->lines.push_back(sketch.upright(s.bearing_rad));
    return;
  }
  if (const auto at = sketch.along(s.bearing_rad, s.elevation_rad))
    found->marks.push_back({at->x(), at->y(), s.landmark_id});
}

Found found_in(const LookedAt &looked, const Sketch &sketch) {
  Found out;
  for (const wm_event &event : looked.events) {
    if (event.kind == WM_EVENT_SIGHTING) add_sighting(event.as.sighting, sketch, &out);
    if (event.kind == WM_EVENT_MARKER) {
      const wm_marker &m = event.as.marker;
      if (const auto at = sketch.pixel(sketch.from_sensor({m.p_m[0], m.p_m[1], m.p_m[2]})))
        out.marks.push_back({at->x(), at->y(), m.id});
    }
    if (event.kind == WM_EVENT_STEREO && std::isfinite(event.as.stereo.left_px[0]))
      out.marks.push_back({event.as.stereo.left_px[0], event.as.stereo.left_px[1], event.as.stereo.id});
    if (event.kind != WM_EVENT_POINTS || sketch.camera() == nullptr) continue;
    const wm_points &points = event.as.points;
    for (uint32_t i = 0; i < std::min<uint32_t>(points.count, WM_POINTS_MAX); i++)
      if (const auto at = floor_pixel(*sketch.camera(), {points.x_m[i], points.y_m[i]}))
        out.dots.push_back(pixel_json(*at));
  }
  return out;
}

// Where the map's edges should be, by the pose.
Json edges_expected(const MapEdges &edges, const Pose &pose, const Sketch &sketch, int width_px) {
  Json out = Json::array();
  std::set<std::pair<int, int>> taken;
  const double apart_px = std::max(kApart * width_px, 0.5);
  const Vector3d eye = pose.p_m + pose.q * sketch.eye();
  for (const Vector2d &edge : edges.seen_from(eye.head<2>())) {
    const Vector3d base = pose.q.conjugate() * Vector3d(edge.x() - pose.p_m.x(), edge.y() - pose.p_m.y(), 0);
    const auto at = floor_pixel(*sketch.camera(), base.head<2>());
    if (at && taken.emplace(static_cast<int>(at->x() / apart_px), static_cast<int>(at->y() / apart_px)).second)
      out.push_back(pixel_json(*at));
  }
  return out;
}

Json landmarks_expected(const std::vector<wm_landmark> &landmarks, const Pose &pose, const Sketch &sketch) {
  Json out = Json::array();
  for (const wm_landmark &l : landmarks) {
    const Vector3d there(l.p_m[0], l.p_m[1], std::isfinite(l.p_m[2]) ? l.p_m[2] : pose.p_m.z());
    const Vector3d base = pose.q.conjugate() * (there - pose.p_m);
    if (!base.allFinite() || base.norm() > kLandmarks_m) continue;
    if (const auto at = sketch.pixel(base)) out.push_back({at->x(), at->y(), l.id});
  }
  return out;
}

// So that at most about kWidth_px columns are left.
std::string jpeg_of(const LookedAt &looked) {
  const uint32_t times = std::max<uint32_t>(1, (looked.head.width_px + kWidth_px / 2) / kWidth_px);
  return small_jpeg(looked.grey.data(), looked.head.width_px, looked.head.width_px, looked.head.height_px, times);
}

}  // namespace

std::optional<LookedAt> read_picture(const wm_picture_head &head, const std::vector<uint8_t> &body) {
  if (wm_picture_body_bytes(&head) != body.size()) return std::nullopt;
  LookedAt out{head, {}, {}};
  size_t at = 0;
  for (uint32_t i = 0; i < head.event_count; i++) {
    wm_event event;
    size_t used = 0;
    if (wm_event_decode(body.data() + at, head.event_bytes - at, &event, &used) != WM_OK) return std::nullopt;
    at += used;
    out.events.push_back(event);
  }
  if (at != head.event_bytes) return std::nullopt;
  out.grey.assign(body.begin() + static_cast<std::ptrdiff_t>(at), body.end());
  return out;
}

std::string picture_json(const LookedAt &looked, const WebSite &site, const MapEdges *edges, const Around &around,
                         int64_t number) {
  const wm_picture_head &head = looked.head;
  const auto camera = std::find_if(site.cameras.begin(), site.cameras.end(), [&](const NamedCamera &c) {
    return c.name == head.camera && c.camera.width == static_cast<int>(head.width_px) &&
           c.camera.height == static_cast<int>(head.height_px);
  });
  const Sketch sketch(camera == site.cameras.end() ? nullptr : &*camera, site.sensor(head.camera));
  const Found found = found_in(looked, sketch);
  Json out = {{"number", number},
              {"source", head.source},
              {"sources", head.source_count},
              {"name", head.source_name},
              {"camera", head.camera},
              {"t_ns", head.t_ns},
              {"missed", head.missed},
              {"width", head.width_px},
              {"height", head.height_px},
              {"is_calibrated", sketch.camera() != nullptr},
              {"has_pose", around.pose.has_value()},
              {"dots", found.dots},
              {"lines", found.lines},
              {"marks", found.marks},
              {"map_dots", Json::array()},
              {"map_marks", Json::array()}};
  if (around.pose && sketch.camera() != nullptr) {
    if (edges != nullptr)
      out["map_dots"] = edges_expected(*edges, *around.pose, sketch, static_cast<int>(head.width_px));
    out["map_marks"] = landmarks_expected(around.landmarks, *around.pose, sketch);
  }
  if (head.width_px > 0 && head.height_px > 0) out["jpeg"] = base64(jpeg_of(looked));
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace wm::tools
