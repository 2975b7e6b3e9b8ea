// SPDX-License-Identifier: Apache-2.0
// The player's state, for its three parts: the order of the data (play.c), faults (apply.c), pictures (convert.c).
#ifndef WM_PLAY_PLAYER_H
#define WM_PLAY_PLAYER_H

#include "files.h"
#include "jpeg.h"

#define PLAY_LOADS_MAX 64  // frames that are added: a generator for each fault and bus

// A stream with what is asked of it.
typedef struct play_state {
  play_file *file;
  uint32_t next_number;
  int is_left_out;
  char format[8];  // that is given out
  wm_time_ns delay_ns;
  payload held;  // the last picture before a fault that freezes
  int has_held;
} play_state;

typedef struct play_edge {
  wm_time_ns due_ns;
  size_t fault;
  int begins;
} play_edge;

typedef struct play_load {
  size_t fault;
  uint16_t stream;
  uint64_t next;  // frames before this one
} play_load;

struct wm_play {
  char dir[WM_PATH_MAX];
  wm_play_options options;
  play_file *file[WM_PLAY_STREAMS_MAX];
  size_t file_count;
  wm_play_stream stream[WM_PLAY_STREAMS_MAX];
  play_state state[WM_PLAY_STREAMS_MAX];
  size_t stream_count;
  double duration_s;
  wm_time_ns first_ns;           // on the recording's clock
  wm_time_ns from_ns, until_ns;  // of a pass, since first_ns
  uint32_t pass;
  wm_time_ns base_ns, last_ns;  // of this pass; the latest due time
  play_edge *edge;
  size_t edge_count, next_edge;
  play_load load[PLAY_LOADS_MAX];
  size_t load_count;
  wm_play_item again;  // a frame that comes twice
  int has_again;
  uint8_t *stored, *grey, *made;  // pictures: as stored, decoded, made anew
  size_t stored_max, grey_max, made_max;
  jpeg_decoder jpeg;
  play_datum datum;
};

// Makes the tables of begins, ends and added frames. WM_BAD_CONFIG: a fault of something that is not there.
wm_status play_faults_begin(wm_play *self, wm_error *err);
// Applies the faults to self->datum, due at `due_ns`. 1: *out is to be given out; 0: it is missing.
int play_apply(wm_play *self, uint16_t stream, uint32_t number, wm_time_ns due_ns, wm_play_item *out);
// When the next begin, end or added frame is due; INT64_MAX: none.
wm_time_ns play_fault_due_ns(const wm_play *self);
// That one.
void play_fault_item(wm_play *self, wm_play_item *out);

// Reads the picture of the item, and makes it what is asked for. WM_OK, WM_IO; WM_BAD_DATA: it can't be made.
wm_status play_convert(wm_play *self, const payload *picture, wm_play_item *item, double brightness, wm_error *err);

#endif
