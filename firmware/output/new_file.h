// SPDX-License-Identifier: Apache-2.0
// Files that a run writes.
#ifndef WAYMARK_OUTPUT_NEW_FILE_H
#define WAYMARK_OUTPUT_NEW_FILE_H

#include <stdio.h>

// fopen(path, "wbe") that follows no link at the path's last part, so that nobody who may write into the folder can
// direct a program with more rights at another file. NULL with errno; ELOOP: it is a link.
FILE *new_file(const char *path);

#endif
