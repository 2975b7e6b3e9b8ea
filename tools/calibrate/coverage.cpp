// SPDX-License-Identifier: Apache-2.0
#include "calibrate/coverage.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/failure.h"
#include "images/pictures.h"

namespace wm::calibrate {
namespace {

constexpr int kColumns = 12, kRows = 8;

struct Cells {
  bool seen[kRows][kColumns] = {};
  explicit Cells(const Calibration &c) {
    for (const View &view : c.views)
      for (const BoardCorner &corner : view.corners) {
        const int i = static_cast<int>(corner.pixel.x() * kColumns / c.camera.width),
                  j = static_cast<int>(corner.pixel.y() * kRows / c.camera.height);
        if (i >= 0 && j >= 0 && i < kColumns && j < kRows) seen[j][i] = true;
      }
  }
};

Vec2 middle(const images::Camera &camera, int column, int row) {
  return {(column + 0.5) * camera.width / kColumns - 0.5, (row + 0.5) * camera.height / kRows - 0.5};
}

double angle_of(const Vec3 &d) { return std::atan2(d.head<2>().norm(), d.z()); }

double off(const Calibration &c, const View &view, const BoardCorner &corner) {
  Vec2 pixel(0, 0);
  const bool there =
      images::project(c.camera, view.T_camera_board * Vec3(corner.board.x(), corner.board.y(), 0), pixel);
  return there ? (pixel - corner.pixel).norm() : 1e3;
}

}  // namespace

Coverage coverage_of(const Calibration &c) {
  Coverage out;
  const Cells cells(c);
  int shown = 0, covered = 0;
  double sum = 0;
  for (int row = 0; row < kRows; row++)
    for (int column = 0; column < kColumns; column++) {
      Vec3 d(0, 0, 1);
      const Vec2 at = middle(c.camera, column, row);
      if (!images::unproject(c.camera, at, d)) continue;
      shown++;
      out.picture_rad = std::max(out.picture_rad, angle_of(d));
      if (!cells.seen[row][column]) continue;
      covered++;
      const double sigma = pixel_sigma(c, at);
      if (!std::isfinite(sigma)) continue;
      sum += sigma;
      out.sigma_worst_px = std::max(out.sigma_worst_px, sigma);
    }
  if (shown > 0) out.covered = static_cast<double>(covered) / shown;
  if (covered > 0) out.sigma_mean_px = sum / covered;
  for (const View &view : c.views) {
    for (const BoardCorner &corner : view.corners) {
      Vec3 d(0, 0, 1);
      if (images::unproject(c.camera, corner.pixel, d)) out.widest_rad = std::max(out.widest_rad, angle_of(d));
    }
    for (const View &other : c.views) {
      const double along = std::fabs(view.T_camera_board.linear().col(2).dot(other.T_camera_board.linear().col(2)));
      out.tilt_rad = std::max(out.tilt_rad, std::acos(std::min(1.0, along)));
    }
  }
  return out;
}

std::vector<std::string> complaints(const Calibration &c, const Coverage &coverage) {
  std::vector<std::string> out;
  const auto say = [&](const char *format, double value) {
    char text[200];
    std::snprintf(text, sizeof text, format, value);
    out.emplace_back(text);
  };
  if (c.views.size() < 8)
    say("only %.0f pictures of the board count; 15 to 40 are good", static_cast<double>(c.views.size()));
  if (!c.determined)
    out.emplace_back("these pictures do not determine all of the camera's parameters; take tilted and off-centre ones");
  if (c.rms_px > 0.7)
    say("the corners are off by %.2f px: a bent board, blurred pictures or another lens model (--model)", c.rms_px);
  if (coverage.covered < 0.7)
    say("only %.0f %% of the picture has seen the board; hold it into the empty cells of the picture, at the rim most "
        "of all",
        100 * coverage.covered);
  if (coverage.tilt_rad < 0.5)
    say("the boards differ by %.0f degrees of tilt at most; tilt it by 30 to 45 degrees both ways",
        coverage.tilt_rad * 180 / images::kPi);
  if (coverage.sigma_worst_px > 1)
    say("the projection is uncertain by %.1f px at the worst place; take more pictures there", coverage.sigma_worst_px);
  return out;
}

void draw_coverage(const Calibration &c, const tools::GreyPicture &picture, const std::string &file) {
  images::Picture8 out{c.camera.width, c.camera.height, 3, {}};
  out.bytes.resize(static_cast<size_t>(out.width) * static_cast<size_t>(out.height) * 3);
  const Cells cells(c);
  for (int y = 0; y < out.height; y++)
    for (int x = 0; x < out.width; x++) {
      const bool seen = cells.seen[y * kRows / out.height][x * kColumns / out.width];
      const bool inside = x < picture.width && y < picture.height;
      const int grey = inside ? picture.at(x, y) / 2 : 0;
      uint8_t *p = &out.bytes[(static_cast<size_t>(y) * static_cast<size_t>(out.width) + static_cast<size_t>(x)) * 3];
      p[0] = static_cast<uint8_t>(seen ? grey : grey + 60);
      p[1] = static_cast<uint8_t>(grey);
      p[2] = static_cast<uint8_t>(seen ? grey : grey + 30);
    }
  for (const View &view : c.views)
    for (const BoardCorner &corner : view.corners) {
      const double r = off(c, view, corner);
      const uint8_t red = r > 0.3 ? 255 : 40, green = r > 1 ? 40 : 230;
      const int cx = static_cast<int>(std::lround(corner.pixel.x())),
                cy = static_cast<int>(std::lround(corner.pixel.y()));
      for (int y = std::max(0, cy - 1); y <= std::min(out.height - 1, cy + 1); y++)
        for (int x = std::max(0, cx - 1); x <= std::min(out.width - 1, cx + 1); x++) {
          uint8_t *p =
              &out.bytes[(static_cast<size_t>(y) * static_cast<size_t>(out.width) + static_cast<size_t>(x)) * 3];
          p[0] = red, p[1] = green, p[2] = 40;
        }
    }
  std::string error;
  if (!images::write_png(file, out, error)) throw tools::Failure(error);
}

}  // namespace wm::calibrate
