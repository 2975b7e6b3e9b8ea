// SPDX-License-Identifier: Apache-2.0
#include "waymark/source.h"

#include <stdio.h>

void wm_source_refuse(wm_source_counts *counts, const char *where, const char *why) {
  counts->malformed++;
  if (!counts->first_problem[0])
    (void)snprintf(counts->first_problem, sizeof counts->first_problem, "%s: %s", where, why);
}
