// SPDX-License-Identifier: Apache-2.0
#include "filters/core/turn_check.hpp"

#include <cmath>
#include <limits>

namespace wm {
namespace {

// Another sign; another unit: degrees for radians, of which next to nothing is right.
constexpr double kFactor[] = {-1.0, 0.0};
constexpr double kNisMost = 9.0;     // an outlier has no more weight
constexpr double kLinear_rad = 0.5;  // a larger shift of the heading is beyond the derivatives
// Nats. On 30 good drives (docs/reports/archive-motion.md, turn rates) the sum stays below 12, where commands are
// obeyed by half; mistakes reach the most, which other evidence takes back within as many observations.
constexpr double kAlarm = 20.0, kMost = 40.0;

double clipped(double z) {
  const double nis = square(z);
  return nis < kNisMost ? nis : kNisMost;
}

}  // namespace

void turn_check::init() {
  restart();
  for (double &n : nats_) n = 0.0;
}

void turn_check::restart() {
  for (double &by : by_) by = 0.0;
}

void turn_check::move(double x_m, double y_m, double turn_rad) {
  by_[0] -= y_m * by_[2];
  by_[1] += x_m * by_[2];
  by_[2] += turn_rad;
}

void turn_check::fade_correlated(double left) {
  for (int i = noise_adaption::kPose; i < kBlock; i++) by_[i] *= left;
}

void turn_check::update(const noise_adaption::row &r) {
  double shift = 0.0;
  for (int i = 0; i < kBlock; i++) shift += r.by[i] * by_[i];
  const double sigma = std::sqrt(r.variance), z = r.innovation / sigma, by = shift / sigma;
  for (int k = 0; k < kAlternatives; k++) {
    const double off = kFactor[k] - 1.0;
    if (std::fabs(off * by_[2]) > kLinear_rad) continue;
    const double sum = nats_[k] + 0.5 * (clipped(z) - clipped(z - off * by));
    nats_[k] = sum < 0.0 ? 0.0 : sum > kMost ? kMost : sum;
  }
  for (int i = 0; i < kBlock; i++) by_[i] -= r.gain[i] * shift;
}

void turn_check::list(calibration_list *out) const {
  const int best = nats_[0] >= nats_[1] ? 0 : 1;
  if (nats_[best] <= kAlarm) return;
  out->add("motion.turn_factor", kFactor[best], std::numeric_limits<double>::quiet_NaN());
  out->alarm(WM_ALARM_TURN, kFactor[best]);
}

}  // namespace wm
