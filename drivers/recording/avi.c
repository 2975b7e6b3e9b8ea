// SPDX-License-Identifier: Apache-2.0
// AVI (RIFF, and its OpenDML continuation beyond 1 GB): lists are entered, so that one flat walk over the chunks visits
// them in order. Source: Microsoft, "AVI RIFF File Reference"; OpenDML AVI File Format Extensions 1.02.
#include <string.h>

#include "container.h"

#define NO_STREAM UINT64_MAX

static uint32_t u32(const uint8_t *p) {
  return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

typedef struct chunk {
  uint8_t id[4];
  uint64_t at, data, length;  // head, content, bytes of it
} chunk;

// The next chunk or list; lists are entered, chunks skipped. A truncated file has sizes of 0 or beyond its end, so a
// list's size is never used.
static wm_status next_chunk(container *self, chunk *out, wm_error *err) {
  uint8_t head[12];
  wm_status status = container_bytes(self, self->at, head, 8, err);
  if (status != WM_OK) return status;
  memcpy(out->id, head, 4);
  out->at = self->at;
  out->length = u32(head + 4);
  out->data = self->at + 8;
  for (int i = 0; i < 4; i++)
    if (head[i] < 0x20 || head[i] > 0x7E)
      return container_fail(self, err, WM_BAD_DATA, out->at, "no chunk begins here: the file is damaged");
  if (memcmp(out->id, "LIST", 4) == 0 || memcmp(out->id, "RIFF", 4) == 0) {
    status = container_bytes(self, out->data, head, 4, err);
    memcpy(out->id, head, 4);  // a list is identified by its kind
    out->length = 0;
    self->at = out->data + 4;
    return status;
  }
  self->at = out->data + out->length + (out->length & 1);
  return WM_OK;
}

static int is(const chunk *c, const char *id) { return memcmp(c->id, id, 4) == 0; }

static int is_one_of(const uint8_t *code, const char *const *names) {
  for (; *names; names++)
    if (memcmp(code, *names, 4) == 0) return 1;
  return 0;
}

// 00dc, 00db: stream and kind.
static int is_picture(const container *self, const chunk *c) {
  if (c->id[0] < '0' || c->id[0] > '9' || c->id[1] < '0' || c->id[1] > '9') return 0;
  if (c->id[2] != 'd' || (c->id[3] != 'c' && c->id[3] != 'b')) return 0;
  return self->track == (uint64_t)(c->id[0] - '0') * 10 + (uint64_t)(c->id[1] - '0');
}

static wm_status next_picture(container *self, payload *out, wm_error *err) {
  for (;;) {
    chunk c;
    wm_status status = next_chunk(self, &c, err);
    if (status != WM_OK) return status;
    if (!is_picture(self, &c)) continue;
    if (c.length == 0) {
      self->empty++;
      continue;
    }
    if (c.length > self->size - c.data)
      return container_fail(self, err, WM_BAD_DATA, c.at, "the file ends within a picture");
    *out = (payload){c.data, c.length, self->next_frame++};
    return WM_OK;
  }
}

static wm_status read_format(container *self, const chunk *c, wm_error *err) {
  static const char *const kJpeg[] = {"MJPG", "mjpg", "JPEG", "jpeg", "AVI1", NULL};
  static const char *const kGrey[] = {"Y800", "Y8  ", "GREY", NULL};
  uint8_t format[40], shown[5] = {0};
  if (c->length < sizeof format)
    return container_fail(self, err, WM_BAD_DATA, c->at, "the stream's format is truncated");
  wm_status status = container_bytes(self, c->data, format, sizeof format, err);
  if (status != WM_OK) return status;
  self->width_px = u32(format + 4);
  self->height_px = u32(format + 8);
  if (is_one_of(format + 16, kGrey)) self->coding = PICTURE_GREY;
  if (is_one_of(format + 16, kGrey) || is_one_of(format + 16, kJpeg)) return WM_OK;
  for (int i = 0; i < 4; i++) shown[i] = format[16 + i] >= 0x20 && format[16 + i] <= 0x7E ? format[16 + i] : '?';
  return wm_fail(err, WM_UNSUPPORTED,
                 "%s: its pictures are '%s'; MJPG and Y800 are read: convert it by `waymark import`", self->path,
                 shown);
}

wm_status avi_open(container *self, wm_error *err) {
  uint64_t stream = NO_STREAM;  // of the last strh
  int is_video = 0;
  self->track = NO_STREAM;
  self->next = next_picture;
  for (;;) {
    chunk c;
    uint8_t kind[4];
    wm_status status = next_chunk(self, &c, err);
    if (status == WM_OK && is(&c, "strh")) {
      stream = stream == NO_STREAM ? 0 : stream + 1;
      status = c.length < 4 ? WM_END : container_bytes(self, c.data, kind, 4, err);
      is_video = status == WM_OK && memcmp(kind, "vids", 4) == 0 && self->track == NO_STREAM;
    } else if (status == WM_OK && is(&c, "strf") && is_video) {
      self->track = stream;
      is_video = 0;
      status = read_format(self, &c, err);
    }
    if (status == WM_OK && is(&c, "movi")) break;
    if (status == WM_END) return wm_fail(err, WM_BAD_DATA, "%s: ends before its first picture", self->path);
    if (status != WM_OK) return status;
  }
  if (self->track == NO_STREAM || self->track > 99)
    return wm_fail(err, WM_BAD_DATA, "%s: has no video stream", self->path);
  return WM_OK;
}
