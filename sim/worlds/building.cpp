// SPDX-License-Identifier: Apache-2.0
// A building of one's own: a polyline plan, or the map of a robot that has been there.
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <vector>

#include "waymark/internal/math/elementary.hpp"
#include "waymark/map.h"
#include "waymark/yaml.h"
#include "worlds/plan.h"
#include "worlds/raster.h"

namespace wm::sim {
namespace {

constexpr size_t kFacesMax = 20000;
constexpr int kDarkBelow = 90;  // grey level: an occupancy above 0.65, map_server's default

// Walls of a picture of a plan: where it is dark, or of map_server's map what is occupied. `place`: resolution and
// origin.
wm_status from_picture(const GreyImage &grey, const wm_raster &place, int occupied_below, const std::string &file,
                       double ceiling_m, Plan &out, wm_error *err) {
  out = plan_of_image(grey, place.resolution_m, {0, 0}, occupied_below, ceiling_m);
  if (out.faces.empty())
    return wm_fail(err, WM_BAD_CONFIG, "%s: no pixel is occupied; are `negate` and the thresholds right?",
                   file.c_str());
  if (out.faces.size() > kFacesMax)
    return wm_fail(err, WM_BAD_CONFIG, "%s: %zu walls, more than %zu: clean such a rough map first", file.c_str(),
                   out.faces.size(), kFacesMax);
  const auto turned = wm::sincos(place.origin_yaw_rad);
  for (Face &f : out.faces)
    for (Point *p : {&f.a, &f.b})
      *p = {place.origin_x_m + turned.cos * p->x_m - turned.sin * p->y_m,
            place.origin_y_m + turned.sin * p->x_m + turned.cos * p->y_m};
  return WM_OK;
}

// Unknown cells are no walls.
wm_status from_map(const std::string &path, double ceiling_m, Plan &out, wm_error *err) {
  wm_raster place{};
  int8_t *read = nullptr;
  const wm_status status = wm_map_cells_load(path.c_str(), &place, &read, err);
  const std::unique_ptr<int8_t, decltype(&std::free)> cells(read, std::free);
  if (status != WM_OK) return status;
  const size_t count = static_cast<size_t>(place.width_px) * place.height_px;
  GreyImage grey{static_cast<int>(place.width_px), static_cast<int>(place.height_px), std::vector<uint8_t>(count)};
  for (size_t i = 0; i < count; i++) grey.pixels[i] = cells.get()[i] == WM_CELL_OCCUPIED ? 0 : 255;
  return from_picture(grey, place, 128, path, ceiling_m, out, err);
}

bool is_picture(const std::string &path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  return ending == ".png" || ending == ".PNG" || ending == ".pgm" || ending == ".PGM";
}

}  // namespace

wm_status load_building(const std::string &path, double ceiling_m, double resolution_m, Plan &out, wm_error *err) {
  if (is_picture(path)) {
    if (!(resolution_m > 0))
      return wm_fail(err, WM_BAD_CONFIG,
                     "world.plan: %s is a picture: `resolution_m`, metres of a pixel, is needed beside it",
                     path.c_str());
    GreyImage grey;
    wm_raster place{};
    place.resolution_m = resolution_m;
    const wm_status status = read_grey(path, grey, err);
    return status == WM_OK ? from_picture(grey, place, kDarkBelow, path, ceiling_m, out, err) : status;
  }
  wm_yaml *doc = nullptr;
  if (const wm_status s = wm_yaml_load(path.c_str(), &doc, err); s != WM_OK) return s;
  const std::unique_ptr<wm_yaml, decltype(&wm_yaml_free)> owner(doc, wm_yaml_free);
  const wm_yaml_node root = wm_yaml_root(doc), image = wm_yaml_get(&root, "image"),
                     format = wm_yaml_get(&root, "format");
  if (wm_yaml_there(&image)) return from_map(path, ceiling_m, out, err);
  if (!wm_yaml_there(&format))
    return wm_yaml_fail(&root, err, "neither a plan (`format: waymark-plan/1`) nor a ROS map (`image: FILE`)");
  return load_plan(path, out, err);
}

}  // namespace wm::sim
