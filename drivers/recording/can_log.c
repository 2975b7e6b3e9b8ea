// SPDX-License-Identifier: Apache-2.0
#include "can_log.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BACK_NS (500 * WM_NS_PER_MS)  // queues and adapters exchange frames by less
#define LINES_FIRST 65536

typedef struct sorted_line {
  wm_time_ns t_ns;
  size_t at;
  uint32_t length;
  long number;
} sorted_line;

// ── a log that was sorted by id ─────────────────────────────────────────────────────────────────────────────────────

// Whether all frames of an id stand together, of more than one id, and the time goes back from one id to the next: no
// clock does that.
typedef struct order_by_id {
  uint64_t ids[WM_CAN_SURVEY_IDS];
  size_t count;
  wm_time_ns last_ns;
  int goes_back, is_mixed;
} order_by_id;

static uint64_t identity(const wm_can_frame *frame) {
  uint64_t bus = 0;
  for (const char *c = frame->iface; *c; c++) bus = bus * 31 + (unsigned char)*c;
  return bus << 31 ^ (uint64_t)frame->id << 1 ^ frame->is_extended;
}

static void take_order(order_by_id *self, const wm_can_frame *frame) {
  if (frame->is_error || frame->is_remote || self->is_mixed) return;
  const uint64_t id = identity(frame);
  if (self->count == 0 || self->ids[self->count - 1] != id) {
    for (size_t i = 0; i < self->count; i++) self->is_mixed |= self->ids[i] == id;
    self->is_mixed |= self->count == WM_CAN_SURVEY_IDS;
    if (self->is_mixed) return;
    self->ids[self->count] = id;
    self->goes_back |= self->count++ > 0 && frame->t_ns < self->last_ns - BACK_NS;
  }
  self->last_ns = frame->t_ns;
}

static int by_time(const void *a, const void *b) {
  const sorted_line *x = a, *y = b;
  return x->t_ns != y->t_ns ? (x->t_ns > y->t_ns) - (x->t_ns < y->t_ns)
                            : (x->number > y->number) - (x->number < y->number);
}

static void *grown(void *items, size_t needed, size_t *room, size_t item_bytes) {
  if (needed <= *room) return items;
  size_t more = *room ? 2 * *room : LINES_FIRST;
  while (more < needed) more *= 2;
  void *out = realloc(items, more * item_bytes);
  if (out) *room = more;
  return out;
}

static void forget(can_log *self) {
  free(self->text);
  free(self->sorted);
  self->text = NULL;
  self->sorted = NULL;
  self->sorted_count = 0;
}

// All lines, until their order is not by id. A line that is no frame has the time of the one before.
static wm_status read_whole(can_log *self, order_by_id *order, wm_error *err) {
  size_t text_room = 0, lines_room = 0, used = 0;
  const char *line, *problem;
  size_t length;
  wm_time_ns t_ns = 0;
  wm_status status;
  while (!order->is_mixed && (status = lines_next(&self->lines, &line, &length, &problem, err)) == WM_OK) {
    wm_can_frame frame;
    if (wm_candump_parse(line, length, &frame, NULL) == WM_OK) {
      t_ns = frame.t_ns;
      take_order(order, &frame);
    }
    char *text = grown(self->text, used + length, &text_room, 1);
    if (text) self->text = text;
    sorted_line *sorted = grown(self->sorted, self->sorted_count + 1, &lines_room, sizeof *sorted);
    if (sorted) self->sorted = sorted;
    if (!text || !sorted) return wm_fail(err, WM_IO, "%s: no memory to sort it by time", self->lines.path);
    memcpy(self->text + used, line, length);
    self->sorted[self->sorted_count++] = (sorted_line){t_ns, used, (uint32_t)length, self->lines.number};
    used += length;
  }
  return order->is_mixed || status == WM_END ? WM_OK : status;
}

static wm_status sort_where_by_id(can_log *self, wm_error *err) {
  order_by_id *order = calloc(1, sizeof *order);
  if (!order) return wm_fail(err, WM_IO, "%s: no memory to read it", self->lines.path);
  const wm_status status = read_whole(self, order, err);
  if (status == WM_OK && !order->is_mixed && order->goes_back)
    qsort(self->sorted, self->sorted_count, sizeof *self->sorted, by_time);
  else
    forget(self);
  free(order);
  return status;
}

// ── the log ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status survey_log(can_log *self, wm_can_survey *survey, wm_error *err) {
  const char *line, *problem;
  size_t length;
  wm_can_frame frame;
  wm_status status;
  while ((status = lines_next(&self->lines, &line, &length, &problem, err)) == WM_OK)
    if (!problem && wm_candump_parse(line, length, &frame, NULL) == WM_OK && !wm_can_survey_take(survey, &frame)) break;
  return status == WM_END ? WM_OK : status;
}

wm_status can_log_rewind(can_log *self, wm_error *err) {
  char path[WM_PATH_MAX];
  (void)snprintf(path, sizeof path, "%s", self->lines.path);
  self->next = 0;
  self->sum_ns = 0;
  lines_close(&self->lines);
  return lines_open(&self->lines, path, err);
}

wm_status can_log_open(can_log *self, const char *path, wm_can_survey *survey, char *note, size_t room, wm_error *err) {
  *self = (can_log){0};
  note[0] = '\0';
  wm_status status = lines_open(&self->lines, path, err);
  if (status == WM_OK) status = survey_log(self, survey, err);
  if (status != WM_OK) return status;
  self->has_differences = wm_can_survey_has_differences(survey);
  if (self->has_differences)
    (void)snprintf(note, room, "%s: its times are differences (candump -td): they are summed up", path);
  status = can_log_rewind(self, err);
  if (status != WM_OK || self->has_differences || survey->runs != survey->count) return status;
  status = sort_where_by_id(self, err);
  if (self->sorted)
    (void)snprintf(note, room, "%s: its lines are sorted by id: they are read in the order of their times", path);
  return status == WM_OK ? can_log_rewind(self, err) : status;
}

// The next line; NULL with *why where it can't be read.
static wm_status next_line(can_log *self, const char **line, size_t *length, wm_error *why, wm_error *err) {
  if (self->sorted) {
    if (self->next == self->sorted_count) return WM_END;
    const sorted_line *at = &self->sorted[self->next++];
    *line = self->text + at->at;
    *length = at->length;
    self->line = at->number;
    return WM_OK;
  }
  const char *problem;
  const wm_status status = lines_next(&self->lines, line, length, &problem, err);
  self->line = self->lines.number;
  if (status == WM_OK && problem) (void)wm_fail(why, WM_BAD_DATA, "%s", problem);
  return status;
}

wm_status can_log_next(can_log *self, wm_can_frame *out, wm_error *why, wm_error *err) {
  const char *line;
  size_t length;
  why->text[0] = '\0';
  wm_status status = next_line(self, &line, &length, why, err);
  if (status != WM_OK) return status;
  if (why->text[0] || wm_candump_parse(line, length, out, why) != WM_OK) return WM_AGAIN;
  if (self->has_differences) out->t_ns = self->sum_ns += out->t_ns;
  return WM_OK;
}

void can_log_close(can_log *self) {
  lines_close(&self->lines);
  forget(self);
}
