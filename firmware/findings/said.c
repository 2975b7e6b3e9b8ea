// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <string.h>

#include "findings/findings.h"

// Whether this finding is due now; if so, it is entered.
static int is_due(wm_said *self, const wm_finding *f, wm_time_ns now_ns) {
  for (size_t i = 0; i < self->count; i++) {
    if (self->known[i].id != f->id || strcmp(self->known[i].about, f->about) != 0) continue;
    if (now_ns - self->known[i].at_ns < WM_SAID_AGAIN_NS) return 0;
    self->known[i].at_ns = now_ns;
    return 1;
  }
  if (self->count == WM_FINDINGS_MAX) return 0;  // a log that is full of findings needs no more
  self->known[self->count].id = f->id;
  self->known[self->count].at_ns = now_ns;
  (void)snprintf(self->known[self->count].about, sizeof self->known[0].about, "%s", f->about);
  self->count++;
  return 1;
}

void wm_said_take(wm_said *self, const wm_findings *found, wm_time_ns now_ns, wm_line_fn say, void *context) {
  char line[sizeof(wm_finding)];
  for (size_t i = 0; i < found->count; i++) {
    if (!is_due(self, &found->at[i], now_ns)) continue;
    (void)wm_finding_line(&found->at[i], line, sizeof line);
    say(context, line);
  }
}
