// SPDX-License-Identifier: Apache-2.0
// Findings of a run, for its user.
#ifndef WAYMARK_OUTPUT_RUN_FINDINGS_H
#define WAYMARK_OUTPUT_RUN_FINDINGS_H

#include <stddef.h>

#include "waymark/health.h"

// One line of text, without its end.
typedef void (*wm_finding_fn)(void *context, const char *line);

// Lateness above its bound with the bound that would suffice, stale sources, data lost or refused: a line each. Returns
// how many lines there were.
size_t wm_findings(const wm_health *health, wm_finding_fn say, void *context);

#endif
