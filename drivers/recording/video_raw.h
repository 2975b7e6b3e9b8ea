// SPDX-License-Identifier: Apache-2.0
// A video's pictures as they are stored, for the player: after wm_video_peek, before wm_video_skip.
#ifndef WM_RECORDING_VIDEO_RAW_H
#define WM_RECORDING_VIDEO_RAW_H

#include "container.h"
#include "waymark/video.h"

// Where the pictures are read by container_read; coding and path.
const container *video_container(const wm_video *self);
// The picture that was peeked.
const payload *video_peeked(const wm_video *self);
// Of the camera, or of its first picture.
void video_size(const wm_video *self, uint32_t *width_px, uint32_t *height_px);

#endif
