// SPDX-License-Identifier: Apache-2.0
// Files at the end of a run: health.json, timing.json, map-estimate.csv.
#ifndef WAYMARK_OUTPUT_JSON_FILES_H
#define WAYMARK_OUTPUT_JSON_FILES_H

#include "output/run_folder.h"

wm_status wm_write_health_json(const char *dir, const wm_assembly *assembly, const wm_health *health,
                               const wm_findings *found, wm_error *err);
wm_status wm_write_map(const char *dir, const wm_estimator *estimator, const void *state, wm_error *err);
wm_status wm_write_timing_json(const char *dir, const wm_timing *timing, wm_error *err);

#endif
