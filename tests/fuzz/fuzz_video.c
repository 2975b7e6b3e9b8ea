// SPDX-License-Identifier: Apache-2.0
// Any bytes as a video: pictures lie within the file, one after the other, and the decoder takes or refuses them.
#include <stdio.h>
#include <sys/mman.h>
#include <unistd.h>

#include "container.h"
#include "fuzz.h"
#include "jpeg.h"

#define W 64
#define H 48

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  int fd = memfd_create("video", 0);
  char path[64];
  (void)snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
  check(fd >= 0 && write(fd, data, size) == (ssize_t)size);
  container file;
  wm_error err;
  static uint8_t bytes[1 << 16], grey[W * H];
  jpeg_decoder decoder;
  check(jpeg_open(&decoder, &err) == WM_OK);
  if (container_open(&file, path, &err) == WM_OK) {
    payload picture;
    uint64_t end = 0, frames = 0;
    while (file.next(&file, &picture, &err) == WM_OK) {
      check(picture.offset >= end && picture.length > 0 && picture.length <= size - picture.offset);
      check(picture.frame == frames++);
      end = picture.offset + picture.length;
      if (picture.length > sizeof bytes) continue;
      char why[128];
      check(container_read(&file, &picture, bytes, &err) == WM_OK);
      (void)jpeg_decode(&decoder, bytes, (size_t)picture.length, W, H, grey, W, why, sizeof why);
    }
    container_close(&file);
  }
  jpeg_close(&decoder);
  close(fd);
  return 0;
}
