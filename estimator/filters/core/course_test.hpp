// SPDX-License-Identifier: Apache-2.0
// Positions against the motion between them, for the monitor: whether the way turns to the side to which the measured
// turn does, and whether a vehicle can drive such turns.
#ifndef WAYMARK_ESTIMATOR_CORE_COURSE_TEST_HPP
#define WAYMARK_ESTIMATOR_CORE_COURSE_TEST_HPP

#include "waymark/monitor.h"

namespace wm {

void course_begin(wm_monitor_course *self);
// Dead reckoning goes on until the estimate's stamp.
void course_move(wm_monitor_course *self, const wm_estimate &e);
void course_take(wm_monitor_course *self, wm_time_ns t_ns, const wm_position &position);
bool course_contradicts(const wm_monitor_course &self);
// Probability that turn or positions are mirrored, and the pose that is right then.
double course_mirrored(const wm_monitor_course &self);
wm_pose2 course_mirror_image(const wm_monitor_course &self);

}  // namespace wm

#endif
