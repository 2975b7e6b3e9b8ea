// SPDX-License-Identifier: Apache-2.0
// The last seconds of what was fused, and of what the cameras saw, kept where the robot got lost or the run died: event
// logs that replay. The first of a run begins as the run did (start, map of the run before), so that it gives the same
// poses; a later one begins at the pose of then, with the newest map that the estimator kept. In the folder: now.wmlog
// and before.wmlog, which take turns and hold between one and two times `keep_s`; and what was kept:
// lost-0001-before.wmlog, lost-0001-now.wmlog, died-0002-... . Of the disk thread.
#ifndef WAYMARK_OUTPUT_BLACK_BOX_H
#define WAYMARK_OUTPUT_BLACK_BOX_H

#include "fusion/assembly.h"
#include "output/black_box_video.h"
#include "output/event_log.h"
#include "output/run_findings.h"

#define BLACK_BOX_KEPT_MAX 20  // of losses and deaths; the oldest go

typedef struct black_box {
  char folder[WM_PATH_MAX];
  wm_time_ns keep_ns;
  wm_assembly assembly;  // the run's, with the start and the map of the present log
  void *map;             // the newest that came; NULL: none
  size_t map_capacity;
  wm_log_writer log;
  int is_open, was_tracking, said_unwritable;
  wm_time_ns begun_ns;      // arrival of the first event of a log without a pose
  wm_time_ns rotate_ns;     // the present log ends then; WM_TIME_NONE: no pose came since the run's or a loss's end
  wm_time_ns kept_from_ns;  // when what happened is to be kept; WM_TIME_NONE: nothing happened
  black_box_video pictures;
  wm_finding_fn say;
  void *say_context;
} black_box;

// Keeps what a run that died left behind. With an empty `folder` there is no black box, and nothing below does
// anything. What can't be written is said once, and localizing goes on. `assembly` outlives it.
void black_box_open(black_box *self, const char *folder, double keep_s, double pictures_hz, const wm_assembly *assembly,
                    wm_finding_fn say, void *say_context);
void black_box_event(black_box *self, const wm_event *event);
// The newest map (waymark/keeper.h), of which it makes a copy. May allocate.
void black_box_map(black_box *self, const void *image, size_t bytes);
// The newest pose: a log begins with one, and a loss is seen by it. `now_ns`: monotonic.
void black_box_pose(black_box *self, const wm_estimate *pose, wm_time_ns now_ns);
// Reads the pictures of each camera of `rig` that there is, until it is closed.
wm_status black_box_open_pictures(black_box *self, wm_pictures *pictures, const wm_rig *rig, wm_error *err);
// Takes the pictures that came. Every few milliseconds.
void black_box_take_pictures(black_box *self);
// Hands what is buffered to the system. Once a second.
void black_box_flush(black_box *self);
// In order: what is in it is not kept. A second time it does nothing.
void black_box_close(black_box *self);

#endif
