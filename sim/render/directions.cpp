// SPDX-License-Identifier: Apache-2.0
#include "render/directions.h"

#include <cmath>

namespace wm::render {

Directions::Directions(const Camera &camera) : width(camera.width), height(camera.height) {
  const size_t columns = static_cast<size_t>(width) + 1, rows = static_cast<size_t>(height) + 1;
  // Eight are read at a time, also at the end.
  constexpr size_t kBeyond = 8;
  x.assign(columns * rows + kBeyond, 0), y = x, z = x;
  there.assign(static_cast<size_t>(width) * static_cast<size_t>(height), 0);
  angle_rad.assign(there.size() + kBeyond, 0);
  std::vector<uint8_t> known(columns * rows);
  for (size_t v = 0, i = 0; v < rows; v++) {
    for (size_t u = 0; u < columns; u++, i++) {
      Vec3 d;
      known[i] = unproject(camera, Vec2(static_cast<double>(u) - 0.5, static_cast<double>(v) - 0.5), d);
      if (!known[i]) continue;
      x[i] = static_cast<float>(d.x()), y[i] = static_cast<float>(d.y()), z[i] = static_cast<float>(d.z());
    }
  }
  for (size_t v = 0; v + 1 < rows; v++) {
    for (size_t u = 0; u + 1 < columns; u++) {
      const size_t a = v * columns + u, c = a + columns, pixel = v * (columns - 1) + u;
      there[pixel] = known[a] && known[a + 1] && known[c] && known[c + 1];
      auto gap = [&](size_t i, size_t j) {
        const float dx = x[i] - x[j], dy = y[i] - y[j], dz = z[i] - z[j];
        return std::sqrt(dx * dx + dy * dy + dz * dz);
      };
      angle_rad[pixel] = 0.5f * (gap(a, a + 1) + gap(a, c));
    }
  }
}

}  // namespace wm::render
