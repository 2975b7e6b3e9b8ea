// SPDX-License-Identifier: Apache-2.0
// Bounds of a pose for a stated risk: the least distances that its error exceeds with at most that probability. The
// error is a mixture: of the estimate's own, of other poses that are known, and of a pose anywhere else. Pure functions
// of constant memory; the same numbers give the same bits.
#ifndef WAYMARK_ESTIMATOR_BOUNDS_H
#define WAYMARK_ESTIMATOR_BOUNDS_H

#include <stddef.h>

#include "waymark/bound.h"
#include "waymark/estimator.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_integrity {
  double risk;                // of each bound of a pose: above 0, below 1
  double limit_m, limit_rad;  // 0: none
  int without_motion;         // no drive shows a heading, and a pose without one is usable where it has no limit
} wm_integrity;

// Another pose that may be the right one, as seen from the estimate.
typedef struct wm_other_pose {
  double distance_m, turn_rad;
  double sigma_m, sigma_rad;
  double probability;
} wm_other_pose;

wm_other_pose wm_other_pose_of(const wm_estimate *estimate, const wm_hypothesis *hypothesis);

// Of an estimate, and `count` other poses beside it, whose probabilities are a part of its lost_probability.
// `untested`: probability of a fault that no test could see yet (wm_monitor_untested).
// A bound grows with sigmas, distances and probabilities, and falls with the risk.
void wm_bound_of(const wm_estimate *estimate, double untested, const wm_integrity *integrity,
                 const wm_other_pose *others, size_t count, wm_bound *out);

#ifdef __cplusplus
}
#endif

#endif
