// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "common/failure.h"
#include "images/pictures.h"
#include "map/layers.h"

namespace wm::tools {
namespace {

struct Shade {
  uint8_t r, g, b;
};
constexpr Shade kElsewhere{200, 203, 208}, kFloor{255, 255, 255}, kEdge{20, 40, 90}, kGrid{215, 228, 240},
    kOrigin{220, 40, 40}, kMark{230, 120, 0};

}  // namespace

void draw_map(const Layers &layers, const Plan &place, double grid_m, int width,
              const std::vector<Eigen::Vector2d> &marks, const std::string &file) {
  const int scale = std::max(1, (layers.width + width - 1) / width);
  images::Picture8 out{layers.width / scale, layers.height / scale, 3, {}};
  if (out.width < 1 || out.height < 1) throw Failure(file + ": the map is too small to be drawn");
  out.bytes.resize(static_cast<size_t>(out.width) * static_cast<size_t>(out.height) * 3);
  const auto put = [&](int x, int y, Shade s) {
    if (x < 0 || y < 0 || x >= out.width || y >= out.height) return;
    uint8_t *p = &out.bytes[(static_cast<size_t>(y) * static_cast<size_t>(out.width) + static_cast<size_t>(x)) * 3];
    p[0] = s.r, p[1] = s.g, p[2] = s.b;
  };
  const auto line_at = [&](double v, double cell) { return std::fabs(v - grid_m * std::round(v / grid_m)) < cell / 2; };
  for (int y = 0; y < out.height; y++)
    for (int x = 0; x < out.width; x++) {
      int floor = 0;
      bool edge = false;
      for (int j = 0; j < scale; j++)
        for (int i = 0; i < scale; i++) {
          const size_t at = static_cast<size_t>(y * scale + j) * static_cast<size_t>(layers.width) +
                            static_cast<size_t>(x * scale + i);
          floor += layers.drivable[at] != 0 ? 1 : 0;
          edge |= layers.edges[at] != 0;
        }
      Shade s = 2 * floor >= scale * scale ? kFloor : kElsewhere;
      const Eigen::Vector2d p = map_of(layers, place, (x + 0.5) * scale - 0.5, (y + 0.5) * scale - 0.5);
      const double cell = layers.resolution_m * scale;
      if (line_at(p.x(), cell) || line_at(p.y(), cell)) s = kGrid;
      if (edge) s = kEdge;
      if (p.norm() < 6 * cell && (std::fabs(p.x()) < cell || std::fabs(p.y()) < cell)) s = kOrigin;
      put(x, y, s);
    }
  for (const Eigen::Vector2d &mark : marks) {
    const Eigen::Vector2d at = pixel_of(layers, place, mark) / scale;
    for (int j = -3; j <= 3; j++)
      for (int i = -3; i <= 3; i++)
        if (i * i + j * j <= 10)
          put(static_cast<int>(std::lround(at.x())) + i, static_cast<int>(std::lround(at.y())) + j, kMark);
  }
  std::string error;
  if (!images::write_png(file, out, error)) throw Failure(error);
}

}  // namespace wm::tools
