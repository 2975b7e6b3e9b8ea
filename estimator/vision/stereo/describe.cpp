// SPDX-License-Identifier: Apache-2.0
#include "vision/stereo/describe.hpp"

#include <array>
#include <cmath>

namespace wm {
namespace {

constexpr int kPairs = 256;
// Radius of the pattern: on the ground, and its limits in the picture. On a drawn floor seen from 2.4 m, again turned
// by 20 degrees and 10 % higher, 19 of 19 points that both pictures have are found; with 0.10 m at half the size 8.
constexpr double kRadius_m = 0.24, kRadiusLeast_px = 8.0, kRadiusMost_px = 40.0;
constexpr int kLevel = 2;      // a quarter of the size: places are means of about 8 x 8 pixels
constexpr int kUnit = 64;      // of the pattern's coordinates: its radius
constexpr int kFraction = 16;  // of a pixel, in which places are rounded

struct place_pair {
  int8_t x[2], y[2];
};

// Places drawn about the middle, denser there (sums of four even draws), by a fixed generator [Knuth1997, 3.3.4].
constexpr std::array<place_pair, kPairs> make_pattern() {
  std::array<place_pair, kPairs> out{};
  uint64_t state = 1;
  const auto draw = [&state]() {
    int sum = 0;
    for (int i = 0; i < 4; i++) {
      state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
      sum += static_cast<int>(state >> 58);  // 0 to 63
    }
    return sum / 2 - kUnit + 1;  // -63 to 63, sigma 18
  };
  for (place_pair &pair : out)
    for (int end = 0; end < 2; end++) {
      do {
        pair.x[end] = static_cast<int8_t>(draw());
        pair.y[end] = static_cast<int8_t>(draw());
      } while (pair.x[end] * pair.x[end] + pair.y[end] * pair.y[end] > kUnit * kUnit);
    }
  return out;
}
constexpr std::array<place_pair, kPairs> kPattern = make_pattern();

// Bilinear, times kFraction squared.
int32_t grey_at(const grey_plane &plane, double u, double v) {
  const auto x = static_cast<int32_t>(std::floor(u * kFraction + 0.5)),
             y = static_cast<int32_t>(std::floor(v * kFraction + 0.5));
  const int32_t right = x & (kFraction - 1), down = y & (kFraction - 1);
  const uint8_t *from = plane.grey + static_cast<ptrdiff_t>(y / kFraction) * plane.width + x / kFraction;
  const int32_t above = from[0] * (kFraction - right) + from[1] * right;
  const int32_t below = from[plane.width] * (kFraction - right) + from[plane.width + 1] * right;
  return above * (kFraction - down) + below * down;
}

// Direction from the middle to the patch's centre of brightness: cosine and sine; none (1, 0).
void direction_of(const grey_plane &plane, double u, double v, double radius, double out[2]) {
  const auto reach = static_cast<int32_t>(radius);
  int64_t across = 0, down = 0;
  const auto x = static_cast<int32_t>(u), y = static_cast<int32_t>(v);
  for (int32_t j = -reach; j <= reach; j++)
    for (int32_t i = -reach; i <= reach; i++) {
      if (i * i + j * j > reach * reach) continue;
      const int32_t grey = plane.grey[static_cast<ptrdiff_t>(y + j) * plane.width + x + i];
      across += static_cast<int64_t>(i) * grey;
      down += static_cast<int64_t>(j) * grey;
    }
  const auto a = static_cast<double>(across), d = static_cast<double>(down);
  const double length = std::sqrt(a * a + d * d);
  out[0] = length > 0.0 ? a / length : 1.0;
  out[1] = length > 0.0 ? d / length : 0.0;
}

}  // namespace

void describe(const pyramid &picture, const pixel &at, double px_per_m, uint64_t out[4]) {
  for (int i = 0; i < 4; i++) out[i] = 0;
  const grey_plane &plane = picture.level[kLevel];
  double radius = kRadius_m * px_per_m;
  if (!(radius > kRadiusLeast_px)) radius = kRadiusLeast_px;
  if (!(radius < kRadiusMost_px)) radius = kRadiusMost_px;
  const double scale = 1.0 / (1 << kLevel), u = scale * at.u, v = scale * at.v;
  radius *= scale;
  const double margin = radius + 2.0;
  if (!(u > margin) || !(v > margin) || !(u < plane.width - margin) || !(v < plane.height - margin)) return;
  double turn[2];
  direction_of(plane, u, v, radius, turn);
  const double step = radius / kUnit, c = step * turn[0], s = step * turn[1];
  for (int i = 0; i < kPairs; i++) {
    int32_t grey[2];
    for (int end = 0; end < 2; end++) {
      const double x = kPattern[static_cast<size_t>(i)].x[end], y = kPattern[static_cast<size_t>(i)].y[end];
      grey[end] = grey_at(plane, u + (c * x - s * y), v + (s * x + c * y));
    }
    out[i / 64] = out[i / 64] << 1 | static_cast<uint64_t>(grey[0] < grey[1]);
  }
  if ((out[0] | out[1] | out[2] | out[3]) == 0) out[3] = 1;  // 0 is none
}

}  // namespace wm
