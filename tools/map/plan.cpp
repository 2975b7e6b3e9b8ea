// SPDX-License-Identifier: Apache-2.0
// Plans read.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "common/failure.h"
#include "map/layers.h"
#include "waymark/map.h"

namespace wm::tools {

Plan plan_from_picture(const GreyPicture &picture, int walls_below) {
  Plan out;
  out.picture = picture;
  // Stretched about the threshold, so that half a pixel of wall stays half a pixel of wall.
  for (uint8_t &v : out.picture.pixels) v = static_cast<uint8_t>(std::clamp(128 + (v - walls_below), 0, 255));
  return out;
}

Plan plan_from_occupancy(const std::string &map_yaml) {
  if (!std::filesystem::exists(map_yaml)) throw Failure(map_yaml + ": there is no such file", kUsage);
  wm_raster place{};
  int8_t *read = nullptr;
  wm_error error{};
  const wm_status status = wm_map_cells_load(map_yaml.c_str(), &place, &read, &error);
  const std::unique_ptr<int8_t, void (*)(void *)> cells(read, std::free);
  if (status != WM_OK) throw Failure(error.text);
  Plan out;
  out.resolution_m = place.resolution_m;
  out.origin_x_m = place.origin_x_m, out.origin_y_m = place.origin_y_m, out.origin_yaw_rad = place.origin_yaw_rad;
  const size_t count = static_cast<size_t>(place.width_px) * place.height_px;
  out.picture = {static_cast<int>(place.width_px), static_cast<int>(place.height_px), std::vector<uint8_t>(count)};
  out.unknown.resize(count);
  for (size_t i = 0; i < count; i++) {
    out.unknown[i] = cells.get()[i] == WM_CELL_UNKNOWN ? 1 : 0;
    out.picture.pixels[i] = cells.get()[i] == WM_CELL_OCCUPIED ? 0 : 255;
  }
  return out;
}

}  // namespace wm::tools
