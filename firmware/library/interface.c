// SPDX-License-Identifier: Apache-2.0
// The functions of waymark.h: each goes through the entry guard (entry.h), and what is behind it needs no checks of
// handles and pointers.
#include <stdlib.h>
#include <string.h>

#include <wm_version.h>
#include "library/entry.h"
#include "library/session.h"
#include "waymark/lcm_messages.h"

#define GIVEN(...)           \
  (const entry_argument[]) { \
    __VA_ARGS__, { NULL, 0 } \
  }
#define NONE_GIVEN           \
  (const entry_argument[]) { \
    { NULL, 0 }              \
  }
#define ENTER(given) entry_begin(ENTRY_SESSION, __func__, handle, given, (void **)&self, err)

const char *waymark_version(void) { return WM_VERSION; }

// ── session ─────────────────────────────────────────────────────────────────────────────────────────────────────────

wm_status waymark_open(const waymark_options *options, waymark_session **out, wm_error *err) {
  waymark_options taken;
  session *self;
  wm_status status = entry_check(__func__, GIVEN(ENTRY_GIVEN(out)), err);
  if (status != WM_OK) return status;
  *out = NULL;
  status = library_take_options(__func__, options, options ? options->bytes : 0, &taken, sizeof taken, err);
  if (status != WM_OK) return status;
  if (!taken.config || !taken.config[0])
    return wm_fail(err, WM_BAD_USAGE, "waymark_open: options.config: the configuration's path is missing");
  status = session_open(&taken, &self, err);
  if (status != WM_OK) return status;
  status = entry_open(ENTRY_SESSION, self, (void **)out, err);
  if (status != WM_OK) (void)session_close(self, NULL);
  return status;
}

wm_status waymark_add_source(waymark_session *handle, const char *name, uint32_t *out, wm_error *err) {
  session *self;
  wm_status status = ENTER(GIVEN(ENTRY_GIVEN(name), ENTRY_GIVEN(out)));
  if (status != WM_OK) return status;
  status = session_add_source(self, name, out, err);
  entry_leave(handle);
  return status;
}

wm_status waymark_start(waymark_session *handle, wm_error *err) {
  session *self;
  wm_status status = ENTER(NONE_GIVEN);
  if (status != WM_OK) return status;
  status = session_start(self, err);
  entry_leave(handle);
  return status;
}

wm_status waymark_push_row(waymark_session *handle, uint32_t source, wm_time_ns t_ns, wm_time_ns arrival_ns,
                           const double *numbers, size_t count, wm_error *err) {
  session *self;
  wm_status status = ENTER(GIVEN(ENTRY_GIVEN_IF(count > 0, numbers)));
  if (status != WM_OK) return status;
  status = session_push_row(self, source, t_ns, arrival_ns, numbers, count, err);
  entry_leave(handle);
  return status;
}

wm_status waymark_push_event(waymark_session *handle, uint32_t source, const wm_event *event, size_t bytes,
                             wm_error *err) {
  session *self;
  wm_status status = ENTER(GIVEN(ENTRY_GIVEN(event)));
  if (status != WM_OK) return status;
  status = library_check_size(__func__, event, bytes, sizeof *event, err);
  if (status == WM_OK) status = session_push_event(self, source, event, err);
  entry_leave(handle);
  return status;
}

wm_status waymark_push_can(waymark_session *handle, wm_time_ns t_ns, const char *interface, uint32_t id,
                           int is_extended, const void *data, size_t length, wm_error *err) {
  session *self;
  wm_status status = ENTER(GIVEN(ENTRY_GIVEN(interface), ENTRY_GIVEN_IF(length > 0, data)));
  if (status != WM_OK) return status;
  if (length > WM_CAN_DATA_MAX || id > (is_extended ? 0x1FFFFFFFu : 0x7FFu)) {
    status = wm_fail(err, WM_BAD_DATA, "%.40s: a frame of id %x and %zu bytes can't be", interface, id, length);
  } else {
    wm_can_frame frame = {
        .t_ns = t_ns, .id = id, .is_extended = is_extended != 0, .is_fd = length > 8, .length = (uint8_t)length};
    if (length > 0) memcpy(frame.data, data, length);
    status = session_push_can(self, interface, &frame, err);
  }
  entry_leave(handle);
  return status;
}

