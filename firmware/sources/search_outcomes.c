// SPDX-License-Identifier: Apache-2.0
#include "sources/search_outcomes.h"

#include <stdlib.h>
#include <string.h>

#define NOTHING UINT8_MAX

int search_outcomes_open(search_outcomes *self, size_t appearances) {
  *self = (search_outcomes){.capacity = appearances};
  size_t n = appearances > 0 ? appearances : 1;
  self->newest = calloc(n, sizeof *self->newest);
  self->row_of = calloc(n, sizeof *self->row_of);
  self->best = calloc(n, sizeof *self->best);
  self->rows = calloc(n, sizeof *self->rows);
  return self->newest && self->row_of && self->best && self->rows;
}

void search_outcomes_close(search_outcomes *self) {
  free(self->newest);
  free(self->row_of);
  free(self->best);
  free(self->rows);
  *self = (search_outcomes){0};
}

// The detector lists its landmarks in the same order for each picture.
static void name_rows(search_outcomes *self) {
  for (size_t i = 0; i < self->entries; i++) {
    size_t row = 0;
    while (row < self->count && self->rows[row].landmark_id != self->newest[i].landmark_id) row++;
    if (row == self->count) self->rows[self->count++].landmark_id = self->newest[i].landmark_id;
    self->row_of[i] = (uint32_t)row;
  }
}

// The best outcome among a landmark's appearances; outcomes are numbered by how far the search came.
static uint8_t better(uint8_t a, uint8_t b) {
  if (a == NOTHING) return b;
  if (a == WM_LOOK_FOUND || b == WM_LOOK_FOUND) return WM_LOOK_FOUND;
  return a > b ? a : b;
}

void search_outcomes_take(search_outcomes *self, const wm_detector *detector, const void *state,
                          uint64_t sum[WM_LOOK_COUNT]) {
  if (!detector->looked_for) return;
  size_t entries = detector->looked_for(state, self->newest, self->capacity);
  if (entries > self->capacity) entries = self->capacity;
  if (self->count == 0) {
    self->entries = entries;
    name_rows(self);
  }
  if (entries != self->entries) return;
  memset(self->best, NOTHING, self->count);
  for (size_t i = 0; i < entries; i++) {
    uint8_t *best = &self->best[self->row_of[i]];
    *best = better(*best, self->newest[i].look);
  }
  for (size_t row = 0; row < self->count; row++) {
    if (self->best[row] >= WM_LOOK_COUNT) continue;
    self->rows[row].looks[self->best[row]]++;
    sum[self->best[row]]++;
  }
}
