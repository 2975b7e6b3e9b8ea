// SPDX-License-Identifier: Apache-2.0
// Scales of wheels, gyro and ranges against their priors.
#ifndef WAYMARK_ESTIMATOR_CORE_SCALE_TEST_HPP
#define WAYMARK_ESTIMATOR_CORE_SCALE_TEST_HPP

#include "motion/motion_params.h"
#include "sensors/sighting_params.h"

namespace wm {

struct scale_judgement {
  // It is off its prior by more than a fifth, and by more than five times the prior's sigma and its own.
  bool contradicts;
  // Where a robot maps by itself, wheels and ranges are its only standards of length. Square of how far a scale of one
  // of them is off its prior, in sigmas (chi-square, one degree of freedom); 0 of any other scale.
  double length_square;
};

// Of a term of the motion's calibration; one that is no scale contradicts nothing.
scale_judgement judge_motion_scale(const wm_motion_states &states, int term, double value, double sigma);
scale_judgement judge_range_scale(const wm_sighting_params &sightings, double value, double sigma);
// Whether the sum over all values is too large for the priors.
bool lengths_contradict(double squares);

}  // namespace wm

#endif
