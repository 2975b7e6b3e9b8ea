// SPDX-License-Identifier: Apache-2.0
#include "can_stream.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arrival.h"
#include "can_log.h"
#include "waymark/can.h"

typedef struct log_frame {
  wm_can_frame can;
  long line;
} log_frame;

typedef struct can_stream {
  wm_source base;
  can_log log;
  wm_can_decoder *decoder;
  wm_can_part part;
  wm_can_gnss gnss;
  arrival_order order;
  uint32_t seq;
  log_frame frame, ahead;
  int has_ahead;  // `ahead` is read, and not handed on yet
  can_buses buses;
  size_t bus;  // its index
  wm_can_survey *survey;
} can_stream;

static void keep_problem(can_stream *self, long line, const char *why) {
  char *first = self->base.counts.first_problem;
  if (!first[0]) snprintf(first, sizeof self->base.counts.first_problem, "%s:%ld: %s", self->log.lines.path, line, why);
}

// In a log of several buses each stream takes its own frames; the first one counts frames of no stream.
static int is_mine(can_stream *self, const char *interface) {
  size_t i = 0;
  if (self->buses.count == 0) return 1;
  while (i < self->buses.count && strcmp(self->buses.bus[i].interface, interface) != 0) i++;
  self->base.counts.ignored += i == self->buses.count && self->bus == 0;
  return i == self->bus;
}

// The next frame of the log; other lines are counted, once.
static wm_status read_frame(can_stream *self, log_frame *out, wm_error *err) {
  for (;;) {
    wm_error why;
    const wm_status status = can_log_next(&self->log, &out->can, &why, err);
    if (status != WM_OK && status != WM_AGAIN) return status;
    out->line = self->log.line;
    if (status == WM_OK && is_mine(self, out->can.iface)) return WM_OK;
    if (status == WM_OK || !why.text[0] || self->bus > 0) continue;
    self->base.counts.malformed++;
    keep_problem(self, out->line, why.text);
  }
}

// The next frame, into self->frame. One is read ahead: a stamp is checked against the one after it.
static wm_status next_frame(can_stream *self, wm_error *err) {
  wm_status status = self->has_ahead ? WM_OK : read_frame(self, &self->ahead, err);
  if (status != WM_OK) return status;
  for (;;) {
    self->frame = self->ahead;
    status = read_frame(self, &self->ahead, err);
    if (status != WM_OK && status != WM_END) return status;
    self->has_ahead = status == WM_OK;
    wm_time_ns here_ns = self->frame.can.t_ns, next_ns = self->has_ahead ? self->ahead.can.t_ns : here_ns;
    if (!arrival_order_leaps(&self->order, here_ns, next_ns)) return WM_OK;
    char why[96];
    arrival_leap_text("the stamp", here_ns, next_ns, "line", why, sizeof why);
    self->base.counts.not_finite++;
    if (!self->base.counts.first_problem[0]) self->base.counts.first_problem_kind = WM_ROW_STAMP_APART;
    keep_problem(self, self->frame.line, why);
  }
}

// What the whole log has shown: messages that never came, integers that are floating-point numbers.
static void judge_whole(can_stream *self) {
  char text[sizeof self->base.counts.first_problem];
  char *first = self->base.counts.first_problem;
  const int is_missing = wm_can_decoder_missing(self->decoder, self->survey, text, sizeof text) > 0;
  if (!is_missing && wm_can_decoder_floats(self->decoder, text, sizeof text) == 0) return;
  const int has_frames = self->survey->count > 0;  // 0: the first problem is that the lines are no log
  if (first[0] && (self->base.counts.received > 0 || !has_frames)) return;
  const char *path = self->log.lines.path, *slash = strrchr(path, '/');
  (void)snprintf(first, sizeof self->base.counts.first_problem, "%.40s: %.210s", slash ? slash + 1 : path, text);
}

static wm_status next_event(wm_source *base, wm_event *out, wm_error *err) {
  can_stream *self = (can_stream *)base;
  for (;;) {
    wm_error why = {0};
    wm_status status = next_frame(self, err);
    if (status == WM_END) judge_whole(self);
    if (status != WM_OK) return status;
    const wm_can_frame *frame = &self->frame.can;
    status = wm_can_event(self->decoder, self->part, &self->gnss, frame, out, &base->counts, &why);
    if (why.text[0]) keep_problem(self, self->frame.line, why.text);
    if (status != WM_OK) continue;
    out->source = base->index;
    out->arrival_ns = arrival_order_next(&self->order, frame->t_ns, &base->counts);
    out->seq = self->seq++;
    base->counts.received++;
    return WM_OK;
  }
}

static void close_can(wm_source *base) {
  can_stream *self = (can_stream *)base;
  can_log_close(&self->log);
  wm_can_decoder_free(self->decoder);
  free(self->survey);
  free(self);
}

static const wm_source_ops kCan = {next_event, close_can};

// Opens the log, and warns of what its first frames show.
static wm_status open_log(can_stream *self, const char *log, wm_warn_fn warn, void *context, wm_error *err) {
  char text[320], whole[WM_PATH_MAX + sizeof text];
  wm_status status = can_log_open(&self->log, log, self->survey, whole, sizeof whole, err);
  if (status != WM_OK || !warn) return status;
  if (whole[0] && self->bus == 0) warn(context, WM_NOTE_FILE, whole);
  if (wm_can_decoder_twins(self->decoder)[0]) warn(context, WM_NOTE_FILE, wm_can_decoder_twins(self->decoder));
  if (wm_can_decoder_senders(self->decoder, self->survey, text, sizeof text) == 0) return status;
  (void)snprintf(whole, sizeof whole, "%s: %s", log, text);
  warn(context, WM_NOTE_FILE, whole);
  return status;
}

wm_status can_stream_open(const char *log, const can_buses *buses, size_t bus, wm_can_part part,
                          const double gnss_origin[3], wm_warn_fn warn, void *context, wm_source **out,
                          uint32_t *quantities, wm_error *err) {
  const can_bus *is = &buses->bus[bus];
  *out = NULL;
  can_stream *self = calloc(1, sizeof *self);
  if (self) self->survey = calloc(1, sizeof *self->survey);
  if (!self || !self->survey) {
    free(self);
    return wm_fail(err, WM_IO, "%s: no memory to read it", log);
  }
  self->base.ops = &kCan;
  self->base.is_motion = part == WM_CAN_MOTION;
  self->base.in_order = self->base.is_bus = 1;
  self->base.kinds = WM_EVENT_BIT(part == WM_CAN_GNSS ? WM_EVENT_POSITION : WM_EVENT_QUANTITIES);
  self->part = part;
  wm_can_gnss_init(&self->gnss, gnss_origin);
  self->buses = *buses;
  self->bus = bus;
  snprintf(self->base.name, sizeof self->base.name, "can%s%s%s", part == WM_CAN_GNSS ? "-gnss" : "",
           buses->count > 1 ? ":" : "", buses->count > 1 ? is->interface : "");
  wm_status status = wm_can_decoder_load(is->dbc, is->signals, part, &self->decoder, err);
  if (status == WM_OK && self->decoder) status = open_log(self, log, warn, context, err);
  if (status != WM_OK || !self->decoder) {
    close_can(&self->base);
    return status;
  }
  if (part == WM_CAN_MOTION) *quantities = wm_can_decoder_quantities(self->decoder);
  *out = &self->base;
  return WM_OK;
}
