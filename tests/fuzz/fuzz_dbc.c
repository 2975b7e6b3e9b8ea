// SPDX-License-Identifier: Apache-2.0
// Any bytes as a DBC file. What is read is bound, every signal to every quantity in turn, and decodes random frames.
#include <stdio.h>
#include <string.h>

#include "dbc.h"
#include "fuzz.h"

enum { kSignalsTried = 40, kFramesTried = 8 };

static uint32_t next_random(uint32_t *state) {
  *state = *state * 1664525u + 1013904223u;
  return *state >> 8;
}

static int copy_name(char out[64], wm_text name) {
  if (name.length >= 64) return 0;
  memcpy(out, name.at, name.length);
  out[name.length] = '\0';
  return 1;
}

static void decode(wm_can_decoder *decoder, const dbc_message *m, uint32_t *state) {
  wm_source_counts counts = {0};
  wm_quantities out;
  wm_error err;
  static wm_can_survey survey;
  char text[64];
  memset(&survey, 0, sizeof survey);
  for (int i = 0; i < kFramesTried; i++) {
    wm_can_frame frame = {.id = m->id, .is_extended = m->is_extended, .iface = "can0"};
    frame.length = (uint8_t)(next_random(state) % (WM_CAN_DATA_MAX + 1));
    for (int k = 0; k < frame.length; k++) frame.data[k] = (uint8_t)(next_random(state) & next_random(state));
    if (i % 3 == 1) frame.id ^= next_random(state) & 0x1C00FFFFu;  // another priority, destination or sender
    (void)wm_can_survey_take(&survey, &frame);
    if (wm_can_decoder_missing(decoder, &survey, text, sizeof text) >= sizeof text) abort();
    wm_status status = wm_can_decode(decoder, &frame, &out, &counts, &err);
    if (status == WM_OK && (out.count == 0 || out.count > WM_QUANTITIES_MAX)) abort();
    for (int k = 0; k < out.count; k++)
      if (!(out.value[k] - out.value[k] == 0.0)) abort();  // only finite values are handed out
  }
  if (wm_can_decoder_senders(decoder, &survey, text, sizeof text) >= sizeof text) abort();
  if (wm_can_decoder_floats(decoder, text, sizeof text) >= sizeof text) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  wm_dbc *dbc = NULL;
  wm_error err = {WM_OK, ""};
  wm_status status = wm_dbc_parse((const char *)data, size, "fuzz.dbc", &dbc, &err);
  if (status != WM_OK) {
    if (dbc || strncmp(err.text, "fuzz.dbc:", 9) != 0) abort();
    return 0;
  }
  uint32_t state = (uint32_t)size;
  int tried = 0;
  for (size_t i = 0; i < dbc->message_count && tried < kSignalsTried; i++) {
    const dbc_message *m = &dbc->messages[i];
    for (uint32_t k = 0; k < m->signal_count && tried < kSignalsTried; k++, tried++) {
      wm_can_binding b = {.quantity = tried % WM_Q_COUNT, .signal_count = 1, .scale = 1.0};
      wm_can_decoder *decoder = NULL;
      if (!copy_name(b.message, m->name) || !copy_name(b.signal[0], dbc->signals[m->first_signal + k].name)) continue;
      (void)wm_can_decoder_make(dbc, &b, 1, &decoder, &err);
      if (!decoder) (void)snprintf(b.unit, sizeof b.unit, "%s", tried % 2 ? "m/s" : "deg");
      if (!decoder) (void)wm_can_decoder_make(dbc, &b, 1, &decoder, &err);
      if (decoder) decode(decoder, m, &state);
      wm_can_decoder_free(decoder);
    }
  }
  wm_dbc_free(dbc);
  return 0;
}
