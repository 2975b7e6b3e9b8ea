// SPDX-License-Identifier: Apache-2.0
// One bad input and the message that it gives. docs/errors.md is made from the same table that the test runs.
#pragma once

typedef enum error_kind {
  ERROR_CONFIG,     // `input` follows a good head of a configuration (unless it begins with "format")
  ERROR_RECORDING,  // `input` is `file` of a recording that is otherwise good; NULL: the file is taken away
  ERROR_ROW         // as before; the recording opens, and the message is what the source says of the row that it skips
} error_kind;

typedef struct error_case {
  error_kind kind;
  const char *name;
  const char *file;
  const char *input;
  const char *message;  // with "rec/" for the recording's folder; ", ...)" at its end: the list goes on
} error_case;

extern const error_case kErrorCases[];  // ends with a case without name
