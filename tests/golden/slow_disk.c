// SPDX-License-Identifier: Apache-2.0
// Preloaded into a run: from WM_BLOCK_AFTER_S on, once, the first fflush or fsync of a file in the folder
// WM_BLOCK_FOLDER waits for WM_BLOCK_S, as a disk that hangs. The time of the block goes to standard error.
#include <dlfcn.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static double now_s(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static double begin_s;
static atomic_int blocked;

__attribute__((constructor)) static void begin(void) { begin_s = now_s(); }

static int is_in_folder(int fd) {
  char link[64], path[4096];
  const char *folder = getenv("WM_BLOCK_FOLDER");
  (void)snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  ssize_t n = readlink(link, path, sizeof path - 1);
  if (!folder || n <= 0) return 0;
  path[n] = '\0';
  return strncmp(path, folder, strlen(folder)) == 0;
}

static double number(const char *name) {
  const char *text = getenv(name);
  return text ? strtod(text, NULL) : 0;
}

static void block(int fd) {
  if (now_s() - begin_s <= number("WM_BLOCK_AFTER_S") || !is_in_folder(fd) || atomic_exchange(&blocked, 1)) return;
  (void)dprintf(2, "slow disk: blocked for %s s\n", getenv("WM_BLOCK_S"));
  (void)usleep((useconds_t)(number("WM_BLOCK_S") * 1e6));
}

int fsync(int fd) {
  static int (*real)(int);
  if (!real) *(void **)&real = dlsym(RTLD_NEXT, "fsync");
  block(fd);
  return real(fd);
}

int fflush(FILE *file) {
  static int (*real)(FILE *);
  if (!real) *(void **)&real = dlsym(RTLD_NEXT, "fflush");
  if (file) block(fileno(file));
  return real(file);
}