wm_status waymark_push_picture(waymark_session *handle, const char *camera, const wm_frame *frame, size_t bytes,
                               wm_error *err) {
  session *self;
  wm_status status = ENTER(GIVEN(ENTRY_GIVEN(camera), ENTRY_GIVEN(frame)));
  if (status != WM_OK) return status;
  status = library_check_size(__func__, frame, bytes, sizeof *frame, err);
  if (status == WM_OK) status = session_push_picture(self, camera, frame, err);
  entry_leave(handle);
  return status;
}

wm_status waymark_advance(waymark_session *handle, wm_time_ns now_ns, wm_error *err) {
  session *self;
  wm_status status = ENTER(NONE_GIVEN);
  if (status != WM_OK) return status;
  status = session_advance(self, __func__, now_ns, err);
  entry_leave(handle);
  return status;
}

wm_status waymark_pose(waymark_session *handle, wm_time_ns now_ns, wm_published *out, size_t bytes, wm_error *err) {
  session *self;
  wm_status status = ENTER(GIVEN(ENTRY_GIVEN(out)));
  if (status != WM_OK) return status;
  status = library_check_size(__func__, out, bytes, sizeof *out, err);
  if (status == WM_OK) status = session_pose(self, now_ns, out, err);
  entry_leave(handle);
  return status;
}

wm_status waymark_bound(waymark_session *handle, wm_bound *out, size_t bytes, wm_error *err) {
  session *self;
  wm_status status = ENTER(GIVEN(ENTRY_GIVEN(out)));
  if (status != WM_OK) return status;
  status = library_check_size(__func__, out, bytes, sizeof *out, err);
  if (status == WM_OK) status = session_bound(self, out, err);
  entry_leave(handle);
  return status;
}

wm_status waymark_health(waymark_session *handle, wm_health *out, size_t bytes, wm_error *err) {
  session *self;
  wm_health health;
  wm_status status = ENTER(GIVEN(ENTRY_GIVEN(out)));
  if (status != WM_OK) return status;
  status = session_health(self, &health, err);
  if (status == WM_OK) status = library_put_health(__func__, &health, out, bytes, err);
  entry_leave(handle);
  return status;
}

const char *waymark_source_name(const waymark_session *handle, uint32_t source) {
  const session *self = entry_look(ENTRY_SESSION, handle);
  return self && source < self->assembly.source_count ? self->assembly.sources[source].name : "";
}

const char *waymark_floor_name(const waymark_session *handle, uint32_t floor) {
  const session *self = entry_look(ENTRY_SESSION, handle);
  return self && self->assembly.building ? wm_building_floor_name(self->assembly.building, (int)floor) : "";
}

wm_status waymark_close(waymark_session *handle, wm_error *err) {
  session *self;
  if (!handle) return WM_OK;
  wm_status status = ENTER(NONE_GIVEN);
  if (status != WM_OK) return status;
  status = session_close(self, err);  // its last poses go to `take`, which may ask for names
  entry_close(handle);
  return status;
}

// ── replay ──────────────────────────────────────────────────────────────────────────────────────────────────────────

wm_status waymark_replay(const waymark_replay_options *options, waymark_report *out, size_t bytes, wm_error *err) {
  waymark_replay_options taken;
  wm_status status = entry_check(__func__, GIVEN(ENTRY_GIVEN(options), ENTRY_GIVEN(out)), err);
  if (status == WM_OK) status = library_take_options(__func__, options, options->bytes, &taken, sizeof taken, err);
  if (status == WM_OK) status = library_check_size(__func__, out, bytes, sizeof *out, err);
  return status == WM_OK ? session_replay(&taken, out, err) : status;
}

// ── event logs ──────────────────────────────────────────────────────────────────────────────────────────────────────

wm_status waymark_log_open(const char *path, waymark_log **out, wm_error *err) {
  event_log *self;
  wm_status status = entry_check(__func__, GIVEN(ENTRY_GIVEN(path), ENTRY_GIVEN(out)), err);
  if (status != WM_OK) return status;
  *out = NULL;
  status = event_log_open(path, &self, err);
  if (status != WM_OK) return status;
  status = entry_open(ENTRY_LOG, self, (void **)out, err);
  if (status != WM_OK) event_log_close(self);
  return status;
}

