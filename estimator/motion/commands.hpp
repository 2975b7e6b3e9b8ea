// SPDX-License-Identifier: Apache-2.0
// Twists that are commands: what a drive makes of them. A drive takes speed and radius, with a largest radius and an
// integer overflow beyond (iRobot Create); it loses speed in turns. It obeys a change after a dead time (the lag), with
// a first-order response, and a rise later than a fall, since friction brakes both:
//   y' = (c - y) / response,  out = y - onset max(0, d|y|/dt) sign(y)
// Whether it is a drive by radius is a state, the share of gentle turns that are driven with the largest radius.
#ifndef WAYMARK_ESTIMATOR_MOTION_COMMANDS_HPP
#define WAYMARK_ESTIMATOR_MOTION_COMMANDS_HPP

#include "motion/step.hpp"

namespace wm {

// Whether a parameter of this model is set; else twists are measurements.
bool are_commands(const wm_motion_params &params);

// Turn rate that the drive makes of a commanded one.
double driven_rate(const wm_motion_params &params, double v_mps, double w_radps);

// The response at the input's beginning, behind the input before; nullptr: the robot has obeyed since long.
void begin_response(const wm_motion_params &params, const motion_input *before, motion_input *input);

// A command's segment: its input becomes the mean response, with its rises, what is left to change, and its end.
void respond(const wm_motion_params &params, const wm_motion_calibration &c, const wm_wheels &wheels,
             motion_segment *segment);

// Twist of a response with the loss at the onset and the share of gentle turns, then with the slowdown in turns,
// v = sign(v) max(0, |v| - slowdown w^2).
motion_twist twist_of_command(const planar_twist &response, const drive_terms &drive, const wm_motion_calibration &c,
                              double track_m);

// Noise of a change of command: the dead time differs each time by delay_sigma_s. The whole change of c adds
// (delay_sigma_s c)^2, however it is cut; a slow change adds less, as many small ones do.
void add_change_noise(const motion_segment &segment, const wm_motion_params &params, motion_noise *noise);

}  // namespace wm

#endif
