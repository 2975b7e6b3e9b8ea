// SPDX-License-Identifier: Apache-2.0
// The bound of a published pose, with what else may be true by the estimator and by the monitor. Fixed cost.
#ifndef WAYMARK_FUSION_BOUND_H
#define WAYMARK_FUSION_BOUND_H

#include "fusion/fuser.h"
#include "rt/realtime.h"
#include "waymark/bounds.h"

// `fused`: the fuser's estimate; `now`: the same, carried on by odometry.
WM_REALTIME void wm_fuser_bound(wm_fuser *self, const wm_integrity *integrity, const wm_estimate *fused,
                                const wm_estimate *now, wm_bound *out);

#endif
