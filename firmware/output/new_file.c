// SPDX-License-Identifier: Apache-2.0
#include "output/new_file.h"

#include <errno.h>
#include <fcntl.h>
#include <unistd.h>

FILE *new_file(const char *path) {
  int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (fd < 0) return NULL;
  FILE *file = fdopen(fd, "wb");
  if (file) return file;
  int failed = errno;
  (void)close(fd);
  errno = failed;
  return NULL;
}
