// SPDX-License-Identifier: Apache-2.0
// A building of one's own: a polyline plan, or the map of a robot that has been there.
#include <cmath>
#include <filesystem>
#include <memory>

#include "waymark/internal/math/elementary.hpp"
#include "waymark/yaml.h"
#include "worlds/plan.h"
#include "worlds/raster.h"

namespace wm::sim {
namespace {

constexpr size_t kFacesMax = 20000;

// The keys of ROS map_server that matter here.
struct RosMap {
  std::string image;
  double resolution_m = 0, origin[3] = {0, 0, 0}, occupied = 0.65;
  int negate = 0;
};

wm_status read_ros(const wm_yaml_node &root, RosMap &out, wm_error *err) {
  const auto get = [&](const char *key) { return wm_yaml_get(&root, key); };
  const wm_yaml_node image = get("image"), resolution = get("resolution"), origin = get("origin"),
                     occupied = get("occupied_thresh"), negate = get("negate");
  char name[512];
  if (!wm_yaml_there(&resolution)) return wm_yaml_fail(&root, err, "`resolution`, metres of a pixel, is missing");
  wm_status status = wm_yaml_string(&image, name, sizeof name, err);
  if (status == WM_OK) status = wm_yaml_f64(&resolution, 1e-4, 10, &out.resolution_m, err);
  if (status == WM_OK && wm_yaml_there(&origin)) status = wm_yaml_f64_list(&origin, 3, 3, out.origin, nullptr, err);
  if (status == WM_OK && wm_yaml_there(&occupied)) status = wm_yaml_f64(&occupied, 0, 1, &out.occupied, err);
  int64_t flag = 0;
  if (status == WM_OK && wm_yaml_there(&negate)) status = wm_yaml_i64(&negate, 0, 1, &flag, err);
  out.negate = static_cast<int>(flag);
  if (status == WM_OK) out.image = name;
  return status;
}

wm_status from_map(const RosMap &map, const std::string &path, double ceiling_m, Plan &out, wm_error *err) {
  const std::filesystem::path image = map.image;
  GreyImage grey;
  const std::string file = (image.is_absolute() ? image : std::filesystem::path(path).parent_path() / image).string();
  if (const wm_status s = read_grey(file, grey, err); s != WM_OK) return s;
  if (map.negate)
    for (uint8_t &pixel : grey.pixels) pixel = static_cast<uint8_t>(255 - pixel);
  // Occupied: (255 - grey) / 255 above the threshold. Unknown pixels, between both thresholds, are no walls.
  const int occupied_below = static_cast<int>(std::ceil(255 * (1 - map.occupied)));
  out = plan_of_image(grey, map.resolution_m, {0, 0}, occupied_below, ceiling_m);
  if (out.faces.empty())
    return wm_fail(err, WM_BAD_CONFIG, "%s: no pixel is occupied (darker than grey %d); is `negate` right?",
                   file.c_str(), occupied_below);
  if (out.faces.size() > kFacesMax)
    return wm_fail(err, WM_BAD_CONFIG, "%s: %zu walls, more than %zu: clean such a rough map first", file.c_str(),
                   out.faces.size(), kFacesMax);
  const auto turned = wm::sincos(map.origin[2]);
  for (Face &f : out.faces)
    for (Point *p : {&f.a, &f.b})
      *p = {map.origin[0] + turned.cos * p->x_m - turned.sin * p->y_m,
            map.origin[1] + turned.sin * p->x_m + turned.cos * p->y_m};
  return WM_OK;
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
    RosMap map;
    map.image = std::filesystem::absolute(path).string();
    map.resolution_m = resolution_m;
    return from_map(map, path, ceiling_m, out, err);
  }
  wm_yaml *doc = nullptr;
  if (const wm_status s = wm_yaml_load(path.c_str(), &doc, err); s != WM_OK) return s;
  const std::unique_ptr<wm_yaml, decltype(&wm_yaml_free)> owner(doc, wm_yaml_free);
  const wm_yaml_node root = wm_yaml_root(doc), image = wm_yaml_get(&root, "image"),
                     format = wm_yaml_get(&root, "format");
  if (wm_yaml_there(&image)) {
    RosMap map;
    const wm_status s = read_ros(root, map, err);
    return s == WM_OK ? from_map(map, path, ceiling_m, out, err) : s;
  }
  if (!wm_yaml_there(&format))
    return wm_yaml_fail(&root, err, "neither a plan (`format: waymark-plan/1`) nor a ROS map (`image: FILE`)");
  return load_plan(path, out, err);
}

}  // namespace wm::sim
