// SPDX-License-Identifier: Apache-2.0
#include "filters/core/length_test.hpp"

#include <cmath>

#include "filters/core/noise_adaption.hpp"
#include "math/elementary.hpp"
#include "motion/motion_kind.hpp"
#include "sensors/sensor_model.hpp"

namespace wm {
namespace {

// Sigmas, of all lengths together. With default priors SLAM on 16 real recordings reaches 1.4.
constexpr double kLengthSigmas = 3.5;
// Each factor of noise, the lengths together, the lasting error, the turn, and values that are stated wrongly.
static_assert(noise_adaption::kFactors + 3 < WM_ALARMS_MAX);

double square_of(double prior, double prior_sigma, double value, double sigma) {
  return prior_sigma > 0.0 ? square((value - prior) / larger(prior_sigma, sigma)) : 0.0;
}

}  // namespace

double length_square(const wm_motion_states &states, int term, double value, double sigma) {
  const bool is_length =
      term == WM_SPEED_SCALE || term == WM_LEFT_SCALE || term == WM_RIGHT_SCALE || term == WM_SIDE_SCALE;
  return is_length ? square_of(start_value(states, term), start_sigma(states, term), value, sigma) : 0.0;
}

double length_square(const wm_sighting_params &sightings, double range_scale, double sigma) {
  return square_of(1.0, std::fabs(sightings.states.sigma[WM_SENSOR_ROW_kRangeScale]), range_scale, sigma);
}

bool lengths_contradict(double squares) { return squares > square(kLengthSigmas); }

}  // namespace wm
