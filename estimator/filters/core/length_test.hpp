// SPDX-License-Identifier: Apache-2.0
// Where a robot maps by itself, wheels and ranges are its only standards of length. A chi-square of how far all of them
// are off what was stated.
#ifndef WAYMARK_ESTIMATOR_CORE_LENGTH_TEST_HPP
#define WAYMARK_ESTIMATOR_CORE_LENGTH_TEST_HPP

#include "motion/motion_params.h"
#include "sensors/sighting_params.h"

namespace wm {

// Square of how far a scale of lengths is off its prior, in sigmas; 0 of another term of the motion's calibration.
double length_square(const wm_motion_states &states, int term, double value, double sigma);
double length_square(const wm_sighting_params &sightings, double range_scale, double sigma);
// Whether the sum over all values is too large for the priors.
bool lengths_contradict(double squares);

}  // namespace wm

#endif
