// SPDX-License-Identifier: Apache-2.0
#include "vision/markers/print_reader.hpp"

#include "math/eigen.hpp"

namespace wm {

namespace {

constexpr int kSamples = 12;             // along a side, for black and for white. Not swept
constexpr double kMiddle = 0.2;          // of a module, from its middle: within the part that blur leaves
constexpr double kContrastMin_grey = 1;  // between the interpolated white and black at a module

}  // namespace

void shade::add(double x, double y, double grey) {
  const double row[3] = {1, x, y};
  for (int i = 0; i < 3; i++) {
    right[i] += row[i] * grey;
    for (int k = 0; k < 3; k++) normal[i][k] += row[i] * row[k];
  }
}

bool shade::solve() {
  vector<3> x;
  if (!solve_positive<3, 1>(map(normal), map(right), &x)) return false;
  a = x(0), b = x(1), c = x(2);
  return true;
}

bool print_reader::module(double x, double y, double *out) const {
  const double off = kMiddle * module_size;
  double sum = 0, one;
  for (int i = 0; i < 5; i++) {
    const double dx = i == 0 ? 0 : i % 2 ? off : -off, dy = i == 0 ? 0 : i < 3 ? off : -off;
    if (!grey(x + dx, y + dy, &one)) return false;
    sum += one;
  }
  *out = sum / 5;
  return true;
}

bool print_reader::measure_shades(const double (*outline)[2], int count, double white_scale, double black_scale) {
  white = black = shade{};
  int used = 0;
  for (int side = 0; side < count; side++) {
    const double *a = outline[side], *b = outline[side + 1 < count ? side + 1 : 0];
    for (int i = 0; i < kSamples; i++) {
      const double t = (i + 0.5) / kSamples, x = a[0] + t * (b[0] - a[0]), y = a[1] + t * (b[1] - a[1]);
      double low, high;
      if (!grey(black_scale * x, black_scale * y, &low) || !grey(white_scale * x, white_scale * y, &high)) continue;
      black.add(black_scale * x, black_scale * y, low);
      white.add(white_scale * x, white_scale * y, high);
      used++;
    }
  }
  return 2 * used > count * kSamples && white.solve() && black.solve();
}

bool print_reader::level(double x, double y, double *out) const {
  double grey;
  if (!module(x, y, &grey)) return false;
  const double low = black.at(x, y), high = white.at(x, y);
  if (!(high - low > kContrastMin_grey)) return false;
  *out = (grey - 0.5 * (low + high)) / (high - low);
  return true;
}

bool is_black_module(const double *level, int across, int i, double sharpen) {
  const int x = i % across, y = i / across;
  double around = 0;
  int count = 0;
  const auto add = [&](bool there, int k) {
    if (there) around += level[k], count++;
  };
  add(x > 0, i - 1);
  add(x + 1 < across, i + 1);
  add(y > 0, i - across);
  add(y + 1 < across, i + across);
  return level[i] + sharpen * (count * level[i] - around) < 0;
}

}  // namespace wm