static const wm_log_head *head_of(const waymark_log *handle) {
  const event_log *self = entry_look(ENTRY_LOG, handle);
  return self ? wm_log_reader_head(self->reader) : NULL;
}

const char *waymark_log_get_text(const waymark_log *handle, waymark_log_text which) {
  const event_log *self = entry_look(ENTRY_LOG, handle);
  const wm_log_head *head = head_of(handle);
  if (!head) return "";
  switch (which) {
    case WAYMARK_LOG_PROGRAM: return head->program;
    case WAYMARK_LOG_ESTIMATOR: return head->estimator;
    case WAYMARK_LOG_RECORDING: return head->recording;
    case WAYMARK_LOG_CONFIG: return self->config;
    case WAYMARK_LOG_CALIBRATION: return self->calibration;
  }
  return "";
}

const char *waymark_log_source_name(const waymark_log *handle, uint32_t source) {
  const wm_log_head *head = head_of(handle);
  return head && source < head->source_count ? head->sources[source].name : "";
}

const char *waymark_log_sensor_name(const waymark_log *handle, uint32_t sensor) {
  const wm_log_head *head = head_of(handle);
  return head && sensor < head->sensor_count ? head->sensors[sensor].name : "";
}

wm_status waymark_log_next(waymark_log *handle, wm_event *out, size_t bytes, uint64_t *missing, wm_error *err) {
  event_log *self;
  uint64_t lost = 0;
  int was_cut;
  wm_status status = entry_begin(ENTRY_LOG, __func__, handle, GIVEN(ENTRY_GIVEN(out)), (void **)&self, err);
  if (status != WM_OK) return status;
  status = library_check_size(__func__, out, bytes, sizeof *out, err);
  if (status == WM_OK) status = wm_log_next(self->reader, out, &lost, &was_cut, err);
  if (missing) *missing += lost;
  entry_leave(handle);
  return status;
}

void waymark_log_close(waymark_log *handle) {
  event_log *self;
  if (entry_begin(ENTRY_LOG, __func__, handle, NONE_GIVEN, (void **)&self, NULL) != WM_OK) return;
  event_log_close(self);
  entry_close(handle);
}

// ── messages ────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status judge(const char *fault, wm_error *err) {
  return fault ? wm_fail(err, WM_BAD_DATA, "%s", fault) : WM_OK;
}

wm_status waymark_read_pose(const void *message, size_t length, wm_published *out, size_t bytes, wm_error *err) {
  wm_status status = entry_check(__func__, GIVEN(ENTRY_GIVEN(message), ENTRY_GIVEN(out)), err);
  if (status == WM_OK) status = library_check_size(__func__, out, bytes, sizeof *out, err);
  return status == WM_OK ? judge(wm_lcm_read_pose(message, length, out), err) : status;
}

wm_status waymark_read_bound(const void *message, size_t length, wm_bound *out, size_t bytes, wm_error *err) {
  wm_status status = entry_check(__func__, GIVEN(ENTRY_GIVEN(message), ENTRY_GIVEN(out)), err);
  if (status == WM_OK) status = library_check_size(__func__, out, bytes, sizeof *out, err);
  return status == WM_OK ? judge(wm_lcm_read_bound(message, length, out), err) : status;
}

wm_status waymark_read_health(const void *message, size_t length, wm_health *out, size_t bytes, wm_error *err) {
  wm_health health;
  wm_status status = entry_check(__func__, GIVEN(ENTRY_GIVEN(message), ENTRY_GIVEN(out)), err);
  if (status == WM_OK) status = judge(wm_lcm_read_health(message, length, &health), err);
  return status == WM_OK ? library_put_health(__func__, &health, out, bytes, err) : status;
}

wm_status waymark_read_innovation(const void *message, size_t length, wm_innovation *out, size_t bytes, wm_error *err) {
  wm_status status = entry_check(__func__, GIVEN(ENTRY_GIVEN(message), ENTRY_GIVEN(out)), err);
  if (status == WM_OK) status = library_check_size(__func__, out, bytes, sizeof *out, err);
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
    case WAYMARK_NAMES_UNUSABLE: return wm_unusable_name(number);
    case WAYMARK_NAMES_STATUS: return wm_status_text((wm_status)number);
  }
  return "?";
}
