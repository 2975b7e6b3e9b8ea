// SPDX-License-Identifier: Apache-2.0
// A temporary folder with files of the test's making.
#pragma once

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

// Makes an empty folder where there is none; the path holds until folder_remove(), which removes all that is in it.
const char *folder_make(void);
void folder_remove(void);
// Path of a file or folder in it; holds until the next calls but three.
const char *folder_path(const char *file);
// Writes a file into it, over what was there, and makes the folders above it. `text` is terminated; folder_write_bytes
// takes zero bytes, too.
void folder_write(const char *file, const char *text);
void folder_write_bytes(const char *file, const char *bytes, size_t length);

#ifdef __cplusplus
}
#endif
