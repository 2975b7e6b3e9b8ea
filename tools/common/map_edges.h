// SPDX-License-Identifier: Apache-2.0
// The layers of a raster map by places in the map: what a camera may see of it, and small pictures of it.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "waymark/setup.h"

namespace wm::tools {

// A layer made smaller: a cell is set where one of the map's cells is that it stands for.
struct MapMask {
  std::vector<uint8_t> cells;  // width x height, row 0 at the top
  int width = 0, height = 0;
  int times = 1;  // a cell stands for times x times of the map's; the lower left corner stays
};

class MapEdges {
 public:
  explicit MapEdges(const wm_raster &raster);

  // Edges within 8 m of `eye` (in map) that a straight look meets: no wall stands before them. All of those within
  // reach where the map has no floor, or none under `eye`.
  [[nodiscard]] std::vector<Eigen::Vector2d> seen_from(const Eigen::Vector2d &eye) const;
  // `layer` (the raster's edges or drivable; not null) with at most `side` cells a side.
  [[nodiscard]] MapMask reduced(const uint8_t *layer, int side) const;

 private:
  [[nodiscard]] Eigen::Vector2d centre(int column, int row) const;
  [[nodiscard]] Eigen::Vector2i cell(const Eigen::Vector2d &map) const;
  [[nodiscard]] bool set(const uint8_t *layer, int column, int row) const;
  [[nodiscard]] bool open(const Eigen::Vector2i &c) const;
  [[nodiscard]] bool sees(const Eigen::Vector2d &eye, const Eigen::Vector2d &edge) const;

  const wm_raster &raster_;
  Eigen::Matrix2d axes_;
};

}  // namespace wm::tools
