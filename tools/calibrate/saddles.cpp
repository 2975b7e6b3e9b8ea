// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "calibrate/corners.h"

namespace wm::calibrate {
namespace {

using tools::GreyPicture;

constexpr int kRadius = 5;
constexpr int kRing[16][2] = {{0, -5}, {2, -5}, {3, -3}, {5, -2}, {5, 0},  {5, 2},   {3, 3},   {2, 5},
                              {0, 5},  {-2, 5}, {-3, 3}, {-5, 2}, {-5, 0}, {-5, -2}, {-3, -3}, {-2, -5}};
constexpr float kFloor = 160;  // of the response: below it noise makes corners
constexpr size_t kCandidates = 3000;

float chess(const GreyPicture &p, int x, int y) {
  int ring[16], sum = 0, across = 0, along = 0;
  for (int i = 0; i < 16; i++) sum += ring[i] = p.at(x + kRing[i][0], y + kRing[i][1]);
  for (int i = 0; i < 4; i++) across += std::abs(ring[i] + ring[i + 8] - ring[i + 4] - ring[i + 12]);
  for (int i = 0; i < 8; i++) along += std::abs(ring[i] - ring[i + 8]);
  const float centre =
      static_cast<float>(p.at(x, y) + p.at(x - 1, y) + p.at(x + 1, y) + p.at(x, y - 1) + p.at(x, y + 1)) / 5;
  return static_cast<float>(across - along) - 16 * std::fabs(centre - static_cast<float>(sum) / 16);
}

GreyPicture halved(const GreyPicture &p) {
  GreyPicture out{p.width / 2, p.height / 2, {}};
  out.pixels.reserve(static_cast<size_t>(out.width) * static_cast<size_t>(out.height));
  for (int y = 0; y < out.height; y++)
    for (int x = 0; x < out.width; x++)
      out.pixels.push_back(static_cast<uint8_t>(
          (p.at(2 * x, 2 * y) + p.at(2 * x + 1, 2 * y) + p.at(2 * x, 2 * y + 1) + p.at(2 * x + 1, 2 * y + 1) + 2) / 4));
  return out;
}

// Local maxima of the response, in pixels of this picture.
std::vector<CornerCandidate> maxima(const GreyPicture &p) {
  std::vector<CornerCandidate> out;
  if (p.width < 4 * kRadius || p.height < 4 * kRadius) return out;
  std::vector<float> response(p.pixels.size(), 0);
  const auto at = [&](int x, int y) -> float & {
    return response[static_cast<size_t>(y) * static_cast<size_t>(p.width) + static_cast<size_t>(x)];
  };
  for (int y = kRadius; y < p.height - kRadius; y++)
    for (int x = kRadius; x < p.width - kRadius; x++) at(x, y) = chess(p, x, y);
  constexpr int kReach = 3;
  for (int y = kRadius; y < p.height - kRadius; y++)
    for (int x = kRadius; x < p.width - kRadius; x++) {
      const float here = at(x, y);
      if (here < kFloor) continue;
      bool top = true;
      for (int dy = -kReach; top && dy <= kReach; dy++)
        for (int dx = -kReach; top && dx <= kReach; dx++)
          if (const int u = x + dx, v = y + dy; (dx != 0 || dy != 0) && u >= 0 && v >= 0 && u < p.width && v < p.height)
            top = at(u, v) < here || (at(u, v) == here && (dy > 0 || (dy == 0 && dx > 0)));
      if (top) out.push_back({{x, y}, here});
    }
  return out;
}

double bilinear(const GreyPicture &p, double x, double y) {
  const int u = static_cast<int>(x), v = static_cast<int>(y);
  const double a = x - u, b = y - v;
  return (1 - b) * ((1 - a) * p.at(u, v) + a * p.at(u + 1, v)) +
         b * ((1 - a) * p.at(u, v + 1) + a * p.at(u + 1, v + 1));
}

}  // namespace

bool refine_corner(const GreyPicture &picture, int half_window, Vec2 &corner) {
  const Vec2 start = corner;
  const double sigma = 0.5 * half_window + 0.5;
  for (int iteration = 0; iteration < 30; iteration++) {
    const double margin = half_window + 2;
    if (!(corner.x() > margin && corner.y() > margin && corner.x() < picture.width - 1 - margin &&
          corner.y() < picture.height - 1 - margin))
      return false;
    Eigen::Matrix2d N = Eigen::Matrix2d::Zero();
    Vec2 b = Vec2::Zero();
    for (int j = -half_window; j <= half_window; j++)
      for (int i = -half_window; i <= half_window; i++) {
        const Vec2 q = corner + Vec2(i, j);
        const Vec2 g(bilinear(picture, q.x() + 1, q.y()) - bilinear(picture, q.x() - 1, q.y()),
                     bilinear(picture, q.x(), q.y() + 1) - bilinear(picture, q.x(), q.y() - 1));
        const double weight = std::exp(-0.5 * (i * i + j * j) / (sigma * sigma));
        const Eigen::Matrix2d G = weight * g * g.transpose();
        N += G;
        b += G * q;
      }
    if (!(N.determinant() > 1e-3 * N.trace() * N.trace()) || !(N.trace() > 50)) return false;
    const Vec2 next = N.ldlt().solve(b);
    const double step = (next - corner).norm();
    corner = next;
    if (!((corner - start).norm() <= half_window + 1)) return false;
    if (step < 1e-3) return true;
  }
  return true;
}

std::vector<CornerCandidate> find_saddles(const GreyPicture &picture) {
  std::vector<CornerCandidate> found = maxima(picture);
  for (const CornerCandidate &c : maxima(halved(picture)))
    found.push_back({2 * c.pixel + Vec2(0.5, 0.5), 0.9F * c.response});
  std::sort(found.begin(), found.end(),
            [](const CornerCandidate &a, const CornerCandidate &b) { return a.response > b.response; });
  if (found.size() > kCandidates) found.resize(kCandidates);
  std::vector<CornerCandidate> out;
  for (CornerCandidate c : found) {
    if (!refine_corner(picture, 4, c.pixel)) continue;
    const bool again = std::any_of(out.begin(), out.end(), [&](const CornerCandidate &other) {
      return (other.pixel - c.pixel).squaredNorm() < 9;
    });
    if (!again) out.push_back(c);
  }
  return out;
}

}  // namespace wm::calibrate
