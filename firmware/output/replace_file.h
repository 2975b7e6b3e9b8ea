// SPDX-License-Identifier: Apache-2.0
// Atomic replacement of a file: at every moment the old or the new content is complete, also after a power cut.
#ifndef WAYMARK_OUTPUT_REPLACE_FILE_H
#define WAYMARK_OUTPUT_REPLACE_FILE_H

#include <stddef.h>

#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct file_part {
  const void *bytes;
  size_t count;
} file_part;

// Writes the parts into `path`.new, which must not be a link, syncs it and renames it. Some ms, on a memory card up to
// seconds: not on the real-time thread. WM_IO with the reason; the old file is then unchanged.
wm_status replace_file(const char *path, const file_part *parts, size_t count, wm_error *err);

// Renames and syncs the folder, so that a power cut does not take the new name back. 0 or an errno.
int rename_through(const char *from, const char *to);

#ifdef __cplusplus
}
#endif

#endif
