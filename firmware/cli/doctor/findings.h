// SPDX-License-Identifier: Apache-2.0
// Findings with a remedy each: of a computer (doctor) or of a configuration and its files (check).
#ifndef WAYMARK_CLI_DOCTOR_FINDINGS_H
#define WAYMARK_CLI_DOCTOR_FINDINGS_H

#include <stddef.h>
#include <stdio.h>

#include "waymark/status.h"

typedef enum finding_level { FINDING_GOOD, FINDING_NOTE, FINDING_BAD } finding_level;

typedef struct finding {
  finding_level level;
  char about[32];  // "kernel", "can can0", "calibration"
  char text[WM_ERROR_TEXT_MAX];
  char mend[240];  // "": no action needed
} finding;

#define FINDINGS_MAX 64  // further ones are dropped
typedef struct findings {
  finding at[FINDINGS_MAX];
  size_t count;
} findings;

// Adds a finding; beyond FINDINGS_MAX they are dropped. `mend` may be "".
void find(findings *out, finding_level level, const char *about, const char *mend, const char *format, ...)
    __attribute__((format(printf, 5, 6)));
// Adds an error; its text after the last semicolon is the remedy.
void find_error(findings *out, const char *about, const wm_error *err);
// Number of findings of this level.
size_t findings_of(const findings *self, finding_level level);
// Moves the findings from place `from` on to the front: causes stand before their consequences.
void findings_to_front(findings *self, size_t from);

// A line each: "LEVEL ABOUT TEXT; mend: MEND".
void findings_print(const findings *self, FILE *to);
// The list in brackets.
void findings_json(const findings *self, FILE *to);

#endif
