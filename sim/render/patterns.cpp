// SPDX-License-Identifier: Apache-2.0
// Floors, walls and ceilings.
#include "render/patterns.h"

#include <algorithm>
#include <cmath>

#include "render/dice.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::render {

namespace {

// A number in [0, 1) for a place of a lattice.
double lattice(uint64_t seed, int x, int y) {
  const uint64_t key = static_cast<uint64_t>(static_cast<uint32_t>(x)) << 32 | static_cast<uint32_t>(y);
  return static_cast<double>(dice(dice(seed) + key) >> 11) * 0x1p-53;
}

int around(int i, int n) { return ((i % n) + n) % n; }

// Value noise that repeats after `nx`, `ny` cells; x and y in cells.
double value_noise(uint64_t seed, double x, double y, int nx, int ny) {
  const int xi = static_cast<int>(std::floor(x)), yi = static_cast<int>(std::floor(y));
  const double fx = x - xi, fy = y - yi;
  const double sx = fx * fx * (3 - 2 * fx), sy = fy * fy * (3 - 2 * fy);
  auto at = [&](int i, int j) { return lattice(seed, around(xi + i, nx), around(yi + j, ny)); };
  return (at(0, 0) * (1 - sx) + at(1, 0) * sx) * (1 - sy) + (at(0, 1) * (1 - sx) + at(1, 1) * sx) * sy;
}

// Several octaves, stretched: `cx` and `cy` cells over the picture.
Picture clouds(uint64_t seed, int width, int height, int cx, int cy, int octaves, double gain) {
  Picture out(width, height, 1);
  for (int y = 0; y < height; y++) {
    for (int x = 0; x < width; x++) {
      double sum = 0, weight = 0, w = 1;
      for (int o = 0; o < octaves; o++, w *= gain) {
        const int nx = cx << o, ny = cy << o;
        sum += w * value_noise(seed + static_cast<uint64_t>(o) * 7919, (x + 0.5) * nx / width, (y + 0.5) * ny / height,
                               nx, ny);
        weight += w;
      }
      out.at(x, y) = static_cast<float>(sum / weight);
    }
  }
  return out;
}

double grain(uint64_t seed, int x, int y) { return lattice(seed ^ 0x6772616eull, x, y) - 0.5; }

// `colour` times a factor for each pixel.
template <class Factor>
Picture tinted(int size_px, Colour colour, Factor factor) {
  Picture out(size_px, size_px, 3);
  for (int y = 0; y < size_px; y++)
    for (int x = 0; x < size_px; x++) out.set(x, y, colour * static_cast<float>(std::clamp(factor(x, y), 0.0, 4.0)));
  return out;
}

double soft_step(double edge0, double edge1, double x) {
  const double t = std::clamp((x - edge0) / (edge1 - edge0), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

Colour mix(Colour a, Colour b, double share) {
  return a * static_cast<float>(1 - share) + b * static_cast<float>(share);
}

}  // namespace

Picture noise(uint64_t seed, int size_px, int cells, int octaves, double gain) {
  return clouds(seed, size_px, size_px, cells, cells, octaves, gain);
}

Picture paint(uint64_t seed, int size_px, Colour colour, double grime) {
  const Picture cloud = noise(seed, size_px, 3, 5), fine = noise(seed + 1, size_px, size_px / 8, 2);
  const Picture streak = clouds(seed + 2, size_px, size_px, 24, 2, 4, 0.6);
  return tinted(size_px, colour, [&](int x, int y) {
    const double stain = soft_step(0.55, 0.8, double(streak.at(x, y))) * soft_step(0.35, 0.7, double(cloud.at(x, y)));
    return 1 + 0.10 * (double(cloud.at(x, y)) - 0.5) + 0.08 * (double(fine.at(x, y)) - 0.5) + 0.03 * grain(seed, x, y) -
           grime * 0.6 * stain;
  });
}

Picture tiles(uint64_t seed, int size_px, int tiles, double joint, Colour tile, Colour joint_colour, double variation) {
  const Picture cloud = noise(seed, size_px, tiles * 2, 5, 0.6), wide = noise(seed + 3, size_px, 2, 3);
  Picture out(size_px, size_px, 3);
  for (int y = 0; y < size_px; y++) {
    for (int x = 0; x < size_px; x++) {
      const double u = (x + 0.5) * tiles / size_px, v = (y + 0.5) * tiles / size_px;
      const int i = static_cast<int>(u), j = static_cast<int>(v);
      const double edge = std::min({u - i, 1 - (u - i), v - j, 1 - (v - j)});  // in tiles
      const double own = lattice(seed + 5, i, j) - 0.5;
      const double shade = 1 + variation * (own + 0.8 * (double(cloud.at(x, y)) - 0.5)) +
                           0.1 * (double(wide.at(x, y)) - 0.5) + 0.04 * grain(seed, x, y);
      const double pixel = static_cast<double>(tiles) / size_px;
      const double in_joint = 1 - soft_step(joint / 2 - pixel / 2, joint / 2 + pixel, edge);
      const double dirt = 0.8 + 0.4 * double(wide.at(x, y));
      out.set(x, y, mix(tile * static_cast<float>(shade), joint_colour * static_cast<float>(dirt), in_joint));
    }
  }
  return out;
}

Picture planks(uint64_t seed, int size_px, int rows, Colour colour, double variation) {
  const Picture fibre = clouds(seed, size_px, size_px, 4, rows * 16, 3, 0.6);
  return tinted(size_px, colour, [&](int x, int y) {
    const double v = (y + 0.5) * rows / size_px;
    const int row = static_cast<int>(v);
    const double shift = lattice(seed + 1, row, 0), u = (x + 0.5) / size_px * 2 + shift;
    const int board = around(static_cast<int>(std::floor(u)), 2);
    const double own = lattice(seed + 2, row, board) - 0.5;
    const double along = (u - std::floor(u)) * size_px / 2, across = (v - row) * size_px / rows;
    const double gap = std::min(across, std::min(along, size_px / 2.0 - along)) < 1.2 ? 0.45 : 1;
    return gap * (1 + variation * own + variation * 0.7 * (double(fibre.at(x, y)) - 0.5));
  });
}

Picture carpet(uint64_t seed, int size_px, Colour colour, double contrast) {
  const Picture wide = noise(seed, size_px, 4, 4), loops = noise(seed + 1, size_px, size_px / 4, 1);
  return tinted(size_px, colour, [&](int x, int y) {
    return 1 + contrast * (1.2 * (double(loops.at(x, y)) - 0.5) + 0.5 * grain(seed, x, y) +
                           0.4 * (double(wide.at(x, y)) - 0.5));
  });
}

Picture linoleum(uint64_t seed, int size_px, Colour colour, double speckle) {
  const Picture cloud = noise(seed, size_px, 6, 5, 0.65), flakes = noise(seed + 1, size_px, size_px / 6, 2);
  return tinted(size_px, colour, [&](int x, int y) {
    const double f = double(flakes.at(x, y));
    const double flake = soft_step(0.68, 0.76, f) - soft_step(0.68, 0.76, 1 - f);
    return 1 + speckle * 0.5 * flake + 0.18 * (double(cloud.at(x, y)) - 0.5) + 0.03 * grain(seed, x, y);
  });
}

Picture concrete(uint64_t seed, int size_px, Colour colour, double stains) {
  const Picture cloud = noise(seed, size_px, 3, 6, 0.6), spot = noise(seed + 1, size_px, 5, 4);
  const Picture pores = noise(seed + 2, size_px, size_px / 5, 1);
  return tinted(size_px, colour, [&](int x, int y) {
    const double stain = soft_step(0.55, 0.75, double(spot.at(x, y)));
    const double pore = soft_step(0.86, 0.93, double(pores.at(x, y)));
    return 1 + 0.35 * (double(cloud.at(x, y)) - 0.5) - stains * 0.4 * stain - 0.35 * pore + 0.05 * grain(seed, x, y);
  });
}

Picture bricks(uint64_t seed, int size_px, int rows, Colour brick, Colour mortar, double variation) {
  const int columns = std::max(rows / 3, 1);
  const Picture rough = noise(seed, size_px, rows * 3, 4, 0.6), wide = noise(seed + 1, size_px, 3, 3);
  Picture out(size_px, size_px, 3);
  for (int y = 0; y < size_px; y++) {
    for (int x = 0; x < size_px; x++) {
      const double v = (y + 0.5) * rows / size_px;
      const int row = static_cast<int>(v);
      const double u = (x + 0.5) * columns / size_px + (row % 2 ? 0.5 : 0.0);
      const int column = around(static_cast<int>(std::floor(u)), columns);
      const double edge_v = std::min(v - row, 1 - (v - row)) / rows;
      const double edge_u = std::min(u - std::floor(u), 1 - (u - std::floor(u))) / columns;
      const double half = 0.07 / rows, edge = std::min(edge_u, edge_v);
      const double own = lattice(seed + 2, row, column) - 0.5, r = double(rough.at(x, y)) - 0.5;
      const double shade = 1 + variation * own + 0.4 * r + 0.2 * (double(wide.at(x, y)) - 0.5);
      const double in_mortar = 1 - soft_step(half, half + 1.5 / size_px, edge);
      out.set(x, y, mix(brick * static_cast<float>(shade), mortar * static_cast<float>(1 + 0.3 * r), in_mortar));
    }
  }
  return out;
}

Picture asphalt(uint64_t seed, int size_px, Colour colour, double cracks) {
  const Picture wide = noise(seed, size_px, 3, 5, 0.6), stones = noise(seed + 1, size_px, size_px / 3, 1);
  const Picture crack = noise(seed + 2, size_px, 4, 5, 0.55);
  return tinted(size_px, colour, [&](int x, int y) {
    const double line = 1 - soft_step(0.0, 0.012, std::fabs(double(crack.at(x, y)) - 0.5));
    return 1 + 0.4 * (double(wide.at(x, y)) - 0.5) + 0.7 * (double(stones.at(x, y)) - 0.5) - cracks * 0.6 * line;
  });
}

Picture sand(uint64_t seed, int size_px, Colour colour, double ripples) {
  const Picture wide = noise(seed, size_px, 4, 5), bend = noise(seed + 1, size_px, 3, 3);
  const Picture fine = noise(seed + 2, size_px, size_px / 4, 2);
  return tinted(size_px, colour, [&](int x, int y) {
    const double phase = (y + 0.5) / size_px * 12 + 1.5 * double(bend.at(x, y));
    return 1 + ripples * 0.35 * wm::sin(2 * kPi * phase) + 0.5 * (double(wide.at(x, y)) - 0.5) +
           0.5 * (double(fine.at(x, y)) - 0.5) + 0.2 * grain(seed, x, y);
  });
}

Picture rock(uint64_t seed, int size_px, Colour colour, double contrast) {
  const Picture base = noise(seed, size_px, 4, 7, 0.65), vein = noise(seed + 1, size_px, 6, 5, 0.6);
  return tinted(size_px, colour, [&](int x, int y) {
    const double ridge = std::fabs(double(vein.at(x, y)) - 0.5) * 2;
    return 1 + contrast * (1.4 * (double(base.at(x, y)) - 0.5) - 0.5 * (1 - soft_step(0.0, 0.15, ridge)) +
                           0.25 * grain(seed, x, y));
  });
}

Picture ceiling_panels(uint64_t seed, int size_px, int panels, Colour colour) {
  const Picture cloud = noise(seed, size_px, 3, 3), holes = noise(seed + 1, size_px, size_px / 6, 1);
  return tinted(size_px, colour, [&](int x, int y) {
    const double u = (x + 0.5) * panels / size_px, v = (y + 0.5) * panels / size_px;
    const double edge = std::min({u - std::floor(u), std::ceil(u) - u, v - std::floor(v), std::ceil(v) - v});
    const double rail = 1 - soft_step(0.012, 0.02, edge);
    const double hole = soft_step(0.75, 0.85, double(holes.at(x, y)));
    return (1 + 0.06 * (double(cloud.at(x, y)) - 0.5) - 0.15 * hole) * (1 - rail) + 0.7 * rail;
  });
}

void add_dirt(uint64_t seed, double amount, Picture &picture) {
  if (picture.width < 8 || picture.height < 8 || amount <= 0) return;
  const Picture stain = clouds(seed, picture.width, picture.height, 3, 3, 5, 0.6);
  const Picture scuff = clouds(seed + 1, picture.width, picture.height, 3, 40, 3, 0.7);
  for (int y = 0; y < picture.height; y++) {
    for (int x = 0; x < picture.width; x++) {
      const double dark =
          0.45 * soft_step(0.5, 0.75, double(stain.at(x, y))) + 0.5 * soft_step(0.72, 0.82, double(scuff.at(x, y)));
      picture.set(x, y, picture.colour(x, y) * static_cast<float>(std::max(1 - amount * dark, 0.0)));
    }
  }
}

}  // namespace wm::render
