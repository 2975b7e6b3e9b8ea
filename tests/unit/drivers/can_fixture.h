// SPDX-License-Identifier: Apache-2.0
// A DBC text, bindings and frames in a line each, for the tests of the decoder.
#pragma once

#include <stdio.h>
#include <string.h>

#include "unity.h"
#include "waymark/can.h"

typedef struct fixture {
  wm_dbc *dbc;
  wm_can_decoder *decoder;
  wm_source_counts counts;
  wm_quantities got;
  wm_error err;
} fixture;

static inline wm_can_binding binding(int quantity, const char *message, const char *signal) {
  wm_can_binding b = {.quantity = quantity, .signal_count = 1, .scale = 1.0, .line = 3};
  (void)snprintf(b.message, sizeof b.message, "%s", message);
  (void)snprintf(b.signal[0], sizeof b.signal[0], "%s", signal);
  (void)snprintf(b.file, sizeof b.file, "can-signals.yaml");
  return b;
}

static inline void close_it(fixture *f) {
  wm_can_decoder_free(f->decoder);
  f->decoder = NULL;
}

// Closes what was open before.
static inline wm_status open_with(fixture *f, const char *dbc, const wm_can_binding *bindings, size_t count) {
  close_it(f);
  memset(f, 0, sizeof *f);
  wm_status status = wm_dbc_parse(dbc, strlen(dbc), "car.dbc", &f->dbc, &f->err);
  if (status == WM_OK) status = wm_can_decoder_make(f->dbc, bindings, count, &f->decoder, &f->err);
  wm_dbc_free(f->dbc);  // the decoder lives without it
  f->dbc = NULL;
  return status;
}

static inline void open_one(fixture *f, const char *dbc, wm_can_binding b) {
  wm_status status = open_with(f, dbc, &b, 1);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, f->err.text);
}

// `text` as in candump: "can0 123#0102".
static inline wm_status feed_at(fixture *f, double t_s, const char *text) {
  char line[256];
  wm_can_frame frame;
  (void)snprintf(line, sizeof line, "(%.6f) %s", t_s, text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_candump_parse(line, strlen(line), &frame, &f->err), f->err.text);
  return wm_can_decode(f->decoder, &frame, &f->got, &f->counts, &f->err);
}

static inline wm_status feed(fixture *f, const char *text) { return feed_at(f, 1.0, text); }

// The only value of a frame that has to give one.
static inline double value_of(fixture *f, const char *text) {
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, feed(f, text), text);
  TEST_ASSERT_EQUAL(1, f->got.count);
  return f->got.value[0];
}
