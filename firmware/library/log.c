// SPDX-License-Identifier: Apache-2.0
// Event logs.
#include "output/event_log.h"

#include <stdlib.h>
#include <string.h>

#include "library/session.h"

static char *copy_text(const char *text, size_t length) {
  char *out = malloc(length + 1);
  if (!out) return NULL;
  if (length > 0) memcpy(out, text, length);
  out[length] = '\0';
  return out;
}

wm_status event_log_open(const char *path, event_log **out, wm_error *err) {
  event_log *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  wm_status status = wm_log_open(path, &self->reader, err);
  if (status != WM_OK) {
    free(self);
    return status;
  }
  const wm_log_head *head = wm_log_reader_head(self->reader);
  self->config = copy_text(head->config_text, head->config_length);
  self->calibration = copy_text(head->calibration_text, head->calibration_length);
  if (!self->config || !self->calibration) {
    event_log_close(self);
    return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  }
  *out = self;
  return WM_OK;
}

void event_log_close(event_log *self) {
  wm_log_reader_close(self->reader);
  free(self->config);
  free(self->calibration);
  free(self);
}
