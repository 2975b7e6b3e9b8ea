// SPDX-License-Identifier: Apache-2.0
// Starts the desk's search for the mistake that explains a drive (waymark-causes), where it is installed, and takes
// what it found as findings.
#ifndef WAYMARK_CLI_CAUSES_H
#define WAYMARK_CLI_CAUSES_H

#include "findings/findings.h"

typedef struct causes_question {
  const char *config, *recording;
  const char *landmarks, *calibration, *map;  // in place of the recording's; NULL: its own
  const char *apply_to;                       // folder of a corrected copy; NULL: none
  int clocks_apart;                           // of two streams of motion
} causes_question;

typedef struct causes_answer {
  int is_installed, is_answered;
  uint64_t rows, drives;  // mistakes that were tried, and drives of changed copies
  int is_found, is_undecided;
  char applied[2][512];  // folder of the corrected copy and the configuration in it; "": none
  char *json;            // the engine's whole answer, from malloc; NULL: none
} causes_answer;

// Adds its findings to `found`: a cause that the filter's states take up is a note where nothing else is bad. The
// caller frees out->json.
void causes_ask(const causes_question *question, wm_findings *found, causes_answer *out);

#endif
