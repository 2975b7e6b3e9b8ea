// SPDX-License-Identifier: Apache-2.0
// A map for benchmarks, of the paper's size: 4676 x 1372 pixels at 75 a metre.
#ifndef WAYMARK_BENCH_DRAWN_MAP_H
#define WAYMARK_BENCH_DRAWN_MAP_H

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

namespace bench {

inline constexpr int kMapWidth = 4676, kMapHeight = 1372;
inline constexpr double kMapPixel_m = 1.0 / 75;

// Two corridors and what joins them, with recesses, as a building of this size has: its edges.
inline std::vector<uint8_t> drawn_edges() {
  std::vector<uint8_t> edges(static_cast<size_t>(kMapWidth) * kMapHeight, 0);
  const auto line = [&](int x0, int y0, int x1, int y1) {
    const int steps = std::max(std::abs(x1 - x0), std::abs(y1 - y0));
    for (int i = 0; i <= steps; i++) {
      const int x = x0 + (x1 - x0) * i / steps, y = y0 + (y1 - y0) * i / steps;
      edges[static_cast<size_t>(y) * kMapWidth + static_cast<size_t>(x)] = 255;
    }
  };
  for (int y : {150, 330, 1000, 1180})
    for (int x = 100; x < 4500; x += 200) {
      line(x, y, x + 130, y);
      line(x + 130, y, x + 130, y + 15);
      line(x + 130, y + 15, x + 200, y + 15);
      line(x + 200, y + 15, x + 200, y);
    }
  for (int x : {1000, 1180, 3000, 3180}) line(x, 345, x, 1000);
  return edges;
}

}  // namespace bench

#endif
