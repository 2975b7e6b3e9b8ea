// SPDX-License-Identifier: Apache-2.0
// How likely an update's observation was before it was made.
#ifndef WAYMARK_OUTPUT_LIKELIHOOD_H
#define WAYMARK_OUTPUT_LIKELIHOOD_H

#include "waymark/pose.h"

#ifdef __cplusplus
extern "C" {
#endif

// Log density of an outlier, which has any value: over a turn, over 50 m, over a picture of 1000 px, over half a turn;
// of a length over 20 sigma, where that is more. `variance`: of the innovation; 0: not known.
double wm_outlier_log_density(unsigned residual, double variance);
// Observed minus expected; angles within half a turn.
double wm_innovation_difference(const wm_innovation *innovation);
// Log density of a Gaussian with the innovation's variance (> 0).
double wm_innovation_log_density(const wm_innovation *innovation);

#ifdef __cplusplus
}
#endif

#endif
