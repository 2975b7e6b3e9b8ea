// SPDX-License-Identifier: Apache-2.0
#include "common/map_edges.h"

#include <algorithm>
#include <cmath>

namespace wm::tools {
namespace {

constexpr double kReach_m = 8;  // edges further away are a pixel or two above the nearer ones

}  // namespace

MapEdges::MapEdges(const wm_raster &raster)
    : raster_(raster), axes_(Eigen::Rotation2Dd(raster.origin_yaw_rad).toRotationMatrix()) {}

Eigen::Vector2d MapEdges::centre(int column, int row) const {
  const double up = static_cast<double>(raster_.height_px) - row - 0.5;
  return Eigen::Vector2d(raster_.origin_x_m, raster_.origin_y_m) +
         axes_ * Eigen::Vector2d(column + 0.5, up) * raster_.resolution_m;
}

Eigen::Vector2i MapEdges::cell(const Eigen::Vector2d &map) const {
  const Eigen::Vector2d at =
      axes_.transpose() * (map - Eigen::Vector2d(raster_.origin_x_m, raster_.origin_y_m)) / raster_.resolution_m;
  return {static_cast<int>(std::floor(at.x())),
          static_cast<int>(raster_.height_px) - 1 - static_cast<int>(std::floor(at.y()))};
}

bool MapEdges::set(const uint8_t *layer, int column, int row) const {
  return column >= 0 && row >= 0 && column < static_cast<int>(raster_.width_px) &&
         row < static_cast<int>(raster_.height_px) &&
         layer[static_cast<size_t>(row) * raster_.width_px + static_cast<size_t>(column)] != 0;
}

// Floor, or so close to an edge that a ray along a wall may pass.
bool MapEdges::open(const Eigen::Vector2i &c) const {
  if (set(raster_.drivable, c.x(), c.y())) return true;
  for (int j = -1; j <= 1; j++)
    for (int i = -1; i <= 1; i++)
      if (set(raster_.edges, c.x() + i, c.y() + j)) return true;
  return false;
}

bool MapEdges::sees(const Eigen::Vector2d &eye, const Eigen::Vector2d &edge) const {
  if (raster_.drivable == nullptr || !open(cell(eye))) return true;
  const int steps = static_cast<int>((edge - eye).norm() / raster_.resolution_m);
  for (int i = 1; i < steps; i++)
    if (!open(cell(eye + (edge - eye) * i / steps))) return false;
  return true;
}

std::vector<Eigen::Vector2d> MapEdges::seen_from(const Eigen::Vector2d &eye) const {
  std::vector<Eigen::Vector2d> out;
  const Eigen::Vector2i middle = cell(eye);
  const int reach = static_cast<int>(kReach_m / raster_.resolution_m);
  for (int row = middle.y() - reach; row <= middle.y() + reach; row++)
    for (int column = middle.x() - reach; column <= middle.x() + reach; column++) {
      if (!set(raster_.edges, column, row)) continue;
      const Eigen::Vector2d edge = centre(column, row);
      if ((edge - eye).norm() <= kReach_m && sees(eye, edge)) out.push_back(edge);
    }
  return out;
}

MapMask MapEdges::reduced(const uint8_t *layer, int side) const {
  const int width = static_cast<int>(raster_.width_px), height = static_cast<int>(raster_.height_px);
  MapMask out;
  out.times = (std::max(width, height) + side - 1) / side;
  out.width = (width + out.times - 1) / out.times;
  out.height = (height + out.times - 1) / out.times;
  out.cells.resize(static_cast<size_t>(out.width) * static_cast<size_t>(out.height));
  const int spare = out.height * out.times - height;  // rows above the uppermost, so that the lower left corner stays
  for (int row = 0; row < height; row++)
    for (int column = 0; column < width; column++)
      if (set(layer, column, row))
        out.cells[static_cast<size_t>((row + spare) / out.times) * static_cast<size_t>(out.width) +
                  static_cast<size_t>(column / out.times)] = 1;
  return out;
}

}  // namespace wm::tools
