// SPDX-License-Identifier: Apache-2.0
// What the map knows of how its landmarks look: each is photographed once, from straight ahead, at the beginning.
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "render/sensor.h"
#include "simulate/film.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

using images::Vec3;

constexpr double kLong_px = 128, kShort_px = 40;  // the longer side has at least the first, the shorter one the second
constexpr double kExposure_s = 0.004;
constexpr uint64_t kPhotoSeed = 0x70686f746fULL;

struct Photo {
  images::Camera camera;
  images::Pose T_map_body;
  double width_m, height_m, yaw_rad;
};

// A camera whose picture the panel just fills.
Photo straight_ahead(const World::Panel &panel) {
  const Vec3 right = panel.corners[1] - panel.corners[0], down = panel.corners[3] - panel.corners[0];
  Photo p;
  p.width_m = right.norm();
  p.height_m = down.norm();
  p.yaw_rad = wm::atan2(right.y(), right.x());
  const double longer = std::max(p.width_m, p.height_m), shorter = std::min(p.width_m, p.height_m);
  const double scale = std::max(kLong_px / longer, kShort_px / shorter), away_m = 0.6 + 1.2 * longer;
  p.camera.model = images::Model::pinhole_radtan;
  p.camera.width = static_cast<int>(std::lround(scale * p.width_m));
  p.camera.height = static_cast<int>(std::lround(scale * p.height_m));
  p.camera.intrinsics = {p.camera.width * away_m / p.width_m, p.camera.height * away_m / p.height_m,
                         0.5 * (p.camera.width - 1), 0.5 * (p.camera.height - 1)};
  p.T_map_body = images::Pose::Identity();
  p.T_map_body.linear().col(0) = -panel.normal;
  p.T_map_body.linear().col(1) = -right.normalized();
  p.T_map_body.linear().col(2) = -down.normalized();
  p.T_map_body.translation() = panel.middle() + away_m * panel.normal;
  return p;
}

bool take(const Film &film, const Photo &photo, uint64_t seed, images::Picture8 &out, std::string &problem) {
  render::Quality quality;
  quality.psf_sigma_px = film.scenario.pictures.psf_sigma_px;
  const auto renderer = render::Renderer::make(film.world->scene, photo.camera, quality, seed, true, problem);
  if (!renderer) return false;
  render::Shot shot;
  shot.exposure_ns = std::llround(kExposure_s * 1e9);
  shot.T_map_base = [&photo](double) { return photo.T_map_body; };
  render::Image image;
  renderer->render(shot, image);
  render::SensorModel model;
  model.response_power = film.scenario.pictures.response_power;
  model.vignetting = 0;
  render::AutoExposure exposure(film.scenario.pictures.brightness, 1, 0, seed);
  const render::Sensor sensor(model, seed, photo.camera.width, photo.camera.height,
                              {photo.camera.intrinsics[2], photo.camera.intrinsics[3]});
  images::Picture8 colour;
  sensor.develop(image, {exposure.next(image, 0), 1}, 0, colour);
  out = {colour.width, colour.height, 1, {}};
  for (size_t i = 0; i + 2 < colour.bytes.size(); i += 3)  // as JPEG's brightness
    out.bytes.push_back(static_cast<uint8_t>(
        std::lround(0.299 * colour.bytes[i] + 0.587 * colour.bytes[i + 1] + 0.114 * colour.bytes[i + 2])));
  return true;
}

}  // namespace

wm_status write_appearances(const Film &film, const std::string &dir, wm_error *err) {
  if (!film.world->has(World::Labels::landmarks)) return WM_OK;
  const std::string folder = dir + "/landmarks";
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) return wm_fail(err, WM_IO, "%s: cannot create this folder: %s", folder.c_str(), failed.message().c_str());
  std::string rows = "id,picture,width_m,height_m,yaw_rad\n";
  for (const World::Panel &panel : film.world->panels) {
    const Photo photo = straight_ahead(panel);
    images::Picture8 picture;
    std::string problem;
    const std::string name = std::to_string(panel.id) + ".png";
    if (!take(film, photo, kPhotoSeed + static_cast<uint64_t>(panel.id), picture, problem) ||
        !images::write_png(folder + "/" + name, picture, problem))
      return wm_fail(err, WM_IO, "%s", problem.c_str());
    char row[160];
    std::snprintf(row, sizeof row, "%d,%s,%.4f,%.4f,%.6f\n", panel.id, name.c_str(), photo.width_m, photo.height_m,
                  photo.yaw_rad);
    rows += row;
  }
  const std::string file = folder + "/appearance.csv";
  FILE *out = std::fopen(file.c_str(), "w");
  const bool written = out && std::fwrite(rows.data(), 1, rows.size(), out) == rows.size();
  if (!out || std::fclose(out) != 0 || !written) return wm_fail(err, WM_IO, "%s: can't write", file.c_str());
  return WM_OK;
}

}  // namespace wm::sim
