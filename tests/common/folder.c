// SPDX-License-Identifier: Apache-2.0
#define _GNU_SOURCE  // nftw
#include "folder.h"

#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static char root[256];

static void die(const char *what) {
  perror(what);
  exit(1);
}

const char *folder_make(void) {
  const char *base = getenv("TMPDIR");
  if (root[0]) return root;
  (void)snprintf(root, sizeof root, "%s/waymark-test-XXXXXX", base && *base ? base : "/tmp");
  if (!mkdtemp(root)) die(root);
  return root;
}

static int remove_one(const char *path, const struct stat *s, int kind, struct FTW *ftw) {
  (void)s, (void)kind, (void)ftw;
  return remove(path);
}

void folder_remove(void) {
  if (root[0] && nftw(root, remove_one, 16, FTW_DEPTH | FTW_PHYS) != 0) die(root);
  root[0] = '\0';
}

const char *folder_path(const char *file) {
  static char paths[4][512];
  static int next;
  char *path = paths[next++ % 4];
  (void)snprintf(path, sizeof paths[0], "%s/%s", folder_make(), file);
  return path;
}

void folder_write_bytes(const char *file, const char *bytes, size_t length) {
  char above[512];
  for (const char *end = strchr(file + 1, '/'); end; end = strchr(end + 1, '/')) {
    (void)snprintf(above, sizeof above, "%s/%.*s", folder_make(), (int)(end - file), file);
    (void)mkdir(above, 0777);
  }
  FILE *f = fopen(folder_path(file), "wb");
  if (!f || fwrite(bytes, 1, length, f) != length || fclose(f) != 0) die(folder_path(file));
}

void folder_write(const char *file, const char *text) { folder_write_bytes(file, text, strlen(text)); }
