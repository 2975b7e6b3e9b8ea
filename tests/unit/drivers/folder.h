// SPDX-License-Identifier: Apache-2.0
// A temporary folder with files of the test's making.
#pragma once

#include <stddef.h>

// Makes an empty folder; the path holds until folder_remove().
const char *folder_make(void);
// Writes a file into it, over what was there. `text` is terminated; folder_write_bytes takes zero bytes, too.
void folder_write(const char *file, const char *text);
void folder_write_bytes(const char *file, const char *bytes, size_t length);
const char *folder_path(const char *file);  // holds until the next call
void folder_remove(void);
