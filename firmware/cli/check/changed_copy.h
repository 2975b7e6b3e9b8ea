// SPDX-License-Identifier: Apache-2.0
// A recording's folder with changes: links to the unchanged files and new texts of the others. The original stays as
// it is.
#ifndef WAYMARK_CLI_CHECK_CHANGED_COPY_H
#define WAYMARK_CLI_CHECK_CHANGED_COPY_H

#include "cli/check/edits.h"
#include "config/config.h"
#include "waymark/site.h"

typedef struct changed_copy {
  const char *dir;                   // of the recording
  wm_recording_overrides overrides;  // the copy's files in place of those that were overridden and are changed
  char out[WM_PATH_MAX];             // the copy
} changed_copy;

// Makes the folder `out`, which must not be there. Edits of the configuration
// are left out. `comment` as in edit_text; with one, changed tables are listed in
// comments of recording.yaml.
wm_status changed_copy_make(changed_copy *self, const wm_recording_overrides *overrides, const file_edit *edits,
                            size_t count, const char *comment, wm_error *err);
// The configuration's text with its edits; NULL where it has none. The caller frees it.
wm_status changed_config(const file_edit *edits, size_t count, const char *comment, char **text, size_t *length,
                         wm_error *err);
// Writes the configuration with its edits into the copy, where it has any or names a file that the copy has changed;
// the files that it names have absolute paths there. `written`: its path, "" if none.
wm_status changed_copy_config(const changed_copy *self, const wm_config *config, const file_edit *edits, size_t count,
                              const char *comment, char written[WM_PATH_MAX], wm_error *err);
// Removes a copy that changed_copy_make made.
void changed_copy_remove(const changed_copy *self);

// "FILE:LINE: `TEXT`" of the first line that each edit changes, with words for a table's other rows.
void changed_lines(const char *dir, const wm_recording_overrides *overrides, const file_edit *edits, size_t count,
                   char *out, size_t capacity);

#endif
