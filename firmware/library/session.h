// SPDX-License-Identifier: Apache-2.0
// Inside of a session: pushed data are sources and pictures as a device's, read by the readers of a run.
#ifndef WAYMARK_LIBRARY_SESSION_H
#define WAYMARK_LIBRARY_SESSION_H

#include <waymark/waymark.h>

#include "fusion/pipeline.h"
#include "fusion/source_reader.h"
#include "library/pushed_pictures.h"
#include "library/pushed_source.h"
#include "output/run_folder.h"

struct waymark_session {
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
  wm_time_ns now_ns;                         // newest time on the clock of the arrivals
};

// `given` of `bytes` bytes into `full_bytes` of zeros. WM_BAD_USAGE: larger than this library's, or none.
wm_status library_take_options(const char *function, const void *given, size_t bytes, void *out, size_t full_bytes,
                               wm_error *err);
// WM_BAD_USAGE where a result's struct has another size than the library's.
wm_status library_check_size(const char *function, const void *out, size_t bytes, size_t right_bytes, wm_error *err);
// wm_health has grown at its end: programs of 0.2 get the beginning that they know.
wm_status library_put_health(const char *function, const wm_health *health, void *out, size_t bytes, wm_error *err);
// The callback's kind of a record; 0: it has none.
waymark_record library_record(wm_output_kind kind);

#endif
