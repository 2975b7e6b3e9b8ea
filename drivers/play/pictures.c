// SPDX-License-Identifier: Apache-2.0
// The pictures of a camera, as they are stored.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "files.h"
#include "video_raw.h"

typedef struct pictures {
  play_file base;
  wm_video *video;
  char dir[WM_PATH_MAX];
  const wm_play_options *options;
} pictures;

static wm_status open_video(pictures *self, wm_error *err) {
  wm_camera camera = {0};  // of the size of its first picture
  (void)snprintf(camera.name, sizeof camera.name, "%s", self->base.stream[0].of);
  return wm_video_open(self->dir, &camera, 0, self->options ? self->options->warn : NULL,
                       self->options ? self->options->warn_context : NULL, &self->video, err);
}

// What the video counts as unusable, beside the pictures.
static void take_counts(pictures *self) {
  const wm_video_counts *c = wm_video_counted(self->video);
  const uint64_t bad = c->damaged + c->malformed + c->without_stamp + c->without_picture + c->empty;
  if (bad > self->base.unreadable) self->base.unreadable = bad;
  if (c->first_problem[0] && !self->base.first_problem[0])
    (void)snprintf(self->base.first_problem, sizeof self->base.first_problem, "%s", c->first_problem);
}

static wm_status read_picture(play_file *base, play_datum *out, wm_error *err) {
  pictures *self = (pictures *)base;
  wm_frame head;
  for (;;) {
    wm_status status = wm_video_peek(self->video, &head, err);
    take_counts(self);
    if (status != WM_OK) return status;
    out->picture = *video_peeked(self->video);
    out->due_ns = out->t_ns = head.t_ns;
    out->stream = 0;
    status = wm_video_skip(self->video, err);
    if (status != WM_OK || out->picture.length <= PLAY_PICTURE_MAX) return status;
    play_file_count(base, "a picture of more than 64 MB is skipped");
  }
}

static wm_status picture(const play_file *base, const payload *wanted, uint8_t *out, wm_error *err) {
  return container_read(video_container(((const pictures *)base)->video), wanted, out, err);
}

static wm_status rewind_pictures(play_file *base, wm_error *err) {
  pictures *self = (pictures *)base;
  wm_video_close(self->video);
  self->video = NULL;
  return open_video(self, err);
}

static void close_pictures(play_file *base) {
  wm_video_close(((pictures *)base)->video);
  free(base);
}

static const play_file_ops kPictures = {read_picture, rewind_pictures, picture, close_pictures};

wm_status play_pictures_open(const char *dir, const char *camera, const wm_play_options *options, play_file **out,
                             wm_error *err) {
  *out = NULL;
  pictures *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to read the pictures of '%s'", dir, camera);
  self->base.ops = &kPictures;
  self->options = options;
  wm_play_stream *s = &self->base.stream[0];
  self->base.stream_count = 1;
  s->kind = WM_PLAY_PICTURE;
  (void)snprintf(self->dir, sizeof self->dir, "%s", dir);
  (void)snprintf(s->of, sizeof s->of, "%s", camera);
  (void)snprintf(s->name, sizeof s->name, "camera:%s", camera);
  wm_status status = open_video(self, err);
  if (status != WM_OK) {
    close_pictures(&self->base);
    return status;
  }
  video_size(self->video, &s->width_px, &s->height_px);
  (void)snprintf(s->format, sizeof s->format, "%s",
                 video_container(self->video)->coding == PICTURE_JPEG ? "MJPG" : "GREY");
  *out = &self->base;
  return WM_OK;
}
