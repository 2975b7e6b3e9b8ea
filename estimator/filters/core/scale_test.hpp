// SPDX-License-Identifier: Apache-2.0
// Scales of wheels, gyro and ranges against the sigmas that the configuration states for them, for the monitor: the
// same limits as those of `waymark check` at the end of a drive.
#ifndef WAYMARK_ESTIMATOR_CORE_SCALE_TEST_HPP
#define WAYMARK_ESTIMATOR_CORE_SCALE_TEST_HPP

#include "waymark/monitor.h"

namespace wm {

void scales_begin(const wm_setup &setup, double sigma[WM_MONITOR_SCALES]);
// Whether a value of a calibration is a scale that is off by more than a fifth and by more than five times its stated
// sigma and its own.
bool scale_contradicts(const double sigma[WM_MONITOR_SCALES], const wm_calibration_value &value);

}  // namespace wm

#endif
