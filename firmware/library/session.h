// SPDX-License-Identifier: Apache-2.0
// Inside of a session: pushed data are sources and pictures as a device's, read by the readers of a run.
#ifndef WAYMARK_LIBRARY_SESSION_H
#define WAYMARK_LIBRARY_SESSION_H

#include <waymark/waymark.h>

#include "fusion/pipeline.h"
#include "fusion/source_reader.h"
#include "library/pushed_pictures.h"
#include "library/pushed_source.h"
#include "output/event_log.h"
#include "output/run_folder.h"

typedef struct session {
  waymark_options options;  // its texts are not kept
  wm_config config;
  wm_recording *robot;  // owns sources and pictures
  pushed_source *sources[WM_SOURCES_MAX];
  size_t source_count;
  pushed_pictures *pictures;
  wm_assembly assembly;
  wm_arena arena;
  wm_pipeline pipeline;
  wm_source_reader *readers;  // of the assembly's sources
  wm_run_folder *folder;      // NULL: no files
  wm_output file;
  char site[WM_PATH_MAX], out[WM_PATH_MAX];  // "": none
  int has_started, has_data;                 // has_data: the readers are open
  wm_bound bound;                            // of the last pose
  wm_time_ns now_ns;                         // newest time on the clock of the arrivals
  // First and last of the times that were refused, one behind the other, because they are far ahead; WM_TIME_NONE:
  // none.
  wm_time_ns ahead_from_ns, ahead_to_ns;
  uint32_t noted;  // bit per source of the assembly: its first datum without use to the estimator was noted
} session;

// Of a log: the reader and terminated copies of its texts.
typedef struct event_log {
  wm_log_reader *reader;
  char *config, *calibration;
} event_log;

// `given` of `bytes` bytes into `full_bytes` of zeros. WM_BAD_USAGE: larger than this library's, or none.
wm_status library_take_options(const char *function, const void *given, size_t bytes, void *out, size_t full_bytes,
                               wm_error *err);
// WM_BAD_USAGE where a result's struct has another size than the library's.
wm_status library_check_size(const char *function, const void *out, size_t bytes, size_t right_bytes, wm_error *err);
// wm_health has grown at its end: programs of 0.2 get the beginning that they know.
wm_status library_put_health(const char *function, const wm_health *health, void *out, size_t bytes, wm_error *err);
// WM_BAD_USAGE before the start.
wm_status session_check_started(const session *self, const char *function, wm_error *err);

// A note for each source's first datum that was taken, and is of no use to the estimator.
void session_note_unused(session *self);

// The functions of the interface behind its entry guard (interface.c): no pointer that they need is NULL, and no other
// call has the session.
wm_status session_open(const waymark_options *taken, session **out, wm_error *err);
wm_status session_add_source(session *self, const char *name, uint32_t *out, wm_error *err);
wm_status session_start(session *self, wm_error *err);
wm_status session_push_row(session *self, uint32_t source, wm_time_ns t_ns, wm_time_ns arrival_ns,
                           const double *numbers, size_t count, wm_error *err);
wm_status session_push_event(session *self, uint32_t source, const wm_event *event, wm_error *err);
wm_status session_push_can(session *self, const char *interface, const wm_can_frame *frame, wm_error *err);
wm_status session_push_picture(session *self, const char *camera, const wm_frame *frame, wm_error *err);
wm_status session_advance(session *self, const char *function, wm_time_ns now_ns, wm_error *err);
wm_status session_pose(session *self, wm_time_ns now_ns, wm_published *out, wm_error *err);
wm_status session_bound(session *self, wm_bound *out, wm_error *err);
wm_status session_health(session *self, wm_health *out, wm_error *err);
wm_status session_close(session *self, wm_error *err);
wm_status event_log_open(const char *path, event_log **out, wm_error *err);
void event_log_close(event_log *self);
wm_status session_replay(waymark_replay_options *taken, waymark_report *out, wm_error *err);

// The callback's kind of a record; 0: it has none.
waymark_record library_record(wm_output_kind kind);

#endif
