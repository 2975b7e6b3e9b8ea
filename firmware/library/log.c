// SPDX-License-Identifier: Apache-2.0
// Event logs, messages and names.
#include "output/event_log.h"

#include <stdlib.h>
#include <string.h>

#include "library/session.h"
#include "waymark/lcm_messages.h"

struct waymark_log {
  wm_log_reader *reader;
  char *config, *calibration;  // terminated copies
};

static char *copy_text(const char *text, size_t length) {
  char *out = malloc(length + 1);
  if (!out) return NULL;
  if (length > 0) memcpy(out, text, length);
  out[length] = '\0';
  return out;
}

wm_status waymark_log_open(const char *path, waymark_log **out, wm_error *err) {
  *out = NULL;
  waymark_log *self = calloc(1, sizeof *self);
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
    waymark_log_close(self);
    return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  }
  *out = self;
  return WM_OK;
}

const char *waymark_log_get_text(const waymark_log *self, waymark_log_text which) {
  const wm_log_head *head = wm_log_reader_head(self->reader);
  switch (which) {
    case WAYMARK_LOG_PROGRAM: return head->program;
    case WAYMARK_LOG_ESTIMATOR: return head->estimator;
    case WAYMARK_LOG_RECORDING: return head->recording;
    case WAYMARK_LOG_CONFIG: return self->config;
    case WAYMARK_LOG_CALIBRATION: return self->calibration;
  }
  return "";
}

const char *waymark_log_source_name(const waymark_log *self, uint32_t source) {
  const wm_log_head *head = wm_log_reader_head(self->reader);
  return source < head->source_count ? head->sources[source].name : "";
}

const char *waymark_log_sensor_name(const waymark_log *self, uint32_t sensor) {
  const wm_log_head *head = wm_log_reader_head(self->reader);
  return sensor < head->sensor_count ? head->sensors[sensor].name : "";
}

wm_status waymark_log_next(waymark_log *self, wm_event *out, size_t bytes, uint64_t *missing, wm_error *err) {
  uint64_t lost = 0;
  int was_cut;
  wm_status status = library_check_size("waymark_log_next", out, bytes, sizeof *out, err);
  if (status == WM_OK) status = wm_log_next(self->reader, out, &lost, &was_cut, err);
  if (missing) *missing += lost;
  return status;
}

void waymark_log_close(waymark_log *self) {
  if (!self) return;
  wm_log_reader_close(self->reader);
  free(self->config);
  free(self->calibration);
  free(self);
}

// ── messages ────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status judge(const char *fault, wm_error *err) {
  return fault ? wm_fail(err, WM_BAD_DATA, "%s", fault) : WM_OK;
}

wm_status waymark_read_pose(const void *message, size_t length, wm_published *out, size_t bytes, wm_error *err) {
  wm_status status = library_check_size("waymark_read_pose", out, bytes, sizeof *out, err);
  return status == WM_OK ? judge(wm_lcm_read_pose(message, length, out), err) : status;
}

wm_status waymark_read_health(const void *message, size_t length, wm_health *out, size_t bytes, wm_error *err) {
  wm_health health;
  wm_status status = judge(wm_lcm_read_health(message, length, &health), err);
  return status == WM_OK ? library_put_health("waymark_read_health", &health, out, bytes, err) : status;
}

wm_status waymark_read_innovation(const void *message, size_t length, wm_innovation *out, size_t bytes, wm_error *err) {
  wm_status status = library_check_size("waymark_read_innovation", out, bytes, sizeof *out, err);
  return status == WM_OK ? judge(wm_lcm_read_innovation(message, length, out), err) : status;
}

const char *waymark_name(waymark_names of, uint32_t number) {
  switch (of) {
    case WAYMARK_NAMES_STATE: return wm_state_name(number);
    case WAYMARK_NAMES_CAUSE: return wm_cause_name(number);
    case WAYMARK_NAMES_RESIDUAL: return wm_residual_name(number);
    case WAYMARK_NAMES_VERDICT: return wm_verdict_name(number);
    case WAYMARK_NAMES_EVENT: return wm_event_kind_name(number);
    case WAYMARK_NAMES_QUANTITY: return wm_quantity_name(number);
    case WAYMARK_NAMES_STATUS: return wm_status_text((wm_status)number);
  }
  return "?";
}
