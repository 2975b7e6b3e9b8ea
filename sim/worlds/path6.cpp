// SPDX-License-Identifier: Apache-2.0
#include "worlds/path6.h"

#include <algorithm>
#include <utility>

#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

std::array<double, 6> values(const Knot6 &k) { return {k.x_m, k.y_m, k.z_m, k.roll_rad, k.pitch_rad, k.yaw_rad}; }

}  // namespace

// Clamped cubic splines in Hermite form: the slopes m of a spline whose second derivative is continuous satisfy
// m[i-1]/h0 + 2 m[i] (1/h0 + 1/h1) + m[i+1]/h1 = 3 ((y[i]-y[i-1])/h0^2 + (y[i+1]-y[i])/h1^2), m = 0 at the ends.
Path6::Path6(std::vector<Knot6> knots) : knots_(std::move(knots)), slopes_(knots_.size()) {
  const size_t n = knots_.size();
  if (n < 3) return;
  for (size_t c = 0; c < 6; c++) {
    std::vector<double> upper(n, 0.0), right(n, 0.0);
    for (size_t i = 1; i + 1 < n; i++) {
      const double h0 = knots_[i].t_s - knots_[i - 1].t_s, h1 = knots_[i + 1].t_s - knots_[i].t_s;
      const double y0 = values(knots_[i - 1])[c], y1 = values(knots_[i])[c], y2 = values(knots_[i + 1])[c];
      const double pivot = 2 * (1 / h0 + 1 / h1) - upper[i - 1] / h0;
      upper[i] = 1 / h1 / pivot;
      right[i] = (3 * ((y1 - y0) / (h0 * h0) + (y2 - y1) / (h1 * h1)) - right[i - 1] / h0) / pivot;
    }
    for (size_t i = n - 1; i-- > 1;) slopes_[i][c] = right[i] - upper[i] * slopes_[i + 1][c];
  }
}

State6 Path6::at(double t_s) const {
  State6 out{};
  if (knots_.empty()) return out;
  const double t = std::clamp(t_s, knots_.front().t_s, knots_.back().t_s);
  auto next = std::upper_bound(knots_.begin(), knots_.end(), t, [](double v, const Knot6 &k) { return v < k.t_s; });
  const size_t i = static_cast<size_t>(std::clamp<std::ptrdiff_t>(
      next - knots_.begin() - 1, 0, std::max<std::ptrdiff_t>(0, static_cast<std::ptrdiff_t>(knots_.size()) - 2)));
  const size_t j = std::min(i + 1, knots_.size() - 1);
  const double h = knots_[j].t_s - knots_[i].t_s, u = h > 0 ? (t - knots_[i].t_s) / h : 0;
  const auto a = values(knots_[i]), b = values(knots_[j]);
  std::array<double, 6> y{}, d{};
  for (size_t c = 0; c < 6; c++) {
    const double m0 = slopes_[i][c] * h, m1 = slopes_[j][c] * h, rise = b[c] - a[c];
    y[c] = a[c] + u * (m0 + u * (3 * rise - 2 * m0 - m1 + u * (m0 + m1 - 2 * rise)));
    if (h > 0) d[c] = (m0 + u * (2 * (3 * rise - 2 * m0 - m1) + 3 * u * (m0 + m1 - 2 * rise))) / h;
  }
  const auto [sr, cr] = wm::sincos(y[3]);
  const auto [sp, cp] = wm::sincos(y[4]);
  const auto [sy, cy] = wm::sincos(y[5]);
  out.xyz_m = {y[0], y[1], y[2]};
  out.rpy_rad = {y[3], y[4], y[5]};
  // Rᵀ v.
  out.velocity_body_mps = {cy * cp * d[0] + sy * cp * d[1] - sp * d[2],
                           (cy * sp * sr - sy * cr) * d[0] + (sy * sp * sr + cy * cr) * d[1] + cp * sr * d[2],
                           (cy * sp * cr + sy * sr) * d[0] + (sy * sp * cr - cy * sr) * d[1] + cp * cr * d[2]};
  // Rates of the angles to the rate of the body (REP 103 axes, yaw first).
  out.rate_body_radps = {d[3] - d[5] * sp, d[4] * cr + d[5] * sr * cp, -d[4] * sr + d[5] * cr * cp};
  return out;
}

}  // namespace wm::sim
