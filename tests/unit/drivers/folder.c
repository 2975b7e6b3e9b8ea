// SPDX-License-Identifier: Apache-2.0
#include "folder.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char root[256];

static void die(const char *what) {
  perror(what);
  exit(1);
}

const char *folder_make(void) {
  const char *base = getenv("TMPDIR");
  snprintf(root, sizeof root, "%s/waymark-test-XXXXXX", base ? base : "/tmp");
  if (!mkdtemp(root)) die(root);
  return root;
}

const char *folder_path(const char *file) {
  static char path[512];
  snprintf(path, sizeof path, "%s/%s", root, file);
  return path;
}

void folder_write_bytes(const char *file, const char *bytes, size_t length) {
  FILE *f = fopen(folder_path(file), "wb");
  if (!f || fwrite(bytes, 1, length, f) != length || fclose(f) != 0) die(folder_path(file));
}

void folder_write(const char *file, const char *text) { folder_write_bytes(file, text, strlen(text)); }

void folder_remove(void) {
  DIR *dir = opendir(root);
  if (!dir) return;
  for (struct dirent *entry; (entry = readdir(dir));)
    if (entry->d_name[0] != '.') (void)unlink(folder_path(entry->d_name));
  closedir(dir);
  (void)rmdir(root);
}
