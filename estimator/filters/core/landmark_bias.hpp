// SPDX-License-Identifier: Apache-2.0
// Innovations of each landmark over some 20 s, for the monitor: whether several of them have a mean. Means of opposite
// sign cancel in the mean of a source: a mirrored map, a bearing of the wrong sign, permuted identities.
#ifndef WAYMARK_ESTIMATOR_CORE_LANDMARK_BIAS_HPP
#define WAYMARK_ESTIMATOR_CORE_LANDMARK_BIAS_HPP

#include "waymark/monitor.h"

namespace wm {

void landmark_bias_clear(wm_monitor_landmarks *self);
// An innovation of a landmark, fused or refused by a gate.
void landmark_bias_take(wm_monitor_landmarks *self, const wm_innovation &i);
// Tests what was taken until then; call it a few times a second.
void landmark_bias_test(wm_monitor_landmarks *self, wm_time_ns t_ns);
bool landmark_bias_contradicts(const wm_monitor_landmarks &self);

}  // namespace wm

#endif
