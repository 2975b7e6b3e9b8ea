// SPDX-License-Identifier: Apache-2.0
// Whether rows of speed and turn rate are commands, which repeat until they change, or measurements, which have noise:
// by the share of the rows that equal the row before, while the robot moves. A measurement that is written several
// times, since its sensor is slower than the rows, repeats as well, but always as often: its runs have one length, or
// two neighbouring ones where the rates are no multiples. And its noise changes both numbers at a time, of a command
// mostly one changes.
#ifndef WAYMARK_REPEATED_ROWS_H
#define WAYMARK_REPEATED_ROWS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// Moving rows between two decisions. Of a longer run only so many rows count, since a measurement stands still, too:
// runs of 4 or 16 separate worse.
#define WM_REPEATED_DECIDE 64
#define WM_REPEATED_RUN 8
// Share of repeated rows above which they are commands, of the rows until then. On recordings it is at least 0.27 of
// commands and at most 0.12 of measured twists at any decision.
#define WM_REPEATED_SHARE 0.2
// Share of the runs that have the most frequent length above 1 or the next one, and of the changes that are of both
// numbers: of values that are written several times both are nearly 1. Of commands of people and programs the first is
// at most 0.37 at any decision; of a controller that is slower than the rows the second is at most 0.56.
#define WM_REPEATED_REGULAR 0.9
#define WM_REPEATED_BOTH 0.9

typedef enum wm_rows_kind { WM_ROWS_UNKNOWN = 0, WM_ROWS_MEASURED, WM_ROWS_COMMANDS } wm_rows_kind;

// All zeros at the start.
typedef struct wm_repeated_rows {
  double last_v, last_w;
  uint32_t moving, repeated;
  uint32_t run;   // repeated rows until now
  uint32_t kind;  // wm_rows_kind
  uint32_t was_moving;
  uint32_t changes, of_both;            // of the value, while it moved: all, and those of both numbers
  uint32_t ended[WM_REPEATED_RUN + 2];  // runs by their length, the last one: longer ones
} wm_repeated_rows;

static inline int wm_rows_are_regular(const wm_repeated_rows *self) {
  uint32_t all = 0, most = 0;
  for (int length = 1; length < WM_REPEATED_RUN + 2; length++) all += self->ended[length];
  for (int length = 2; length < WM_REPEATED_RUN; length++) {
    const uint32_t both = self->ended[length] + self->ended[length + 1];
    if (both > most) most = both;
  }
  return most > WM_REPEATED_REGULAR * all && self->of_both > WM_REPEATED_BOTH * self->changes;
}

static inline void wm_rows_note(wm_repeated_rows *self, double v_mps, double w_radps, int moving) {
  const int repeats = v_mps == self->last_v && w_radps == self->last_w;
  if (!repeats && self->was_moving) {
    self->ended[self->run < WM_REPEATED_RUN + 1 ? self->run + 1 : WM_REPEATED_RUN + 1]++;
    self->changes++;
    self->of_both += v_mps != self->last_v && w_radps != self->last_w;
  }
  self->run = repeats ? self->run + (self->run <= WM_REPEATED_RUN) : 0;
  if (moving && self->run <= WM_REPEATED_RUN) {
    self->repeated += self->run > 0;
    if (++self->moving % WM_REPEATED_DECIDE == 0)
      self->kind = self->repeated > WM_REPEATED_SHARE * self->moving && !wm_rows_are_regular(self) ? WM_ROWS_COMMANDS
                                                                                                   : WM_ROWS_MEASURED;
  }
  self->last_v = v_mps;
  self->last_w = w_radps;
  self->was_moving = (uint32_t)(moving != 0);
}

#ifdef __cplusplus
}
#endif

#endif
