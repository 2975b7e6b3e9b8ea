// SPDX-License-Identifier: Apache-2.0
#include "detect/sketch.h"

#include <algorithm>
#include <cmath>

#include "common/failure.h"
#include "detect/polylines.h"
#include "images/picture.h"
#include "waymark/internal/sensors/bearing.hpp"
#include "waymark/internal/sensors/mounting.hpp"

namespace wm::tools {
namespace {

constexpr images::Colour kFound(1.F, 0.82F, 0.1F), kJoined(1.F, 0.35F, 0.2F), kShade(0.F, 0.F, 0.F);
constexpr double kUpright_rad = 1.2;  // a bearing without elevation is drawn so far up and down
constexpr int kPieces = 48, kRing = 24;
constexpr double kUsualWidth_px = 1280;  // lines and letters are drawn for this width, and grow with the picture

double scale_of(const images::Picture &p) { return std::max(0.6, p.width / kUsualWidth_px); }

void label(const std::string &text, double u, double v, images::Picture *out) {
  const double height = 12 * scale_of(*out);
  images::draw_text(text.c_str(), u + 1.5, v + 1.5, height, kShade, *out);
  images::draw_text(text.c_str(), u, v, height, kFound, *out);
}

void stroke(const pixel &a, const pixel &b, const images::Colour &colour, images::Picture *out) {
  images::line(a.u, a.v, b.u, b.v, 2 * scale_of(*out), colour, *out);
}

void mark(const pixel &at, images::Picture *out) {
  const double r = 8 * scale_of(*out);
  stroke({at.u - r, at.v}, {at.u + r, at.v}, kFound, out);
  stroke({at.u, at.v - r}, {at.u, at.v + r}, kFound, out);
}

void draw_path(const std::vector<std::optional<pixel>> &path, images::Picture *out) {
  for (size_t i = 1; i < path.size(); i++)
    if (path[i - 1] && path[i]) stroke(*path[i - 1], *path[i], kFound, out);
}

}  // namespace

Sketch::Sketch(const wm_rig &rig, int32_t camera, double marker_m) : marker_m_(marker_m) {
  const wm_camera &mine = rig.cameras[camera];
  if (const char *why = mounted_camera_init(&camera_, mine); why != nullptr)
    throw Failure(std::string(mine.name) + ": " + why, kUsage);
  R_base_body_ = matrix_of_rpy(mine.mounting.rpy_rad);
  yaw_rad_ = mine.mounting.rpy_rad[2];
  steep_ = is_steep(mine);
  if (rig.stereo.left == camera && std::isfinite(rig.stereo.rectified_px[0]))
    std::copy_n(rig.stereo.rectified_px, 4, rectified_px_);
}

std::optional<pixel> Sketch::along(double bearing_rad, double elevation_rad) const {
  const double azimuth = bearing_rad + (steep_ ? yaw_rad_ : 0), across = std::cos(elevation_rad);
  const vec3 ray = {across * std::cos(azimuth), across * std::sin(azimuth), std::sin(elevation_rad)};
  pixel at{};
  if (!pixel_of(camera_, camera_.centre_m + (steep_ ? ray : R_base_body_ * ray), 0, &at)) return std::nullopt;
  return at;
}

std::optional<pixel> Sketch::of_sensor(const vec3 &point_m) const {
  pixel at{};
  if (!pixel_of(camera_, camera_.centre_m + R_base_body_ * point_m, 0, &at)) return std::nullopt;
  return at;
}

// Rays of the rectified picture have the left camera's axes.
std::optional<pixel> Sketch::of_rectified(const double px[2]) const {
  pixel at = {px[0], px[1]};
  if (!std::isfinite(px[0]) || !std::isfinite(px[1])) return std::nullopt;
  const double *r = rectified_px_;
  if (r[0] > 0 && !project(camera_.optics, {(px[0] - r[2]) / r[0], (px[1] - r[3]) / r[1], 1}, &at)) return std::nullopt;
  return at;
}

std::optional<pixel> Sketch::pixel_of_event(const wm_event &event) const {
  if (event.kind == WM_EVENT_SIGHTING) {
    const wm_sighting &s = event.as.sighting;
    if (!std::isfinite(s.bearing_rad) || !std::isfinite(s.elevation_rad)) return std::nullopt;
    return along(s.bearing_rad, s.elevation_rad);
  }
  if (event.kind == WM_EVENT_MARKER) return of_sensor(vec_of(event.as.marker.p_m));
  if (event.kind == WM_EVENT_STEREO) return of_rectified(event.as.stereo.left_px);
  return std::nullopt;
}

std::vector<std::vector<pixel>> Sketch::polylines(const wm_event &event) const {
  return join_points(event.as.points, camera_);
}

void Sketch::draw_points(const wm_event &event, images::Picture *out) const {
  for (const auto &line : polylines(event))
    for (size_t i = 1; i < line.size(); i++) stroke(line[i - 1], line[i], kJoined, out);
  const wm_points &points = event.as.points;
  for (uint32_t i = 0; i < std::min<uint32_t>(points.count, WM_POINTS_MAX); i++) {
    pixel at{};
    const vec3 place = {static_cast<double>(points.x_m[i]), static_cast<double>(points.y_m[i]), 0};
    if (pixel_of(camera_, place, 0, &at)) images::fill_disc(at.u, at.v, 2 * scale_of(*out), kFound, *out);
  }
}

void Sketch::draw_sighting(const wm_sighting &s, images::Picture *out) const {
  if (!std::isfinite(s.bearing_rad)) return;
  const std::string name = s.landmark_id >= 0 ? std::to_string(s.landmark_id) : "";
  if (std::isfinite(s.elevation_rad)) {
    const auto at = along(s.bearing_rad, s.elevation_rad);
    if (!at) return;
    mark(*at, out);
    label(name, at->u + 10 * scale_of(*out), at->v - 4, out);
    return;
  }
  std::vector<std::optional<pixel>> path;
  for (int i = 0; i <= kPieces; i++) path.push_back(along(s.bearing_rad, kUpright_rad * (2.0 * i / kPieces - 1)));
  draw_path(path, out);
  std::optional<pixel> end;
  for (const auto &at : path)
    if (at && at->v < out->height - 20) {
      end = at;
      break;
    }
  if (end) label(name, end->u + 4, end->v - 4, out);
}

// A ring of half the marker's width around its middle, across the line of sight.
void Sketch::draw_marker(const wm_marker &m, images::Picture *out) const {
  const vec3 middle = vec_of(m.p_m);
  const auto at = of_sensor(middle);
  if (!at) return;
  const double away_m = length(middle);
  const vec3 up = std::fabs(middle.z) < 0.9 * away_m ? vec3{0, 0, 1} : vec3{1, 0, 0};
  vec3 right = cross(up, middle);
  right = (1 / length(right)) * right;
  const vec3 above = (1 / away_m) * cross(middle, right);
  std::vector<std::optional<pixel>> ring;
  for (int i = 0; i <= kRing; i++) {
    const double angle = 2 * M_PI * i / kRing, r = 0.5 * marker_m_;
    ring.push_back(of_sensor(middle + (r * std::cos(angle)) * right + (r * std::sin(angle)) * above));
  }
  draw_path(ring, out);
  mark(*at, out);
  label(std::to_string(m.id), at->u + 10 * scale_of(*out), at->v - 4, out);
}

void Sketch::draw_stereo(const wm_stereo &point, images::Picture *out) const {
  const auto at = of_rectified(point.left_px);
  const double other_px[2] = {point.right_px[0], point.left_px[1]};
  if (const auto other = of_rectified(other_px); at && other) stroke(*at, *other, kJoined, out);
  if (at) images::fill_disc(at->u, at->v, 3 * scale_of(*out), kFound, *out);
}

images::Picture8 Sketch::draw(const wm_frame &frame, const std::vector<wm_event> &events,
                              const std::string &caption) const {
  const auto width = static_cast<int>(frame.width_px), height = static_cast<int>(frame.height_px);
  images::Picture p(width, height, 3);
  for (int y = 0; y < height; y++)
    for (int x = 0; x < width; x++)
      for (int c = 0; c < 3; c++)
        p.at(x, y, c) = static_cast<float>(frame.grey[static_cast<size_t>(y) * frame.stride_bytes + x]) / 255.F;
  for (const wm_event &event : events) {
    if (event.kind == WM_EVENT_POINTS) draw_points(event, &p);
    if (event.kind == WM_EVENT_SIGHTING) draw_sighting(event.as.sighting, &p);
    if (event.kind == WM_EVENT_MARKER) draw_marker(event.as.marker, &p);
    if (event.kind == WM_EVENT_STEREO) draw_stereo(event.as.stereo, &p);
  }
  label(caption, 10, 10 + 14 * scale_of(p), &p);
  images::Picture8 out{width, height, 3, {}};
  out.bytes.reserve(p.values.size());
  for (const float value : p.values)
    out.bytes.push_back(static_cast<uint8_t>(std::lround(255 * std::clamp(value, 0.F, 1.F))));
  return out;
}

}  // namespace wm::tools
