// SPDX-License-Identifier: Apache-2.0
#include "worlds/raster.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>

#include "waymark/map.h"

namespace wm::sim {
namespace {

constexpr uint8_t kOccupied = 0, kFree = 254, kUnknown = 205;

bool stands_in_map(const Face &f) { return f.bottom_m <= 0 && f.mapped; }

}  // namespace

RasterMap draw_map(const Plan &plan, Point origin, int width, int height, double resolution) {
  RasterMap map;
  map.resolution_m = resolution;
  map.origin = origin;
  const size_t count = static_cast<size_t>(width) * static_cast<size_t>(height);
  map.plan = {width, height, std::vector<uint8_t>(count, kUnknown)};
  map.edges = {width, height, std::vector<uint8_t>(count, 0)};
  map.drivable = {width, height, std::vector<uint8_t>(count, 0)};

  // Row by row: where the outlines cross it, and how often they go round what lies between.
  struct Crossing {
    double x;
    int turn;  // what is added to the winding on the way to +x
  };
  std::vector<Crossing> crossings;
  for (int row = 0; row < height; row++) {
    const double y = origin.y_m + (height - 0.5 - row) * resolution;
    crossings.clear();
    for (const Face &f : plan.faces) {
      if (!stands_in_map(f) || (f.a.y_m <= y) == (f.b.y_m <= y)) continue;
      crossings.push_back(
          {f.a.x_m + (y - f.a.y_m) / (f.b.y_m - f.a.y_m) * (f.b.x_m - f.a.x_m), f.b.y_m > f.a.y_m ? -1 : 1});
    }
    std::sort(crossings.begin(), crossings.end(), [](const Crossing &a, const Crossing &b) { return a.x < b.x; });
    int winding = plan.outside_is_solid ? 0 : 1;
    size_t next = 0;
    for (int column = 0; column < width; column++) {
      const double x = origin.x_m + (column + 0.5) * resolution;
      while (next < crossings.size() && crossings[next].x <= x) winding += crossings[next++].turn;
      if (winding < 1) continue;
      const size_t at = static_cast<size_t>(row) * static_cast<size_t>(width) + static_cast<size_t>(column);
      map.plan.pixels[at] = kFree;
      map.drivable.pixels[at] = 255;
    }
  }
  for (const Face &f : plan.faces) {
    if (!stands_in_map(f)) continue;
    const double dx = f.b.x_m - f.a.x_m, dy = f.b.y_m - f.a.y_m;
    const int steps = 1 + static_cast<int>(std::ceil(8 * std::sqrt(dx * dx + dy * dy) / resolution));
    for (int i = 0; i <= steps; i++) {
      const double s = static_cast<double>(i) / steps;
      const int column = static_cast<int>(std::floor((f.a.x_m + s * dx - origin.x_m) / resolution));
      const int row = height - 1 - static_cast<int>(std::floor((f.a.y_m + s * dy - origin.y_m) / resolution));
      if (column < 0 || row < 0 || column >= width || row >= height) continue;
      const size_t at = static_cast<size_t>(row) * static_cast<size_t>(width) + static_cast<size_t>(column);
      map.edges.pixels[at] = 255;
      map.plan.pixels[at] = kOccupied;
    }
  }
  return map;
}

wm_status write_png(const GreyImage &image, const std::string &path, wm_error *err) {
  std::vector<uint8_t> pixels = image.pixels;
  const wm_grey grey{static_cast<uint32_t>(image.width), static_cast<uint32_t>(image.height), pixels.data()};
  void *bytes = nullptr;
  size_t size = 0;
  if (const wm_status s = wm_grey_encode(&grey, path.c_str(), &bytes, &size, err); s != WM_OK) return s;
  const std::unique_ptr<void, decltype(&std::free)> owner(bytes, std::free);
  std::ofstream file(path, std::ios::binary);
  file.write(static_cast<const char *>(bytes), static_cast<std::streamsize>(size)).flush();
  return file ? WM_OK : wm_fail(err, WM_IO, "%s: can't be written: %s", path.c_str(), std::strerror(errno));
}

wm_status read_grey(const std::string &path, GreyImage &out, wm_error *err) {
  wm_grey grey{};
  if (const wm_status s = wm_grey_load(path.c_str(), &grey, err); s != WM_OK) return s;
  out.width = static_cast<int>(grey.width_px);
  out.height = static_cast<int>(grey.height_px);
  out.pixels.assign(grey.pixels, grey.pixels + static_cast<size_t>(grey.width_px) * grey.height_px);
  std::free(grey.pixels);
  return WM_OK;
}

wm_status write_map(const RasterMap &map, const std::string &folder, wm_error *err) {
  wm_status status = write_png(map.plan, folder + "/plan.png", err);
  if (status == WM_OK) status = write_png(map.edges, folder + "/edges.png", err);
  if (status == WM_OK) status = write_png(map.drivable, folder + "/drivable.png", err);
  if (status != WM_OK) return status;
  char text[512];
  std::snprintf(text, sizeof text,
                "image: plan.png\nresolution: %.17g\norigin: [%.6f, %.6f, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n"
                "free_thresh: 0.196\nlayers:\n  edges: edges.png\n  drivable: drivable.png\n",
                map.resolution_m, map.origin.x_m, map.origin.y_m);
  std::ofstream file(folder + "/map.yaml", std::ios::binary);
  file << text;
  file.flush();
  if (!file) return wm_fail(err, WM_IO, "%s/map.yaml: can't be written: %s", folder.c_str(), std::strerror(errno));
  return WM_OK;
}

}  // namespace wm::sim
