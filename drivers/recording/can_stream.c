// SPDX-License-Identifier: Apache-2.0
#include "can_stream.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arrival.h"
#include "calibration.h"
#include "lines.h"
#include "waymark/can.h"

typedef struct can_stream {
  wm_source base;
  line_reader lines;
  wm_dbc *dbc;
  wm_can_decoder *decoder;
  arrival_order order;
  uint32_t seq;
} can_stream;

static void count_bad(can_stream *self, const char *why) {
  wm_source_counts *counts = &self->base.counts;
  counts->malformed++;
  if (!counts->first_problem[0])
    snprintf(counts->first_problem, sizeof counts->first_problem, "%s:%ld: %s", self->lines.path, self->lines.number,
             why);
}

// The next frame of the log; lines that aren't one are counted.
static wm_status next_frame(can_stream *self, wm_can_frame *frame, wm_error *err) {
  for (;;) {
    const char *text;
    size_t length;
    int too_long;
    wm_error why = {0};
    wm_status status = lines_next(&self->lines, &text, &length, &too_long, err);
    if (status != WM_OK) return status;
    if (too_long) {
      count_bad(self, "the line is longer than 65536 bytes; it is skipped");
      continue;
    }
    status = wm_candump_parse(text, length, frame, &why);
    if (status == WM_OK) return WM_OK;
    if (status != WM_AGAIN) count_bad(self, why.text);
  }
}

static wm_status next_quantities(wm_source *base, wm_event *out, wm_error *err) {
  can_stream *self = (can_stream *)base;
  for (;;) {
    wm_can_frame frame;
    wm_error why = {0};
    wm_status status = next_frame(self, &frame, err);
    if (status != WM_OK) return status;
    memset(out, 0, WM_EVENT_SMALL_BYTES);
    status = wm_can_decode(self->decoder, &frame, &out->as.quantities, &base->counts, &why);
    if (status != WM_OK) {  // counted by the decoder
      if (why.text[0] && !base->counts.first_problem[0])
        snprintf(base->counts.first_problem, sizeof base->counts.first_problem, "%s:%ld: %s", self->lines.path,
                 self->lines.number, why.text);
      continue;
    }
    out->kind = WM_EVENT_QUANTITIES;
    out->source = base->index;
    out->t_ns = frame.t_ns;
    out->arrival_ns = arrival_order_next(&self->order, frame.t_ns, &base->counts);
    out->seq = self->seq++;
    base->counts.received++;
    return WM_OK;
  }
}

static void close_can(wm_source *base) {
  can_stream *self = (can_stream *)base;
  lines_close(&self->lines);
  if (self->decoder) wm_can_decoder_free(self->decoder);
  if (self->dbc) wm_dbc_free(self->dbc);
  free(self);
}

static const wm_source_ops kCan = {next_quantities, close_can};

wm_status can_stream_open(const char *log, const char *dbc, const char *signals, wm_source **out, uint32_t *quantities,
                          wm_error *err) {
  *out = NULL;
  can_stream *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to read it", log);
  self->base.ops = &kCan;
  self->base.is_motion = 1;
  self->base.in_order = 1;
  self->base.kinds = WM_EVENT_BIT(WM_EVENT_QUANTITIES);
  self->lines.fd = -1;
  snprintf(self->base.name, sizeof self->base.name, "can");
  wm_can_binding *bindings = NULL;
  size_t count = 0;
  wm_status status = wm_dbc_load(dbc, &self->dbc, err);
  if (status == WM_OK) status = can_signals_read(signals, &bindings, &count, err);
  if (status == WM_OK) status = wm_can_decoder_make(self->dbc, bindings, count, &self->decoder, err);
  if (status == WM_OK) status = lines_open(&self->lines, log, err);
  free(bindings);
  if (status != WM_OK) {
    close_can(&self->base);
    return status;
  }
  *quantities = wm_can_decoder_quantities(self->decoder);
  *out = &self->base;
  return WM_OK;
}
