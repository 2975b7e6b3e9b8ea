// SPDX-License-Identifier: Apache-2.0
// Lines of a text file of any size, also one that is packed by gzip, through a fixed buffer.
#ifndef WM_RECORDING_LINES_H
#define WM_RECORDING_LINES_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/recording.h"
#include "waymark/status.h"

#define LINES_BUFFER_BYTES 65536  // also the longest line that is read

typedef struct line_reader {
  struct gzFile_s *file;  // zlib's: it hands on what is not packed as it is
  char path[WM_PATH_MAX];
  char *buffer;
  size_t begin, end;
  int ended;
  int is_cut;     // the packed file ends too early, or is damaged
  char line_end;  // '\n', or '\r' in a file without any '\n'; '\0': nothing is read yet
  long number;    // of the line handed out last, from 1
} line_reader;

wm_status lines_open(line_reader *self, const char *path, wm_error *err);
void lines_close(line_reader *self);
// The next line without its end (LF, CRLF or CR; the last one may lack it; a byte order mark is removed). *text is
// valid until the next call. *problem: NULL, or why the line can't be read (too long; the packed file ends too early),
// of which only the number is known. WM_OK, WM_END, WM_IO.
wm_status lines_next(line_reader *self, const char **text, size_t *length, const char **problem, wm_error *err);

#endif
