// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "images/picture.h"

namespace wm::images {

namespace {

// Paints by `inside` (coverage 0 to 1 of a pixel at its centre) within a box.
template <class Inside>
void cover(double x0, double y0, double x1, double y1, Colour colour, Picture &picture, Inside inside) {
  const int left = std::max(static_cast<int>(std::floor(x0)), 0), top = std::max(static_cast<int>(std::floor(y0)), 0);
  const int right = std::min(static_cast<int>(std::ceil(x1)), picture.width);
  const int bottom = std::min(static_cast<int>(std::ceil(y1)), picture.height);
  for (int y = top; y < bottom; y++) {
    for (int x = left; x < right; x++) {
      const auto share = static_cast<float>(std::clamp(inside(x + 0.5, y + 0.5), 0.0, 1.0));
      if (share > 0) picture.set(x, y, picture.colour(x, y) * (1 - share) + colour * share);
    }
  }
}

}  // namespace

void fill_rect(double x0_px, double y0_px, double x1_px, double y1_px, Colour colour, Picture &picture) {
  cover(x0_px, y0_px, x1_px, y1_px, colour, picture, [&](double x, double y) {
    const double across = std::min(x + 0.5, x1_px) - std::max(x - 0.5, x0_px);
    const double along = std::min(y + 0.5, y1_px) - std::max(y - 0.5, y0_px);
    return std::max(across, 0.0) * std::max(along, 0.0);
  });
}

void fill_disc(double x_px, double y_px, double radius_px, Colour colour, Picture &picture) {
  const double r = radius_px + 1;
  cover(x_px - r, y_px - r, x_px + r, y_px + r, colour, picture, [&](double x, double y) {
    return radius_px + 0.5 - std::sqrt((x - x_px) * (x - x_px) + (y - y_px) * (y - y_px));
  });
}

void line(double x0_px, double y0_px, double x1_px, double y1_px, double width_px, Colour colour, Picture &picture) {
  const double dx = x1_px - x0_px, dy = y1_px - y0_px, length2 = std::max(dx * dx + dy * dy, 1e-12);
  const double r = width_px / 2 + 1;
  cover(std::min(x0_px, x1_px) - r, std::min(y0_px, y1_px) - r, std::max(x0_px, x1_px) + r, std::max(y0_px, y1_px) + r,
        colour, picture, [&](double x, double y) {
          const double t = std::clamp(((x - x0_px) * dx + (y - y0_px) * dy) / length2, 0.0, 1.0);
          const double ex = x - x0_px - t * dx, ey = y - y0_px - t * dy;
          return width_px / 2 + 0.5 - std::sqrt(ex * ex + ey * ey);
        });
}

}  // namespace wm::images
