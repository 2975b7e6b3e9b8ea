// SPDX-License-Identifier: Apache-2.0
// looked-for.csv of a run: each landmark of a detector's map, and how often it was found, or why not.
#ifndef WAYMARK_OUTPUT_SEARCH_OUTCOME_FILE_H
#define WAYMARK_OUTPUT_SEARCH_OUTCOME_FILE_H

#include "sources/vision.h"
#include "waymark/status.h"

// Writes nothing where no detector of known landmarks looked (`vision` may be NULL).
wm_status wm_write_search_outcomes(const char *dir, wm_vision *vision, wm_error *err);

#endif
