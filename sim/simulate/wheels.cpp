// SPDX-License-Identifier: Apache-2.0
#include "simulate/wheels.h"

#include <algorithm>
#include <cmath>

#include "simulate/angle.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

constexpr double kSlipStep_s = 0.01;
constexpr double kSlipMemory_s = 5;  // slip wanders with this correlation time

}  // namespace

Wheels::Wheels(const Scenario &sc, const Random &random, const Drive &drive, const Drawn &drawn) : drive_(drive) {
  const wm_wheels &w = sc.robot.wheels;
  track_m_ = w.track_m * sc.motion.track_scale * (1 + drawn.track);
  heading0_rad_ = drive.at(0).heading_rad;
  for (int side = 0; side < 2; side++) radius_m_[side] = w.radius_m * (1 + drawn.wheel_radius[side]);
  if (sc.errors.slip > 0 || sc.errors.wheel_noise_sqrtm > 0 || !sc.faults.wheel_slip.empty()) slip(sc, random);
}

// First-order Gauss-Markov: stationary, of the deviation that the scenario says.
void Wheels::slip(const Scenario &sc, const Random &random) {
  const double keep = wm::exp(-kSlipStep_s / kSlipMemory_s), fresh = std::sqrt(1 - keep * keep);
  const auto steps = static_cast<uint64_t>(drive_.duration_s() / kSlipStep_s) + 2;
  for (uint64_t side = 0; side < 2; side++) {
    double share = random.normal(Stream::slip, 0, side), sum = 0;
    for (uint64_t k = 0; k < steps; k++) {
      slipped_m_[side].push_back(sum);
      const double t_s = static_cast<double>(k) * kSlipStep_s;
      double slip = sc.errors.slip * share, added_mps = 0;
      for (const Slip &fault : sc.faults.wheel_slip) {
        if (!fault.holds(t_s) || fault.wheel == 1 - static_cast<int>(side)) continue;
        slip += fault.share;
        added_mps += fault.added_mps;
      }
      const State now = drive_.at(t_s);
      const double rim_mps = now.speed_mps + (side == 0 ? -0.5 : 0.5) * track_m_ * now.yaw_rate_radps;
      sum += (slip * rim_mps + added_mps) * kSlipStep_s;
      if (sc.errors.wheel_noise_sqrtm > 0)
        sum += sc.errors.wheel_noise_sqrtm * std::sqrt(std::fabs(rim_mps) * kSlipStep_s) *
               random.normal(Stream::wheel_noise, k, side);
      share = keep * share + fresh * random.normal(Stream::slip, k + 1, side);
    }
  }
}

double Wheels::rolled_m(size_t side, double t_s) const {
  const State s = drive_.at(t_s);
  double rolled = s.way_m - s.carried_way_m +
                  (side == 0 ? -0.5 : 0.5) * track_m_ * (s.heading_rad - s.carried_heading_rad - heading0_rad_);
  if (const std::vector<double> &slipped = slipped_m_[side]; !slipped.empty()) {
    const double at = std::clamp(t_s / kSlipStep_s, 0.0, static_cast<double>(slipped.size() - 2));
    const auto i = static_cast<size_t>(at);
    rolled += slipped[i] + (at - static_cast<double>(i)) * (slipped[i + 1] - slipped[i]);
  }
  return rolled;
}

double Wheels::turns(size_t side, double t_s) const { return rolled_m(side, t_s) / (2 * kPi * radius_m_[side]); }

}  // namespace wm::sim
