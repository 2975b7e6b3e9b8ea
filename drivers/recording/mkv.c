// SPDX-License-Identifier: Apache-2.0
// Matroska: only the elements that lead to pictures are entered, so that one flat walk visits them in order, with or
// without known sizes. Source: RFC 8794 (EBML), RFC 9559 (Matroska).
#include <string.h>

#include "container.h"

enum {
  ID_SEGMENT = 0x18538067,
  ID_CLUSTER = 0x1F43B675,
  ID_BLOCK_GROUP = 0xA0,
  ID_BLOCK = 0xA1,
  ID_SIMPLE_BLOCK = 0xA3,
  ID_TRACKS = 0x1654AE6B,
  ID_TRACK = 0xAE,
  ID_TRACK_NUMBER = 0xD7,
  ID_TRACK_TYPE = 0x83,
  ID_CODEC = 0x86,
  ID_CODEC_PRIVATE = 0x63A2,
  ID_ENCODINGS = 0x6D80,
  ID_VIDEO = 0xE0,
  ID_WIDTH = 0xB0,
  ID_HEIGHT = 0xBA,
  ID_COLOUR_SPACE = 0x2EB524
};
#define UNKNOWN_SIZE UINT64_MAX  // RFC 8794, section 6.2: all bits of a size set
#define TYPE_VIDEO 1             // RFC 9559: TrackType

typedef struct element {
  uint32_t id;
  uint64_t at, data, length;
} element;

// A number whose length is in the leading zeros of its first byte; `keep` leaves the marker bit in (ids).
static wm_status read_vint(const container *self, uint64_t *at, int bytes_max, int keep, uint64_t *out, wm_error *err) {
  uint8_t byte;
  wm_status status = container_bytes(self, *at, &byte, 1, err);
  if (status != WM_OK) return status;
  int more = 0;
  while (more < 8 && !(byte & (0x80 >> more))) more++;
  if (more >= bytes_max)
    return container_fail(self, err, WM_BAD_DATA, *at, "no element begins here: the file is damaged");
  uint64_t value = keep ? byte : byte & (0x7Fu >> more);
  int all_ones = !keep && value == (0x7Fu >> more);
  uint8_t rest[8];
  status = container_bytes(self, *at + 1, rest, (size_t)more, err);
  if (status != WM_OK) return status;
  for (int i = 0; i < more; i++) {
    value = value << 8 | rest[i];
    all_ones &= rest[i] == 0xFF;
  }
  *at += 1 + (uint64_t)more;
  *out = all_ones ? UNKNOWN_SIZE : value;
  return WM_OK;
}

static int is_stepped_into(uint32_t id) {
  return id == ID_SEGMENT || id == ID_CLUSTER || id == ID_BLOCK_GROUP || id == ID_TRACKS || id == ID_TRACK ||
         id == ID_VIDEO;
}

static wm_status next_element(container *self, element *out, wm_error *err) {
  uint64_t id, at = self->at;
  out->at = at;
  wm_status status = read_vint(self, &at, 4, 1, &id, err);
  if (status == WM_OK) status = read_vint(self, &at, 8, 0, &out->length, err);
  if (status != WM_OK) return status;
  out->id = (uint32_t)id;
  out->data = at;
  if (is_stepped_into(out->id)) {
    self->at = at;
    return WM_OK;
  }
  if (out->length == UNKNOWN_SIZE) return container_fail(self, err, WM_BAD_DATA, out->at, "an element without a size");
  if (out->length > self->size - at) {
    self->at = self->size;
    return out->id == ID_SIMPLE_BLOCK || out->id == ID_BLOCK
               ? container_fail(self, err, WM_BAD_DATA, out->at, "the file ends within a picture")
               : WM_END;
  }
  self->at = at + out->length;
  return WM_OK;
}

static wm_status next_picture(container *self, payload *out, wm_error *err) {
  for (;;) {
    element e;
    uint64_t track;
    uint8_t head[3];  // time within the cluster, flags
    wm_status status = next_element(self, &e, err);
    if (status != WM_OK) return status;
    if (e.id != ID_SIMPLE_BLOCK && e.id != ID_BLOCK) continue;
    uint64_t at = e.data;
    status = read_vint(self, &at, 8, 0, &track, err);
    if (status == WM_OK) status = container_bytes(self, at, head, sizeof head, err);
    if (status != WM_OK) return status;
    uint64_t used = at + sizeof head - e.data;
    if (used > e.length) return container_fail(self, err, WM_BAD_DATA, e.at, "a block without its head");
    if (track != self->track) continue;
    if (head[2] & 0x06)
      return container_fail(self, err, WM_BAD_DATA, e.at, "several pictures in one block (lacing) are not read");
    if (used == e.length) {
      self->empty++;
      continue;
    }
    *out = (payload){at + sizeof head, e.length - used, self->next_frame++};
    return WM_OK;
  }
}

