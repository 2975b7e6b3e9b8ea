// SPDX-License-Identifier: Apache-2.0
// Lines of a text file of any size through a fixed buffer.
#ifndef WM_RECORDING_LINES_H
#define WM_RECORDING_LINES_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/recording.h"
#include "waymark/status.h"

#define LINES_BUFFER_BYTES 65536  // also the longest line that is read

typedef struct line_reader {
  int fd;
  char path[WM_PATH_MAX];
  char *buffer;
  size_t begin, end;
  int ended;
  char line_end;  // '\n', or '\r' in a file without any '\n'; '\0': nothing is read yet
  long number;    // of the line handed out last, from 1
} line_reader;

wm_status lines_open(line_reader *self, const char *path, wm_error *err);
void lines_close(line_reader *self);
// The next line without its end (LF, CRLF or CR; the last one may lack it; a byte order mark is removed). *text is
// valid until the next call. *too_long: the line exceeded the buffer; only its number is known. WM_OK, WM_END, WM_IO.
wm_status lines_next(line_reader *self, const char **text, size_t *length, int *too_long, wm_error *err);

#endif
