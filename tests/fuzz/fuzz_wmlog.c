// SPDX-License-Identifier: Apache-2.0
// Any bytes as an event log, as they are and with the records' sums mended (else no mutation would get past them):
// refused with a text, or events that are within bounds, given to an estimator's front.
#include <stdio.h>
#include <string.h>

#include "fusion/fuser.h"
#include "fuzz.h"
#include "output/crc32.h"
#include "output/event_log.h"
#include "tiny_estimator.h"
#include "waymark/bytes.h"

static void forget(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  (void)context, (void)kind, (void)record, (void)bytes;
}

static void read_log(const uint8_t *data, size_t size) {
  FILE *file = fmemopen((void *)data, size, "rb");
  if (!file) abort();
  wm_error err = {WM_OK, ""};
  wm_log_reader *log;
  if (wm_log_open_file(file, "fuzz", &log, &err) != WM_OK) {
    if (err.text[0] == '\0' || log) abort();  // a refusal without a word
    return;
  }
  const wm_log_head *head = wm_log_reader_head(log);
  if (head->source_count > WM_SOURCES_MAX || strlen(head->config_text) > head->config_length) abort();
  static tiny_state state;
  static wm_fuser fuser;
  tiny_init(&state, NULL, NULL);
  wm_fuser_init(&fuser, &kTiny, &state, head->driving, (wm_output){forget, NULL});
  static wm_event event;
  uint64_t missing = 0;
  int cut;
  wm_status status;
  while ((status = wm_log_next(log, &event, &missing, &cut, &err)) == WM_OK) {
    if (event.source >= head->source_count || event.kind >= WM_EVENT_KIND_COUNT) abort();
    if (event.kind == WM_EVENT_QUANTITIES && event.as.quantities.count > WM_QUANTITIES_MAX) abort();
    if (event.kind == WM_EVENT_POINTS && event.as.points.count > WM_POINTS_MAX) abort();
    wm_fuser_feed(&fuser, &event);
  }
  wm_fuser_finish(&fuser);
  if (status != WM_END && err.text[0] == '\0') abort();
  wm_log_reader_close(log);
}

static void mend_sums(uint8_t *data, size_t size) {
  size_t at = 8;
  while (at + 8 <= size) {
    wm_reader r = wm_reader_of(data + at, 8);
    uint32_t length = wm_get_u32(&r);
    if (length > size - at - 8) return;
    wm_writer w = wm_writer_of(data + at + 4, 4);
    wm_put_u32(&w, crc32_of(0, data + at + 8, length));
    at += 8 + length;
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  if (size == 0) return 0;
  read_log(data, size);
  uint8_t *mended = malloc(size);
  if (!mended) return 0;
  memcpy(mended, data, size);
  mend_sums(mended, size);
  read_log(mended, size);
  free(mended);
  return 0;
}
