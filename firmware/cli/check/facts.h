// SPDX-License-Identifier: Apache-2.0
// The facts of a driven recording: its sources, the shares of the states, and how well the observations fit. As lines
// for a person, and as JSON for programs.
#ifndef WAYMARK_CLI_CHECK_FACTS_H
#define WAYMARK_CLI_CHECK_FACTS_H

#include <stdint.h>
#include <stdio.h>

#include "cli/check/check.h"

typedef struct drive_facts {
  const wm_assembly *assembly;
  const source_facts *sources;  // by the assembly's sources
  const drive_evidence *evidence;
  double recorded_s;
  uint64_t due;  // messages that were due
} drive_facts;

void facts_print_source(const wm_assembled_source *source, const source_facts *facts, FILE *to);
void facts_print(const drive_facts *self, FILE *to);
// An object: estimator, recording, duration_s, sources, states (shares), fit.
void facts_json(const drive_facts *self, FILE *to);

#endif
