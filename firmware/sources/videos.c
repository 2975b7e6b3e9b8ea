// SPDX-License-Identifier: Apache-2.0
#include "sources/videos.h"

static int has(const wm_pictures *base, const char *camera) {
  return wm_video_there(((const videos *)base)->dir, camera);
}

static wm_status open_video(wm_pictures *base, const wm_camera *camera, int32_t index, const wm_frame_wishes *wishes,
                            wm_frame_source **out, wm_error *err) {
  videos *self = (videos *)base;
  wm_video *video;
  (void)wishes;
  *out = NULL;
  wm_status status = wm_video_open(self->dir, camera, index, self->warn, self->warn_context, &video, err);
  if (status != WM_OK) return status;
  wm_video **first = &self->first[index];
  if (*first) status = wm_video_share(video, *first, err);
  if (status != WM_OK) {
    wm_video_close(video);
    return status;
  }
  if (!*first) *first = video;
  *out = wm_video_frames(video);
  return WM_OK;
}

static wm_status start_nothing(wm_pictures *base, wm_error *err) {
  (void)base, (void)err;
  return WM_OK;
}

static void close_nothing(wm_pictures *base) { (void)base; }

static const wm_pictures_ops kVideos = {has, open_video, start_nothing, close_nothing};

void videos_of(videos *out, const wm_recording *recording, wm_warn_fn warn, void *context) {
  *out = (videos){.base = {&kVideos,
                           "has no pictures (video/CAMERA.avi, .mkv or a folder of JPEG) of a camera of "
                           "calibration.yaml"},
                  .dir = wm_recording_dir(recording),
                  .warn = warn,
                  .warn_context = context};
}
