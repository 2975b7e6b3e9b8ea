// SPDX-License-Identifier: Apache-2.0
// Scales of wheels, gyro and ranges against their priors, for the monitor: the same limits as those of `waymark check`
// at the end of a drive.
#ifndef WAYMARK_ESTIMATOR_CORE_SCALE_TEST_HPP
#define WAYMARK_ESTIMATOR_CORE_SCALE_TEST_HPP

#include "waymark/monitor.h"

namespace wm {

void scales_begin(const wm_setup &setup, wm_monitor_scale scales[WM_MONITOR_SCALES]);
// Whether a value of a calibration is a scale that is off its prior by more than a fifth, and by more than five times
// the prior's sigma and its own.
bool scale_contradicts(const wm_monitor_scale scales[WM_MONITOR_SCALES], const wm_calibration_value &value);
// Where a robot maps by itself, wheels and ranges are its only standards of length. Square of how far a scale of one of
// them is off its prior, in sigmas (chi-square, one degree of freedom); 0 of any other value.
double length_contradiction(const wm_monitor_scale scales[WM_MONITOR_SCALES], const wm_calibration_value &value);
// Whether the sum over all values is too large for the priors.
bool lengths_contradict(double squares);

}  // namespace wm

#endif
