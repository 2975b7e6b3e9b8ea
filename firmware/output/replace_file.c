// SPDX-License-Identifier: Apache-2.0
#include "output/replace_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "waymark/recording.h"

static int write_all(int fd, const file_part *part) {
  const char *at = part->bytes;
  for (size_t left = part->count; left > 0;) {
    ssize_t written = write(fd, at, left);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    at += written;
    left -= (size_t)written;
  }
  return 0;
}

// To the disk, not only to the system: after a power cut the new name must not refer to an empty file.
static int write_through(int fd, const file_part *parts, size_t count) {
  int failed = 0;
  for (size_t i = 0; i < count && !failed; i++) failed = write_all(fd, &parts[i]);
  if (!failed && fsync(fd) != 0) failed = errno;
  return failed;
}

int rename_through(const char *from, const char *to) {
  char folder[WM_PATH_MAX];
  if (rename(from, to) != 0) return errno;
  (void)snprintf(folder, sizeof folder, "%s", to);
  char *slash = strrchr(folder, '/');
  if (slash == folder) slash++;
  if (slash) *slash = '\0';
  int fd = open(slash ? folder : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return 0;  // the file is on the disk; only its new name may be lost in a power cut
  (void)fsync(fd);
  (void)close(fd);
  return 0;
}

wm_status replace_file(const char *path, const file_part *parts, size_t count, wm_error *err) {
  char beside[WM_PATH_MAX + 8];
  (void)snprintf(beside, sizeof beside, "%s.new", path);
  (void)unlink(beside);  // left by a run that was killed during its write
  int fd = open(beside, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644);
  if (fd < 0) return wm_fail(err, WM_IO, "%s: can't be written: %s", path, strerror(errno));
  int failed = write_through(fd, parts, count);
  if (close(fd) != 0 && !failed) failed = errno;
  if (!failed) failed = rename_through(beside, path);
  if (!failed) return WM_OK;
  (void)unlink(beside);
  return wm_fail(err, WM_IO, "%s: can't be written: %s", path, strerror(failed));
}
