// SPDX-License-Identifier: Apache-2.0
// Positions of the pictures in a video file. Containers are read from front to back and never held in memory; their own
// stamps, counts and indices are ignored. No field is trusted: sizes are checked against the file's.
#ifndef WM_RECORDING_CONTAINER_H
#define WM_RECORDING_CONTAINER_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/recording.h"
#include "waymark/status.h"

typedef enum picture_coding { PICTURE_JPEG, PICTURE_GREY } picture_coding;

// Position of one picture in the file.
typedef struct payload {
  uint64_t offset, length;
  uint64_t frame;  // its number: pictures of length 0 don't count
} payload;

typedef struct container container;
struct container {
  int fd;             // -1: a folder of files
  uint64_t size, at;  // of the file; position of the walk
  char path[WM_PATH_MAX];
  picture_coding coding;
  uint32_t width_px, height_px;  // by the container's header, 0 where absent
  uint64_t track;                // number of the video stream
  uint64_t next_frame;
  uint64_t empty;  // pictures of length 0 so far
  // The next picture. WM_OK; WM_END; WM_BAD_DATA: corrupt from here on (text in err); WM_IO.
  wm_status (*next)(container *self, payload *out, wm_error *err);
};

// By the file's first bytes: RIFF or EBML. WM_NOT_FOUND, WM_IO, WM_UNSUPPORTED, WM_BAD_DATA.
wm_status container_open(container *self, const char *path, wm_error *err);
void container_close(container *self);
// Reads a picture's bytes; `out` holds payload.length. WM_BAD_DATA where the file ends before.
wm_status container_read(const container *self, const payload *picture, uint8_t *out, wm_error *err);

// For the parsers: exactly so many bytes at an offset; WM_END where the file ends before.
wm_status container_bytes(const container *self, uint64_t offset, void *out, size_t count, wm_error *err);
wm_status container_fail(const container *self, wm_error *err, wm_status status, uint64_t offset, const char *what);

// Reads up to the first picture: finds the video stream and its coding.
wm_status avi_open(container *self, wm_error *err);
wm_status mkv_open(container *self, wm_error *err);
// A folder of NNNNNN.jpg. Its pictures are found by their number alone.
wm_status folder_open(container *self, const char *path, wm_error *err);
// WM_NOT_FOUND without a file of this number.
wm_status folder_find(container *self, uint64_t frame, payload *out, wm_error *err);

#endif
