// SPDX-License-Identifier: Apache-2.0
// The videos of a recording's folder as its cameras: each reader has the file to itself.
#ifndef WAYMARK_SOURCES_VIDEOS_H
#define WAYMARK_SOURCES_VIDEOS_H

#include "waymark/frame_source.h"
#include "waymark/recording.h"

typedef struct videos {
  wm_pictures base;
  const char *dir;
  wm_warn_fn warn;
  void *warn_context;
} videos;

// No memory of its own; `recording` outlives it.
void videos_of(videos *out, const wm_recording *recording, wm_warn_fn warn, void *context);

#endif
