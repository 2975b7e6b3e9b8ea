// SPDX-License-Identifier: Apache-2.0
// Parses a command line: `--name VALUE` or `--name=VALUE`, flags, and words in between. The error of an unknown option
// suggests the nearest one.
#ifndef WAYMARK_CLI_OPTIONS_H
#define WAYMARK_CLI_OPTIONS_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/status.h"

// OPTION_F64 is above 0; OPTION_F64_FROM_0 may be 0.
typedef enum option_kind {
  OPTION_TEXT,
  OPTION_TEXTS,
  OPTION_U64,
  OPTION_F64,
  OPTION_F64_FROM_0,
  OPTION_FLAG
} option_kind;

#define OPTION_TEXTS_MAX 32
// The values of an option that may be given several times.
typedef struct option_texts {
  const char *text[OPTION_TEXTS_MAX];
  size_t count;
} option_texts;

typedef struct option {
  const char *name;  // "--out"
  option_kind kind;
  void *out;  // const char **, option_texts *, uint64_t *, double *, double *, int *
} option;

// Stores the options' values and puts the other words into `words` (at most `capacity`). WM_BAD_USAGE with the reason.
wm_status options_parse(int argc, char *const *argv, const option *options, size_t count, const char **words,
                        size_t capacity, size_t *word_count, wm_error *err);

#endif
