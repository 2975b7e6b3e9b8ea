// SPDX-License-Identifier: Apache-2.0
// Any bytes as faults.yaml: it is read, or refused with a message; what is read has times in order, and prints as JSON.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "fuzz.h"
#include "waymark/faults.h"

static void check_fault(const wm_fault *f) {
  const wm_fault_kind_row *row = wm_fault_kind_of(f->kind);
  if (!(f->from_s >= 0 && f->until_s >= f->from_s) || !f->name[0]) abort();
  for (size_t i = 0; i < WM_FAULT_PARAMS_MAX && row->params[i].name; i++)
    if (!(f->param[i] >= row->params[i].min && f->param[i] <= row->params[i].max)) abort();
  for (size_t i = 0; i < f->state_count; i++)
    if (!f->states[i].what[0] && f->states[i].kind != WM_STATES_TEXT) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  wm_faults faults;
  wm_error err;
  if (wm_faults_parse((const char *)data, size, "fuzz.yaml", &faults, &err) != WM_OK) {
    if (strlen(err.text) < 10 || faults.fault) abort();
    return 0;
  }
  char *text = NULL;
  size_t length;
  for (size_t i = 0; i < faults.count; i++) {
    check_fault(&faults.fault[i]);
    (void)wm_faults_at(&faults, faults.fault[i].kind, "front", faults.fault[i].from_s);
  }
  FILE *to = open_memstream(&text, &length);
  if (!to) abort();
  wm_faults_json(&faults, to);
  if (fclose(to) != 0 || length < 10) abort();
  free(text);
  wm_faults_free(&faults);
  return 0;
}
