// SPDX-License-Identifier: Apache-2.0
#include "container.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

wm_status container_fail(const container *self, wm_error *err, wm_status status, uint64_t offset, const char *what) {
  return wm_fail(err, status, "%s: byte %" PRIu64 ": %s", self->path, offset, what);
}

static wm_status read_at(int fd, const char *path, uint64_t offset, void *out, size_t count, wm_error *err) {
  uint8_t *to = out;
  while (count > 0) {
    ssize_t n = pread(fd, to, count, (off_t)offset);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return wm_fail(err, WM_IO, "%s: cannot be read: %s", path, strerror(errno));
    if (n == 0) return WM_END;
    to += n;
    offset += (uint64_t)n;
    count -= (size_t)n;
  }
  return WM_OK;
}

wm_status container_bytes(const container *self, uint64_t offset, void *out, size_t count, wm_error *err) {
  if (offset > self->size || count > self->size - offset) return WM_END;
  return read_at(self->fd, self->path, offset, out, count, err);
}

static wm_status open_file(const char *path, int *fd, uint64_t *size, wm_error *err) {
  struct stat about;
  *fd = open(path, O_RDONLY | O_CLOEXEC);
  if (*fd < 0 && errno == ENOENT) return wm_fail(err, WM_NOT_FOUND, "%s: there is no such file", path);
  if (*fd < 0) return wm_fail(err, WM_IO, "%s: cannot be opened: %s", path, strerror(errno));
  if (fstat(*fd, &about) == 0 && S_ISREG(about.st_mode)) {
    *size = (uint64_t)about.st_size;
    return WM_OK;
  }
  close(*fd);
  *fd = -1;
  return wm_fail(err, WM_IO, "%s: is not a file that can be read from any place", path);
}

wm_status container_open(container *self, const char *path, wm_error *err) {
  static const uint8_t kEbml[4] = {0x1A, 0x45, 0xDF, 0xA3};
  uint8_t head[12];
  *self = (container){.fd = -1};
  (void)snprintf(self->path, sizeof self->path, "%s", path);
  wm_status status = open_file(path, &self->fd, &self->size, err);
  if (status != WM_OK) return status;
  status = container_bytes(self, 0, head, sizeof head, err);
  if (status == WM_END)
    status = wm_fail(err, WM_BAD_DATA, "%s: has %" PRIu64 " bytes: not a video", path, self->size);
  else if (status == WM_OK && memcmp(head, "RIFF", 4) == 0 && memcmp(head + 8, "AVI ", 4) == 0)
    status = avi_open(self, err);
  else if (status == WM_OK && memcmp(head, kEbml, 4) == 0)
    status = mkv_open(self, err);
  else if (status == WM_OK)
    status = wm_fail(err, WM_UNSUPPORTED, "%s: is neither AVI nor Matroska; convert it by `waymark import`", path);
  if (status != WM_OK) container_close(self);
  return status;
}

void container_close(container *self) {
  if (self->fd >= 0) close(self->fd);
  self->fd = -1;
}

// ── a folder of files ───────────────────────────────────────────────────────────────────────────────────────────────

static wm_status picture_path(const container *self, uint64_t frame, char out[WM_PATH_MAX], wm_error *err) {
  if (snprintf(out, WM_PATH_MAX, "%s/%06" PRIu64 ".jpg", self->path, frame) < WM_PATH_MAX) return WM_OK;
  return wm_fail(err, WM_NOT_FOUND, "%s: the path is longer than %d bytes", self->path, WM_PATH_MAX - 1);
}

wm_status folder_open(container *self, const char *path, wm_error *err) {
  *self = (container){.fd = -1, .coding = PICTURE_JPEG};
  if (snprintf(self->path, sizeof self->path, "%s", path) < (int)sizeof self->path) return WM_OK;
  return wm_fail(err, WM_NOT_FOUND, "%s: the path is longer than %d bytes", path, WM_PATH_MAX - 1);
}

wm_status folder_find(container *self, uint64_t frame, payload *out, wm_error *err) {
  char path[WM_PATH_MAX];
  struct stat about;
  wm_status status = picture_path(self, frame, path, err);
  if (status != WM_OK) return status;
  if (stat(path, &about) != 0 || !S_ISREG(about.st_mode))
    return wm_fail(err, WM_NOT_FOUND, "%s: there is no such picture", path);
  *out = (payload){0, (uint64_t)about.st_size, frame};
  return WM_OK;
}

wm_status container_read(const container *self, const payload *picture, uint8_t *out, wm_error *err) {
  if (self->fd >= 0) {
    wm_status status = container_bytes(self, picture->offset, out, (size_t)picture->length, err);
    return status == WM_END ? container_fail(self, err, WM_BAD_DATA, picture->offset, "the file ends within a picture")
                            : status;
  }
  char path[WM_PATH_MAX];
  int fd;
  uint64_t size;
  wm_status status = picture_path(self, picture->frame, path, err);
  if (status == WM_OK) status = open_file(path, &fd, &size, err);
  if (status != WM_OK) {
    (void)wm_fail_in(err, "frame %" PRIu64, picture->frame);
    return WM_BAD_DATA;
  }
  status = read_at(fd, path, 0, out, (size_t)picture->length, err);
  close(fd);
  return status == WM_END ? wm_fail(err, WM_BAD_DATA, "%s: became shorter", path) : status;
}
