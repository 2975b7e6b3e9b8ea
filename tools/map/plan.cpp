// SPDX-License-Identifier: Apache-2.0
// Plans read.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/failure.h"
#include "common/yaml.h"
#include "map/layers.h"

namespace wm::tools {

Plan plan_from_picture(const GreyPicture &picture, int walls_below) {
  Plan out;
  out.picture = picture;
  // Stretched about the threshold, so that half a pixel of wall stays half a pixel of wall.
  for (uint8_t &v : out.picture.pixels) v = static_cast<uint8_t>(std::clamp(128 + (v - walls_below), 0, 255));
  return out;
}

Plan plan_from_occupancy(const std::string &map_yaml) {
  namespace fs = std::filesystem;
  if (!fs::exists(map_yaml)) throw Failure(map_yaml + ": there is no such file", kUsage);
  const Yaml yaml(map_yaml);
  const auto number = [&](const char *key, double fallback) {
    const std::string text = yaml.text(key);
    if (text.empty()) return fallback;
    char *end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (*end != '\0' || !std::isfinite(value))
      throw Failure(map_yaml + ": " + key + ": '" + text + "' is not a number");
    return value;
  };
  const std::string image = yaml.text("image");
  if (image.empty()) throw Failure(map_yaml + ": image: the picture of the map is missing");
  Plan out;
  out.resolution_m = number("resolution", 0);
  if (!(out.resolution_m > 0)) throw Failure(map_yaml + ": resolution: metres of a pixel, above 0, are needed");
  const std::vector<double> origin = yaml.numbers("origin");
  if (origin.size() != 3) throw Failure(map_yaml + ": origin: [x, y, yaw] is needed");
  out.origin_x_m = origin[0], out.origin_y_m = origin[1], out.origin_yaw_rad = origin[2];
  const double occupied = number("occupied_thresh", 0.65), free = number("free_thresh", 0.196);
  const bool negate = number("negate", 0) != 0;
  try {
    out.picture = load_picture(fs::path(map_yaml).parent_path() / image);
  } catch (const Failure &failure) {
    throw Failure(map_yaml + ": image: " + failure.what());
  }
  out.unknown.resize(out.picture.pixels.size());
  for (size_t i = 0; i < out.unknown.size(); i++) {
    const double shade = out.picture.pixels[i] / 255.0, wall = negate ? shade : 1 - shade;
    out.unknown[i] = wall <= occupied && wall >= free ? 1 : 0;
    out.picture.pixels[i] = wall > occupied ? 0 : 255;
  }
  return out;
}

}  // namespace wm::tools
