// SPDX-License-Identifier: Apache-2.0
// Two measurements of one quantity, compared over a drive: sign, factor, axis, zeros.
#ifndef WAYMARK_CLI_CHECK_COMPARISONS_H
#define WAYMARK_CLI_CHECK_COMPARISONS_H

#include <stdio.h>

#include "cli/check/channels.h"
#include "findings/findings.h"
#include "fusion/assembly.h"

// Whether a finding of fact says that this channel's clock or counter is broken, so that no other channel is compared
// with it.
int comparisons_is_broken(const channel *c, const wm_assembly *assembly, const wm_findings *found);
// Findings about the sensors that contradict the others.
void comparisons_judge(const channels *self, const wm_assembly *assembly, wm_findings *out);
// A line for each pair: "compared  A with B: 0.99 times, r 0.98", or that the drive does not show it.
void comparisons_print(const channels *self, const wm_assembly *assembly, FILE *to);
// Findings about clocks that run apart, by the turns of two sources.
void drifts_judge(const channels *self, const wm_assembly *assembly, wm_findings *out);

#endif
