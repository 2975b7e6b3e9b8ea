// SPDX-License-Identifier: Apache-2.0
// What was played, as text and as JSON.
#ifndef WAYMARK_CLI_PLAY_REPORT_H
#define WAYMARK_CLI_PLAY_REPORT_H

#include "cli/play/places.h"

typedef struct play_report {
  const player *player;
  const play_places *places;
  const char *recording;
  const char *state;  // "playing", "done", "interrupted"
  double took_s;
} play_report;

// Faults that this player does not cause, before it begins.
void report_left_out(const play_report *self, FILE *to);
// Per stream: sent, not sent, how late; what has no place; faults.
void report_print(const play_report *self, FILE *to);
// The recording's streams in JSON, `waymark-play-streams/1`: a stream's kind is can, picture or message.
void report_streams(const wm_play *play, const char *recording, FILE *to);
// What was played in JSON, over the file that is there. `waymark-play/1`.
wm_status report_write_json(const play_report *self, const char *path, wm_error *err);

#endif
