// SPDX-License-Identifier: Apache-2.0
// Twists that are commands: what a drive makes of them. A drive takes speed and radius, with a largest radius and an
// integer overflow beyond (iRobot Create); it loses speed in turns, and obeys each change sooner or later.
#ifndef WAYMARK_ESTIMATOR_MOTION_COMMANDS_HPP
#define WAYMARK_ESTIMATOR_MOTION_COMMANDS_HPP

#include "motion/step.hpp"

namespace wm {

// Whether a parameter of this model is set; else twists are measurements.
bool are_commands(const wm_motion_params &params);

// Turn rate that the drive makes of a commanded one.
double driven_rate(const wm_motion_params &params, double v_mps, double w_radps);

// Twist with the calibration's slowdown in turns: v = sign(v) max(0, |v| - slowdown w^2).
motion_twist twist_of_command(double speed, double side, double rate, const wm_motion_calibration &c, double track_m);

// Noise of a change of command: its time and shape differ each time. Variances are proportional to the change, not to
// its square, so that a change in many small steps counts as one in a single step.
void add_change_noise(const motion_segment &segment, const wm_motion_params &params, motion_noise *noise);

}  // namespace wm

#endif
