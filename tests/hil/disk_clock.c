// SPDX-License-Identifier: Apache-2.0
// disk_clock DEVICE: writes CLOCK_MONOTONIC, in nanoseconds, into the last 4096 bytes of a block device ten times a
// second, past the page cache. A log of the device's writes shows by it what was written when.
#define _GNU_SOURCE  // O_DIRECT
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define BLOCK 4096

int main(int argc, char **argv) {
  void *block = NULL;
  int fd = argc == 2 ? open(argv[1], O_WRONLY | O_DIRECT) : -1;
  off_t end = fd >= 0 ? lseek(fd, 0, SEEK_END) : 0;
  if (end < BLOCK || posix_memalign(&block, BLOCK, BLOCK) != 0) {
    perror("disk_clock");
    return 1;
  }
  memset(block, 0, BLOCK);
  for (;;) {
    struct timespec now, pause = {0, 100000000};
    clock_gettime(CLOCK_MONOTONIC, &now);
    (void)snprintf(block, BLOCK, "monotonic %lld\n", now.tv_sec * 1000000000LL + now.tv_nsec);
    if (pwrite(fd, block, BLOCK, end - BLOCK) != BLOCK) return 1;
    (void)nanosleep(&pause, NULL);
  }
}
