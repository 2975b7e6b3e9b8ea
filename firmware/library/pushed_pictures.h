// SPDX-License-Identifier: Apache-2.0
// Cameras whose pictures a program pushes: each detector reads a picture once.
#ifndef WAYMARK_LIBRARY_PUSHED_PICTURES_H
#define WAYMARK_LIBRARY_PUSHED_PICTURES_H

#include "sources/vision.h"
#include "waymark/frame_source.h"

typedef struct pushed_pictures pushed_pictures;

// For wm_recording_set_pictures, which owns it.
pushed_pictures *pushed_pictures_make(void);
wm_pictures *pushed_pictures_base(pushed_pictures *self);
// The next picture of a camera, for all of its readers, whose number is returned. One that they have not taken is
// replaced, and counted.
size_t pushed_pictures_put(pushed_pictures *self, int32_t camera, const wm_frame *frame);

#endif
