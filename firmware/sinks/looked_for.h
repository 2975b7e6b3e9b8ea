// SPDX-License-Identifier: Apache-2.0
// looked-for.csv of a run: each landmark of a detector's map, and how often it was found, or why not.
#ifndef WAYMARK_FIRMWARE_LOOKED_FOR_H
#define WAYMARK_FIRMWARE_LOOKED_FOR_H

#include "waymark/status.h"
#include "waymark/vision.h"

// Writes nothing where no detector of known landmarks looked (`vision` may be NULL).
wm_status wm_write_looked_for(const char *dir, wm_vision *vision, wm_error *err);

#endif
