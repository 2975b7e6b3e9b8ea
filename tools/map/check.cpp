// SPDX-License-Identifier: Apache-2.0
#include "map/check.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "common/failure.h"
#include "common/text.h"
#include "waymark/map.h"

namespace wm::tools {
namespace {

size_t share_of(const std::vector<uint8_t> &layer) {
  return static_cast<size_t>(std::count(layer.begin(), layer.end(), 255));
}

// Edge pixels in the midst of others: walls that were filled instead of outlined.
size_t filled(const Layers &m) {
  size_t out = 0;
  const auto at = [&](int x, int y) {
    return m.edges[static_cast<size_t>(y) * static_cast<size_t>(m.width) + static_cast<size_t>(x)];
  };
  for (int y = 1; y + 1 < m.height; y++)
    for (int x = 1; x + 1 < m.width; x++)
      out += at(x, y) != 0 && at(x - 1, y) != 0 && at(x + 1, y) != 0 && at(x, y - 1) != 0 && at(x, y + 1) != 0 ? 1 : 0;
  return out;
}

// Edge pixels with no drivable floor within a radius of so many pixels (looked at along rows and columns).
size_t far_edges(const Layers &m, int reach) {
  size_t out = 0;
  const auto drivable = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < m.width && y < m.height &&
           m.drivable[static_cast<size_t>(y) * static_cast<size_t>(m.width) + static_cast<size_t>(x)] != 0;
  };
  for (int y = 0; y < m.height; y++)
    for (int x = 0; x < m.width; x++) {
      if (m.edges[static_cast<size_t>(y) * static_cast<size_t>(m.width) + static_cast<size_t>(x)] == 0) continue;
      bool near = false;
      for (int r = 1; !near && r <= reach; r++)
        near = drivable(x + r, y) || drivable(x - r, y) || drivable(x, y + r) || drivable(x, y - r);
      out += near ? 0 : 1;
    }
  return out;
}

}  // namespace

MapReport check_map(const std::string &map_yaml, const std::vector<Eigen::Vector2d> &starts) {
  MapReport out;
  wm_error error{};
  wm_map *loaded = nullptr;
  const auto odd = [](void *context, wm_note, const char *line) {
    static_cast<MapReport *>(context)->odd.emplace_back(line);
  };
  const wm_status status = wm_map_load(map_yaml.c_str(), odd, &out, &loaded, &error);
  const std::unique_ptr<wm_map, void (*)(wm_map *)> map(loaded, wm_map_free);
  if (status != WM_OK) throw Failure(error.text, kUsage);
  const wm_raster *raster = wm_map_raster(map.get());
  const size_t pixels = static_cast<size_t>(raster->width_px) * raster->height_px;
  Layers &m = out.layers;
  m.width = static_cast<int>(raster->width_px);
  m.height = static_cast<int>(raster->height_px);
  m.resolution_m = raster->resolution_m;
  out.place.resolution_m = raster->resolution_m;
  out.place.origin_x_m = raster->origin_x_m;
  out.place.origin_y_m = raster->origin_y_m;
  out.place.origin_yaw_rad = raster->origin_yaw_rad;
  m.edges.assign(pixels, 0);
  m.drivable.assign(pixels, 0);
  if (raster->edges != nullptr) m.edges.assign(raster->edges, raster->edges + pixels);
  if (raster->drivable != nullptr) m.drivable.assign(raster->drivable, raster->drivable + pixels);

  const double r = m.resolution_m;
  const size_t edges = share_of(m.edges), drivable = share_of(m.drivable);
  out.facts.push_back(text("%d x %d px of %.4g m: %.1f x %.1f m, turned by %.1f degrees", m.width, m.height, r,
                           m.width * r, m.height * r, raster->origin_yaw_rad * 180 / 3.14159265358979323846));
  out.facts.push_back(
      text("edges: %zu px, about %.0f m of joints of wall and floor", edges, static_cast<double>(edges) * r));
  out.facts.push_back(text("drivable: %.1f m2", static_cast<double>(drivable) * r * r));
  if (raster->edges == nullptr)
    out.wrong.emplace_back("layers.edges is missing: waymark map make makes it from this map's image");
  else if (edges == 0)
    out.wrong.emplace_back("the edges layer is empty (white, 255, is an edge)");
  else if (edges > pixels / 5)
    out.wrong.push_back(text("%.0f %% of the map are edges: is the layer black on white? White is an edge",
                             100.0 * static_cast<double>(edges) / static_cast<double>(pixels)));
  else if (const size_t inner = filled(m); inner > edges / 3)
    out.wrong.push_back(
        text("%.0f %% of the edge pixels lie within others: edges are lines, one pixel wide, where wall "
             "and floor meet; waymark map make draws them",
             100.0 * static_cast<double>(inner) / static_cast<double>(edges)));
  if (raster->drivable != nullptr && drivable == 0) out.wrong.emplace_back("nothing is drivable");
  if (raster->drivable == nullptr) out.odd.emplace_back("there is no drivable layer: particles may walk through walls");
  if (edges > 0 && drivable > 0) {
    const size_t far = far_edges(m, static_cast<int>(std::ceil(1.0 / r)));
    if (far > edges / 10)
      out.odd.push_back(
          text("%.0f %% of the edges have no drivable floor within 1 m: do the layers lie over each other?",
               100.0 * static_cast<double>(far) / static_cast<double>(edges)));
  }
  if (r > 0.06) out.odd.push_back(text("a pixel is %.2f m: positions will be no better than about half of that", r));
  for (const Eigen::Vector2d &start : starts) {
    const Eigen::Vector2d at = pixel_of(m, out.place, start);
    const int x = static_cast<int>(std::lround(at.x())), y = static_cast<int>(std::lround(at.y()));
    const bool inside = x >= 0 && y >= 0 && x < m.width && y < m.height;
    if (!inside)
      out.wrong.push_back(
          text("the start pose (%.2f, %.2f) lies outside of the map: is origin right?", start.x(), start.y()));
    else if (raster->drivable != nullptr &&
             m.drivable[static_cast<size_t>(y) * static_cast<size_t>(m.width) + static_cast<size_t>(x)] == 0)
      out.wrong.push_back(text("the start pose (%.2f, %.2f) is not drivable", start.x(), start.y()));
  }
  return out;
}

}  // namespace wm::tools
