// SPDX-License-Identifier: Apache-2.0
// looked-for.csv of a run: how often each landmark of a detector's map was found, and the reasons where it was not.
#ifndef WAYMARK_OUTPUT_SEARCH_OUTCOME_FILE_H
#define WAYMARK_OUTPUT_SEARCH_OUTCOME_FILE_H

#include "sources/vision.h"
#include "waymark/status.h"

// Writes nothing without a detector of known landmarks (`vision` may be NULL).
wm_status wm_write_search_outcomes(const char *dir, wm_vision *vision, wm_error *err);

#endif