// The track entry that is being read.
typedef struct track_entry {
  uint64_t number, type, width, height;
  char codec[32];
  uint8_t code[4];  // FOURCC of a Video for Windows or uncompressed track
  int encoded;      // compressed a second time by the container
} track_entry;

static wm_status read_number(const container *self, const element *e, uint64_t *out, wm_error *err) {
  uint8_t bytes[8];
  if (e->length > sizeof bytes) return container_fail(self, err, WM_BAD_DATA, e->at, "a number of more than 8 bytes");
  wm_status status = container_bytes(self, e->data, bytes, (size_t)e->length, err);
  if (status != WM_OK) return status;
  *out = 0;
  for (uint64_t i = 0; i < e->length; i++) *out = *out << 8 | bytes[i];
  return WM_OK;
}

static wm_status read_track_element(const container *self, const element *e, track_entry *t, wm_error *err) {
  switch (e->id) {
    case ID_TRACK_NUMBER: return read_number(self, e, &t->number, err);
    case ID_TRACK_TYPE: return read_number(self, e, &t->type, err);
    case ID_WIDTH: return read_number(self, e, &t->width, err);
    case ID_HEIGHT: return read_number(self, e, &t->height, err);
    case ID_ENCODINGS: t->encoded = 1; return WM_OK;
    case ID_CODEC: {
      size_t n = e->length < sizeof t->codec - 1 ? (size_t)e->length : sizeof t->codec - 1;
      memset(t->codec, 0, sizeof t->codec);
      return container_bytes(self, e->data, t->codec, n, err);
    }
    case ID_CODEC_PRIVATE: return e->length < 20 ? WM_OK : container_bytes(self, e->data + 16, t->code, 4, err);
    case ID_COLOUR_SPACE: return e->length < 4 ? WM_OK : container_bytes(self, e->data, t->code, 4, err);
    default: return WM_OK;
  }
}

// Whether the track is the one to read: the first video track.
static wm_status judge(container *self, const track_entry *t, wm_error *err) {
  if (t->type != TYPE_VIDEO || self->track != 0) return WM_OK;
  int is_jpeg =
      strcmp(t->codec, "V_MJPEG") == 0 || (strcmp(t->codec, "V_MS/VFW/FOURCC") == 0 && memcmp(t->code, "MJPG", 4) == 0);
  int is_grey =
      strcmp(t->codec, "V_UNCOMPRESSED") == 0 && (memcmp(t->code, "Y800", 4) == 0 || memcmp(t->code, "GREY", 4) == 0);
  if (!is_jpeg && !is_grey) {
    char shown[sizeof t->codec];
    for (size_t i = 0; i < sizeof shown; i++)
      shown[i] = t->codec[i] == '\0' || (t->codec[i] >= 0x20 && t->codec[i] <= 0x7E) ? t->codec[i] : '?';
    return wm_fail(err, WM_UNSUPPORTED,
                   "%s: its pictures are '%s'; V_MJPEG and uncompressed Y800 are read: convert it by `waymark import`",
                   self->path, shown);
  }
  if (t->encoded)
    return wm_fail(err, WM_UNSUPPORTED,
                   "%s: its track is compressed by the container as well; write it without that (mkvmerge "
                   "--compression -1:none) or convert it by `waymark import`",
                   self->path);
  self->track = t->number;
  self->coding = is_grey ? PICTURE_GREY : PICTURE_JPEG;
  self->width_px = t->width > 65535 ? 0 : (uint32_t)t->width;
  self->height_px = t->height > 65535 ? 0 : (uint32_t)t->height;
  return WM_OK;
}

wm_status mkv_open(container *self, wm_error *err) {
  track_entry entry = {0};
  self->next = next_picture;
  for (;;) {
    element e;
    wm_status status = next_element(self, &e, err);
    if (status == WM_END) return wm_fail(err, WM_BAD_DATA, "%s: ends before its first picture", self->path);
    if (status != WM_OK) return status;
    if (e.id == ID_TRACK || e.id == ID_CLUSTER) {
      status = judge(self, &entry, err);
      memset(&entry, 0, sizeof entry);
    } else {
      status = read_track_element(self, &e, &entry, err);
      if (status == WM_END) status = container_fail(self, err, WM_BAD_DATA, e.at, "the file ends within its head");
    }
    if (status != WM_OK) return status;
    if (e.id == ID_CLUSTER) break;
  }
  return self->track != 0 ? WM_OK : wm_fail(err, WM_BAD_DATA, "%s: has no video track", self->path);
}
