// SPDX-License-Identifier: Apache-2.0
// Walls as lines on a plan, what a ray meets of them, and a map of their edges.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

struct segment {
  double ax, ay, bx, by;
};

// An L of corridors with recesses of different lengths, 18 x 12 m, and a pillar.
inline const std::vector<segment> kCorridors = {
    {1, 1, 16, 1},      {16, 1, 16, 3},       {16, 3, 9, 3},         {9, 3, 9, 3.4},    {9, 3.4, 7.8, 3.4},
    {7.8, 3.4, 7.8, 3}, {7.8, 3, 6, 3},       {6, 3, 6, 5},          {6, 5, 6.5, 5},    {6.5, 5, 6.5, 7},
    {6.5, 7, 6, 7},     {6, 7, 6, 11},        {6, 11, 3.5, 11},      {3.5, 11, 3.5, 3}, {3.5, 3, 1, 3},
    {1, 3, 1, 1},       {12, 1.6, 12.4, 1.6}, {12.4, 1.6, 12.4, 1.3}};

// Distance of the first wall along a ray, infinite without one; *normal: direction of its normal towards the wall's
// dark side.
inline double cast(const std::vector<segment> &walls, double x, double y, double angle, double *normal = nullptr) {
  double best = INFINITY;
  const double c = std::cos(angle), s = std::sin(angle);
  for (const segment &w : walls) {
    const double ex = w.bx - w.ax, ey = w.by - w.ay, det = ex * s - ey * c;
    if (std::fabs(det) < 1e-9) continue;
    const double t = (ex * (w.ay - y) - ey * (w.ax - x)) / det, u = (c * (w.ay - y) - s * (w.ax - x)) / det;
    if (!(t > 0.05 && u >= 0 && u <= 1 && t < best)) continue;
    best = t;
    const double across = std::atan2(ex, -ey);
    if (normal) *normal = std::cos(across - angle) > 0 ? across : across + M_PI;
  }
  return best;
}

// Pixels of the walls, 255, in a picture whose rows begin at the top.
inline std::vector<uint8_t> drawn(const std::vector<segment> &walls, int width, int height, double pixel_m) {
  std::vector<uint8_t> edges(static_cast<size_t>(width) * static_cast<size_t>(height), 0);
  for (const segment &w : walls)
    for (int i = 0; i <= 4000; i++) {
      const int column = static_cast<int>((w.ax + (w.bx - w.ax) * i / 4000) / pixel_m);
      const int row = height - 1 - static_cast<int>((w.ay + (w.by - w.ay) * i / 4000) / pixel_m);
      edges[static_cast<size_t>(row) * static_cast<size_t>(width) + static_cast<size_t>(column)] = 255;
    }
  return edges;
}
