// SPDX-License-Identifier: Apache-2.0
// The black box's pictures: of each camera some a second, as the camera sent them, in two videos that take turns as the
// logs do: pictures-CAMERA-a.avi and -b.avi with their stamps, the files of a recording. A loss or a death keeps them
// by hard links, lost-0001-CAMERA-a.avi; what is linked is never written over. Each camera is of its own thread.
#ifndef WM_FIRMWARE_BOX_PICTURES_H
#define WM_FIRMWARE_BOX_PICTURES_H

#include <stdatomic.h>
#include <stdio.h>

#include "waymark/devices.h"

typedef struct box_camera {
  char name[WM_NAME_MAX];
  FILE *video, *stamps;
  int part;  // 0: a, 1: b
  uint64_t count;
  wm_time_ns next_ns, rotate_ns;
} box_camera;

typedef struct box_pictures {
  char folder[WM_PATH_MAX];
  wm_time_ns keep_ns, period_ns;
  box_camera cameras[WM_CAMERA_DEVICES_MAX];
  atomic_int failed;  // errno of what couldn't be written last; who reads it sets it to 0
} box_pictures;

// `rate_hz` 0: none are kept, and nothing below does anything.
void box_pictures_open(box_pictures *self, const char *folder, double keep_s, double rate_hz);
// The camera's thread: a picture that came, `camera` of those of the run. A write of the picture's size, some a second.
void box_pictures_put(box_pictures *self, size_t camera, const char *name, const wm_frame *frame,
                      const wm_camera_raw *raw);
// Keeps what is in `folder` as WHAT-NUMBER-CAMERA-PART. 0, or errno. Any thread.
int box_pictures_keep(const char *folder, const char *what, unsigned number);
// When the cameras' threads have ended.
void box_pictures_close(box_pictures *self);

#endif
