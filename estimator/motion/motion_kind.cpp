// SPDX-License-Identifier: Apache-2.0
#include "motion/motion_kind.hpp"

#include "motion/step.hpp"

namespace wm {
namespace {

constexpr uint32_t bit(int index) { return UINT32_C(1) << index; }
constexpr uint32_t kRates = bit(kSpeedScale) | bit(kYawRateScale) | bit(kYawRateBias) | bit(kRotationCenter);
constexpr uint32_t kTwistRates = kRates | bit(kSideScale);

// A twist of skid steer is by an effective track already, but of another floor.
constexpr double kSkidRateSigma = 0.2;

// The terms that have an effect, by motion_kind. A twist's wheel scales would only repeat its speed's and rate's.
constexpr uint32_t kTerms[] = {
    0,
    bit(kLeftScale) | bit(kRightScale) | bit(kTrackScale) | bit(kRotationCenter),
    kTwistRates | bit(kTrackScale),  // the track: of the wheels' difference as a second source of the heading
    bit(kSpeedScale) | bit(kSteeringOffset),
    kTwistRates,
    kTwistRates,
    kTwistRates | bit(kLag) | bit(kTurnSlowdown) | bit(kSpeedOnset) | bit(kTurnOnset) | bit(kGentleTurns),
    0,
};

// Noise per sqrt(s), by motion_kind; of a twist of unknown kind the larger one. Measured twists and gyros: flat within
// a factor of 2 on plaza, starry-night, comma2k19 and the crossings. Commands: regression of the turn's squared errors
// on the ten robots of mrclam, besides commands.delay_sigma_s: 0.005 and 0.11 to 0.13 over 2, 5 and 10 s alike.
// Steering: not swept.
constexpr rate_noise kNoise[] = {
    {0.03, 0.01, 0.03},   // unknown
    {0.03, 0.01, 0.03},   // ticks: only while their noise is not used
    {0.02, 0.004, 0.01},  // gyro
    {0.03, 0.01, 0.03},   // steering
    {0.06, 0.02, 0.13},   // twist
    {0.03, 0.01, 0.05},   // measured
    {0.06, 0.006, 0.12},  // commands
    {0.03, 0.01, 0.05},   // calibrated: only while their noise is not used
};

}  // namespace

bool is_state(double sigma, int term, motion_kind kind) {
  return sigma > 0.0 || (sigma < 0.0 && (kTerms[kind] & bit(term)));
}

double start_sigma(const wm_motion_states &states, int term) {
  const double sigma = states.sigma[term];
  const bool skids = sigma < 0.0 && states.drive == WM_DRIVE_SKID_STEER;
  if (skids && term == kTrackScale) return WM_SKID_TRACK_SIGMA;
  if (skids && term == kYawRateScale) return kSkidRateSigma;
  return sigma < 0.0 ? -sigma : sigma;
}

double start_value(const wm_motion_states &states, int term) {
  const bool skids = states.sigma[term] < 0.0 && term == kTrackScale && states.drive == WM_DRIVE_SKID_STEER;
  return skids ? WM_SKID_TRACK : kNeutralCalibration.value[term];
}

bool may_be_state(const wm_motion_states &states, int term, int model) {
  const double sigma = states.sigma[term];
  if (sigma < 0.0 && term == kSideScale && states.drive != WM_DRIVE_HOLONOMIC) return false;
  if (sigma < 0.0 && term == kRotationCenter && states.drive != WM_DRIVE_SKID_STEER) return false;
  static constexpr motion_kind kMost[] = {kKindUnknown,  kKindTicks,    kKindGyro,   kKindSteering,
                                          kKindCommands, kKindMeasured, kKindUnknown};
  return model == WM_MOTION_AUTO ? sigma != 0.0 : is_state(sigma, term, kMost[model]);
}

rate_noise rate_noise_of(const wm_motion_params &p, motion_kind kind) {
  rate_noise out = kNoise[kind];
  if (p.noise_speed_rel >= 0.0) out.speed_rel = p.noise_speed_rel;
  if (p.noise_yaw_rate_radps >= 0.0) out.yaw_rate_radps = p.noise_yaw_rate_radps;
  if (p.noise_yaw_rate_rel >= 0.0) out.yaw_rate_rel = p.noise_yaw_rate_rel;
  return out;
}

}  // namespace wm
