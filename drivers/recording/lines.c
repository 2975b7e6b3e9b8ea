// SPDX-License-Identifier: Apache-2.0
#include "lines.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>

wm_status lines_open(line_reader *self, const char *path, wm_error *err) {
  *self = (line_reader){0};
  snprintf(self->path, sizeof self->path, "%s", path);
  const int fd = open(path, O_RDONLY | O_CLOEXEC);
  if (fd < 0 && errno == ENOENT) return wm_fail(err, WM_NOT_FOUND, "%s: there is no such file", path);
  if (fd < 0) return wm_fail(err, WM_IO, "%s: cannot be opened: %s", path, strerror(errno));
  self->buffer = malloc(LINES_BUFFER_BYTES);
  self->file = self->buffer ? gzdopen(fd, "rb") : NULL;
  if (self->file) return WM_OK;
  close(fd);
  lines_close(self);
  return wm_fail(err, WM_IO, "%s: no memory to read it", path);
}

void lines_close(line_reader *self) {
  if (self->file) gzclose(self->file);
  free(self->buffer);
  self->file = NULL;
  self->buffer = NULL;
}

// Moves the rest to the buffer's front and reads more after it.
static wm_status fill(line_reader *self, wm_error *err) {
  if (self->begin > 0) memmove(self->buffer, self->buffer + self->begin, self->end - self->begin);
  self->end -= self->begin;
  self->begin = 0;
  errno = 0;
  int n, problem = Z_OK;
  do {
    n = gzread(self->file, self->buffer + self->end, (unsigned)(LINES_BUFFER_BYTES - self->end));
  } while (n < 0 && errno == EINTR);
  if (n <= 0) (void)gzerror(self->file, &problem);
  if (n < 0 && problem == Z_ERRNO) return wm_fail(err, WM_IO, "%s: cannot be read: %s", self->path, strerror(errno));
  self->ended = n <= 0;
  self->is_cut = problem != Z_OK;
  self->end += n > 0 ? (size_t)n : 0;
  if (self->line_end == '\0') {  // by the first part of the file
    const int is_old_mac = memchr(self->buffer, '\r', self->end) && !memchr(self->buffer, '\n', self->end);
    self->line_end = is_old_mac ? '\r' : '\n';
  }
  return WM_OK;
}

wm_status lines_next(line_reader *self, const char **text, size_t *length, const char **problem, wm_error *err) {
  size_t searched = 0;
  *problem = NULL;
  for (;;) {
    size_t there = self->end - self->begin;
    const char *from = self->buffer + self->begin;
    const char *newline = there > searched ? memchr(from + searched, self->line_end, there - searched) : NULL;
    if (!newline && !self->ended) {
      if (there == LINES_BUFFER_BYTES) {  // drop the content, skip to the line's end
        *problem = "the line is longer than 65536 bytes";
        self->begin = self->end = 0;
        there = 0;
      }
      searched = there;
      wm_status status = fill(self, err);
      if (status != WM_OK) return status;
      continue;
    }
    if (!newline && self->is_cut) {
      *problem = "the file is packed by gzip, and ends too early or is damaged from here on";
      self->is_cut = 0;
    }
    if (!newline && there == 0 && !*problem) return WM_END;
    size_t n = newline ? (size_t)(newline - from) : there;
    self->begin += n + (newline ? 1 : 0);
    self->number++;
    if (n > 0 && from[n - 1] == '\r') n--;
    if (self->number == 1 && n >= 3 && memcmp(from, "\xEF\xBB\xBF", 3) == 0) {
      from += 3;
      n -= 3;
    }
    *text = from;
    *length = *problem ? 0 : n;
    return WM_OK;
  }
}
