// SPDX-License-Identifier: Apache-2.0
// The videos of a recording's folder as cameras: each reader has its own position in the file; a picture is decoded
// once for all of them.
#ifndef WAYMARK_SOURCES_VIDEOS_H
#define WAYMARK_SOURCES_VIDEOS_H

#include "waymark/frame_source.h"
#include "waymark/recording.h"
#include "waymark/video.h"

typedef struct videos {
  wm_pictures base;
  wm_video *first[WM_CAMERAS_MAX];  // reader of each camera of the rig
  const char *dir;
  wm_warn_fn warn;
  void *warn_context;
} videos;

// Allocates nothing; `recording` outlives it, and its readers stay open until the last one is opened.
void videos_of(videos *out, const wm_recording *recording, wm_warn_fn warn, void *context);

#endif
