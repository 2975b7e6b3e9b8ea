// SPDX-License-Identifier: Apache-2.0
#include "report/bird.h"

#include <algorithm>
#include <cmath>

#include "common/cameras.h"
#include "report/frames.h"

namespace wm::tools {
namespace {

constexpr double kPixelsAMetre = 50, kReach_m = 6;
constexpr uint8_t kUnseen = 255;

// Between the four pixels about the place; the picture's rim as it is.
uint8_t brightness(const std::vector<uint8_t> &grey, int width, int height, const Eigen::Vector2d &at) {
  const double u = std::clamp(at.x(), 0.0, width - 1.001), v = std::clamp(at.y(), 0.0, height - 1.001);
  const int column = static_cast<int>(u), row = static_cast<int>(v);
  const double right = u - column, down = v - row;
  const auto level = [&](int c, int r) {
    return static_cast<double>(grey[static_cast<size_t>(r) * static_cast<size_t>(width) + static_cast<size_t>(c)]);
  };
  const double above = level(column, row) * (1 - right) + level(column + 1, row) * right;
  const double below = level(column, row + 1) * (1 - right) + level(column + 1, row + 1) * right;
  return static_cast<uint8_t>(above * (1 - down) + below * down + 0.5);
}

}  // namespace

std::optional<Eigen::Vector2d> FloorView::pixel(const Eigen::Vector2d &base) const {
  const Eigen::Vector2d at = {(corner.y() - base.y()) * kPixelsAMetre - 0.5,
                              (corner.x() - base.x()) * kPixelsAMetre - 0.5};
  if (at.x() < 0 || at.y() < 0 || at.x() > width_px - 1 || at.y() > height_px - 1) return std::nullopt;
  return at;
}

FloorView view_floor(const images::Camera &camera, const std::vector<uint8_t> &grey) {
  const Eigen::Vector3d eye = camera.T_base_camera.translation();
  const int side = static_cast<int>(2 * kReach_m * kPixelsAMetre);
  std::vector<uint8_t> all(static_cast<size_t>(side) * static_cast<size_t>(side), kUnseen);
  int left = side, right = -1, top = side, bottom = -1;
  for (int row = 0; row < side; row++)
    for (int column = 0; column < side; column++) {
      const Eigen::Vector2d from_eye = {kReach_m - (row + 0.5) / kPixelsAMetre,
                                        kReach_m - (column + 0.5) / kPixelsAMetre};
      if (from_eye.norm() > kReach_m) continue;
      const auto seen = floor_pixel(camera, eye.head<2>() + from_eye);
      if (!seen) continue;
      all[static_cast<size_t>(row) * static_cast<size_t>(side) + static_cast<size_t>(column)] =
          brightness(grey, camera.width, camera.height, *seen);
      left = std::min(left, column);
      right = std::max(right, column);
      top = std::min(top, row);
      bottom = std::max(bottom, row);
    }
  FloorView out;
  if (right < left) return out;
  out.width_px = right - left + 1;
  out.height_px = bottom - top + 1;
  out.corner = {eye.x() + kReach_m - top / kPixelsAMetre, eye.y() + kReach_m - left / kPixelsAMetre};
  std::vector<uint8_t> cut;
  for (int row = top; row <= bottom; row++) {
    const auto begin = all.begin() + static_cast<ptrdiff_t>(row) * side;
    cut.insert(cut.end(), begin + left, begin + right + 1);
  }
  out.jpeg = grey_jpeg(cut, out.width_px, out.height_px);
  return out;
}

}  // namespace wm::tools
