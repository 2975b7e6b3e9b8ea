// SPDX-License-Identifier: Apache-2.0
// V4L2's place: cameras of a recording, stamped at the end of the exposure.
#include <errno.h>
#include <linux/videodev2.h>
#include <stdlib.h>
#include <string.h>

#include "camera_io.h"
#include "played_world.h"

typedef struct played_camera {
  played_cursor cursor;
  uint8_t *buffer[CAMERA_BUFFERS_MAX];  // the reader's until it is given back
  uint32_t room[CAMERA_BUFFERS_MAX];
} played_camera;

static int open_camera(void *context, camera_identity *wanted, void **camera) {
  (void)context;
  wm_play_stream about;
  if (!played_find(wanted->path, WM_PLAY_PICTURE, &about) || played_fault(WM_FAULT_CAMERA_UNPLUGGED, about.of))
    return -ENODEV;
  played_camera *self = calloc(1, sizeof *self);
  if (!self) return -ENOMEM;
  self->cursor.about = about;
  *camera = self;
  return 0;
}

// As wanted, where it is one that a player makes; else as recorded.
static int set_mode(void *camera, camera_mode *mode) {
  static const struct {
    uint32_t fourcc;
    const char *name;
    uint32_t bytes;
  } kFormats[] = {{V4L2_PIX_FMT_MJPEG, "MJPG", 0}, {V4L2_PIX_FMT_GREY, "GREY", 1}, {V4L2_PIX_FMT_YUYV, "YUYV", 2}};
  played_camera *self = camera;
  size_t chosen = strcmp(self->cursor.about.format, "GREY") == 0;
  for (size_t i = 0; i < 3; i++)
    if (mode->fourcc == kFormats[i].fourcc) chosen = i;
  strcpy(self->cursor.format, kFormats[chosen].name);
  mode->fourcc = kFormats[chosen].fourcc;
  mode->width = self->cursor.about.width_px;
  mode->height = self->cursor.about.height_px;
  mode->stride = mode->width * kFormats[chosen].bytes;
  mode->image_bytes = mode->width * mode->height * (chosen == 1 ? 1 : 2);
  return 0;
}

static int set_control(void *camera, camera_control *control) {
  (void)camera, (void)control;
  return 0;
}

static wm_time_ns exposure_ns(void *camera) {
  (void)camera;
  return 0;
}

static int start(void *camera, uint32_t buffers) {
  (void)buffers;
  played_close(&((played_camera *)camera)->cursor);  // what came before is gone
  return 0;
}

static const uint8_t *keep(played_camera *self, uint32_t index, const wm_play_item *item) {
  if (self->room[index] < item->bytes) {
    uint8_t *larger = realloc(self->buffer[index], item->bytes);
    if (!larger) return NULL;
    self->buffer[index] = larger;
    self->room[index] = item->bytes;
  }
  memcpy(self->buffer[index], item->data, item->bytes);
  return self->buffer[index];
}

static int take(void *camera, int wait_ms, camera_buffer *out) {
  played_camera *self = camera;
  wm_time_ns due_ns = 0;
  if (played_fault(WM_FAULT_CAMERA_UNPLUGGED, self->cursor.about.of)) return -ENODEV;
  const wm_play_item *item = played_next(&self->cursor, &due_ns);
  if (!played_sleep(item ? due_ns : INT64_MAX, wait_ms)) return 0;
  played_taken(&self->cursor);
  const uint32_t index = item->number % CAMERA_BUFFERS_MAX;
  const uint8_t *data = keep(self, index, item);
  if (!data) return -ENOMEM;
  *out = (camera_buffer){.index = index,
                         .bytes = item->bytes,
                         .sequence = item->number,
                         .flags = item->is_damaged ? CAMERA_BUFFER_ERROR : 0,
                         .stamp_ns = due_ns + item->ahead_ns,
                         .data = data};
  return 1;
}

static int give_back(void *camera, uint32_t index) {
  (void)camera, (void)index;
  return 0;
}

static void close_camera(void *camera) {
  played_camera *self = camera;
  played_close(&self->cursor);
  for (int i = 0; i < CAMERA_BUFFERS_MAX; i++) free(self->buffer[i]);
  free(self);
}

static void sleep_ms(void *context, int ms) {
  (void)context;
  (void)played_sleep(INT64_MAX, ms);
}

static wm_time_ns monotonic_ns(void *context) {
  (void)context;
  return played_now_ns();
}

const camera_io kV4l2 = {open_camera, set_mode,  set_control,  exposure_ns, start,
                         take,        give_back, close_camera, sleep_ms,    monotonic_ns};
