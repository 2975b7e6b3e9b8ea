// SPDX-License-Identifier: Apache-2.0
// Counts the search outcomes (wm_look) of each known landmark over all pictures of one camera.
#ifndef WAYMARK_SOURCES_SEARCH_OUTCOMES_H
#define WAYMARK_SOURCES_SEARCH_OUTCOMES_H

#include "sources/vision.h"
#include "waymark/detector.h"

typedef struct search_outcomes {
  size_t capacity;  // of appearances
  size_t entries;   // appearances of the detector; set by the first picture
  wm_looked_for *newest;
  uint32_t *row_of;  // of each entry: a landmark may have several appearances
  uint8_t *best;     // of each row in the newest picture
  wm_landmark_looks *rows;
  size_t count;
} search_outcomes;

// Room for `appearances`, from malloc. 0 without memory.
int search_outcomes_open(search_outcomes *self, size_t appearances);
void search_outcomes_close(search_outcomes *self);
// Counts the detector's newest picture, each landmark once, into the rows and into `sum`. No allocation.
void search_outcomes_take(search_outcomes *self, const wm_detector *detector, const void *state,
                          uint64_t sum[WM_LOOK_COUNT]);

#endif
