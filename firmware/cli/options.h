// SPDX-License-Identifier: Apache-2.0
// Parses a command line: `--name VALUE` or `--name=VALUE`, flags, and words in between. The error of an unknown option
// suggests the nearest one.
#ifndef WAYMARK_CLI_OPTIONS_H
#define WAYMARK_CLI_OPTIONS_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/status.h"

typedef enum option_kind { OPTION_TEXT, OPTION_U64, OPTION_F64, OPTION_FLAG } option_kind;

typedef struct option {
  const char *name;  // "--out"
  option_kind kind;
  void *out;  // const char **, uint64_t *, double *, int *
} option;

// Stores the options' values and puts the other words into `words` (at most `capacity`). WM_BAD_USAGE with the reason.
wm_status options_parse(int argc, char *const *argv, const option *options, size_t count, const char **words,
                        size_t capacity, size_t *word_count, wm_error *err);

#endif
