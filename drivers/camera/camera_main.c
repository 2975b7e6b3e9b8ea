// SPDX-License-Identifier: Apache-2.0
// The process of a camera by libcamera or GStreamer (camera_process.h). Programs of their own: libcamera brings 22
// libraries along, whose loading would delay each start of waymark.
#include <stdio.h>
#include <string.h>

#include "camera_process.h"

int main(int argc, char **argv) {
  if (argc != 2 || strcmp(argv[1], CAMERA_PROCESS) != 0) {
    (void)fputs("waymark starts this program for each camera that its configuration names with the key " CAMERA_KEY
                "\n",
                stderr);
    return 2;
  }
  camera_process_serve(&CAMERA_IO);
  return 0;
}
