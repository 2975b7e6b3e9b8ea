// SPDX-License-Identifier: Apache-2.0
// Opening of output files.
#ifndef WAYMARK_OUTPUT_NEW_FILE_H
#define WAYMARK_OUTPUT_NEW_FILE_H

#include <stdio.h>

// fopen(path, "wbe") without following a link at the path's last part, so that a link in a writable folder can't direct
// a privileged program at another file. NULL with errno; ELOOP: it is a link.
FILE *new_file(const char *path);

#endif
