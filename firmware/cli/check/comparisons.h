// SPDX-License-Identifier: Apache-2.0
// Two measurements of one quantity, compared over a drive: sign, factor, axis, zeros.
#ifndef WAYMARK_CLI_CHECK_COMPARISONS_H
#define WAYMARK_CLI_CHECK_COMPARISONS_H

#include <stdio.h>

#include "cli/check/channels.h"
#include "findings/findings.h"
#include "fusion/assembly.h"

// "wz_radps of imu"; of CAN the quantity alone. Returns out.
const char *comparisons_name(const channel *c, const wm_assembly *assembly, char *out, size_t capacity);
// Whether the accelerometer of this source shows that it hangs upside down.
int gravity_is_below(const channels *all, uint16_t source);
// The line that mounts an IMU which, on the axes of base_link as they are stated, has to be turned by so much more.
const char *gravity_mounting(const wm_assembly *assembly, double roll_deg, double pitch_deg, char *out,
                             size_t capacity);
// Findings about an IMU's axes and the unit of its accelerations.
void gravity_judge(const channels *self, const wm_assembly *assembly, wm_findings *out);
// Finds sensors that repeat a value while another one moves, and marks them.
void stuck_judge(channels *self, const wm_assembly *assembly, wm_findings *out);
// White noise of a rate by the drive, rad/s per sqrt(s); 0: what it shows is not white, or too short.
double comparisons_white_noise(const channel *c);
// Whether that is far above what is configured of a gyro. It then shows turns where there are none.
int comparisons_is_noisy(const channel *c, const wm_assembly *assembly);
void noise_judge(const channels *self, const wm_assembly *assembly, wm_findings *out);
// Whether a finding names this channel's clock or counter as broken. Then no other channel is compared with it.
int comparisons_is_broken(const channel *c, const wm_assembly *assembly, const wm_findings *found);
// Findings about the sensors that contradict the others.
void comparisons_judge(const channels *self, const wm_assembly *assembly, wm_findings *out);
// A line for each pair: "compared  A with B: 0.99 times, r 0.98", or that the drive does not show it.
void comparisons_print(const channels *self, const wm_assembly *assembly, FILE *to);
// Findings about clocks that run apart, by the turns of two sources.
void drifts_judge(const channels *self, const wm_assembly *assembly, wm_findings *out);

#endif
