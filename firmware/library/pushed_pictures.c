// SPDX-License-Identifier: Apache-2.0
#include "library/pushed_pictures.h"

#include <stdlib.h>
#include <string.h>

#define READERS_MAX (2 * WM_VISION_SOURCES_MAX)  // a pair of pictures for each detector

typedef struct reader {
  wm_frame_source base;
  int32_t camera;
  uint32_t width_px, height_px;
  uint64_t pictures, replaced;
  wm_frame frame;
  int has_frame;
} reader;

struct pushed_pictures {
  wm_pictures base;
  reader *readers[READERS_MAX];
  size_t count;
};

static wm_status peek(wm_frame_source *base, wm_frame *out, wm_error *err) {
  reader *self = (reader *)base;
  (void)err;
  if (!self->has_frame) return WM_AGAIN;
  *out = self->frame;
  out->grey = NULL;
  return WM_OK;
}

static wm_status next(wm_frame_source *base, wm_frame *out, wm_error *err) {
  reader *self = (reader *)base;
  (void)err;
  if (!self->has_frame) return WM_AGAIN;
  self->has_frame = 0;
  *out = self->frame;
  return WM_OK;
}

static wm_status skip(wm_frame_source *base, wm_error *err) {
  reader *self = (reader *)base;
  (void)err;
  self->replaced += (uint64_t)self->has_frame;
  self->has_frame = 0;
  return WM_OK;
}

static void raw(const wm_frame_source *base, wm_camera_raw *out) {
  (void)base;
  *out = (wm_camera_raw){0};
}

static void counts(const wm_frame_source *base, wm_source_counts *out) {
  memset(out, 0, sizeof *out);
  out->overflows = ((const reader *)base)->replaced;
}

static void close_reader(wm_frame_source *base) { ((reader *)base)->camera = -1; }  // freed with the cameras

static const wm_frame_source_ops kReader = {
    .peek = peek, .next = next, .skip = skip, .raw = raw, .counts = counts, .close = close_reader};

// A camera without a size can't be pushed to: each picture is checked against it.
static int has(const wm_pictures *base, const char *camera) {
  (void)base, (void)camera;
  return 1;
}

static wm_status open_reader(wm_pictures *base, const wm_camera *camera, int32_t index, const wm_frame_wishes *wishes,
                             wm_frame_source **out, wm_error *err) {
  pushed_pictures *self = (pushed_pictures *)base;
  (void)wishes;
  *out = NULL;
  if (self->count == READERS_MAX) return wm_fail(err, WM_FULL, "more than %d readers of cameras", READERS_MAX);
  reader *one = calloc(1, sizeof *one);
  if (!one) return wm_fail(err, WM_IO, "no memory for the camera '%s'", camera->name);
  one->base.ops = &kReader;
  one->camera = index;
  self->readers[self->count++] = one;
  *out = &one->base;
  return WM_OK;
}

static wm_status start_nothing(wm_pictures *base, wm_error *err) {
  (void)base, (void)err;
  return WM_OK;
}

static void close_pictures(wm_pictures *base) {
  pushed_pictures *self = (pushed_pictures *)base;
  for (size_t i = 0; i < self->count; i++) free(self->readers[i]);
  free(self);
}

static const wm_pictures_ops kPictures = {has, open_reader, start_nothing, close_pictures};

pushed_pictures *pushed_pictures_make(void) {
  pushed_pictures *self = calloc(1, sizeof *self);
  if (self) self->base = (wm_pictures){&kPictures, "has no camera in calibration.yaml"};
  return self;
}

wm_pictures *pushed_pictures_base(pushed_pictures *self) { return &self->base; }

size_t pushed_pictures_put(pushed_pictures *self, int32_t camera, const wm_frame *frame) {
  size_t readers = 0;
  for (size_t i = 0; i < self->count; i++) {
    reader *one = self->readers[i];
    if (one->camera != camera) continue;
    readers++;
    one->replaced += (uint64_t)one->has_frame;
    one->frame = *frame;
    one->frame.camera = camera;
    one->frame.number = one->pictures++;
    one->has_frame = 1;
  }
  return readers;
}
