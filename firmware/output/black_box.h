// SPDX-License-Identifier: Apache-2.0
// Event logs and pictures of the last seconds, kept when the robot gets lost or a run was killed. The logs replay. The
// first log of a run begins with its start and saved map and gives the same poses; a later one begins with the pose and
// the newest map of its beginning. In the folder: now.wmlog and before.wmlog, which alternate and hold between one and
// two times `keep_s`; and the kept ones: lost-0001-before.wmlog, lost-0001-now.wmlog, died-0002-... . On the disk
// thread.
#ifndef WAYMARK_OUTPUT_BLACK_BOX_H
#define WAYMARK_OUTPUT_BLACK_BOX_H

#include "findings/findings.h"
#include "fusion/assembly.h"
#include "output/black_box_video.h"
#include "output/event_log.h"

#define BLACK_BOX_KEPT_MAX 20  // losses and deaths; the oldest are removed

typedef struct black_box {
  char folder[WM_PATH_MAX];
  wm_time_ns keep_ns;
  wm_assembly assembly;  // the run's, with the start and the map of the present log
  void *map;             // the newest that came; NULL: none
  size_t map_capacity;
  wm_log_writer log;
  int is_open, was_tracking, said_unwritable;
  wm_time_ns begun_ns;      // arrival of the first event of a log without a pose
  wm_time_ns rotate_ns;     // end of the present log; WM_TIME_NONE: no pose since the start or a loss
  wm_time_ns kept_from_ns;  // when a pending loss is kept; WM_TIME_NONE: none pending
  black_box_video pictures;
  wm_line_fn say;
  void *say_context;
} black_box;

// Keeps the logs of a run that was killed. An empty `folder` switches the black box off. A write error is reported
// once, and the run continues. `assembly` outlives it.
void black_box_open(black_box *self, const char *folder, double keep_s, double pictures_hz, const wm_assembly *assembly,
                    wm_line_fn say, void *say_context);
void black_box_event(black_box *self, const wm_event *event);
// The newest map (waymark/keeper.h), of which it makes a copy. May allocate.
void black_box_map(black_box *self, const void *image, size_t bytes);
// The newest pose and its floor (wm_published_floor): starts a log, and detects a loss. `now_ns`: monotonic.
void black_box_pose(black_box *self, const wm_estimate *pose, int floor, wm_time_ns now_ns);
// Subscribes to the pictures of each camera of `rig`, until it is closed.
wm_status black_box_open_pictures(black_box *self, wm_pictures *pictures, const wm_rig *rig, wm_error *err);
// Writes the pictures that have arrived. Every few milliseconds.
void black_box_take_pictures(black_box *self);
// Flushes to the system. Once a second.
void black_box_flush(black_box *self);
// Regular end: the present log is not kept. A second call does nothing.
void black_box_close(black_box *self);

#endif
