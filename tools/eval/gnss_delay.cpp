// SPDX-License-Identifier: Apache-2.0
#include "eval/gnss_delay.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/failure.h"

namespace wm::tools {
namespace {

constexpr double kFrom_s = -0.5, kTo_s = 3;  // below 0: a computer whose clock is behind the receiver's
constexpr double kCoarse_s = 0.1, kFine_s = 0.01;
constexpr double kKept = 0.8;    // the farthest positions are multipath rather than delay
constexpr double kMoves = 1e-3;  // m: a cost that a second of delay changes by less does not depend on it

// Root mean square of the nearest kKept of the distances.
double cost_of(const Trajectory &run, const std::vector<Pose> &gnss, const CompareOptions &options, double delay_s) {
  const Comparison c = compare(run, without_delay(gnss, delay_s), options);
  std::vector<double> squares;
  for (const Sample &s : c.samples) squares.push_back(s.error_m.squaredNorm());
  std::sort(squares.begin(), squares.end());
  const size_t kept = std::max<size_t>(1, static_cast<size_t>(kKept * static_cast<double>(squares.size())));
  double sum = 0;
  for (size_t i = 0; i < kept; i++) sum += squares[i];
  return std::sqrt(sum / static_cast<double>(kept));
}

}  // namespace

std::vector<Pose> without_delay(const std::vector<Pose> &gnss, double delay_s) {
  std::vector<Pose> out = gnss;
  for (Pose &p : out) p.t_ns -= std::llround(delay_s * 1e9);
  return out;
}

GnssDelay find_gnss_delay(const Trajectory &run, const std::vector<Pose> &gnss, const CompareOptions &options) {
  GnssDelay out{0, cost_of(run, gnss, options, 0), 0};
  double worst_m = out.rms_m = out.rms_before_m;
  const auto search = [&](double from_s, double to_s, double step_s) {
    const auto steps = static_cast<int>(std::lround((to_s - from_s) / step_s));
    for (int i = 0; i <= steps; i++) {
      const double delay_s = from_s + i * step_s, cost_m = cost_of(run, gnss, options, delay_s);
      worst_m = std::max(worst_m, cost_m);
      if (cost_m < out.rms_m) out.rms_m = cost_m, out.delay_s = delay_s;
    }
  };
  search(kFrom_s, kTo_s, kCoarse_s);
  const double coarse_s = out.delay_s;
  search(coarse_s - kCoarse_s, coarse_s + kCoarse_s, kFine_s);
  if (worst_m - out.rms_m < kMoves)
    throw Failure("--take-out-delay: the robot hardly moves: the receiver's delay is not observable");
  if (out.delay_s <= kFrom_s || out.delay_s >= kTo_s)
    throw Failure("--take-out-delay: no delay from " + std::to_string(kFrom_s) + " to " + std::to_string(kTo_s) +
                  " s fits best; are both clocks the same?");
  return out;
}

}  // namespace wm::tools
