// SPDX-License-Identifier: Apache-2.0
// The estimator of a configuration that names none: chosen by the sources that are bound and by what is known of the
// place. docs/estimators.md has the table.
#ifndef WAYMARK_FUSION_CHOICE_H
#define WAYMARK_FUSION_CHOICE_H

#include "config/config.h"
#include "waymark/recording.h"

#ifdef __cplusplus
extern "C" {
#endif

// What decides.
typedef struct wm_choice_facts {
  uint32_t kinds;      // WM_EVENT_BIT of what the sources and detectors give
  int has_map;         // a floor plan: map.yaml
  int has_landmarks;   // landmarks.csv with a place at least
  int tracks_unknown;  // a detector whose landmarks are in no list: upright lines
  int measures_depth;  // a source of depths alone
} wm_choice_facts;

// The estimator for these facts, and why, in words for a user; NULL where they don't decide: `why` is what to write.
const wm_estimator *wm_choose(const wm_choice_facts *facts, const char **why);

// Chooses where the file names no estimator; else nothing changes. `recording` is open and has all its devices. `say`
// (may be NULL) gets what was chosen and why, then the configuration's warnings. WM_BAD_CONFIG: they don't decide.
wm_status wm_choose_estimator(wm_config *config, wm_recording *recording, void (*say)(void *context, const char *line),
                              void *context, wm_error *err);

#ifdef __cplusplus
}
#endif

#endif
