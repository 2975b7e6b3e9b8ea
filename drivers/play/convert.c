// SPDX-License-Identifier: Apache-2.0
// A stored picture as what a device gives: JPEG, grey, or YUYV; darker, or cut, where a fault has it so.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "player.h"

static wm_status room(uint8_t **buffer, size_t *have, size_t need, wm_error *err) {
  if (need <= *have) return WM_OK;
  uint8_t *larger = realloc(*buffer, need);
  if (!larger) return wm_fail(err, WM_IO, "no memory for a picture of %zu bytes", need);
  *buffer = larger;
  *have = need;
  return WM_OK;
}

// Packed rows into self->grey.
static wm_status decode(wm_play *self, const wm_play_stream *s, size_t length, wm_error *err) {
  const size_t pixels = (size_t)s->width_px * s->height_px;
  char why[256];
  wm_status status = room(&self->grey, &self->grey_max, pixels, err);
  if (status != WM_OK) return status;
  if (strcmp(s->format, "MJPG") == 0) {
    if (jpeg_decode(&self->jpeg, self->stored, length, s->width_px, s->height_px, self->grey, s->width_px, why,
                    sizeof why) == JPEG_GOOD)
      return WM_OK;
    return wm_fail(err, WM_BAD_DATA, "%s: a picture can't be decoded: %.200s", s->name, why);
  }
  // Rows are packed, or padded to four bytes.
  const size_t padded = (s->width_px + 3) & ~(size_t)3, stride = length == padded * s->height_px ? padded : s->width_px;
  if (length != stride * s->height_px)
    return wm_fail(err, WM_BAD_DATA, "%s: a picture has %zu bytes, the camera %u x %u pixels", s->name, length,
                   s->width_px, s->height_px);
  for (uint32_t y = 0; y < s->height_px; y++)
    memcpy(self->grey + (size_t)y * s->width_px, self->stored + y * stride, s->width_px);
  return WM_OK;
}

static wm_status make_yuyv(wm_play *self, size_t pixels, wm_play_item *item, wm_error *err) {
  wm_status status = room(&self->made, &self->made_max, 2 * pixels, err);
  if (status != WM_OK) return status;
  for (size_t i = 0; i < pixels; i++) {
    self->made[2 * i] = self->grey[i];
    self->made[2 * i + 1] = 128;  // no colour
  }
  item->data = self->made;
  item->bytes = (uint32_t)(2 * pixels);
  return WM_OK;
}

static wm_status make_jpeg(wm_play *self, const wm_play_stream *s, wm_play_item *item, wm_error *err) {
  wm_status status = room(&self->made, &self->made_max, jpeg_bytes_max(s->width_px, s->height_px), err);
  if (status != WM_OK) return status;
  item->data = self->made;
  item->bytes = (uint32_t)jpeg_encode_grey(self->grey, s->width_px, s->height_px, self->made);
  return item->bytes ? WM_OK : wm_fail(err, WM_BAD_DATA, "%s: a picture can't be encoded", s->name);
}

static wm_status make(wm_play *self, const wm_play_stream *s, const char *format, wm_play_item *item, wm_error *err) {
  const size_t pixels = (size_t)s->width_px * s->height_px;
  if (strcmp(format, "MJPG") == 0) return make_jpeg(self, s, item, err);
  if (strcmp(format, "YUYV") == 0) return make_yuyv(self, pixels, item, err);
  item->data = self->grey;
  item->bytes = (uint32_t)pixels;
  return WM_OK;
}

wm_status play_convert(wm_play *self, const payload *picture, wm_play_item *item, double brightness, wm_error *err) {
  const wm_play_stream *s = &self->stream[item->stream];
  const play_state *state = &self->state[item->stream];
  const size_t length = (size_t)picture->length;
  wm_status status = room(&self->stored, &self->stored_max, length, err);
  if (status == WM_OK) status = state->file->ops->picture(state->file, picture, self->stored, err);
  if (status != WM_OK) return status;
  item->data = self->stored;
  item->bytes = (uint32_t)length;
  const int is_same = strcmp(state->format, s->format) == 0 && brightness >= 1.0;
  if (!is_same || strcmp(s->format, "GREY") == 0) {  // grey rows may be padded
    status = decode(self, s, length, err);
    for (size_t i = 0; status == WM_OK && brightness < 1.0 && i < (size_t)s->width_px * s->height_px; i++)
      self->grey[i] = (uint8_t)(self->grey[i] * brightness + 0.5);
    if (status == WM_OK) status = make(self, s, state->format, item, err);
    if (status != WM_OK) return status;
  }
  if (item->is_damaged) item->bytes /= 2;
  return WM_OK;
}
