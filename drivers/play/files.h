// SPDX-License-Identifier: Apache-2.0
// The files of a recording as data for the player: CAN log, CSV streams, videos. Each gives its data in the order of
// the file.
#ifndef WM_PLAY_FILES_H
#define WM_PLAY_FILES_H

#include "arrival.h"
#include "container.h"
#include "waymark/play.h"

#define PLAY_MESSAGE_MAX 4096         // above observations_t with 64 sightings
#define PLAY_INTERFACES_MAX 16        // of a CAN log
#define PLAY_PICTURE_MAX (64u << 20)  // bytes of a stored picture; more is a corrupt length

// A datum as its file has it.
typedef struct play_datum {
  wm_time_ns due_ns, t_ns;  // on the recording's clock
  uint16_t stream;          // within its file
  wm_can_frame frame;
  payload picture;
  uint8_t message[PLAY_MESSAGE_MAX];
  uint32_t bytes;  // of the message
} play_datum;

typedef struct play_file play_file;
typedef struct play_file_ops {
  // The next datum; what can't be read is counted. WM_OK, WM_END, WM_IO.
  wm_status (*read)(play_file *self, play_datum *out, wm_error *err);
  // From the front again.
  wm_status (*rewind)(play_file *self, wm_error *err);
  // Bytes of a picture; NULL where the file has none.
  wm_status (*picture)(const play_file *self, const payload *picture, uint8_t *out, wm_error *err);
  void (*close)(play_file *self);
} play_file_ops;

struct play_file {
  const play_file_ops *ops;
  wm_play_stream stream[PLAY_INTERFACES_MAX];
  size_t stream_count;
  uint16_t first_stream;  // index of stream[0] in the player's list
  uint64_t unreadable;
  char first_problem[256];
  // Read one ahead: a stamp is checked against the one after it.
  arrival_order order;
  play_datum now, ahead;
  int has_now, has_ahead, ended;
};

void play_file_count(play_file *self, const char *why);

// *out is NULL where the recording has no such file.
wm_status play_can_open(const char *dir, play_file **out, wm_error *err);
// Stream number `index` of the recording format's list; *is_last: there are no more. Sightings: one file a sensor, by
// `sensor`, from 0.
wm_status play_rows_open(const char *dir, size_t index, size_t sensor, play_file **out, int *is_last, int *more_sensors,
                         wm_error *err);
wm_status play_pictures_open(const char *dir, const char *camera, const wm_play_options *options, play_file **out,
                             wm_error *err);

#endif
