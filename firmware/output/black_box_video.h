// SPDX-License-Identifier: Apache-2.0
// The black box's pictures: some per second of each camera, in the camera's format, in two alternating videos as the
// logs: pictures-CAMERA-a.avi and -b.avi with their stamps, as in a recording. A loss or a death keeps them by hard
// links, lost-0001-CAMERA-a.avi; a linked file is never overwritten. On the disk thread.
#ifndef WAYMARK_OUTPUT_BLACK_BOX_VIDEO_H
#define WAYMARK_OUTPUT_BLACK_BOX_VIDEO_H

#include <stdio.h>

#include "waymark/devices.h"
#include "waymark/frame_source.h"

typedef struct black_box_camera {
  char name[WM_NAME_MAX];
  wm_frame_source *frames;  // a reader of its pictures
  FILE *video, *stamps;
  int part;  // 0: a, 1: b
  uint64_t count;
  wm_time_ns next_ns, rotate_ns;
} black_box_camera;

typedef struct black_box_video {
  char folder[WM_PATH_MAX];
  wm_time_ns keep_ns, period_ns;
  black_box_camera cameras[WM_CAMERA_DEVICES_MAX];
  size_t camera_count;
} black_box_video;

// `rate_hz` 0: no pictures are kept, and the functions below do nothing.
void black_box_video_open(black_box_video *self, const char *folder, double keep_s, double rate_hz);
// Subscribes to each camera of `rig` that `pictures` has.
wm_status black_box_video_subscribe(black_box_video *self, wm_pictures *pictures, const wm_rig *rig, wm_error *err);
// Writes the pictures that have arrived, at most `rate_hz` of each camera, without waiting. 0, or errno.
int black_box_video_take(black_box_video *self);
// Links the videos in `folder` as WHAT-NUMBER-CAMERA-PART. 0, or errno.
int black_box_video_keep(const char *folder, const char *what, uint64_t number);
// Before the cameras are closed.
void black_box_video_close(black_box_video *self);

#endif
