// SPDX-License-Identifier: Apache-2.0
#include "filters/core/scale_test.hpp"

#include <cmath>
#include <iterator>

#include "filters/core/noise_adaption.hpp"
#include "math/elementary.hpp"
#include "motion/motion_kind.hpp"
#include "sensors/sensor_model.hpp"

namespace wm {
namespace {

constexpr double kMost = 1.2, kSigmas = 5.0;
// Sigmas, of all lengths together. With default priors SLAM on 16 real recordings reaches 1.4.
constexpr double kLengthSigmas = 3.5;
// The motion's terms that are scales.
constexpr struct {
  int term;
  bool is_length;
} kScales[] = {{WM_SPEED_SCALE, true}, {WM_YAW_RATE_SCALE, false}, {WM_LEFT_SCALE, true},
               {WM_RIGHT_SCALE, true}, {WM_TRACK_SCALE, false},    {WM_SIDE_SCALE, true}};
// Each factor of noise, each scale, the lengths together, the lasting error, the turn.
static_assert(noise_adaption::kFactors + std::size(kScales) + kMaxSensors + 3 <= WM_ALARMS_MAX);

scale_judgement judge(double prior, double prior_sigma, bool is_length, double value, double sigma) {
  if (!(prior_sigma > 0.0)) return {false, 0.0};
  const double ratio = value / prior, off = value - prior, spread = larger(prior_sigma, sigma);
  return {(ratio > kMost || ratio < 1.0 / kMost) && std::fabs(off) > kSigmas * spread,
          is_length ? square(off / spread) : 0.0};
}

}  // namespace

scale_judgement judge_motion_scale(const wm_motion_states &states, int term, double value, double sigma) {
  for (const auto &scale : kScales)
    if (scale.term == term)
      return judge(start_value(states, term), start_sigma(states, term), scale.is_length, value, sigma);
  return {false, 0.0};
}

scale_judgement judge_range_scale(const wm_sighting_params &sightings, double value, double sigma) {
  return judge(1.0, std::fabs(sightings.states.sigma[WM_SENSOR_ROW_kRangeScale]), true, value, sigma);
}

bool lengths_contradict(double squares) { return squares > square(kLengthSigmas); }

}  // namespace wm
