// SPDX-License-Identifier: Apache-2.0
// The black box's pictures: of each camera some a second, as the camera sent them, in two videos that take turns as the
// logs do: pictures-CAMERA-a.avi and -b.avi with their stamps, the files of a recording. A loss or a death keeps them
// by hard links, lost-0001-CAMERA-a.avi; what is linked is never written over. Of the disk thread.
#ifndef WAYMARK_OUTPUT_BLACK_BOX_VIDEO_H
#define WAYMARK_OUTPUT_BLACK_BOX_VIDEO_H

#include <stdio.h>

#include "waymark/devices.h"
#include "waymark/frame_source.h"

typedef struct box_camera {
  char name[WM_NAME_MAX];
  wm_frame_source *frames;  // a reader of its pictures
  FILE *video, *stamps;
  int part;  // 0: a, 1: b
  uint64_t count;
  wm_time_ns next_ns, rotate_ns;
} box_camera;

typedef struct box_pictures {
  char folder[WM_PATH_MAX];
  wm_time_ns keep_ns, period_ns;
  box_camera cameras[WM_CAMERA_DEVICES_MAX];
  size_t camera_count;
} box_pictures;

// `rate_hz` 0: none are kept, and nothing below does anything.
void box_pictures_open(box_pictures *self, const char *folder, double keep_s, double rate_hz);
// Reads each camera of `rig` that `pictures` have.
wm_status box_pictures_subscribe(box_pictures *self, wm_pictures *pictures, const wm_rig *rig, wm_error *err);
// Writes what came, at most `rate_hz` of each camera; waits for no picture. 0, or errno of what can't be written.
int box_pictures_take(box_pictures *self);
// Keeps what is in `folder` as WHAT-NUMBER-CAMERA-PART. 0, or errno.
int box_pictures_keep(const char *folder, const char *what, unsigned number);
// Before the cameras are closed.
void box_pictures_close(box_pictures *self);

#endif
