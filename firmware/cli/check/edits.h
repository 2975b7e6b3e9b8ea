// SPDX-License-Identifier: Apache-2.0
// Changes of a recording's files and of the configuration: a column of a table, a value of a YAML file, a signal of a
// DBC file, a mirrored picture. A trial reads files with such changes, a fix states them, and a corrected copy has
// them.
#ifndef WAYMARK_CLI_CHECK_EDITS_H
#define WAYMARK_CLI_CHECK_EDITS_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/site.h"
#include "waymark/status.h"

typedef enum file_edit_kind {
  EDIT_COLUMN,  // value = factor * value + offset
  EDIT_SWAP,    // of the columns `name` and `text`
  EDIT_IDS,     // by `ids`
  EDIT_SORT,    // rows by the column `name`
  EDIT_VALUE,   // of YAML: `text` at the path `name`
  EDIT_SIGNAL,  // of the DBC's signal `name`: by `layout`, `factor` of its scale, `offset` of its first bit
  EDIT_MIRROR   // of a picture: left and right swapped; `factor` -1: top and bottom
} file_edit_kind;

typedef enum signal_layout {
  LAYOUT_SAME,
  LAYOUT_ORDER,        // the other byte order, of the same bytes
  LAYOUT_ORDER_START,  // the other byte order, of the same first bit
  LAYOUT_SIGN          // signed for unsigned and the reverse
} signal_layout;

#define ID_PAIRS_MAX 64
typedef struct id_table {
  int32_t from[ID_PAIRS_MAX], to[ID_PAIRS_MAX];
  size_t count;
} id_table;

typedef struct file_edit {
  file_edit_kind kind;
  char file[WM_PATH_MAX];  // in the recording's folder: "sightings.csv"
  int is_config;           // the file is the configuration, by its own path
  char name[96];
  char text[96];
  char only[64];  // rows of this sensor, signals of this message; "": of all
  double factor, offset;
  signal_layout layout;
  const id_table *ids;
  int is_optional;  // of a column that may be missing
} file_edit;

// The text with the change; the caller frees *out. `comment` ("": none) is put beside the change where the format has
// comments. WM_NOT_FOUND where there is nothing to change.
wm_status edit_text(const file_edit *edit, const char *text, size_t length, const char *comment, char **out,
                    size_t *out_length, wm_error *err);
// What is done with a table, in words: "range_m times 0.001"; "" for other files.
void edit_words(const file_edit *edit, char *out, size_t capacity);

#endif
